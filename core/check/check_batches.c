/* SPDX-License-Identifier: MIT */
/* quern_check_batches - what every kernel promises: results that depend neither on how entities are cut nor on threads, no byte
 * outside its columns, sensible numbers for any parameters */
#include "check.h"
#include "text.h"
#include <stdlib.h>
#include <string.h>

/* ---- results kept aside ---- */

typedef struct {
	char *bytes;
	size_t n;
} results;

static size_t column_bytes(const check_kernel *k, const check_column *c) {
	return c->found ? k->n * (c->integer ? sizeof(int32_t) : sizeof(quern_real)) : 0;
}

static results keep(const check_kernel *k) {
	results r = { 0 };
	for (uint32_t c = 0; c < k->n_columns; c++) r.n += column_bytes(k, &k->column[c]);
	char *to = r.bytes = quern_take(r.n, 1);
	for (uint32_t c = 0; c < k->n_columns; c++) {
		const size_t n = column_bytes(k, &k->column[c]);
		if (n) memcpy(to, k->column[c].found, n);
		to += n;
	}
	return r;
}

/* The name of the first column that differs, or NULL. */
static const char *differs(const check_kernel *k, const results *r) {
	const char *from = r->bytes;
	for (uint32_t c = 0; c < k->n_columns; c++) {
		const size_t n = column_bytes(k, &k->column[c]);
		if (n && memcmp(from, k->column[c].found, n) != 0) return k->column[c].name;
		from += n;
	}
	return NULL;
}

/* ---- batches, threads, guards ---- */

typedef struct {
	check_tally batches, threads, guards, inputs, self, environment;
} batch_tallies;

static void try_kernel(check_kernel *k, batch_tallies *t, quern_pool *pool) {
	static const uint32_t cuts[] = { 1, 7, 8, 64, 250 };
	quern_check_run(k, 512, NULL);
	results whole = keep(k);
	for (size_t i = 0; i < sizeof cuts / sizeof *cuts; i++) {
		quern_check_run(k, cuts[i], NULL);
		const char *column = differs(k, &whole);
		quern_check_expect(&t->batches, !column, "%s, %u-D: %s differs between batches of 512 and of %u",
			k->name, k->dim, column, cuts[i]);
	}
	for (int turn = 0; turn < 8; turn++) {
		quern_check_run(k, 16, pool);
		const char *column = differs(k, &whole);
		quern_check_expect(&t->threads, !column, "%s, %u-D: %s differs when several threads call it", k->name,
			k->dim, column);
	}
	const char *culprit = k->culprit ? k->culprit : "";
	quern_check_expect(
		&t->guards, !k->overrun, "%s, %u-D: writes beyond cap of %s", k->name, k->dim, culprit);
	quern_check_expect(&t->inputs, !k->changed, "%s, %u-D: changes its input %s", k->name, k->dim, culprit);
	quern_check_expect(
		&t->self, !k->altered, "%s, %u-D: changes self, which is read-only after init", k->name, k->dim);
	quern_check_expect(&t->environment, !k->environment,
		"%s, %u-D: changes rounding or another mode of arithmetic", k->name, k->dim);
	free(whole.bytes);
}

static void try_instance(const check *c, const check_kind *kind, const check_instance *it, batch_tallies *t) {
	quern_pool *pool = quern_pool_create(4);
	check_kernel *k = quern_take(1, sizeof *k);
	for (uint32_t variant = 0; variant < 16 && kind->make(c, it, variant, 700, k); variant++) {
		try_kernel(k, t, pool);
		quern_check_kernel_finish(k);
	}
	free(k);
	quern_pool_destroy(pool);
}

void quern_check_batches(const check *c, const check_kind *kind) {
	batch_tallies t = { { .name = "batches" }, { .name = "threads" }, { .name = "guards" },
		{ .name = "inputs" }, { .name = "self" }, { .name = "arithmetic" } };
	for (uint32_t dim = 2; dim <= 3; dim++) {
		check_instance it;
		if (!check_has_dim(c, dim)) continue;
		if (quern_check_instance_create(c, dim, 0, &it) == CHECK_READY) try_instance(c, kind, &it, &t);
		quern_check_instance_finish(c, &it);
	}
	if (!t.batches.tried) return;
	quern_check_tell(c, &t.batches, "1, 7, 8, 64, 250 and 512 at a time give the same bits");
	quern_check_tell(c, &t.threads, "4 threads at once give the same bits");
	quern_check_tell(c, &t.guards, "nothing is written beyond cap");
	quern_check_tell(c, &t.inputs, "inputs are left alone");
	quern_check_tell(c, &t.self, "self is left alone");
	quern_check_tell(c, &t.environment, "modes of arithmetic are left alone");
}

/* ---- parameters ---- */

static bool gives_sense(const check *c, const check_kind *kind, const check_instance *it, const char **why) {
	bool good = true;
	if (kind->sane) return kind->sane(c, it, why);
	if (!kind->make) return true;
	check_kernel *k = quern_take(1, sizeof *k);
	for (uint32_t variant = 0; good && variant < 16 && kind->make(c, it, variant, 64, k); variant++) {
		quern_check_run(k, 64, NULL);
		good = quern_check_finite(k, why);
		quern_check_kernel_finish(k);
	}
	free(k);
	return good;
}

void quern_check_parameters(const check *c, const check_kind *kind) {
	enum { MIXTURES = 60 };
	check_tally ordinary = { .name = "set-up" }, polite = { .name = "parameters" },
				finite = { .name = "finite" };
	const uint64_t single = quern_check_settings(c), n = c->file->n_params ? single + MIXTURES : 1;
	uint32_t accepted = 0, refused = 0;
	for (uint32_t dim = 2; dim <= 3; dim++)
		for (uint64_t setting = 0; check_has_dim(c, dim) && setting < n; setting++) {
			check_instance it;
			const char *why = "";
			const check_outcome outcome = quern_check_instance_create(c, dim, setting, &it);
			if (!setting)
				quern_check_expect(&ordinary, outcome == CHECK_READY,
					"no instance in %u-D: %s; name what it needs with --set key=value", dim, it.why);
			quern_check_expect(&polite, outcome != CHECK_RUDE, "%s (%u-D)", it.why, dim);
			accepted += outcome == CHECK_READY;
			refused += outcome == CHECK_REFUSED;
			if (outcome == CHECK_READY) {
				char what[400];
				const bool good = gives_sense(c, kind, &it, &why);
				quern_text text = { 0 };
				quern_node_print(it.tree->root, 0, &text);
				snprintf(what, sizeof what, "%s", quern_text_string(&text));
				for (char *s = what; *s; s++)
					if (*s == '\n') *s = ';';
				quern_check_expect(&finite, good, "%s is not finite in %u-D with %s", why, dim, what);
				quern_text_finish(&text);
			}
			quern_check_instance_finish(c, &it);
		}
	quern_check_tell(c, &ordinary, NULL);
	quern_check_tell(c, &polite, "%u settings accepted, %u refused with a reason", accepted, refused);
	quern_check_tell(c, &finite, NULL);
}
