/* check_solver - a solver's sets, slots and stages: names that exist, units that parse, defaults that can be read */
#include "check.h"
#include "check_table.h"
#include "text.h"
#include <string.h>

static const quern_solver_ops *ops_of(const check *c) { return c->file->plugin.ops; }

static bool has_stage(const check *c, const char *name) {
	for (const quern_stage *s = ops_of(c)->stages; s && s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

static bool has_slot(const check *c, const char *name) {
	for (const quern_slot *s = ops_of(c)->slots; s && s->name; s++)
		if (!strcmp(s->name, name)) return true;
	return false;
}

static void check_sets(const check *c, check_tally *t) {
	const quern_set *sets = ops_of(c)->sets;
	for (const quern_set *s = sets; s && s->name; s++) {
		check_expect(
			t, quern_is_name(s->name) && strlen(s->name) < 24, "set '%s': a short name is wanted", s->name);
		check_expect(t, s->doc && *s->doc, "set %s: no doc", s->name);
		check_expect(t, s->rows == 0 || s->rows == 8, "set %s: rows is %u, must be 0 or 8", s->name, s->rows);
		check_expect(t, !s->slot || has_slot(c, s->slot), "set %s hangs on a slot '%s' that does not exist",
			s->name, s->slot);
		check_expect(t, strcmp(s->name, "total") != 0 && strcmp(s->name, "cell") != 0,
			"set %s belongs to the host", s->name);
		for (const quern_set *other = sets; other != s; other++)
			check_expect(t, strcmp(other->name, s->name) != 0, "set %s stands twice", s->name);
	}
}

static void check_slot_default(const quern_slot *s, check_tally *t) {
	quern_report *report = quern_report_create();
	quern_tree *tree = quern_tree_parse("default", s->def, strlen(s->def), report);
	const quern_node *root = tree->root;
	check_expect(t,
		root && (root->kind == QUERN_NODE_SCALAR || root->kind == QUERN_NODE_LIST || root->n == 1),
		"slot %s: the default '%s' is no plugin", s->name, s->def);
	quern_tree_destroy(tree);
	quern_report_destroy(report);
}

static void check_slots(const check *c, check_tally *t) {
	const quern_slot *slots = ops_of(c)->slots;
	for (const quern_slot *s = slots; s && s->name; s++) {
		const size_t n = strcspn(s->name, ".");
		char list[64];
		snprintf(list, sizeof list, "%.*s", (int)n, s->name);
		check_expect(t, quern_kind_name(s->kind) && s->kind != QUERN_SOLVER, "slot %s: kind %u is unknown",
			s->name, s->kind);
		check_expect(t, s->same_as || (s->doc && *s->doc), "slot %s: no doc", s->name);
		for (int h = 0; h < 3; h++)
			check_expect(t, !s->stage[h] || has_stage(c, s->stage[h]), "slot %s: there is no stage '%s'",
				s->name, s->stage[h]);
		check_expect(t, s->stage[0] || s->stage[1] || s->stage[2], "slot %s: no stage calls it", s->name);
		if (s->name[n])
			check_expect(t, quern_param_find(c->file->params, list) && !quern_kind_of(list),
				"slot %s: there is no list '%s' among the parameters", s->name, list);
		if (s->def) check_slot_default(s, t);
		check_expect(t, !s->rows == !s->item_size, "slot %s: rows and item_size go together", s->name);
		if (s->rows) check_parameter_rows(c, t, s->rows, s->item_size, 0);
		for (const quern_slot *other = slots; other != s; other++)
			check_expect(t, strcmp(other->name, s->name) != 0, "slot %s stands twice", s->name);
	}
}

static void check_stages(const check *c, check_tally *t) {
	const quern_stage *stages = ops_of(c)->stages;
	uint32_t last = 0;
	check_expect(t, stages && stages->name, "there are no stages");
	for (const quern_stage *s = stages; s && s->name; s++) {
		check_expect(t, strchr(s->name, '.') != NULL, "stage '%s': call it SOLVER.NAME", s->name);
		check_expect(t, s->doc && *s->doc, "stage %s: no doc", s->name);
		check_expect(t, s->phase < QUERN_PHASES, "stage %s: phase %u is unknown", s->name, s->phase);
		check_expect(
			t, s->phase >= last, "stage %s: its phase comes before that of the stage above", s->name);
		check_expect(t, s->run && s->uses, "stage %s: no run or no uses", s->name);
		last = s->phase;
		if (s->uses) check_use_rows(c, t, s->uses, c->file->params);
		for (const quern_stage *other = stages; other != s; other++)
			check_expect(t, strcmp(other->name, s->name) != 0, "stage %s stands twice", s->name);
	}
}

void check_solver(const check *c) {
	check_tally sets = { .name = "sets" }, slots = { .name = "slots" }, stages = { .name = "stages" };
	check_place(c, "its tables");
	check_sets(c, &sets);
	check_slots(c, &slots);
	check_stages(c, &stages);
	check_tell(c, &sets, NULL);
	check_tell(c, &slots, NULL);
	check_tell(c, &stages, "%u cases; stages run in scenes, not here", stages.tried);
}
