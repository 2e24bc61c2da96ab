/* SPDX-License-Identifier: MIT */
/* sort - the stage that keeps points in the order of blocks and cells */
#include "../common/cover.h"
#include "mpm.h"

/* What a block's cells hold is the hybrid's to give away: between its updates none goes. */
static bool always(const void *arg, uint32_t block) {
	(void)arg, (void)block;
	return true;
}

quern_status quern_mpm_sort(const void *self, const quern_step *s) {
	int32_t *unsorted = s->use[SORT_UNSORTED].index;
	/* a stage of the scene begins as a scene that starts from the state before it would: sorted */
	const bool begins = s->step == s->stage_step;
	(void)self;
	if (!*unsorted && !begins) return QUERN_OK;
	*unsorted = 0;
	const bool hybrid = s->host->has(s->run, "hybrid");
	const cover c = {
		.point = s->use[SORT_POSITION], .grain = { .real = { NULL } }, .holds = hybrid ? always : NULL
	};
	return quern_cover_sort(s, &c);
}
