/* SPDX-License-Identifier: MIT */
/* Sets and fields: reordering carries every column, indices follow their target, and who lost it goes. */
#include <quern/columns.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <field.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GRAIN, CONTACT };
enum { ID, POSITION, STRESS, FIRST, SECOND, SLIP, FIELDS };

static void add_set(quern_store *s, const char *name) {
	s->sets = realloc(s->sets, (s->n_sets + 1) * sizeof *s->sets);
	assert_non_null(s->sets);
	s->sets[s->n_sets] = (quern_set_store) { .n = 0 };
	snprintf(s->sets[s->n_sets++].name, sizeof s->sets->name, "%s", name);
}

static void add_field(quern_store *s, const char *name, int set, uint8_t shape, int target, double initial) {
	s->fields = realloc(s->fields, (s->n_fields + 1) * sizeof *s->fields);
	assert_non_null(s->fields);
	quern_field *f = &s->fields[s->n_fields++];
	*f = (quern_field) { .set = set,
		.target = target,
		.shape = shape,
		.n_components = (uint8_t)quern_shape_size(shape, 2),
		.initial = initial };
	snprintf(f->name, sizeof f->name, "%s", name);
}

static int open_store(void **state) {
	quern_store *s = malloc(sizeof *s);
	assert_non_null(s);
	quern_store_init(s, quern_pool_create(2));
	add_set(s, "grain");
	add_set(s, "contact");
	add_field(s, "grain.id", GRAIN, QUERN_ID, -1, 0);
	add_field(s, "grain.position", GRAIN, QUERN_VECTOR, -1, 0.5);
	add_field(s, "grain.stress", GRAIN, QUERN_SYMMETRIC, -1, 3);
	add_field(s, "contact.first", CONTACT, QUERN_INDEX, GRAIN, 0);
	add_field(s, "contact.second", CONTACT, QUERN_INDEX, GRAIN, 0);
	add_field(s, "contact.slip", CONTACT, QUERN_AXIAL, -1, 7);
	*state = s;
	return 0;
}

static int close_store(void **state) {
	quern_store *s = *state;
	quern_pool *pool = s->pool;
	quern_store_finish(s);
	quern_pool_destroy(pool);
	free(s);
	return 0;
}

static quern_column column(const quern_store *s, int field) {
	return quern_field_column(s, &s->fields[field], s->fields[field].now);
}

/* Five grains at x = 0 .. 4 and four contacts between neighbours. */
static void fill(quern_store *s) {
	assert_int_equal(quern_store_fill(s, GRAIN, 5), QUERN_OK);
	assert_int_equal(quern_store_fill(s, CONTACT, 4), QUERN_OK);
	for (int i = 0; i < 5; i++) column(s, POSITION).real[0][i] = i;
	for (int i = 0; i < 4; i++) {
		column(s, FIRST).index[i] = i;
		column(s, SECOND).index[i] = i + 1;
		column(s, SLIP).real[0][i] = 10 * i;
	}
}

static void starts_as_new(void **state) {
	quern_store *s = *state;
	fill(s);
	assert_int_equal(s->sets[GRAIN].n, 5);
	for (int i = 0; i < 5; i++) {
		assert_int_equal(column(s, ID).id[i], i);
		assert_true(column(s, POSITION).real[1][i] == 0.5);
		/* the diagonal alone */
		assert_true(column(s, STRESS).real[0][i] == 3 && column(s, STRESS).real[1][i] == 3);
		assert_true(column(s, STRESS).real[2][i] == 0);
	}
	for (int f = 0; f < FIELDS; f++)
		for (int k = 0; k < s->fields[f].n_components; k++)
			assert_int_equal((uintptr_t)s->fields[f].data[0][k] % 64, 0);
}

static void reorders(void **state) {
	static const int32_t from[] = { 4, 2, 0, -1, 1, 3 };
	static const uint32_t block[] = { 0, 2, 6 };
	quern_store *s = *state;
	fill(s);
	const uint64_t version = s->version;
	assert_int_equal(quern_store_remap(s, GRAIN, 6, from, 2, block), QUERN_OK);
	assert_true(s->version > version);
	assert_int_equal(s->sets[GRAIN].n, 6);
	assert_int_equal(s->sets[GRAIN].n_blocks, 2);
	assert_int_equal(s->sets[GRAIN].block[1], 2);
	for (int i = 0; i < 6; i++) {
		assert_true(column(s, POSITION).real[0][i] == (from[i] < 0 ? 0.5 : from[i]));
		assert_int_equal(column(s, ID).id[i], from[i] < 0 ? 5 : from[i]); /* the new one counts on */
	}
	assert_int_equal(s->sets[CONTACT].n, 4);
	for (int i = 0; i < 4; i++) { /* contacts still name the same grains */
		assert_true(column(s, POSITION).real[0][column(s, FIRST).index[i]] == i);
		assert_true(column(s, POSITION).real[0][column(s, SECOND).index[i]] == i + 1);
		assert_true(column(s, SLIP).real[0][i] == 10 * i);
	}
}

