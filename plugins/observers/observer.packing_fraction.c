/* SPDX-License-Identifier: MIT */
/* observer.packing_fraction - how much of a box is solid: discs and spheres to where its faces cut them, points as squares
 * and cubes. docs/observers.md */
#include "observers.h"
#include "region.h"
#include <quern/math.h>

typedef struct {
	observer_region region;
	quern_real density;
} observer;
static const quern_param params[] = { REGION_PARAMS(observer, QUERN_REQUIRED),
	QUERN_PARAM_AS(observer, density, "grain_density", "kg/m^3",
		"Of what grains consist of: makes volume of the mass of points.", .from = "grain.density",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN, .max = 1e6),
	QUERN_END_PARAMS };
/* clang-format off */
#define OWN_USES(X) \
	X(GRAIN_POSITION, "grain.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(GRAIN_RADIUS, "grain.radius", "m", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(POINT_POSITION, "point.position", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL) \
	X(POINT_VOLUME, "point.volume", "m^3", QUERN_READ, QUERN_SCALAR, .flags = QUERN_OPTIONAL) \
	X(BOX, "total.box_length", "m", QUERN_READ, QUERN_VECTOR, .flags = QUERN_OPTIONAL)
/* clang-format on */
QUERN_USE_ENUM_FROM(CLOUD_USES_ROWS, OWN_USES);
static const quern_use uses[] = { CLOUD_USES(QUERN_USE_ROW) OWN_USES(QUERN_USE_ROW) QUERN_END_USES };

enum { FRACTION, GRAINS, POINTS };
static const quern_output outputs[] = {
	{ .name = "fraction", .unit = "1", .doc = "Solid volume in the box over its own." },
	{ .name = "grains", .unit = "1", .doc = "By grains, fixed ones too." },
	{ .name = "points", .unit = "1", .doc = "By points." }, { .name = NULL }
};

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	observer *o = self;
	if (isnan(o->density) && setup->host->keeps(setup, "continuum"))
		return setup->host->fail(
			err, QUERN_E_PARAM, "grain_density", "must be given where there are no grains to take it from");
	return region_init(&o->region, setup, err);
}

/* ---- a disc and a box ---- */

/* Area of the unit disc left of x. */
static quern_real left_of(quern_real x) {
	return x * __builtin_sqrt(quern_max(1 - x * x, 0)) + quern_asin(x) + 0.5 * 3.141592653589793;
}

/* Area of the unit disc left of x and below y: three cases of where the corner is, and the corner in the disc. */
static quern_real corner_area(quern_real x, quern_real y) {
	x = quern_clamp(x, -1, 1), y = quern_clamp(y, -1, 1);
	if (x * x + y * y >= 1) {
		if (x < 0 && y < 0) return 0;
		if (x < 0) return left_of(x);
		if (y < 0) return left_of(y);
		return left_of(x) + left_of(y) - 3.141592653589793;
	}
	const quern_real c = __builtin_sqrt(1 - y * y); /* half the chord at height y */
	return (y > 0 ? left_of(-c) : 0) + y * (x + c) + 0.5 * (left_of(x) - left_of(-c));
}

/* Area of a disc of radius r around the origin within a box. */
static quern_real disc_area(quern_real r, const quern_real low[2], const quern_real high[2]) {
	if (!(r > 0)) return 0;
	const quern_real a = low[0] / r, b = high[0] / r, c = low[1] / r, d = high[1] / r;
	if (a >= 1 || b <= -1 || c >= 1 || d <= -1) return 0;
	const quern_real area = corner_area(b, d) - corner_area(a, d) - corner_area(b, c) + corner_area(a, c);
	return quern_max(area, 0) * r * r;
}

/* ---- a sphere and a box ---- */

/* Volume between two heights of a sphere of radius 1 in a box: its discs, by Gauss's rule in the angle phi of z = middle -
 * half cos phi, which has no root at the ends, where discs vanish or meet a face. */
static quern_real slice(quern_real from, quern_real to, const quern_real low[2], const quern_real high[2]) {
	static const quern_real node[6] = { 0.1252334085114689, 0.3678314989981802, 0.5873179542866175,
		0.7699026741943047, 0.9041172563704749, 0.9815606342467193 },
							weight[6] = { 0.2491470458134028, 0.2334925365383548, 0.2031674267230659,
								0.1600783285433462, 0.1069393259953184, 0.0471753363865118 };
	const quern_real middle = 0.5 * (from + to), half = 0.5 * (to - from), quarter = 0.5 * 3.141592653589793;
	quern_real sum = 0;
	for (int k = 0; k < 12; k++) {
		const quern_real phi = quarter * (1 + (k % 2 ? node[k / 2] : -node[k / 2]));
		const quern_real z = middle - half * quern_cos(phi);
		sum += weight[k / 2] * quern_sin(phi) * disc_area(__builtin_sqrt(quern_max(1 - z * z, 0)), low, high);
	}
	return sum * quarter * half;
}

