/* SPDX-License-Identifier: MIT */
#include "source.h"
#include "renew.h"
#include "tools.h"
#include <math.h>
#include <stdio.h>

const char *const quern_source_keeps[] = { "rate", "full", NULL };

static quern_status check_source(const source *p, uint32_t i, const quern_setup *setup, quern_err *err) {
	char param[60];
	const quern_host *host = setup->host;
	snprintf(param, sizeof param, "source.%u.rate", i);
	if (p->keep == SOURCE_BY_RATE && isnan(p->rate))
		return host->fail(err, QUERN_E_PARAM, param, "say how much is poured in a second, or keep: full");
	if (p->keep == SOURCE_FULL && !isnan(p->rate))
		return host->fail(err, QUERN_E_PARAM, param,
			"a source that keeps its region full has no rate: give one of the two");
	snprintf(param, sizeof param, "source.%u.until", i);
	if (p->until <= p->from)
		return host->fail(
			err, QUERN_E_PARAM, param, "%g s is not after the beginning, %g s", p->until, p->from);
	snprintf(param, sizeof param, "source.%u.velocity", i);
	if (quern_too_fast(p->velocity, 1))
		return host->fail(err, QUERN_E_PARAM, param, "the velocity is beyond that of light");
	return QUERN_OK;
}

quern_status quern_sources_check(const quern_list *list, const quern_setup *setup, quern_err *err) {
	for (uint32_t i = 0; i < list->n; i++)
		if (check_source(quern_source_at(list, i), i, setup, err) != QUERN_OK) return QUERN_E_PARAM;
	return QUERN_OK;
}

quern_status quern_sources_place(
	quern_list *list, const quern_bound *shape, region_use use, const quern_setup *setup, quern_err *err) {
	for (uint32_t i = 0; i < list->n; i++) {
		source *p = (source *)(void *)((char *)list->items + (size_t)i * list->item_size);
		char param[60];
		snprintf(param, sizeof param, "source.%u.region", i);
		if (quern_region_box(&shape[i], use, setup, param, err, p->lower, p->upper) != QUERN_OK)
			return QUERN_E_PARAM;
	}
	return QUERN_OK;
}

bool quern_source_acts(const source *p, const quern_step *s) {
	const int64_t steps = p->every / (int64_t)s->n_substeps;
	return s->step % (steps > 1 ? steps : 1) == 0 && s->time >= p->from;
}

/* Added up from look to look, since one of the scene's stages may change the rate. */
quern_real quern_source_due(const source *p, quern_real time, uint32_t i, const quern_column *row) {
	quern_real *due = &row[0].real[0][i], *looked = &row[1].real[0][i];
	const quern_real begin = *looked > p->from ? *looked : p->from, end = time > p->until ? p->until : time;
	const bool full = p->keep == SOURCE_FULL;
	if (!full && end > begin) *due += p->rate * (end - begin);
	*looked = time;
	const quern_real all = !full ? *due : time >= p->until ? 0 : INFINITY;
	return all > p->most ? p->most : all;
}

void quern_source_even(const source *p, uint32_t i, const quern_column *due, const quern_column *poured) {
	if (p->keep == SOURCE_FULL) due->real[0][i] = poured->real[0][i];
}

quern_status quern_source_room(
	const quern_step *s, const char *set, const char *what, uint32_t n, uint32_t *old) {
	enum { MOST = 1 << 30 };
	*old = s->host->set(s->run, set).n;
	if (n > MOST - *old)
		return s->host->stop(s->run, QUERN_E_NUMERIC, NULL, -1,
			"sources have poured more %s than can be numbered, %d", what, MOST);
	return quern_renew(s, &(renewal) { .set = set, .n_new = n });
}

void quern_source_note(const quern_step *s, uint32_t i, const char *section, const source *p,
	quern_real waiting, const quern_column *row) {
	const bool waits = waiting > 0 && p->keep == SOURCE_BY_RATE;
	int32_t *late = &row[1].index[i];
	row[0].real[0][i] = waits ? waiting : 0;
	if (!waits || *late) return;
	*late = 1;
	s->host->log(s->run, 2,
		"%s.source.%u has no room at t = %.4g s: %.3g kg wait; observe outflow to see how much does later",
		section, i, s->time, waiting);
}