static void drops_orphans(void **state) {
	static const int32_t from[] = { 0, 1, 3, 4 }; /* grain 2 is gone */
	static const uint32_t block[] = { 0, 2, 3, 4 };
	quern_store *s = *state;
	fill(s);
	assert_int_equal(quern_store_partition(s, CONTACT, 3, block), QUERN_OK);
	assert_int_equal(quern_store_remap(s, GRAIN, 4, from, 0, NULL), QUERN_OK);
	assert_int_equal(s->sets[CONTACT].n, 2);
	assert_true(column(s, SLIP).real[0][0] == 0 && column(s, SLIP).real[0][1] == 30);
	assert_int_equal(column(s, FIRST).index[1], 2);
	assert_int_equal(column(s, SECOND).index[1], 3);
	/* contact 1 left block 0, contact 2 was all of block 1 */
	assert_int_equal(s->sets[CONTACT].block[0], 0);
	assert_int_equal(s->sets[CONTACT].block[1], 1);
	assert_int_equal(s->sets[CONTACT].block[2], 1);
	assert_int_equal(s->sets[CONTACT].block[3], 2);
	/* a number once given is never given again */
	static const int32_t more[] = { 0, 1, 2, 3, -1 };
	assert_int_equal(quern_store_remap(s, GRAIN, 5, more, 0, NULL), QUERN_OK);
	assert_int_equal(column(s, ID).id[4], 5);
}

/* An index that points at nothing stays so; one into a set that has no entries has lost its target. */
static void points_at_nothing(void **state) {
	static const int32_t from[] = { 4, 3, 2, 1, 0 };
	quern_store *s = *state;
	fill(s);
	column(s, SECOND).index[2] = QUERN_NO_TARGET;
	assert_int_equal(quern_store_remap(s, GRAIN, 5, from, 0, NULL), QUERN_OK);
	assert_int_equal(s->sets[CONTACT].n, 4);
	assert_int_equal(column(s, FIRST).index[2], 2);
	assert_int_equal(column(s, SECOND).index[2], QUERN_NO_TARGET);
	assert_int_equal(quern_store_fill(s, GRAIN, 0), QUERN_OK);
	assert_int_equal(s->sets[CONTACT].n, 0);
	assert_int_equal(quern_store_fill(s, CONTACT, 3), QUERN_OK); /* at entry 0 of no grains */
	assert_int_equal(quern_store_fill(s, GRAIN, 2), QUERN_OK);
	assert_int_equal(s->sets[CONTACT].n, 0);
}

/* Numbers of blocks and their places are two things: sums and orders go by places, whatever the numbers are. */
static void goes_by_places(void **state) {
	static const int32_t turned[] = { 3, 4, 0, 1,
		2 }; /* the last of the blocks {0, 1}, {2}, {3, 4} gets the first number */
	static const uint32_t block[] = { 0, 2, 3, 5 }, other[] = { 0, 2, 4, 5 }, by_place[] = { 1, 2, 0 };
	static const double x[] = { 5e15, 5e15, 1, -5e15, -5e15 }, y[] = { -5e15, -5e15, 5e15, 5e15, 1 };
	quern_store *s = *state;
	fill(s);
	assert_null(quern_store_parts(s, GRAIN)->block);
	assert_true(quern_store_sum(s, GRAIN, x) == quern_tree_sum(5, x));
	assert_int_equal(quern_store_partition(s, GRAIN, 3, block), QUERN_OK);
	assert_null(quern_store_parts(s, GRAIN)->entry);
	assert_true(quern_store_sum(s, GRAIN, x) == 0); /* 1 is lost beside 1e16 */
	assert_int_equal(quern_store_remap(s, GRAIN, 5, turned, 3, other), QUERN_OK);
	assert_true(quern_store_sum(s, GRAIN, y) == 1); /* in the order of numbers it is not */
	assert_int_equal(quern_store_arrange(s, GRAIN, by_place), QUERN_OK);
	const quern_parts *p = quern_store_parts(s, GRAIN);
	assert_int_equal(p->owned, 5);
	for (uint32_t q = 0; q < 5; q++) assert_true(column(s, POSITION).real[0][p->entry[q]] == q);
	assert_true(quern_store_sum(s, GRAIN, y) == 0);
	assert_int_equal(quern_store_partition(s, GRAIN, 3, other), QUERN_OK); /* cut anew */
	assert_null(quern_store_parts(s, GRAIN)->by_place);
}

