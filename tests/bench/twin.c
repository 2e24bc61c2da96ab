/* SPDX-License-Identifier: MIT */
/* twin - a plugin's source once more, in a program instead of a library: its table under a name of its own, and its call put into the loop
 * that makes it. Compiled for each law of batches.c, with what SOURCE, TABLE, LOOP_2D, LOOP_3D, BATCH and CALL stand for. */
#define quern_library_2 TABLE
#include SOURCE

void LOOP_2D(const void *self, const BATCH *b, uint32_t calls);
void LOOP_3D(const void *self, const BATCH *b, uint32_t calls);

void LOOP_2D(const void *self, const BATCH *b, uint32_t calls) {
	for (uint32_t k = 0; k < calls; k++) CALL(2, self, b);
}
void LOOP_3D(const void *self, const BATCH *b, uint32_t calls) {
	for (uint32_t k = 0; k < calls; k++) CALL(3, self, b);
}
