/* SPDX-License-Identifier: MIT */
/* Memory that runs out while a set is reordered: whichever allocation fails, the store can still be looked at; and in a step, which says so. */
#include <quern/columns.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "harness.h"
#include <run.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The linker puts these in the place of the library's own. */
void *__real_malloc(size_t);
void *__real_calloc(size_t, size_t);
void *__real_realloc(void *, size_t);
void *__real_aligned_alloc(size_t, size_t);
void *__wrap_malloc(size_t);
void *__wrap_calloc(size_t, size_t);
void *__wrap_realloc(void *, size_t);
void *__wrap_aligned_alloc(size_t, size_t);

static long left = -1; /* allocations that still succeed; negative: all */

static bool refused(void) { return left >= 0 && left-- == 0; }
/* once one has failed, all that follow do too */
static bool fails(void) {
	if (!refused()) return false;
	left = 0;
	return true;
}
void *__wrap_malloc(size_t n) { return fails() ? NULL : __real_malloc(n); }
void *__wrap_calloc(size_t n, size_t m) { return fails() ? NULL : __real_calloc(n, m); }
void *__wrap_realloc(void *p, size_t n) { return fails() ? NULL : __real_realloc(p, n); }
static long aligned_left = -1; /* the same of aligned memory, of which one alone fails */
void *__wrap_aligned_alloc(size_t a, size_t n) {
	if (aligned_left >= 0 && aligned_left-- == 0) return NULL;
	return fails() ? NULL : __real_aligned_alloc(a, n);
}

enum { GRAIN, CONTACT, NODE, SETS };
enum { ID, POSITION, FIRST, SECOND, PARTNER, SLIP, FIELDS };

static void open_store(quern_store *s) {
	static const char *const sets[SETS] = { "grain", "contact", "node" };
	quern_store_init(s, quern_pool_create(1));
	s->sets = calloc(SETS, sizeof *s->sets);
	s->fields = calloc(FIELDS, sizeof *s->fields);
	assert_true(s->sets && s->fields);
	for (; s->n_sets < SETS; s->n_sets++)
		snprintf(s->sets[s->n_sets].name, sizeof s->sets->name, "%s", sets[s->n_sets]);
	s->sets[NODE].rows = 8;
	const quern_field fields[FIELDS] = {
		[ID] = { .name = "grain.id", .set = GRAIN, .shape = QUERN_ID, .target = -1 },
		[POSITION] = { .name = "grain.position",
			.set = GRAIN,
			.shape = QUERN_VECTOR,
			.target = -1,
			.twice = true },
		[FIRST] = { .name = "contact.first", .set = CONTACT, .shape = QUERN_INDEX, .target = GRAIN },
		[SECOND] = { .name = "contact.second", .set = CONTACT, .shape = QUERN_INDEX, .target = GRAIN },
		[PARTNER] = { .name = "grain.partner",
			.set = GRAIN,
			.shape = QUERN_INDEX,
			.target = CONTACT,
			.initial = QUERN_NO_TARGET },
		[SLIP] = { .name = "contact.slip", .set = CONTACT, .shape = QUERN_AXIAL, .target = -1 },
	};
	memcpy(s->fields, fields, sizeof fields);
	s->n_fields = FIELDS;
	for (int f = 0; f < FIELDS; f++)
		s->fields[f].n_components = (uint8_t)quern_shape_size(s->fields[f].shape, 2);
}

static void close_store(quern_store *s) {
	quern_pool *pool = s->pool;
	quern_store_finish(s);
	quern_pool_destroy(pool);
}

static quern_column column(const quern_store *s, int field) {
	return quern_field_column(s, &s->fields[field], s->fields[field].now);
}