/* Of the unit sphere. Its discs change their form where they meet a face or an edge of the box: cut there. */
static quern_real sphere_volume(const quern_real low[3], const quern_real high[3]) {
	const quern_real from = quern_max(low[2], -1), to = quern_min(high[2], 1);
	quern_real cut[18] = { from };
	int n = 1;
	for (int k = 0; k < 8 && to > from; k++) {
		const quern_real x = k % 2 ? low[0] : high[0], y = (k < 6 ? k / 2 : k) % 2 ? low[1] : high[1];
		const quern_real d2 = k < 4 ? x * x + y * y : k < 6 ? x * x : y * y;
		const quern_real z = __builtin_sqrt(quern_max(1 - d2, 0));
		if (z < to && z > from) cut[n++] = z;
		if (-z < to && -z > from) cut[n++] = -z;
	}
	for (int i = 1; i < n; i++) /* few: by insertion */
		for (int j = i; j > 1 && cut[j] < cut[j - 1]; j--) {
			const quern_real t = cut[j];
			cut[j] = cut[j - 1], cut[j - 1] = t;
		}
	quern_real sum = 0;
	for (int i = 0; i < n && to > from; i++) sum += slice(cut[i], i + 1 < n ? cut[i + 1] : to, low, high);
	return sum;
}

/* ---- all ---- */

/* Of a grain of radius r with the box around its centre. */
static quern_real grain_volume(
	quern_real r, const quern_real low[3], const quern_real high[3], uint32_t dim) {
	bool in = true;
	quern_real a[3], b[3];
	for (uint32_t k = 0; k < dim; k++) {
		if (low[k] >= r || high[k] <= -r) return 0;
		in = in && low[k] <= -r && high[k] >= r;
		a[k] = low[k] / r, b[k] = high[k] / r;
	}
	if (dim == 2) return r * r * (in ? 3.141592653589793 : disc_area(1, a, b));
	return r * r * r * (in ? 4.0 / 3 * 3.141592653589793 : sphere_volume(a, b));
}

/* Of a square or cube of half a side h, likewise. */
static quern_real cube_volume(quern_real h, const quern_real low[3], const quern_real high[3], uint32_t dim) {
	quern_real volume = 1;
	for (uint32_t k = 0; k < dim; k++) volume *= quern_max(quern_min(high[k], h) - quern_max(low[k], -h), 0);
	return volume;
}

/* The same of an entry and of its images through periodic faces. */
static quern_real volume_in(const observer *o, quern_real *const *x, uint32_t i, quern_real size,
	uint32_t dim, quern_real (*volume)(quern_real, const quern_real *, const quern_real *, uint32_t)) {
	quern_real sum = 0;
	for (int image = 0; image < (dim == 2 ? 9 : 27); image++) {
		const int shift[3] = { image % 3 - 1, image / 3 % 3 - 1, image / 9 - (dim == 3) };
		quern_real low[3], high[3];
		bool none = false;
		for (uint32_t k = 0; k < dim; k++) {
			const quern_real at = x[k][i] + shift[k] * o->region.length[k];
			none = none || (shift[k] && !(o->region.length[k] > 0));
			low[k] = o->region.lower[k] - at, high[k] = o->region.upper[k] - at;
			none = none || low[k] >= size || high[k] <= -size;
		}
		if (!none) sum += volume(size, low, high, dim);
	}
	return sum;
}

static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out,
	const quern_host *host, quern_run *run) {
	if (refuse_box(&b->use[BOX], "observer.packing_fraction", host, run) != QUERN_OK) return QUERN_E_PARAM;
	const observer *o = self;
	const quern_column *u = b->use;
	const cloud grains = observed(b, false), points = observed(b, true);
	quern_real *term = host->memory(run, ((size_t)grains.n + points.n + 1) * sizeof(quern_real)), box = 1;
	if (!term) return QUERN_E_MEMORY;
	for (uint32_t k = 0; k < b->dim; k++) box *= o->region.upper[k] - o->region.lower[k];
	for (uint32_t i = 0; i < grains.n; i++)
		term[i] = (grains.weight ? grains.weight[i] : 1) *
				  volume_in(o, u[GRAIN_POSITION].real, i, u[GRAIN_RADIUS].real[0][i], b->dim, grain_volume);
	if (grains.n) out[GRAINS] = host->sum_set(run, grains.set, term) / box;
	for (uint32_t i = 0; i < points.n; i++) {
		const quern_real volume = u[POINT_VOLUME].real[0][i];
		const quern_real half = 0.5 * (b->dim == 2 ? __builtin_sqrt(volume) : quern_cbrt(volume));
		term[i] = cloud_mass(&points, i) / (o->density * volume) *
				  volume_in(o, u[POINT_POSITION].real, i, half, b->dim, cube_volume);
	}
	if (points.n) out[POINTS] = host->sum_set(run, points.set, term) / box;
	out[FRACTION] = out[GRAINS] + out[POINTS];
	return QUERN_OK;
}

static const quern_observer_ops ops = {
	.size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "observer.packing_fraction",
	.brief = "How much of a box is solid.",
	.doc = "Discs and spheres that a face of the box cuts count with what of them is inside.",
	.instance_size = sizeof(observer),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
