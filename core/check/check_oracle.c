/* SPDX-License-Identifier: MIT */
/* quern_check_oracle - marks and wishes of cells: local, finite, and one of the three zones */
#include "check.h"
#include <math.h>
#include <quern/oracle.h>
#include <stdlib.h>

enum { CENTRE, DISTANCE, ZONE, LEVEL, WISH };
enum { MARKS, DECIDES, VARIANTS };

static void call(const check_kernel *k, const check_batch *b) {
	const quern_oracle_ops *ops = k->ops;
	quern_column use[CHECK_ROWS];
	quern_cell_batch batch = { .n = b->n, .cap = b->cap, .dim = k->dim, .cell = 4e-3, .use = use };
	CHECK_VECTOR(batch.centre, k, b, CENTRE, k->dim);
	batch.distance = check_at(k, b, DISTANCE, 0);
	batch.zone = check_at(k, b, ZONE, 0);
	batch.level = check_at(k, b, LEVEL, 0);
	batch.wish = check_at(k, b, WISH, 0);
	quern_check_columns(k, b, k->use, use);
	(k->pass == MARKS ? ops->mark : ops->decide)(k->instance->self, &batch);
}

static bool make(const check *c, const check_instance *it, uint32_t variant, uint32_t n, check_kernel *k) {
	if (variant >= VARIANTS) return false;
	quern_check_kernel_init(k, c, it, variant == MARKS ? "mark" : "decide", n);
	k->call = call;
	k->pass = variant;
	quern_check_add(k, CENTRE, "centre", CHECK_IN, k->dim);
	quern_check_fill(k, CENTRE, k->dim, 110, 0, 1);
	quern_check_add_integers(k, ZONE, "zone", CHECK_IN);
	for (uint32_t i = 0; i < n; i++)
		((int32_t *)k->column[k->at[ZONE]].given)[i] = (int32_t)quern_check_uniform(111, i, 0, 2.999);
	/* rows are the cells' fields in both calls, whatever their hook */
	quern_check_add_uses(k, 0, true, false);
	quern_check_add_uses(k, 1, true, false);
	if (variant == MARKS) {
		quern_check_add(k, LEVEL, "level", CHECK_OUT, 1);
		return true;
	}
	quern_check_add(k, DISTANCE, "distance", CHECK_IN, 1);
	quern_check_fill(k, DISTANCE, 1, 112, -20e-3, 60e-3);
	quern_check_add_integers(k, WISH, "wish", CHECK_OUT);
	return true;
}

static void law(const check *c) {
	check_tally level = { .name = "levels are numbers" }, wish = { .name = "wishes are zones" };
	check_kernel *k = malloc(sizeof *k);
	if (!k) abort();
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; check_has_dim(c, dim) && setting < quern_check_settings(c) + 20;
			 setting++) {
			check_instance it;
			if (quern_check_instance_create(c, dim, setting, &it) == CHECK_READY)
				for (uint32_t variant = 0; make(c, &it, variant, 500, k); variant++) {
					quern_check_run(k, 64, NULL);
					for (uint32_t i = 0; i < k->n && variant == MARKS; i++)
						quern_check_expect(&level, isfinite(quern_check_found(k, LEVEL, 0)[i]),
							"%u-D: a level is not finite", dim);
					for (uint32_t i = 0; i < k->n && variant == DECIDES; i++) {
						const int32_t w = ((const int32_t *)k->column[k->at[WISH]].found)[i];
						quern_check_expect(&wish, w >= QUERN_DISCRETE && w <= QUERN_CONTINUUM,
							"%u-D: a wish is %d, no zone", dim, w);
					}
					quern_check_kernel_finish(k);
				}
			quern_check_instance_finish(c, &it);
		}
	free(k);
	quern_check_tell(c, &level, NULL);
	quern_check_tell(c, &wish, NULL);
}

const check_kind quern_check_oracle = { .kind = &quern_oracle_kind, .make = make, .law = law };