/* A chain of grains with contacts between neighbours, two blocks of each. */
static void fill(quern_store *s, uint32_t n) {
	const uint32_t block[] = { 0, n / 2, n }, contacts[] = { 0, n / 2, n - 1 };
	assert_int_equal(quern_store_fill(s, GRAIN, n), QUERN_OK);
	assert_int_equal(quern_store_fill(s, CONTACT, n - 1), QUERN_OK);
	assert_int_equal(quern_store_rows(s, NODE, 64), QUERN_OK);
	assert_int_equal(quern_store_partition(s, GRAIN, 2, block), QUERN_OK);
	assert_int_equal(quern_store_partition(s, CONTACT, 2, contacts), QUERN_OK);
	for (uint32_t i = 0; i < n; i++) column(s, POSITION).real[0][i] = i;
	for (uint32_t i = 0; i + 1 < n; i++) {
		column(s, FIRST).index[i] = (int32_t)i;
		column(s, SECOND).index[i] = (int32_t)i + 1;
	}
}

static void check(const quern_store *s) {
	for (int f = 0; f < FIELDS; f++) {
		const quern_field *field = &s->fields[f];
		const quern_set_store *set = &s->sets[field->set];
		for (int copy = 0; copy <= field->twice; copy++)
			for (int k = 0; k < field->n_components; k++)
				if (set->n) assert_non_null(field->data[copy][k]);
		if (field->shape != QUERN_INDEX) continue;
		for (uint32_t i = 0; i < set->n; i++) {
			const int32_t index = column(s, f).index[i];
			assert_true(index == QUERN_NO_TARGET || (uint32_t)index < s->sets[field->target].n);
		}
	}
	for (int k = 0; k < SETS; k++) {
		assert_true(s->sets[k].n <= s->sets[k].cap);
		if (s->sets[k].n_blocks) assert_int_equal(s->sets[k].block[s->sets[k].n_blocks], s->sets[k].n);
	}
	double sum = 0; /* every entry can be read */
	for (uint32_t i = 0; i < s->sets[GRAIN].n; i++) sum += column(s, POSITION).real[0][i];
	assert_true(sum >= 0);
}

enum { N = 40, GROWN = 500 };

/* Grain 7 goes, and with it two contacts; or many come. */
static quern_status change(quern_store *s, bool grows) {
	static int32_t from[GROWN];
	static uint32_t block[GROWN + 1];
	const uint32_t n = grows ? GROWN : N - 1;
	for (uint32_t i = 0; i < n; i++) from[i] = grows ? (i < N ? (int32_t)i : -1) : (int32_t)(i + (i >= 7));
	for (uint32_t i = 0; i <= n; i++) block[i] = i;
	return quern_store_remap(s, GRAIN, n, from, n, block);
}

static void each_failure(bool grows) {
	for (long k = 0;; k++) {
		quern_store s;
		open_store(&s);
		fill(&s, N);
		left = k;
		const quern_status status = change(&s, grows);
		left = -1;
		assert_true(status == QUERN_OK || status == QUERN_E_MEMORY);
		check(&s);
		const bool done = status == QUERN_OK;
		if (!done && s.sets[GRAIN].n == N) { /* nothing was changed: with memory it goes on */
			assert_int_equal(change(&s, grows), QUERN_OK);
			check(&s);
		}
		close_store(&s);
		if (!done) continue;
		assert_true(k > 2);
		return;
	}
}

static void loses_a_grain(void **state) {
	(void)state;
	each_failure(false);
}

static void gains_grains(void **state) {
	(void)state;
	each_failure(true);
}

static void grows_rows(void **state) {
	(void)state;
	quern_store s;
	open_store(&s);
	fill(&s, N);
	left = 0;
	assert_int_equal(quern_store_rows(&s, NODE, 1 << 16), QUERN_E_MEMORY);
	left = -1;
	check(&s);
	assert_int_equal(s.sets[NODE].n, 64);
	for (int i = 0; i < 64 * 8; i++) assert_true(s.sets[NODE].row[i] == 0);
	close_store(&s);
}

/* Nothing at all has an address too: NULL says that memory is gone, and plugins end the run for it. */
static void memory_of_nothing(void **state) {
	(void)state;
	quern_run run = { .status = QUERN_OK };
	void *first = quern_host_table.memory(&run, 0), *second = quern_host_table.memory(&run, 0);
	assert_non_null(first);
	assert_non_null(second);
	assert_null(quern_host_table.memory(&run, SIZE_MAX - 8));
	left = 0;
	assert_null(quern_host_table.memory(&run, 1 << 20));
	left = -1;
	for (size_t i = 0; i < run.arena.n_extra; i++) free(run.arena.extra[i]);
	free(run.arena.extra);
}