/* Parts and joined entries follow the rules of their fields. */
static void parts_and_joins(void **state) {
	static const int32_t from[] = { 0, 1, 2, 3, 4, -2 - 4, -1 };
	static const uint8_t rules[] = { QUERN_SUMS, QUERN_MEANS, QUERN_KEEPS, QUERN_OWN };
	quern_store *s = *state;
	for (size_t r = 0; r < sizeof rules; r++) {
		s->fields[POSITION].rule = rules[r];
		fill(s);
		double *x;
		assert_int_equal(quern_store_remap(s, GRAIN, 7, from, 0, NULL),
			QUERN_OK); /* the last two: a part of 4, and a new one */
		x = column(s, POSITION).real[0];
		assert_true(x[4] == 4 && x[6] == 0.5);
		assert_true(x[5] == (rules[r] == QUERN_SUMS ? 0 : rules[r] == QUERN_OWN ? 0.5 : 4));
		quern_store_give(s, GRAIN, 4, 5, 0.25, 1); /* a quarter goes to the part */
		quern_store_give(s, GRAIN, 1, 3, 1, 0.25); /* 1 joins 3, and has a quarter of the mass of both */
		quern_store_give(s, GRAIN, 2, QUERN_NO_TARGET, 0.5, 0);
		assert_true(x[5] == (rules[r] == QUERN_SUMS ? 1 : rules[r] == QUERN_OWN ? 0.5 : 4));
		assert_true(x[4] == (rules[r] == QUERN_SUMS ? 3 : 4));
		assert_true(x[3] == (rules[r] == QUERN_SUMS ? 4 : rules[r] == QUERN_MEANS ? 2.5 : 3));
		assert_true(x[2] == (rules[r] == QUERN_SUMS ? 1 : 2));
	}
}

/* Contacts that lose a grain go; the places of the blocks of those that stay are what they were. */
static void keeps_places(void **state) {
	static const int32_t from[] = { 0, 1, 3, 4 };
	static const uint32_t block[] = { 0, 2, 3, 4 }, by_place[] = { 2, 0, 1 };
	quern_store *s = *state;
	fill(s);
	assert_int_equal(quern_store_partition(s, CONTACT, 3, block), QUERN_OK);
	assert_int_equal(quern_store_arrange(s, CONTACT, by_place), QUERN_OK);
	assert_int_equal(quern_store_remap(s, GRAIN, 4, from, 0, NULL), QUERN_OK);
	const quern_parts *p = quern_store_parts(s, CONTACT);
	assert_int_equal(p->n, 2);
	assert_int_equal(p->by_place[0], 2);
	assert_int_equal(p->entry[0], 1);
	assert_int_equal(p->entry[1], 0);
}

static void keeps_two_copies(void **state) {
	quern_store *s = *state;
	s->fields[POSITION].twice = true;
	fill(s);
	quern_column now = column(s, POSITION), other = quern_field_column(s, &s->fields[POSITION], 1);
	assert_non_null(other.real[0]);
	assert_ptr_not_equal(now.real[0], other.real[0]);
	static const int32_t from[] = { 4, 3, 2, 1, 0 };
	s->fields[POSITION].now = 1;
	for (int i = 0; i < 5; i++) other.real[0][i] = 100 + i;
	assert_int_equal(quern_store_remap(s, GRAIN, 5, from, 0, NULL), QUERN_OK);
	assert_true(column(s, POSITION).real[0][0] == 104);
}

static void grows(void **state) {
	quern_store *s = *state;
	fill(s);
	for (uint32_t n = 5; n < 20000; n = n * 3 + 1) {
		int32_t *from = malloc(n * sizeof *from);
		assert_non_null(from);
		for (uint32_t i = 0; i < n; i++) from[i] = i < s->sets[GRAIN].n ? (int32_t)i : -1;
		assert_int_equal(quern_store_remap(s, GRAIN, n, from, 0, NULL), QUERN_OK);
		free(from);
		for (uint32_t i = 0; i < n; i++) assert_int_equal(column(s, ID).id[i], i);
	}
	assert_true(column(s, POSITION).real[0][4] == 4);
	assert_int_equal(s->sets[CONTACT].n, 4);
	assert_int_equal(quern_store_remap(s, GRAIN, 0, NULL, 0, NULL), QUERN_OK);
	assert_int_equal(s->sets[CONTACT].n, 0);
}

/* A copy has all that its model has but the id; who points at the model still does. */
static void copies(void **state) {
	static const int32_t from[] = { 0, 1, 2, 3, 4, -2 - 3, -1 };
	quern_store *s = *state;
	fill(s);
	column(s, STRESS).real[2][3] = 7;
	assert_int_equal(quern_store_remap(s, GRAIN, 7, from, 0, NULL), QUERN_OK);
	assert_true(column(s, POSITION).real[0][5] == 3 && column(s, STRESS).real[2][5] == 7);
	assert_true(column(s, POSITION).real[0][6] == 0.5 && column(s, STRESS).real[2][6] == 0);
	assert_int_equal(column(s, ID).id[3], 3);
	assert_int_equal(column(s, ID).id[5], 5);
	assert_int_equal(column(s, ID).id[6], 6);
	assert_int_equal(column(s, FIRST).index[3], 3);
	assert_int_equal(column(s, SECOND).index[2], 3);
}

int main(void) {
#define STORE(test) cmocka_unit_test_setup_teardown(test, open_store, close_store)
	const struct CMUnitTest tests[] = { STORE(starts_as_new), STORE(reorders), STORE(copies),
		STORE(drops_orphans), STORE(goes_by_places), STORE(keeps_places), STORE(parts_and_joins),
		STORE(points_at_nothing), STORE(keeps_two_copies), STORE(grows) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
