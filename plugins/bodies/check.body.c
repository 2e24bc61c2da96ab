/* SPDX-License-Identifier: MIT */
/* check.body - geometry: unit normals, gaps that grow along them, surfaces that go with the pose */
#include <math.h>
#include <quern/body.h>
#include <quern/check.h>
#include <stdlib.h>
#include <string.h>

enum { POSITION, RADIUS, FEATURE, GAP, NORMAL, SPEED };
enum { NODES, GRAINS, VARIANTS };

static const quern_pose still = { .turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_body_ops *ops = k->ops;
	quern_body_batch batch = { .n = b->n, .cap = b->cap, .dim = k->dim, .pose = k->more };
	QUERN_CHECK_VECTOR(batch.position, k, b, POSITION, k->dim);
	batch.radius = quern_check_at(k, b, RADIUS, 0);
	batch.feature = quern_check_integers_at(k, b, FEATURE);
	batch.gap = quern_check_at(k, b, GAP, 0);
	QUERN_CHECK_VECTOR(batch.normal, k, b, NORMAL, k->dim);
	QUERN_CHECK_VECTOR(batch.velocity, k, b, SPEED, k->dim);
	ops->closest(k->self, &batch);
}

/* Bounded axes are covered with a margin of their own length, the others from -1 to 1. */
static void range_of(const quern_check_kernel *k, uint32_t a, double *low, double *high) {
	quern_real lower[3] = { 0 }, upper[3] = { 0 };
	const quern_body_ops *ops = k->ops;
	*low = -1, *high = 1;
	ops->bounds(k->self, k->dim, lower, upper);
	if (!isfinite(lower[a]) || !isfinite(upper[a])) return;
	*low = lower[a] - (upper[a] - lower[a]) - 1e-3;
	*high = upper[a] + (upper[a] - lower[a]) + 1e-3;
}

static quern_check_kernel *create(
	const quern_check *c, const quern_check_instance *it, const quern_pose *pose, uint32_t n) {
	quern_check_kernel *k = c->host->kernel_create(c, it, "closest", n);
	k->call = call;
	k->more = pose;
	c->host->add(k, POSITION, "position", QUERN_CHECK_IN, k->dim);
	c->host->add(k, RADIUS, "radius", QUERN_CHECK_IN, 1);
	c->host->add(k, GAP, "gap", QUERN_CHECK_OUT, 1);
	c->host->add(k, NORMAL, "normal", QUERN_CHECK_OUT, k->dim);
	c->host->add(k, SPEED, "velocity", QUERN_CHECK_OUT, k->dim);
	for (uint32_t a = 0; a < k->dim; a++) {
		double low, high;
		range_of(k, a, &low, &high);
		for (uint32_t i = 0; i < n; i++)
			quern_check_given(k, POSITION, a)[i] = c->host->uniform(130, (uint64_t)a << 32 | i, low, high);
	}
	return k;
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= VARIANTS) return NULL;
	quern_check_kernel *k = create(c, it, &still, n);
	if (variant == GRAINS) c->host->fill(k, RADIUS, 1, 131, 1e-4, 1e-3);
	return k;
}

/* ---- what must hold ---- */

typedef struct {
	quern_check_tally normals, gaps, radii, bounds, shifts, turns, features;
} tallies;

