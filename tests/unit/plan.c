/* SPDX-License-Identifier: MIT */
/* The plan: from uses to order, fields and state; what the uses do not decide is refused by name. The solvers here are
 * tables and nothing else. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <plan.h>
#include <stdlib.h>
#include <string.h>

#define U(field_, access_, ...)                                                                              \
	{ .field = field_, .unit = "m", .shape = QUERN_SCALAR, .access = access_, .doc = "x", __VA_ARGS__ }

typedef struct {
	quern_real friction;
} knob;
static const quern_param params[] = { QUERN_PARAM(knob, friction, "1", "Friction."), QUERN_END_PARAMS };
static const quern_set sets[] = { { .name = "grain", .doc = "x" }, { .name = NULL } };

static quern_status run(const void *self, const quern_step *s) { return (void)self, (void)s, QUERN_OK; }

typedef struct {
	quern_scene scene;
	quern_plugin_file file;
	quern_instance instance;
	quern_solver_ops ops[3];
	knob knob;
	quern_pool *pool;
	quern_plan *plan;
	char *said;
} bench;

/* Sections with these stages and sets; what was reported is in b->said. */
static bench *make_with(
	size_t n, const quern_stage *const *stages, const quern_set *const *sets_of, double friction) {
	static const char *const names[] = { "one", "two", "three" };
	bench *b = calloc(1, sizeof *b);
	size_t size = 0;
	assert_non_null(b);
	b->scene.report = quern_report_create();
	b->scene.units = quern_units_create();
	b->scene.general.dimension = 2;
	b->knob.friction = friction;
	b->file = (quern_plugin_file) {
		.plugin = { .id = "solver.test" }, .params = (quern_param *)(uintptr_t)params, .n_params = 1
	};
	b->instance = (quern_instance) { .file = &b->file, .self = &b->knob };
	for (size_t i = 0; i < n; i++) {
		b->ops[i] = (quern_solver_ops) { .size = sizeof *b->ops, .sets = sets_of[i], .stages = stages[i] };
		b->scene.sections[i] =
			(quern_section) { .name = names[i], .solver = &b->instance, .ops = &b->ops[i] };
	}
	b->scene.n_sections = n;
	b->pool = quern_pool_create(1);
	b->plan = quern_plan_create(&b->scene, b->pool);
	FILE *out = open_memstream(&b->said, &size);
	assert_non_null(out);
	quern_report_print(b->scene.report, out);
	fclose(out);
	return b;
}

/* The first one owns the set. */
static bench *make(size_t n, const quern_stage *const *stages, double friction) {
	return make_with(n, stages, (const quern_set *const[]) { sets, NULL, NULL }, friction);
}

static void finish(bench *b) {
	quern_plan_destroy(b->plan);
	quern_pool_destroy(b->pool);
	quern_units_destroy(b->scene.units);
	quern_report_destroy(b->scene.report);
	free(b->said);
	free(b);
}

static const quern_field *field(const bench *b, const char *name) {
	const int i = quern_store_field(&b->plan->store, name);
	return i < 0 ? NULL : &b->plan->store.fields[i];
}

static int place(const bench *b, const char *stage) {
	for (size_t i = 0; i < b->plan->n_stages; i++)
		if (!strcmp(b->plan->stages[i].name, stage)) return b->plan->stages[i].order;
	fail_msg("no stage %s", stage);
	return -1;
}

static const quern_use writes[] = { U("grain.a", QUERN_WRITE, .flags = 0), QUERN_END_USES };
static const quern_use reads[] = { U("grain.a", QUERN_READ, .flags = 0), QUERN_END_USES };
static const quern_use reads_before[] = { U("grain.a", QUERN_READ, .flags = QUERN_BEFORE), QUERN_END_USES };
static const quern_use updates[] = { U("grain.a", QUERN_UPDATE, .flags = 0), QUERN_END_USES };
static const quern_use adds[] = { U("grain.a", QUERN_ADD, .flags = 0), QUERN_END_USES };

#define STAGES(name_, phase_, uses_)                                                                         \
	(const quern_stage[]) {                                                                                  \
		{ .name = name_, .doc = "x", .phase = phase_, .uses = uses_, .run = run }, { .name = NULL }          \
	}

static void order(void **state) {
	const quern_stage *const stages[] = { STAGES("late.read", QUERN_EXCHANGE, reads),
		STAGES("mid.update", QUERN_EXCHANGE, updates), STAGES("early.write", QUERN_EXCHANGE, writes) };
	bench *b = make(3, stages, 0);
	(void)state;
	assert_string_equal(b->said, "");
	assert_true(place(b, "early.write") < place(b, "mid.update"));
	assert_true(place(b, "mid.update") < place(b, "late.read"));
	assert_false(field(b, "grain.a")->state); /* written anew every step */
	finish(b);
}

