/* SPDX-License-Identifier: MIT */
/* box - a periodic box whose lengths change and whose image across y slides along x. docs/theory/grains.md, section 8
 *
 * Images of a place lie n_x (X, 0, 0) + n_y (S, Y, 0) + n_z (0, 0, Z) away, with whole numbers n, and are faster by n times the rates of
 * these vectors. The box's own flow has the gradient that carries each image to the next. */
#pragma once
#include "rows.h"
#include <quern/math.h>
#include <quern/solver.h>

enum { BOX_ALL, BOX_Y };
static const char *const dem_box_axes[] = { "all", "y", NULL };
/* Rows for what the scene says of a box; with dem.h. */
#define DEM_BOX_PARAMS                                                                                                    \
	QUERN_PARAM_AS(dem, box_shear, "box.shear", "1/s",                                                                    \
		"Shear rate du_x/dy of a domain that is periodic along every axis and strained with all its grains.",             \
		.flags = QUERN_MAYBE),                                                                                            \
		QUERN_PARAM_AS(dem, box_pressure, "box.pressure", "Pa",                                                           \
			"Normal stress that the domain is kept at by what changes of it (box.along); in 2-D force per length.",       \
			.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e12, .unless = "box.packing"),                                 \
		QUERN_PARAM_AS(dem, box_packing, "box.packing", "1",                                                              \
			"Packing fraction that the domain is brought to at box.rate and kept at: volume of all grains over its own.", \
			.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1, .unless = "box.pressure"),                                   \
		QUERN_PARAM_AS(dem, box_rate, "box.rate", "1/s",                                                                  \
			"Rate of change of the lengths, over themselves, on the way there.",                                          \
			.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e9),                                                           \
		QUERN_PARAM_AS(dem, box_along, "box.along", "1",                                                                  \
			"Which lengths change for box.pressure and box.packing.", .choices = dem_box_axes),                           \
		QUERN_PARAM_AS(dem, box_inertia, "box.inertia", "1",                                                              \
			"Mass of what pushes for box.pressure, over that of the grains.", .def = 0.1, .min = 0.001,                   \
			.max = 1e3, .flags = QUERN_ADVANCED),                                                                         \
		QUERN_PARAM_AS(dem, box_damping, "box.damping", "1",                                                              \
			"Its damping rate, over the frequency that it would have on a gas of that pressure.", .def = 10,              \
			.min = 0.1, .max = 1e3, .flags = QUERN_ADVANCED),                                                             \
		QUERN_PARAM(dem, boxed, NULL, "Strain the domain; set by itself where a key of box says how.",                    \
			.flags = QUERN_ADVANCED)

typedef struct dem_box {
	uint32_t dim;
	quern_real lower[3];            /* m, a corner that stays */
	quern_real length[3], speed[3]; /* m, m/s: X, Y, Z and their rates */
	quern_real offset, slide;       /* m, m/s: S and its rate */
} dem_box;

/* From four rows of uses: lengths, their rates, the offset and its rate. Only where the scene has a box. */
QUERN_INLINE dem_box dem_box_at(const quern_step *s, const quern_column *row) {
	dem_box b = { .dim = s->dim, .length = { 1, 1, 1 } };
	for (uint32_t k = 0; k < s->dim; k++)
		b.lower[k] = s->lower[k], b.length[k] = row[0].real[k][0], b.speed[k] = row[1].real[k][0];
	b.offset = row[2].real[0][0];
	b.slide = row[3].real[0][0];
	return b;
}

/* The box after that time. */
QUERN_INLINE dem_box dem_box_after(const dem_box *now, quern_real time) {
	dem_box b = *now;
	for (uint32_t k = 0; k < b.dim; k++) b.length[k] += time * b.speed[k];
	b.offset += time * b.slide;
	return b;
}

/* m^2 or m^3 */
QUERN_INLINE quern_real dem_box_volume(const dem_box *b) {
	return b->length[0] * b->length[1] * b->length[2];
}

/* An upper triangle, of which only xy is off the diagonal. */
typedef struct box_matrix {
	quern_real on[3], xy;
} box_matrix;

/* R L^-1 of the images' vectors L and of others R: of their rates it is the gradient of the box's own flow. */
QUERN_INLINE box_matrix dem_box_over(const quern_real on[3], quern_real xy, const dem_box *b) {
	box_matrix m = { .on = { 0 } };
	for (uint32_t k = 0; k < b->dim; k++) m.on[k] = on[k] / b->length[k];
	m.xy = (xy - m.on[0] * b->offset) / b->length[1];
	return m;
}

/* The nearest image of a difference of places, and how many of each vector lie between. */
QUERN_INLINE void dem_box_image(const dem_box *b, const int dim, quern_real d[3], quern_real crossed[3]) {
	crossed[1] = quern_floor(d[1] / b->length[1] + 0.5);
	d[1] -= crossed[1] * b->length[1];
	d[0] -= crossed[1] * b->offset;
	crossed[0] = quern_floor(d[0] / b->length[0] + 0.5);
	d[0] -= crossed[0] * b->length[0];
	crossed[2] = dim == 3 ? quern_floor(d[2] / b->length[2] + 0.5) : 0;
	if (dim == 3) d[2] -= crossed[2] * b->length[2];
}
