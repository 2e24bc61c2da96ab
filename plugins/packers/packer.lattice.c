/* SPDX-License-Identifier: MIT */
/* packer.lattice - grains on a lattice that is fixed in space, each moved a little if wished. docs/theory/packers.md, section 4 */
#include <math.h>
#include <quern/math.h>
#include <quern/packer.h>

enum { FCC, HCP, CUBIC };

typedef struct {
	quern_real spacing, jitter, origin[3];
	int32_t form;
	quern_real widest; /* m; NaN: nobody says */
} lattice;

static const char *const forms[] = { "fcc", "hcp", "cubic", NULL };
static const quern_param params[] = { QUERN_PARAM(lattice, spacing, "m",
										  "Between nearest neighbours; default: the widest grain's diameter.",
										  .from = "grain.widest", .flags = QUERN_MIN_OPEN, .max = 1e6),
	QUERN_PARAM(lattice, jitter, "1",
		"How far a grain may be off its place, over half the gap between widest neighbours: below 100 % none "
		"meet.",
		.max = 1),
	QUERN_PARAM(lattice, form, "1",
		"Close packed in layers along the last axis, of three kinds (fcc) or two (hcp), and triangular in "
		"2-D; or cubic, and square in 2-D.",
		.choices = forms),
	QUERN_PARAM(lattice, origin, "m", "One of the places."),
	QUERN_PARAM(lattice, widest, "m", "Diameter of the widest grain.", .from = "grain.widest",
		.flags = QUERN_MAYBE | QUERN_ADVANCED, .max = 1e6),
	QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };

static quern_status init(void *self, const quern_setup *setup, quern_err *err) {
	const lattice *p = self;
	if (p->spacing < (1 - 1e-9) * p->widest)
		return setup->host->fail(err, QUERN_E_PARAM, "spacing",
			"is %g m, and the widest grain is %g m wide: neighbours would overlap", p->spacing, p->widest);
	if (p->jitter > 0 && isnan(p->widest))
		return setup->host->fail(err, QUERN_E_PARAM, "jitter",
			"needs to know how much room there is: give `widest`, the widest grain's diameter");
	if (p->jitter > 0 && !(p->spacing > p->widest))
		return setup->host->fail(err, QUERN_E_PARAM, "jitter",
			"has no room: give a spacing above the widest grain's diameter, %g m", p->widest);
	return QUERN_OK;
}

/* Rows along x, in layers along y (2-D) or in layers of rows along z: m apart, and by how much of that each is shifted against the
 * first. */
typedef struct {
	quern_real pitch[3], reach; /* m; how far a grain is off its place at most */
	uint32_t dim, kinds;        /* of layers along z */
	bool staggered;
} frame;

static frame frame_of(const lattice *p, uint32_t dim) {
	const quern_real a = p->spacing, room = 0.5 * p->jitter * (a - p->widest);
	const bool cubic = p->form == CUBIC;
	return (frame) { .pitch = { a, cubic ? a : a * 0.8660254037844386, cubic ? a : a * 0.816496580927726 },
		.reach = room > 0 ? room : 0,
		.dim = dim,
		.kinds = cubic || dim == 2 ? 1
				 : p->form == FCC  ? 3
								   : 2,
		.staggered = !cubic };
}

static int64_t among(int64_t i, uint32_t n) { return (i % n + n) % n; }

/* Line `at` along `axis`, over the pitch: layers of the second and third kind lie over the gaps of the first. */
static quern_real along(const frame *f, uint32_t axis, const int64_t at[3]) {
	const quern_real kind = (quern_real)among(at[2], f->kinds);
	quern_real shift = 0;
	if (axis == 1) shift = kind / 3;
	if (axis == 0 && f->staggered) shift = 0.5 * (quern_real)among(at[1], 2) + 0.5 * kind;
	return (quern_real)at[axis] + shift;
}

/* Lines along an axis that may bring a grain into the region: from the first to below `end`. */
typedef struct {
	int64_t first, end;
} range;