static void phases(void **state) {
	const quern_stage *const stages[] = { STAGES("last", QUERN_ADVANCE, reads),
		STAGES("first", QUERN_BEGIN, writes) };
	bench *b = make(2, stages, 0);
	(void)state;
	assert_true(place(b, "first") < place(b, "last"));
	finish(b);
}

static void before_changes(void **state) {
	const quern_stage *const stages[] = { STAGES("changes", QUERN_EXCHANGE, updates),
		STAGES("wants.old", QUERN_EXCHANGE, reads_before), STAGES("sets.up", QUERN_SETUP, writes) };
	bench *b = make(3, stages, 0);
	(void)state;
	assert_string_equal(b->said, "");
	assert_true(place(b, "wants.old") < place(b, "changes"));
	assert_true(field(b, "grain.a")->state);
	finish(b);
}

static void refused(const quern_stage *const *stages, size_t n, const char *wanted) {
	bench *b = make(n, stages, 0);
	if (!strstr(b->said, wanted)) fail_msg("'%s' is not in '%s'", wanted, b->said);
	finish(b);
}

static void conflicts(void **state) {
	static const quern_use a_then_b[] = { U("grain.a", QUERN_READ, .flags = 0),
		U("grain.b", QUERN_WRITE, .flags = 0), QUERN_END_USES };
	static const quern_use b_then_a[] = { U("grain.b", QUERN_READ, .flags = 0),
		U("grain.a", QUERN_WRITE, .flags = 0), QUERN_END_USES };
	static const quern_use seconds[] = {
		{ .field = "grain.a", .unit = "s", .doc = "x", .access = QUERN_READ, .shape = QUERN_SCALAR },
		QUERN_END_USES
	};
	static const quern_use vectors[] = {
		{ .field = "grain.a", .unit = "m", .doc = "x", .access = QUERN_READ, .shape = QUERN_VECTOR },
		QUERN_END_USES
	};
	static const quern_use sums[] = { U("grain.a", QUERN_UPDATE, .rule = QUERN_SUMS), QUERN_END_USES };
	static const quern_use means[] = { U("grain.a", QUERN_ADD, .rule = QUERN_MEANS), QUERN_END_USES };
	static const quern_use nowhere[] = { U("rock.a", QUERN_READ, .flags = 0), QUERN_END_USES };
	const quern_stage *w = STAGES("one.write", QUERN_EXCHANGE, writes);
	(void)state;
	refused((const quern_stage *[]) { STAGES("one.update", QUERN_EXCHANGE, updates),
				STAGES("two.update", QUERN_EXCHANGE, updates) },
		2, "grain.a: one.update and two.update both change it and nothing says which comes first");
	refused((const quern_stage *[]) { w, STAGES("two.write", QUERN_EXCHANGE, writes) }, 2,
		"grain.a: two.write overwrites what one.write wrote and nobody read");
	refused((const quern_stage *[]) { STAGES("one.ab", QUERN_EXCHANGE, a_then_b),
				STAGES("two.ba", QUERN_EXCHANGE, b_then_a) },
		2, "one.ab and two.ba each need the other to come first among the stages 'exchange'");
	refused((const quern_stage *[]) { STAGES("one.read", QUERN_EXCHANGE, reads) }, 1,
		"one.read needs grain.a, and nothing in this scene makes it");
	refused((const quern_stage *[]) { STAGES("one.lost", QUERN_EXCHANGE, nowhere) }, 1,
		"one.lost needs rock.a, and nothing in the scene has a set of that name");
	refused((const quern_stage *[]) { w, STAGES("two.seconds", QUERN_EXCHANGE, seconds) }, 2,
		"grain.a: two.seconds takes it in s, others in m");
	refused((const quern_stage *[]) { w, STAGES("two.vector", QUERN_EXCHANGE, vectors) }, 2,
		"grain.a: two.vector takes it for a vector, one.write for a scalar");
	refused((const quern_stage *[]) { w, STAGES("two.sums", QUERN_EXCHANGE, sums),
				STAGES("three.means", QUERN_EXCHANGE, means) },
		3,
		"grain.a: by the rule of three.means it is 'means' where entries are parted or joined, by that of "
		"others 'sums'");
}

/* A row that hangs on a parameter or is optional makes nothing by itself. */
static void existence(void **state) {
	static const quern_use rows[] = { U("grain.slip", QUERN_UPDATE, .when = "friction"),
		U("grain.extra", QUERN_WRITE, .flags = QUERN_OPTIONAL),
		U("grain.pair", QUERN_UPDATE, .with = "grain.slip"), QUERN_END_USES };
	(void)state;
	for (int friction = 0; friction < 2; friction++) {
		const quern_stage *const stages[] = { STAGES("one.step", QUERN_SUBSTEP, rows) };
		bench *b = make(1, stages, friction);
		assert_true((field(b, "grain.slip") != NULL) == friction);
		assert_true((field(b, "grain.pair") != NULL) == friction);
		assert_null(field(b, "grain.extra"));
		finish(b);
	}
}

