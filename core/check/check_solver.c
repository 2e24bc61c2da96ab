/* SPDX-License-Identifier: MIT */
/* quern_check_solver - a solver's sets, slots and stages: names that exist, units that parse, defaults that can be
 * read */
#include "check.h"
#include "check_table.h"
#include "text.h"
#include <string.h>

static const quern_solver_ops *ops_of(const check *c) { return c->file->plugin.ops; }

static void check_sets(const check *c, quern_check_tally *t) {
	const quern_set *sets = ops_of(c)->sets;
	for (const quern_set *s = sets; s && s->name; s++) {
		quern_check_expect(t, s->doc && *s->doc, "set %s: no doc", s->name);
		quern_check_expect(t, strcmp(s->name, "total") != 0 && strcmp(s->name, "cell") != 0,
			"set %s belongs to the host", s->name);
		for (const quern_set *other = sets; other != s; other++)
			quern_check_expect(t, strcmp(other->name, s->name) != 0, "set %s stands twice", s->name);
	}
}

static void check_slot_default(const quern_slot *s, quern_check_tally *t) {
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("default", s->def, strlen(s->def), report);
	const quern_node *root = tree->root;
	quern_check_expect(t,
		root && (root->kind == QUERN_NODE_SCALAR || root->kind == QUERN_NODE_LIST || root->n == 1),
		"slot %s: the default '%s' is no plugin", s->name, s->def);
	quern_tree_destroy(tree);
	quern_report_destroy(report);
}

static void check_slots(const check *c, quern_check_tally *t) {
	const quern_slot *slots = ops_of(c)->slots;
	for (const quern_slot *s = slots; s && s->name; s++) {
		quern_check_expect(t, s->same_as || (s->doc && *s->doc), "slot %s: no doc", s->name);
		quern_check_expect(
			t, s->stage[0] || s->stage[1] || s->stage[2], "slot %s: no stage calls it", s->name);
		if (s->def) check_slot_default(s, t);
		quern_check_parameter_rows(c, t, s->rows);
		for (const quern_slot *other = slots; other != s; other++)
			quern_check_expect(t, strcmp(other->name, s->name) != 0, "slot %s stands twice", s->name);
	}
}

static void check_stages(const check *c, quern_check_tally *t) {
	const quern_stage *stages = ops_of(c)->stages;
	uint32_t last = 0;
	for (const quern_stage *s = stages; s && s->name; s++) {
		quern_check_expect(t, strchr(s->name, '.') != NULL, "stage '%s': call it SOLVER.NAME", s->name);
		quern_check_expect(t, s->doc && *s->doc, "stage %s: no doc", s->name);
		quern_check_expect(
			t, s->phase >= last, "stage %s: its phase comes before that of the stage above", s->name);
		last = s->phase;
		quern_check_use_rows(c, t, s->uses);
		for (const quern_stage *other = stages; other != s; other++)
			quern_check_expect(t, strcmp(other->name, s->name) != 0, "stage %s stands twice", s->name);
	}
}

void quern_check_solver(const check *c) {
	quern_check_tally sets = { .name = "sets" }, slots = { .name = "slots" }, stages = { .name = "stages" };
	quern_check_place(&c->open, "its tables");
	check_sets(c, &sets);
	check_slots(c, &slots);
	check_stages(c, &stages);
	quern_check_tell(&c->open, &sets, NULL);
	quern_check_tell(&c->open, &slots, NULL);
	quern_check_tell(&c->open, &stages, NULL);
}
