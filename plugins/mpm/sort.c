/* sort - the stage that keeps points in the order of blocks and cells */
#include "../common/cover.h"
#include "mpm.h"

quern_status quern_mpm_sort(const void *self, const quern_step *s) {
	int32_t *unsorted = s->use[SORT_UNSORTED].index;
	(void)self;
	if (!*unsorted) return QUERN_OK;
	*unsorted = 0;
	/* blocks with cells stay: what their cells hold is the hybrid's to give away */
	const cover c = { .point = s->use[SORT_POSITION],
		.grain = { .real = { NULL } },
		.keep = s->host->set(s->run, "cell").n > 0 };
	return quern_cover_sort(s, &c);
}
