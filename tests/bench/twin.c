/* SPDX-License-Identifier: MIT */
/* twin - compiled once for each law of batches.c, with what SOURCE, TABLE, TWIN, OPS and CALL stand for: the last one is the name both of the
 * function in the source and of its place in the table */
#define quern_library_2 TABLE
#include SOURCE
#include "twin.h"

static void call(
	const quern_plugin *called, uint32_t dim, const void *self, const void *batch, uint32_t calls) {
	const OPS *table = called->ops;
	for (uint32_t k = 0; k < calls; k++) table->CALL[dim - 2](self, batch);
}
static void inlined_2d(const void *self, const void *batch, uint32_t calls) {
	for (uint32_t k = 0; k < calls; k++) CALL(2, self, batch);
}
static void inlined_3d(const void *self, const void *batch, uint32_t calls) {
	for (uint32_t k = 0; k < calls; k++) CALL(3, self, batch);
}

extern const twin TWIN;
const twin TWIN = { &TABLE, call, { inlined_2d, inlined_3d } };
