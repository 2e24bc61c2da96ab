/* SPDX-License-Identifier: MIT */
/* observer.box - the periodic box that grains.box strains, and how full it is. docs/theory/grains.md, section 8 */
#include <quern/observer.h>

typedef struct {
	int32_t unused;
} observer;
static const quern_param params[] = { QUERN_END_PARAMS };
/* clang-format off */
#define USES(X) \
	X(LENGTH, "total.box_length", "m", QUERN_READ, QUERN_VECTOR) \
	X(OFFSET, "total.box_offset", "m", QUERN_READ, QUERN_SCALAR) \
	X(STRAIN, "total.box_strain", "1", QUERN_READ, QUERN_SCALAR) \
	X(SOLID, "total.box_solid", "1", QUERN_READ, QUERN_SCALAR) \
	X(WORK, "total.box_work", "J", QUERN_READ, QUERN_SCALAR) \
	X(IMPULSE, "total.box_impulse", "N s", QUERN_READ, QUERN_VECTOR)
/* clang-format on */
QUERN_USE_ENUM(USES);
static const quern_use uses[] = QUERN_USE_ROWS(USES);

enum { X, SHIFT = X + 3, SHEAR, PACKING, DONE, GIVEN };
static const quern_output outputs[] = { { .name = "x", .unit = "m", .doc = "Length along x." },
	{ .name = "y", .unit = "m", .doc = "Along y." },
	{ .name = "z", .unit = "m", .doc = "Along z; 0 in 2-D." },
	{ .name = "offset", .unit = "m", .doc = "By which the image across y lies further along x." },
	{ .name = "strain", .unit = "1", .doc = "Shear strain so far." },
	{ .name = "packing", .unit = "1", .doc = "Volume of all grains over the box's; overlaps count twice." },
	{ .name = "work", .unit = "J", .doc = "Done on the grains so far." },
	{ .name = "impulse_x", .unit = "N s", .doc = "Given to the grains so far, along x." },
	{ .name = "impulse_y", .unit = "N s", .doc = "Along y." },
	{ .name = "impulse_z", .unit = "N s", .doc = "Along z; 0 in 2-D." }, { .name = NULL } };

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	const quern_column *u = b->use;
	quern_real volume = 1;
	(void)self, (void)host, (void)run;
	for (uint32_t k = 0; k < b->dim; k++) {
		out[X + k] = u[LENGTH].real[k][0];
		out[GIVEN + k] = u[IMPULSE].real[k][0];
		volume *= out[X + k];
	}
	out[SHIFT] = u[OFFSET].real[0][0];
	out[SHEAR] = u[STRAIN].real[0][0];
	out[PACKING] = u[SOLID].real[0][0] / volume;
	out[DONE] = u[WORK].real[0][0];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.box",
	.brief = "The periodic box that is strained, and how full it is.",
	.doc = "For scenes with a key of grains.box.",
	.cite = "Lees & Edwards 1972",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
