/* SPDX-License-Identifier: MIT */
/* quern_check_batches - what every kernel promises: results that depend neither on how entities are cut nor on
 * threads, no byte outside its columns, sensible numbers for any parameters */
#include "check.h"
#include "text.h"
#include "tree.h"
#include <stdlib.h>
#include <string.h>

/* ---- results kept aside ---- */

typedef struct {
	char *bytes;
	size_t n;
} results;

static size_t column_bytes(const check_kernel *k, const quern_check_column *c) {
	return c->found ? k->open.n * quern_check_entry_bytes(c) : 0;
}

static results keep(const check_kernel *k) {
	results r = { 0 };
	for (uint32_t c = 0; c < k->open.n_columns; c++) r.n += column_bytes(k, &k->column[c]);
	char *to = r.bytes = quern_take(r.n, 1);
	for (uint32_t c = 0; c < k->open.n_columns; c++) {
		const size_t n = column_bytes(k, &k->column[c]);
		if (n) memcpy(to, k->column[c].found, n);
		to += n;
	}
	return r;
}

/* The name of the first column that differs, or NULL. */
static const char *differs(const check_kernel *k, const results *r) {
	const char *from = r->bytes;
	for (uint32_t c = 0; c < k->open.n_columns; c++) {
		const size_t n = column_bytes(k, &k->column[c]);
		if (n && memcmp(from, k->column[c].found, n) != 0) return k->column[c].name;
		from += n;
	}
	return NULL;
}

/* ---- batches, threads, guards ---- */

typedef struct {
	quern_check_tally batches, threads, guards, inputs, self, environment;
} batch_tallies;

static void try_kernel(check_kernel *k, batch_tallies *t) {
	static const uint32_t cuts[] = { 1, 7, 8, 64, 250 };
	const char *name = k->open.name, *culprit;
	const uint32_t dim = k->open.dim;
	quern_check_run(&k->open, 512, false);
	results whole = keep(k);
	for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
		quern_check_run(&k->open, cuts[i], false);
		const char *column = differs(k, &whole);
		quern_check_expect(&t->batches, !column, "%s, %u-D: %s differs between batches of 512 and of %u",
			name, dim, column, cuts[i]);
	}
	for (int turn = 0; turn < 8; turn++) {
		quern_check_run(&k->open, 16, true);
		const char *column = differs(k, &whole);
		quern_check_expect(
			&t->threads, !column, "%s, %u-D: %s differs when several threads call it", name, dim, column);
	}
	culprit = k->culprit ? k->culprit : "";
	quern_check_expect(
		&t->guards, !k->overrun, "%s, %u-D: writes beyond the batch in %s", name, dim, culprit);
	quern_check_expect(&t->inputs, !k->changed, "%s, %u-D: changes its input %s", name, dim, culprit);
	quern_check_expect(
		&t->self, !k->altered, "%s, %u-D: changes self, which is read-only after init", name, dim);
	quern_check_expect(&t->environment, !k->environment,
		"%s, %u-D: changes rounding or another mode of arithmetic", name, dim);
	free(whole.bytes);
}

enum { MOST_VARIANTS = 16 };

static void try_instance(const check *c, const quern_check_instance *it, batch_tallies *t) {
	quern_check_kernel *k;
	for (uint32_t v = 0; v < MOST_VARIANTS && (k = c->test->make(&c->open, it, v, 700)); v++) {
		try_kernel((check_kernel *)(void *)k, t);
		quern_check_kernel_destroy(k);
	}
}

void quern_check_batches(const check *c) {
	batch_tallies t = { { .name = "batches" }, { .name = "threads" }, { .name = "guards" },
		{ .name = "inputs" }, { .name = "self" }, { .name = "arithmetic" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		quern_check_instance *it = quern_check_instance_create(&c->open, dim, 0);
		if (it) try_instance(c, it, &t);
		quern_check_instance_destroy(it);
	}
	if (!t.batches.tried) return;
	quern_check_tell(&c->open, &t.batches, "1, 7, 8, 64, 250 and 512 at a time give the same bits");
	quern_check_tell(&c->open, &t.threads, "4 threads at once give the same bits");
	quern_check_tell(&c->open, &t.guards, "nothing is written beyond the batch");
	quern_check_tell(&c->open, &t.inputs, "inputs are left alone");
	quern_check_tell(&c->open, &t.self, "self is left alone");
	quern_check_tell(&c->open, &t.environment, "modes of arithmetic are left alone");
}

/* ---- parameters ---- */

static bool gives_sense(const check *c, const quern_check_instance *it, const char **why) {
	bool good = true;
	quern_check_kernel *k;
	if (c->test && c->test->sane) return c->test->sane(&c->open, it, why);
	if (!c->test || !c->test->make) return true;
	for (uint32_t v = 0; good && v < MOST_VARIANTS && (k = c->test->make(&c->open, it, v, 64)); v++) {
		quern_check_run(k, 64, false);
		good = quern_check_finite(k, why);
		quern_check_kernel_destroy(k);
	}
	return good;
}

/* With what it was set up, in one line. */
static void try_sense(const check *c, const check_instance *it, quern_check_tally *t) {
	char what[400];
	const char *why = "";
	const bool good = gives_sense(c, &it->open, &why);
	quern_text text = { 0 };
	quern_node_print(it->tree->root, 0, &text);
	snprintf(what, sizeof what, "%s", quern_text_string(&text));
	for (char *s = what; *s; s++)
		if (*s == '\n') *s = ';';
	quern_check_expect(t, good, "%s is not finite in %u-D with %s", why, it->open.dim, what);
	quern_text_finish(&text);
}

void quern_check_parameters(const check *c) {
	enum { MIXTURES = 60 };
	quern_check_tally ordinary = { .name = "set-up" }, polite = { .name = "parameters" },
					  finite = { .name = "finite" };
	const uint64_t n = c->file->n_params ? quern_check_settings(&c->open) + MIXTURES : 1;
	uint32_t accepted = 0, refused = 0;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; quern_check_has_dim(c, dim) && setting < n; setting++) {
			check_instance *it = quern_check_try(c, dim, setting);
			const bool ready = it->outcome == CHECK_READY;
			if (!setting)
				quern_check_expect(&ordinary, ready,
					"no instance in %u-D: %s; name what it needs with --set key=value", dim, it->why);
			quern_check_expect(&polite, it->outcome != CHECK_RUDE, "%s (%u-D)", it->why, dim);
			accepted += ready;
			refused += it->outcome == CHECK_REFUSED;
			if (ready) try_sense(c, it, &finite);
			quern_check_instance_destroy(&it->open);
		}
	quern_check_tell(&c->open, &ordinary, NULL);
	quern_check_tell(&c->open, &polite, "%u settings accepted, %u refused with a reason", accepted, refused);
	quern_check_tell(&c->open, &finite, NULL);
}