/* How large a plugin's instance is, the plugin says: where there is no room for it, that is a fault with a place. */
static void no_room_for_a_plugin(void **state) {
	static const char text[] =
		"quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [1, 1]}\ntime: {end: "
		"1}\n"
		"bodies: [{plane: {point: [0, 0], normal: [0, 1], contact: {friction: 0}}}]\n"
		"grains: {material: {density: 2500, radius: {mean: 0.01}}, contact: {linear: {stiffness: 1e5}},\n"
		"  place: [{position: [0.5, 0.5]}]}\nobserve: [mass]\n";
	const char *folder = getenv("QUERN_PLUGINS_DIR");
	(void)state;
	if (folder) setenv("QUERN_PLUGIN_PATH", folder, 1);
	long k = 0;
	for (size_t errors = 1; errors; k++) {
		aligned_left = k;
		quern_scene *scene = quern_scene_parse("scene.yaml", text, sizeof text - 1, &quern_host_table);
		const bool all = aligned_left >= 0;
		aligned_left = -1;
		errors = quern_report_errors(scene->report);
		assert_true((errors > 0) == !all);
		quern_scene_destroy(scene);
	}
	assert_true(k > 6);
}

static quern_run *open_continuum(void) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.1, 0.06]},\n"
		"time: {end: 1, step: 1e-5}, bodies: [{plane: {point: [0, 5 mm], normal: [0, 1], boundary: sticky}}],\n"
		"continuum: {cell: 4 mm, material: {elastic: {bulk_modulus: 1e6, density: 1900}},\n"
		"  fill: {region: {box: {lower: [0, 6 mm], upper: [0.05, 0.04]}}}}}\n");
}

/* Beside a plane, so that the larger lists are those of what is near to it. */
static quern_run *open_grains(void) {
	return harness_open(1,
		"{quern: 1, dimension: 2, gravity: [0, -9.81], domain: {lower: [0, 0], upper: [0.1, 0.06]},\n"
		"time: {end: 1, step: 1e-5}, bodies: [{plane: {point: [0, 5 mm], normal: [0, 1], contact: {friction: 0}}}],\n"
		"grains: {material: {density: 2500, radius: {mean: 1 mm}}, contact: {linear: {stiffness: 1e5}},\n"
		"  place: [{position: [0.05, 0.006], velocity: [0, -0.1]}, {position: [0.0521, 0.006]}, {position: [0.02, 0.04]}]}}\n");
}

static double motion_of(quern_run *run, const char *velocity, const char *set) {
	double sum = 0;
	for (int k = 0; k < 2; k++)
		for (uint32_t i = 0; i < harness_count(run, set); i++)
			sum += (double)(i + 1) * harness_field(run, velocity).real[k][i];
	return sum;
}

/* How often a step said that memory ran out, of all the times that it was refused some; otherwise it has done all the same what it should. */
static long refuse_in_turn(quern_run *(*open)(void), const char *velocity, const char *set) {
	quern_run *run = open();
	harness_steps(run, 1);
	const double motion = motion_of(run, velocity, set);
	harness_close(run);
	long k = 0, told = 0;
	assert_true(motion != 0);
	for (bool all = false; !all; k++) {
		run = open();
		aligned_left = k;
		const quern_status status = harness_try(run, 1);
		all = aligned_left >= 0;
		aligned_left = -1;
		if (status == QUERN_OK) assert_true(motion_of(run, velocity, set) == motion);
		else assert_int_equal(status, QUERN_E_MEMORY);
		told += status != QUERN_OK;
		harness_close(run);
	}
	return told;
}

/* Workers' own memory as well. */
static void no_room_for_a_step(void **state) {
	(void)state;
	assert_true(refuse_in_turn(open_continuum, "point.velocity", "point") > 3);
	assert_true(refuse_in_turn(open_grains, "grain.velocity", "grain") > 3);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(loses_a_grain), cmocka_unit_test(gains_grains),
		cmocka_unit_test(grows_rows), cmocka_unit_test(memory_of_nothing),
		cmocka_unit_test(no_room_for_a_plugin), cmocka_unit_test(no_room_for_a_step) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