static void kept_twice(void **state) {
	static const quern_use rows[] = { U("grain.a", QUERN_READ, .flags = QUERN_OTHERS),
		U("grain.a", QUERN_UPDATE, .flags = 0), QUERN_END_USES };
	const quern_stage *const stages[] = { STAGES("one.step", QUERN_SUBSTEP, rows),
		STAGES("set.up", QUERN_SETUP, writes) };
	bench *b = make(2, stages, 0);
	(void)state;
	assert_true(field(b, "grain.a")->twice);
	assert_int_equal(b->plan->stages[0].swaps[0], quern_store_field(&b->plan->store, "grain.a"));
	assert_int_equal(quern_plan_entry_bytes(b->plan, quern_store_set(&b->plan->store, "grain")), 16);
	finish(b);
}

/* After each swap every column, the writer's as well, is what a plan that is made fresh from nothing has. */
static void columns_follow_a_swap(void **state) {
	static const quern_use rows[] = { U("grain.a", QUERN_READ, .flags = QUERN_OTHERS),
		U("grain.a", QUERN_UPDATE, .flags = 0), QUERN_END_USES };
	const quern_stage *const stages[] = { STAGES("one.step", QUERN_SUBSTEP, rows),
		STAGES("set.up", QUERN_SETUP, writes), STAGES("two.read", QUERN_EXCHANGE, reads) };
	bench *b = make(3, stages, 0);
	quern_plan *p = b->plan;
	(void)state;
	assert_int_equal(quern_store_fill(&p->store, quern_store_set(&p->store, "grain"), 5), QUERN_OK);
	quern_plan_refresh(p);
	for (int turn = 0; turn < 3; turn++) {
		quern_plan_swap(p, p->stages[0].swaps);
		const quern_column then[] = { p->stages[0].column[0], p->stages[0].column[1],
			p->stages[2].column[0] };
		const quern_field *a = field(b, "grain.a");
		assert_ptr_equal(then[0].real[0], a->data[a->now][0]);
		assert_ptr_equal(then[1].real[0], a->data[!a->now][0]);
		p->fresh = UINT64_MAX;
		quern_plan_refresh(p);
		assert_ptr_equal(p->stages[0].column[0].real[0], then[0].real[0]);
		assert_ptr_equal(p->stages[0].column[1].real[0], then[1].real[0]);
		assert_ptr_equal(p->stages[2].column[0].real[0], then[2].real[0]);
	}
	finish(b);
}

static void zeroed(void **state) {
	const quern_stage *const stages[] = { STAGES("one.add", QUERN_DEPOSIT, adds),
		STAGES("two.add", QUERN_DEPOSIT, adds), STAGES("three.read", QUERN_EXCHANGE, reads) };
	bench *b = make(3, stages, 0);
	int zeros = 0;
	(void)state;
	assert_string_equal(b->said, "");
	for (size_t i = 0; i < b->plan->n_stages; i++)
		for (const int *k = b->plan->stages[i].zeros; *k >= 0; k++) zeros++;
	assert_int_equal(zeros, 1); /* before the first addition, and there alone */
	finish(b);
}

/* Lanes of a node's row are the owner's to order, though a section before it names its fields first, backwards. */
static void lanes_are_the_owners(void **state) {
	static const quern_use backwards[] = { U("node.extra", QUERN_WRITE, .flags = 0),
		U("node.force", QUERN_READ, .flags = 0), U("node.mass", QUERN_READ, .flags = 0), QUERN_END_USES };
	static const quern_use owners[] = { U("node.mass", QUERN_ADD, .flags = 0),
		U("node.force", QUERN_ADD, .flags = 0), QUERN_END_USES };
	static const quern_set rows[] = { { .name = "node", .doc = "x", .rows = 8 }, { .name = NULL } };
	const quern_stage *const stages[] = { STAGES("other.look", QUERN_ADVANCE, backwards),
		STAGES("owner.add", QUERN_DEPOSIT, owners) };
	const quern_set *const of[] = { NULL, rows };
	bench *b = make_with(2, stages, of, 0);
	(void)state;
	assert_string_equal(b->said, "");
	assert_int_equal(field(b, "node.mass")->lane, 0);
	assert_int_equal(field(b, "node.force")->lane, 1);
	assert_int_equal(field(b, "node.extra")->lane, 2);
	finish(b);
}

int main(void) {
	const struct CMUnitTest tests[] = { cmocka_unit_test(order), cmocka_unit_test(lanes_are_the_owners),
		cmocka_unit_test(phases), cmocka_unit_test(before_changes), cmocka_unit_test(conflicts),
		cmocka_unit_test(existence), cmocka_unit_test(kept_twice), cmocka_unit_test(columns_follow_a_swap),
		cmocka_unit_test(zeroed) };
	return cmocka_run_group_tests(tests, NULL, NULL);
}