static void check_surface(quern_check_kernel *k, quern_check_kernel *moved, tallies *t) {
	const double scale = 1e-4;
	k->host->run(k, 64, false);
	for (uint32_t i = 0; i < k->n; i++) {
		double length = 0;
		for (uint32_t a = 0; a < k->dim; a++) length += pow(quern_check_found(k, NORMAL, a)[i], 2);
		k->host->measure(&t->normals, fabs(sqrt(length) - 1), 1e-12, "%u-D: a normal has the length %.15g",
			k->dim, sqrt(length));
		for (uint32_t a = 0; a < k->dim; a++)
			quern_check_given(moved, POSITION, a)[i] =
				quern_check_given(k, POSITION, a)[i] + scale * quern_check_found(k, NORMAL, a)[i];
		quern_check_given(moved, RADIUS, 0)[i] = 2e-4;
	}
	k->host->run(moved, 64, false);
	for (uint32_t i = 0; i < k->n; i++) {
		const double was = quern_check_found(k, GAP, 0)[i], is = quern_check_found(moved, GAP, 0)[i] + 2e-4;
		if (was <= 0 && is > 0) continue; /* through the surface a corner may be nearer */
		k->host->measure(&t->gaps, fabs(is - was - scale) / scale, 1e-9,
			"%u-D: %.3g m along the normal change the gap from %.9g to %.9g m", k->dim, scale, was, is);
	}
	memcpy(
		quern_check_given(moved, POSITION, 0), quern_check_given(k, POSITION, 0), k->n * sizeof(quern_real));
	for (uint32_t a = 1; a < k->dim; a++)
		memcpy(quern_check_given(moved, POSITION, a), quern_check_given(k, POSITION, a),
			k->n * sizeof(quern_real));
	k->host->run(moved, 64, false);
	for (uint32_t i = 0; i < k->n; i++)
		k->host->measure(&t->radii,
			fabs(quern_check_found(k, GAP, 0)[i] - quern_check_found(moved, GAP, 0)[i] - 2e-4), 1e-15,
			"%u-D: a radius of 2e-4 m changes the gap from %.9g to %.9g m", k->dim,
			quern_check_found(k, GAP, 0)[i], quern_check_found(moved, GAP, 0)[i]);
}

static void check_bounds(const quern_check_kernel *k, tallies *t) {
	quern_real lower[3] = { 0 }, upper[3] = { 0 };
	((const quern_body_ops *)k->ops)->bounds(k->self, k->dim, lower, upper);
	for (uint32_t i = 0; i < k->n; i++)
		for (uint32_t a = 0; a < k->dim; a++) {
			const double x = quern_check_given(k, POSITION, a)[i];
			k->host->expect(&t->bounds,
				quern_check_found(k, GAP, 0)[i] > 0 || (x >= lower[a] && x <= upper[a]),
				"%u-D: a place inside the body, at %.6g m along axis %u, lies outside bounds()", k->dim, x,
				a);
		}
}

/* x = position + turn x'; v + w x (x - position) */
static void pose_point(const quern_pose *p, uint32_t dim, const double x[3], double out[3]) {
	for (uint32_t a = 0; a < 3; a++) {
		out[a] = p->position[a];
		for (uint32_t b = 0; b < dim; b++) out[a] += p->turn[3 * a + b] * x[b];
	}
}

static void check_pose(quern_check_kernel *k, quern_check_kernel *posed, const quern_pose *pose, bool spins,
	quern_check_tally *t) {
	posed->more = pose;
	for (uint32_t i = 0; i < k->n; i++) {
		double x[3] = { 0 }, out[3];
		for (uint32_t a = 0; a < k->dim; a++) x[a] = quern_check_given(k, POSITION, a)[i];
		pose_point(pose, k->dim, x, out);
		for (uint32_t a = 0; a < k->dim; a++) quern_check_given(posed, POSITION, a)[i] = out[a];
		quern_check_given(posed, RADIUS, 0)[i] = 0;
	}
	k->host->run(posed, 64, false);
	for (uint32_t i = 0; i < k->n; i++) {
		const double gap = quern_check_found(k, GAP, 0)[i], is = quern_check_found(posed, GAP, 0)[i];
		k->host->measure(t, fabs(gap - is), 1e-12,
			"%u-D: the gap to the body in its pose is %.9g m, should be %.9g", k->dim, is, gap);
		if (fabs(gap) < 1e-9) continue;
		double arm[3] = { 0 };
		for (uint32_t a = 0; a < k->dim; a++)
			arm[a] = quern_check_given(posed, POSITION, a)[i] - is * quern_check_found(posed, NORMAL, a)[i] -
					 pose->position[a];
		for (uint32_t a = 0; a < k->dim; a++) {
			const uint32_t b = (a + 1) % 3, c = (a + 2) % 3;
			double v = pose->velocity[a] + (spins ? pose->spin[b] * arm[c] - pose->spin[c] * arm[b] : 0);
			for (uint32_t e = 0; e < k->dim;
				 e++) /* the surface's own, as that of a drum, turns with the pose */
				v += pose->turn[3 * a + e] * quern_check_found(k, SPEED, e)[i];
			k->host->measure(t, fabs(quern_check_found(posed, SPEED, a)[i] - v), 1e-9,
				"%u-D: the surface moves with %.9g m/s, should with %.9g", k->dim,
				quern_check_found(posed, SPEED, a)[i], v);
		}
	}
}

