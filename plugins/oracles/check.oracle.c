/* SPDX-License-Identifier: MIT */
/* check.oracle - marks and wishes of cells: local, finite, and one of the three zones */
#include <math.h>
#include <quern/check.h>
#include <quern/oracle.h>
#include <stdlib.h>

enum { CENTRE, DISTANCE, ZONE, LEVEL, WISH, GAP, WEIGHT, MARKED };
enum { MARKS, DECIDES, VARIANTS };

static void call(const quern_check_kernel *k, const quern_check_batch *b) {
	const quern_oracle_ops *ops = k->ops;
	quern_column use[QUERN_MOST_USES];
	quern_cell_batch batch = { .n = b->n,
		.cap = b->cap,
		.dim = k->dim,
		.cell = 4e-3,
		.use = use,
		.time = 0.1,
		.dt = k->dt,
		.gravity = { 0, -9.81, 0 } };
	QUERN_CHECK_VECTOR(batch.centre, k, b, CENTRE, k->dim);
	batch.distance = quern_check_at(k, b, DISTANCE, 0);
	batch.zone = quern_check_integers_at(k, b, ZONE);
	batch.level = quern_check_at(k, b, LEVEL, 0);
	batch.wish = quern_check_integers_at(k, b, WISH);
	batch.gap = quern_check_at(k, b, GAP, 0);
	batch.weight = quern_check_at(k, b, WEIGHT, 0);
	batch.marked = quern_check_integers_at(k, b, MARKED);
	k->host->columns(k, b, k->use, use);
	(k->pass == MARKS ? ops->mark : ops->decide)(k->self, &batch);
}

static quern_check_kernel *make(
	const quern_check *c, const quern_check_instance *it, uint32_t variant, uint32_t n) {
	if (variant >= VARIANTS) return NULL;
	const quern_oracle_ops *ops = c->ops;
	const uint32_t wants = ops->wants ? ops->wants(it->self) : 0;
	quern_check_kernel *k = c->host->kernel_create(c, it, variant == MARKS ? "mark" : "decide", n);
	k->call = call;
	k->pass = variant;
	c->host->add(k, CENTRE, "centre", QUERN_CHECK_IN, k->dim);
	c->host->fill(k, CENTRE, k->dim, 110, 0, 1);
	c->host->add_integers(k, ZONE, "zone", QUERN_CHECK_IN);
	int32_t *zone = c->host->column(k, k->at[ZONE])->given;
	for (uint32_t i = 0; i < n; i++) zone[i] = (int32_t)c->host->uniform(111, i, 0, 2.999);
	if (wants & QUERN_ORACLE_GAP) {
		c->host->add(k, GAP, "gap", QUERN_CHECK_IN, 1);
		c->host->fill(k, GAP, 1, 113, -20e-3, 60e-3);
		quern_check_given(k, GAP, 0)[0] = INFINITY;
	}
	/* rows are the cells' fields in both calls, whatever their hook */
	c->host->add_uses(k, 0, true);
	c->host->add_uses(k, 1, true);
	if (variant == MARKS && wants & QUERN_ORACLE_MARKED) {
		c->host->add_integers(k, MARKED, "marked", QUERN_CHECK_IN);
		int32_t *marked = c->host->column(k, k->at[MARKED])->given;
		for (uint32_t i = 0; i < n; i++) marked[i] = c->host->uniform(114, i, 0, 1) > 0.5;
	}
	if (variant == MARKS) {
		c->host->add(k, LEVEL, "level", QUERN_CHECK_OUT, 1);
		return k;
	}
	c->host->add(k, DISTANCE, "distance", QUERN_CHECK_IN, 1);
	c->host->fill(k, DISTANCE, 1, 112, -20e-3, 60e-3);
	c->host->add_integers(k, WISH, "wish", QUERN_CHECK_OUT);
	if (wants & QUERN_ORACLE_WEIGHT) c->host->add(k, WEIGHT, "weight", QUERN_CHECK_OUT, 1);
	return k;
}