static range lines(
	const lattice *p, const frame *f, const quern_pack_job *job, uint32_t axis, int64_t at[3]) {
	at[axis] = 0;
	const quern_real shift = along(f, axis, at), one_over = 1 / f->pitch[axis];
	const quern_real low = (job->lower[axis] - f->reach - p->origin[axis]) * one_over - shift,
					 high = (job->upper[axis] + f->reach - p->origin[axis]) * one_over - shift;
	return (range) { (int64_t)floor(low), (int64_t)floor(high) + 2 };
}

/* A region that holds more places than this is left empty: nobody means that, and it would take for ever. */
static bool too_many(const lattice *p, const frame *f, const quern_pack_job *job) {
	quern_real places = 1, farthest = 0;
	for (uint32_t k = 0; k < f->dim; k++) {
		const quern_real low = (job->lower[k] - p->origin[k]) / f->pitch[k],
						 high = (job->upper[k] - p->origin[k]) / f->pitch[k];
		places *= high - low + 2;
		farthest = fmax(farthest, fmax(fabs(low), fabs(high)));
	}
	return !(places < 0x1p24 && farthest < 0x1p40);
}

/* Anywhere in a disc or a ball, by numbers that belong to the place. */
static void move(const frame *f, const quern_pack_job *job, const int64_t at[3], quern_real x[3]) {
	enum { BITS = 21 };
	const uint64_t mask = ((uint64_t)1 << BITS) - 1, stream = job->stream ^ 0x6c617474696365u;
	const uint64_t key =
		((uint64_t)at[0] & mask) | ((uint64_t)at[1] & mask) << BITS | ((uint64_t)at[2] & mask) << 2 * BITS;
	quern_real u[2], w[2] = { 0.5 };
	job->host->random(stream, key, 0, u);
	if (f->dim == 3) job->host->random(stream, key, 1, w);
	const quern_real away = f->reach * (f->dim == 3 ? quern_cbrt(u[0]) : __builtin_sqrt(u[0]));
	const quern_real up = 2 * w[0] - 1, out = away * __builtin_sqrt(1 - up * up);
	const quern_real angle = 6.283185307179586 * u[1];
	x[0] += out * quern_cos(angle);
	x[1] += out * quern_sin(angle);
	if (f->dim == 3) x[2] += away * up;
}

/* False: enough. A grain that finds no room waits for the next place. */
static bool offer(const lattice *p, const frame *f, quern_pack_job *job, const int64_t at[3]) {
	quern_spot spot = { .radius = job->radius(job) };
	for (uint32_t k = 0; k < f->dim; k++) spot.x[k] = p->origin[k] + along(f, k, at) * f->pitch[k];
	if (f->reach > 0) move(f, job, at, spot.x);
	if (!job->inside(job, spot.x) || !job->free(job, &spot)) return true;
	return job->place(job, &spot);
}

static void pack(const void *self, quern_pack_job *job) {
	const lattice *p = self;
	const frame f = frame_of(p, job->dim);
	int64_t at[3] = { 0 };
	if (too_many(p, &f, job)) return;
	const range z = job->dim == 3 ? lines(p, &f, job, 2, at) : (range) { 0, 1 };
	for (int64_t k = z.first; k < z.end; k++) {
		at[2] = k;
		const range y = lines(p, &f, job, 1, at);
		for (int64_t j = y.first; j < y.end; j++) {
			at[1] = j;
			const range x = lines(p, &f, job, 0, at);
			for (int64_t i = x.first; i < x.end; i++) {
				at[0] = i;
				if (!offer(p, &f, job, at)) return;
			}
		}
	}
}

static const quern_packer_ops ops = { .size = sizeof ops, .pack = { pack, pack } };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.id = "packer.lattice",
	.brief = "Grains on a lattice that is fixed in space, each moved a little if wished.",
	.doc = "In a periodic domain the places go on beyond a face only if the domain is a whole number of them "
		   "wide.",
	.cite = "Conway & Sloane 1999, section 1.1",
	.instance_size = sizeof(lattice),
	.params = params,
	.uses = uses,
	.init = init,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