/* Every feature in reach is at least as far as the nearest one, which is among them. */
static void check_features(const quern_check_kernel *k, tallies *t) {
	const quern_body_ops *ops = k->ops;
	for (uint32_t i = 0; i < k->n && i < 100; i++) {
		enum { MOST = 64 };
		int32_t feature[MOST];
		double x[3] = { 0 }, nearest = INFINITY;
		const double gap = quern_check_found(k, GAP, 0)[i];
		for (uint32_t a = 0; a < k->dim; a++) x[a] = quern_check_given(k, POSITION, a)[i];
		k->host->place(k->check, "features, %u-D", k->dim);
		const uint32_t n = ops->features(k->self, &still, x, fabs(gap) + 1e-6, MOST, feature);
		for (uint32_t f = 0; f < n && f < MOST; f++) {
			quern_check_kernel *one = create(k->check, k->instance, &still, 1);
			k->host->add_integers(one, FEATURE, "feature", QUERN_CHECK_IN);
			*(int32_t *)k->host->column(one, one->at[FEATURE])->given = feature[f];
			for (uint32_t a = 0; a < k->dim; a++) quern_check_given(one, POSITION, a)[0] = x[a];
			k->host->run(one, 8, false);
			if (quern_check_found(one, GAP, 0)[0] < nearest) nearest = quern_check_found(one, GAP, 0)[0];
			k->host->kernel_destroy(one);
		}
		k->host->expect(&t->features, n <= MOST && (gap < 0 || fabs(nearest - gap) < 1e-9),
			"%u-D: the nearest surface is %.9g m away, the nearest of %u features %.9g", k->dim, gap, n,
			nearest);
	}
}

static void try_dimension(const quern_check *c, const quern_check_instance *it, tallies *t) {
	enum { PLACES = 1000 };
	const double cosine = 0.8, sine = 0.6;
	const quern_pose shifted = { .position = { 0.01, -0.02, it->dim == 3 ? 0.03 : 0 },
		.turn = { 1, 0, 0, 0, 1, 0, 0, 0, 1 },
		.velocity = { 0.5, -0.25, it->dim == 3 ? 0.125 : 0 } };
	const quern_pose turned = { .position = { 0.01, -0.02, 0 },
		.turn = { cosine, -sine, 0, sine, cosine, 0, 0, 0, 1 },
		.spin = { 0, 0, 2 } };
	quern_check_kernel *k = create(c, it, &still, PLACES), *other = create(c, it, &still, PLACES);
	check_surface(k, other, t);
	check_bounds(k, t);
	check_pose(k, other, &shifted, false, &t->shifts);
	check_pose(k, other, &turned, true, &t->turns);
	if (((const quern_body_ops *)c->ops)->features) check_features(k, t);
	c->host->kernel_destroy(k);
	c->host->kernel_destroy(other);
}

static void law(const quern_check *c) {
	tallies t = { { .name = "unit normals" }, { .name = "gap along the normal" },
		{ .name = "gap and radius" }, { .name = "bounds" }, { .name = "moved pose" },
		{ .name = "turned pose" }, { .name = "features" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = c->host->instance_create(c, dim, 0);
		if (it) try_dimension(c, it, &t);
		c->host->instance_destroy(it);
	}
	c->host->tell(c, &t.normals, NULL);
	c->host->tell(c, &t.gaps, NULL);
	c->host->tell(c, &t.radii, NULL);
	c->host->tell(c, &t.bounds, NULL);
	c->host->tell(c, &t.shifts, NULL);
	c->host->tell(c, &t.turns, NULL);
	if (t.features.tried) c->host->tell(c, &t.features, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = { .size = sizeof ops, .kind = &quern_body_kind, .make = make, .law = law };
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.body",
	.brief = "Geometry: unit normals, gaps that grow along them, surfaces that go with the pose.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