/* -1 leaves it to the solver. */
static void look_at_weights(const quern_check_kernel *k, const int32_t *wish, quern_check_tally *weight) {
	for (uint32_t i = 0; i < k->n; i++) {
		const double w = quern_check_found(k, WEIGHT, 0)[i];
		if (wish[i] == QUERN_HYBRID)
			k->host->expect(weight, w == -1 || (w >= 0 && w <= 1), "%u-D: a share is %g", k->dim, w);
	}
}

static void look(const quern_check_kernel *k, quern_check_tally *level, quern_check_tally *wish) {
	const int32_t *w = k->pass == DECIDES ? k->host->column(k, k->at[WISH])->found : NULL;
	for (uint32_t i = 0; i < k->n && k->pass == MARKS; i++)
		k->host->expect(
			level, isfinite(quern_check_found(k, LEVEL, 0)[i]), "%u-D: a level is not finite", k->dim);
	for (uint32_t i = 0; i < k->n && w; i++)
		k->host->expect(wish, w[i] >= QUERN_DISCRETE && w[i] <= QUERN_CONTINUUM,
			"%u-D: a wish is %d, no zone", k->dim, w[i]);
}

/* Cells beyond its reach are asked again, as if there were no surface at all. */
static void look_beyond(quern_check_kernel *k, quern_check_tally *tally) {
	const quern_oracle_ops *ops = k->ops;
	int32_t *found = k->host->column(k, k->at[WISH])->found, *then = malloc(k->n * sizeof *then);
	quern_real *distance = quern_check_given(k, DISTANCE, 0);
	const quern_real reach = ops->reach(k->self);
	for (uint32_t i = 0; i < k->n && then; i++) {
		then[i] = found[i];
		if (distance[i] > reach) distance[i] = INFINITY;
	}
	k->host->run(k, 64, false);
	found = k->host->column(k, k->at[WISH])->found;
	for (uint32_t i = 0; i < k->n && then; i++)
		if (isinf(distance[i]))
			k->host->expect(tally, found[i] == then[i],
				"%u-D: beyond its reach of %g m a wish is %d, and %d infinitely far away", k->dim, reach,
				then[i], found[i]);
	free(then);
}

static void law(const quern_check *c) {
	quern_check_tally level = { .name = "levels are numbers" }, wish = { .name = "wishes are zones" },
					  weight = { .name = "shares are shares" },
					  far = { .name = "nothing changes beyond its reach" };
	quern_check_kernel *k;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; setting < c->host->settings(c) + 20; setting++) {
			quern_check_instance *it = c->host->instance_create(c, dim, setting);
			for (uint32_t variant = 0; it && (k = make(c, it, variant, 500)); variant++) {
				c->host->run(k, 64, false);
				look(k, &level, &wish);
				if (quern_check_has(k, WEIGHT))
					look_at_weights(k, c->host->column(k, k->at[WISH])->found, &weight);
				if (variant == DECIDES && ((const quern_oracle_ops *)k->ops)->reach) look_beyond(k, &far);
				c->host->kernel_destroy(k);
			}
			c->host->instance_destroy(it);
		}
	c->host->tell(c, &level, NULL);
	c->host->tell(c, &wish, NULL);
	if (weight.tried) c->host->tell(c, &weight, NULL);
	if (far.tried) c->host->tell(c, &far, NULL);
}

static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { QUERN_END_USES };
static const quern_check_ops ops = {
	.size = sizeof ops, .kind = &quern_oracle_kind, .make = make, .law = law
};
static const quern_plugin plugin = { .size = sizeof plugin,
	.revision = 1,
	.dims = QUERN_2D | QUERN_3D,
	.instance_size = 1,
	.id = "check.oracle",
	.brief = "Marks and wishes of cells: finite, and one of the zones.",
	.params = params,
	.uses = uses,
	.ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
