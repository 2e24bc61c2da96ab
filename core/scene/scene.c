/* SPDX-License-Identifier: MIT */
#include "scene.h"
#include "episodes.h"
#include "section.h"
#include "sections.h"
#include "text.h"
#include "watch.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const instructions[] = { "auto", "v1", "v3", "v4", NULL };

#define ROW(m, name_, unit_, ...) QUERN_PARAM_AS(quern_general, m, name_, unit_, __VA_ARGS__)
const quern_param quern_general_rows[] = { ROW(version, "quern", "1", "Version of the scene format: 1.",
											   .flags = QUERN_REQUIRED | QUERN_ONCE, .min = 1, .max = 1e9),
	ROW(name, "name", NULL, "A title for people.", .text = "scene", .flags = QUERN_ONCE),
	ROW(model, "model", NULL,
		"Which representation to keep: all sections, or the name of one, which then runs with those that it "
		"needs.",
		.text = "all", .flags = QUERN_ONCE),
	ROW(dimension, "dimension", "1", "2 (a slab one metre thick) or 3.", .flags = QUERN_REQUIRED | QUERN_ONCE,
		.min = 2, .max = 3),
	ROW(seed, "seed", "1", "Seed of all random numbers.", .def = 1, .max = 2147483647, .flags = QUERN_ONCE),
	ROW(gravity, "gravity", "m/s^2", "Acceleration of gravity.", .flags = QUERN_REQUIRED, .min = -1e6,
		.max = 1e6),
	ROW(lower, "domain.lower", "m", "Lower corner of the domain.", .flags = QUERN_REQUIRED | QUERN_ONCE,
		.min = -1e9, .max = 1e9),
	ROW(upper, "domain.upper", "m", "Upper corner of the domain.", .flags = QUERN_REQUIRED | QUERN_ONCE,
		.min = -1e9, .max = 1e9),
	ROW(end, "time.end", "s", "When the run ends.", .flags = QUERN_REQUIRED | QUERN_ONCE, .max = 1e12),
	ROW(step_text, "time.step", "s",
		"The long step, or auto. Taken a little shorter, so that a whole number of equal steps leads to the "
		"next frame.",
		.text = "auto", .flags = QUERN_ONCE),
	ROW(force, "time.force", NULL, "Take the given step although it is beyond a limit.", .flags = QUERN_ONCE),
	ROW(every, "output.every", "s",
		"Time between frames and between rows of series.csv; default: end/50. It is divided into equal "
		"steps, so another value changes the step a little, and with it the numbers.",
		.flags = QUERN_MAYBE | QUERN_MIN_OPEN | QUERN_ONCE, .max = 1e12),
	ROW(compress, "output.compress", NULL, "Deflate the frames.", .def = 1, .flags = QUERN_ONCE),
	ROW(checkpoint, "checkpoint.every", "s",
		"Time on the clock from one checkpoint to the next; 0: only at the release and at the end.",
		.def = 300, .max = 1e9, .flags = QUERN_ONCE),
	ROW(batch, "run.batch", "1", "Most entities in a batch; results do not depend on it.", .def = 256,
		.min = 8, .max = 512, .flags = QUERN_ADVANCED | QUERN_ONCE),
	ROW(instructions, "run.instructions", "1",
		"Highest instruction set to use, x86-64-v1 to v4; results do not depend on it.",
		.choices = instructions, .flags = QUERN_ADVANCED | QUERN_ONCE),
	QUERN_END_PARAMS };

const quern_general_list quern_general_lists[] = {
	{ "domain.periodic", "true or false",
		"Directions in which the domain repeats itself, one per dimension; default: none." },
	{ "domain.open", "lower_x, upper_x, lower_y, upper_y, lower_z or upper_z",
		"Faces of the domain that let material out and book it (docs/theory/flow.md); default: none." },
	{ "output.fields", "text",
		"Fields to write out beside those that frames always have: SET.NAME, as `quern plan` lists them." },
	{ "stages", "{for: TIME, set: {path.to.key: value}}",
		"Intervals of time, one after the other, in which keys have other values than the scene gives them; "
		"the last one needs no `for`. Settling comes before them all." },
	{ NULL, NULL, NULL }
};

quern_reading quern_scene_reading(const quern_scene *s) {
	return (quern_reading) { s->report, s->units, (uint32_t)s->general.dimension, s->published,
		s->n_published, s->tree };
}

/* ---- services of the set-up phase ---- */

quern_status quern_scene_fail(quern_err *err, quern_status status, const char *param, const char *fmt, ...) {
	quern_text text = { 0 };
	va_list list;
	va_start(list, fmt);
	quern_text_addv(&text, fmt, list);
	va_end(list);
	quern_report_add(err->report, quern_param_mark(err->map, param, err->mark), "%s: %s%s%s", err->owner,
		param ? param : "", param ? ": " : "", quern_text_string(&text));
	quern_text_finish(&text);
	return status;
}

void quern_scene_publish(const quern_setup *setup, const char *name, const char *unit, quern_real value) {
	quern_scene *s = setup->scene;
	for (size_t i = 0; i < s->n_published; i++)
		if (!strcmp(s->published[i].name, name))
			return; /* the first to know is right: in the order of reading */
	s->published = quern_grow(s->published, s->n_published, &s->published_capacity, sizeof(quern_published));
	s->published[s->n_published++] = (quern_published) { quern_tree_keep(s->tree, name), unit, value };
}

bool quern_scene_keeps(const quern_setup *setup, const char *section) {
	const quern_scene *s = setup->scene;
	for (size_t i = 0; i < s->n_kept; i++)
		if (!strcmp(s->kept[i], section)) return true;
	return false;
}

quern_setup quern_scene_setup(const quern_scene *s, const char *path) {
	quern_setup setup = { .dim = (uint32_t)s->general.dimension,
		.lanes = QUERN_LANES,
		.host = s->host,
		.scene = (void *)(uintptr_t)s,
		.later = s->later };
	setup.stream =
		quern_hash(path, strlen(path)) ^ ((uint64_t)(uint32_t)s->general.seed * 0x9e3779b97f4a7c15u);
	memcpy(setup.gravity, s->general.gravity, sizeof setup.gravity);
	memcpy(setup.lower, s->general.lower, sizeof setup.lower);
	memcpy(setup.upper, s->general.upper, sizeof setup.upper);
	memcpy(setup.periodic, s->general.periodic, sizeof setup.periodic);
	memcpy(setup.open, s->general.open, sizeof setup.open);
	return setup;
}

/* ---- the core's own keys ---- */

static double gravity_of(const quern_general *g) {
	double sum = 0;
	for (int k = 0; k < g->dimension; k++) sum += g->gravity[k] * g->gravity[k];
	return sqrt(sum);
}

static void publish_scene(quern_scene *s) {
	const quern_setup setup = quern_scene_setup(s, "scene");
	const quern_general *g = &s->general;
	const double gravity = gravity_of(g);
	double size = 0;
	for (int k = 0; k < g->dimension; k++) { /* the extent along gravity; without gravity, the largest */
		const double extent = g->upper[k] - g->lower[k];
		const double share = gravity > 0 ? fabs(g->gravity[k]) / gravity * extent : 0;
		if (gravity > 0 ? share > size : extent > size) size = gravity > 0 ? share : extent;
	}
	quern_scene_publish(&setup, "scene.gravity", "m/s^2", gravity);
	quern_scene_publish(&setup, "scene.height", "m", size);
	quern_scene_publish(&setup, "scene.speed", "m/s", sqrt(2 * gravity * size));
	if (g->step > 0) quern_scene_publish(&setup, "scene.step", "s", g->step);
}

static void read_periodic(quern_scene *s, const quern_node *domain) {
	const quern_node *node = quern_node_find(domain, "periodic");
	char say[64];
	if (!node) return;
	if (node->kind != QUERN_NODE_LIST || node->n != (size_t)s->general.dimension) {
		quern_report_add(s->report, node->mark,
			"scene: domain.periodic must be a list of %d of true or false, one per dimension, not %s",
			s->general.dimension, quern_node_say(node, say));
		return;
	}
	for (size_t k = 0; k < node->n; k++) {
		const quern_node *value = node->entries[k].value;
		if (!quern_node_bool(value, &s->general.periodic[k]))
			quern_report_add(s->report, value->mark, "scene: domain.periodic is %s, must be true or false",
				quern_node_say(value, say));
	}
}

/* ---- faces ---- */

static const char *const face_names[] = { "lower_x", "upper_x", "lower_y", "upper_y", "lower_z", "upper_z",
	NULL };

const char *quern_face_name(int side, int axis) { return face_names[2 * axis + side]; }

/* Which face a text names; as many as there are if none. */
static int face_named(const quern_node *node, int n) {
	int face = 0;
	while (node->kind == QUERN_NODE_SCALAR && face < n && strcmp(node->text, face_names[face]) != 0) face++;
	return node->kind == QUERN_NODE_SCALAR ? face : n;
}

static void miss_face(quern_scene *s, const quern_node *node, int n) {
	const char *known[7] = { NULL }, *near = NULL;
	char say[64];
	memcpy(known, face_names, (size_t)n * sizeof *known);
	if (node->kind == QUERN_NODE_SCALAR) near = quern_nearest(node->text, known);
	quern_report_add(s->report, node->mark,
		"scene: domain.open: %s is no face of a domain in %d-D, must be lower_x, upper_x%s%s%s%s",
		quern_node_say(node, say), s->general.dimension,
		n == 6 ? ", lower_y, upper_y, lower_z or upper_z" : ", lower_y or upper_y",
		near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

static void open_face(quern_scene *s, const quern_node *node) {
	const int n = 2 * s->general.dimension, face = face_named(node, n);
	if (face == n) {
		miss_face(s, node, n);
		return;
	}
	bool *open = &s->general.open[face % 2][face / 2];
	if (s->general.periodic[face / 2])
		quern_report_add(s->report, node->mark,
			"scene: domain.open: %s cannot be open, since the domain is periodic along axis %d",
			face_names[face], face / 2);
	else if (*open)
		quern_report_add(
			s->report, node->mark, "scene: domain.open: %s stands there twice", face_names[face]);
	*open = true;
}

static void read_open(quern_scene *s, const quern_node *domain) {
	const quern_node *node = quern_node_find(domain, "open");
	char say[64];
	if (!node) return;
	if (node->kind != QUERN_NODE_LIST) {
		quern_report_add(s->report, node->mark,
			"scene: domain.open must be a list of faces, such as [lower_y, upper_x], not %s",
			quern_node_say(node, say));
		return;
	}
	for (size_t k = 0; k < node->n; k++) open_face(s, node->entries[k].value);
}

static void read_fields(quern_scene *s, const quern_node *output) {
	const quern_node *node = quern_node_find(output, "fields");
	char say[64];
	if (!node) return;
	if (node->kind != QUERN_NODE_LIST) {
		quern_report_add(s->report, node->mark, "scene: output.fields must be a list of field names, not %s",
			quern_node_say(node, say));
		return;
	}
	s->fields = quern_take(node->n, sizeof(char *));
	s->field_marks = quern_take(node->n, sizeof(quern_mark));
	for (size_t k = 0; k < node->n; k++) {
		const quern_node *value = node->entries[k].value;
		if (value->kind != QUERN_NODE_SCALAR || !strchr(value->text, '.')) {
			quern_report_add(s->report, value->mark,
				"scene: output.fields: %s is no field: SET.NAME, as quern plan lists them",
				quern_node_say(value, say));
			continue;
		}
		s->fields[s->n_fields] = quern_copy(value->text);
		s->field_marks[s->n_fields++] = value->mark;
	}
}

static void read_step(quern_scene *s, const quern_node *root) {
	char why[160];
	quern_general *g = &s->general;
	const quern_mark mark = quern_param_mark(root, "time.step", root->mark);
	if (!g->step_text || !strcmp(g->step_text, "auto")) return;
	if (!quern_quantity_read(s->units, g->step_text, "s", &g->step, why))
		quern_report_add(s->report, mark, "scene: time.step: %s; it must be a time or auto", why);
	else if (!(g->step > 0))
		quern_report_add(s->report, mark, "scene: time.step is %s, must be above 0 s, or auto", g->step_text);
}

/* Frames are numbered in six digits and more, and their times are whole multiples. */
static void check_frames(quern_scene *s, const quern_node *root) {
	const quern_general *g = &s->general;
	if (g->every > 0 && g->end / g->every > 1e9)
		quern_report_add(s->report, quern_param_mark(root, "output.every", root->mark),
			"scene: output.every: %.3g frames until time.end, more than 1e9", g->end / g->every);
}

static void check_domain(quern_scene *s, const quern_node *root, bool sound) {
	quern_general *g = &s->general;
	for (int k = 0; k < g->dimension; k++)
		if (!isfinite(g->gravity[k]) || !isfinite(g->lower[k]) || !isfinite(g->upper[k])) return;
	for (int k = 0; k < g->dimension; k++)
		if (!(g->upper[k] > g->lower[k])) {
			quern_report_add(s->report, quern_param_mark(root, "domain.upper", root->mark),
				"scene: domain.upper must be above domain.lower in every direction; axis %d is empty", k);
			return;
		}
	s->sound = sound;
	for (int k = 0; k < g->dimension; k++)
		if (g->periodic[k] && g->gravity[k] != 0 && fabs(g->gravity[k]) > 0.999 * gravity_of(g))
			quern_report_warn(s->report, quern_param_mark(root, "gravity", root->mark),
				"gravity acts along the periodic axis %d alone: what falls there never lands", k);
}

static void read_general(quern_scene *s, quern_node *root, const char *const *also) {
	quern_reading r = quern_scene_reading(s);
	char why[160];
	double dimension = 0;
	const quern_node *node = quern_node_find(root, "dimension");
	if (node && node->kind == QUERN_NODE_SCALAR)
		quern_quantity_read(s->units, node->text, "1", &dimension, why);
	r.dim = dimension == 3 ? 3 : 2;
	s->general.dimension = (int32_t)r.dim;
	quern_params_read(&r, "scene", quern_general_rows, root, root->mark, also, &s->general);
	s->general.dimension = (int32_t)r.dim;
	if (s->general.version > 1)
		quern_report_add(s->report, quern_param_mark(root, "quern", root->mark),
			"scene: quern is %d, must be 1: a newer program is needed", s->general.version);
	s->general.every_given = !isnan(s->general.every);
	if (!s->general.every_given) s->general.every = s->general.end > 0 ? s->general.end / 50 : 1;
	read_periodic(s, quern_node_find(root, "domain"));
	read_open(s, quern_node_find(root, "domain"));
	read_fields(s, quern_node_find(root, "output"));
	read_step(s, root);
	check_frames(s, root);
	check_domain(s, root, dimension == 2 || dimension == 3);
	quern_loader_limit(s->loader, (const int[]) { 4, 1, 3, 4 }[s->general.instructions]);
}

/* ---- observers ---- */

static const quern_param observe_rows[] = {
	QUERN_PARAM(quern_observe_item, label, NULL,
		"What its columns in series.csv and its numbers in summary.json are called; default: the plugin's "
		"name, from the second one on with a number.",
		.flags = QUERN_MAYBE),
	QUERN_END_PARAMS
};
const quern_slot quern_observe_slot = { .name = "observe",
	.kind = &quern_observer_kind,
	.list = 1,
	.rows = observe_rows,
	.item_size = sizeof(quern_observe_item) };

static quern_observe_item *observe_item(const quern_scene *s, size_t e) { return s->observe.filling[e].item; }

/* Which of the first n observers has that label; n if none has. */
static size_t labelled(const quern_scene *s, size_t n, const char *label) {
	for (size_t e = 0; e < n; e++)
		if (observe_item(s, e)->label && !strcmp(observe_item(s, e)->label, label)) return e;
	return n;
}

static void check_label(quern_scene *s, size_t e) {
	const quern_instance *it = s->observe.filling[e].instance;
	const char *label = observe_item(s, e)->label;
	const quern_mark mark = quern_param_mark(it->map, "label", it->mark);
	if (!quern_is_name(label))
		quern_report_add(s->report, mark,
			"observe: the label '%s' is no name: it must be letters, digits and '_', beginning with a letter",
			label);
	else if (labelled(s, e, label) < e)
		quern_report_add(
			s->report, mark, "observe: two observers are labelled '%s': give each its own", label);
}

static void label_observers(quern_scene *s) {
	const size_t n = s->observe.n;
	for (size_t e = 0; e < n; e++)
		if (observe_item(s, e)->label) check_label(s, e);
	for (size_t e = 0; e < n; e++) {
		const char *name = quern_id_name(s->observe.filling[e].instance->file->plugin.id);
		char *label = quern_copy(name);
		for (int k = 2; !observe_item(s, e)->label && labelled(s, n, label) < n; k++) {
			free(label);
			label = quern_format("%s_%d", name, k);
		}
		if (!observe_item(s, e)->label) observe_item(s, e)->label = quern_tree_keep(s->tree, label);
		free(label);
	}
}

static void resolve(quern_scene *s) {
	quern_node *root = s->tree->root;
	if (!root) return;
	char say[64];
	if (root->kind != QUERN_NODE_MAP) {
		quern_report_add(s->report, root->mark, "a scene is a map, not %s", quern_node_say(root, say));
		return;
	}
	const char **also = quern_sections_known(s, root);
	read_general(s, root, also);
	free(also);
	publish_scene(s);
	quern_sections_read(s, root);
	s->observe.slot = &quern_observe_slot;
	s->observe.path = quern_copy("observe");
	quern_slot_fill(s, &s->observe, quern_node_find(root, "observe"), root->mark);
	label_observers(s);
}

static quern_scene *create(const quern_host *host, quern_loader *loader) {
	quern_scene *s = quern_take(1, sizeof *s);
	s->host = host;
	s->report = quern_report_create();
	s->units = quern_units_create();
	s->loader = loader;
	return s;
}

static quern_scene *create_alone(const quern_host *host) {
	quern_scene *s = create(host, quern_loader_create());
	quern_watch_know(s->loader);
	return s;
}

bool quern_scene_is_whole(const quern_scene *s) {
	return !s->general.model || !strcmp(s->general.model, "all");
}

quern_scene *quern_scene_read(const char *path, const char *const *sets, const quern_host *host) {
	quern_scene *s = create_alone(host);
	s->tree = quern_tree_read(path, s->report);
	for (; sets && *sets && s->tree->root; sets++) quern_tree_set(s->tree, *sets, s->report);
	resolve(s);
	if (!quern_report_errors(s->report)) quern_episodes_read(s);
	return s;
}

quern_scene *quern_scene_vary(const quern_scene *base, quern_tree *tree) {
	quern_scene *s = create(base->host, base->loader);
	s->tree = tree;
	s->later = true;
	resolve(s);
	return s;
}

quern_scene *quern_scene_parse(const char *name, const char *data, size_t length, const quern_host *host) {
	quern_scene *s = create_alone(host);
	s->tree = quern_tree_parse(name, data, length, s->report);
	resolve(s);
	if (!quern_report_errors(s->report)) quern_episodes_read(s);
	return s;
}

const quern_section *quern_scene_section(const quern_scene *s, const char *name) {
	for (size_t i = 0; i < s->n_sections; i++)
		if (!strcmp(s->sections[i].name, name)) return &s->sections[i];
	return NULL;
}

void quern_scene_destroy(quern_scene *s) {
	if (!s) return;
	quern_episodes_finish(s);
	for (size_t i = 0; i < s->n_sections; i++) {
		for (size_t k = 0; k < s->sections[i].n_slots; k++) quern_slot_finish(&s->sections[i].slots[k]);
		free(s->sections[i].slots);
	}
	if (s->observe.slot) quern_slot_finish(&s->observe);
	for (size_t i = s->n_instances; i-- > 0;) quern_instance_destroy(s->instances[i]);
	for (size_t i = 0; i < s->n_defaults; i++) quern_tree_destroy(s->defaults[i]);
	for (size_t i = 0; i < s->n_fields; i++) free(s->fields[i]);
	free(s->instances);
	free(s->defaults);
	free(s->fields);
	free(s->field_marks);
	free(s->published);
	quern_tree_destroy(s->tree);
	if (!s->later) { /* a stage's plugins are those of its scene */
		quern_watch_know(NULL);
		quern_loader_destroy(s->loader);
	}
	quern_units_destroy(s->units);
	quern_report_destroy(s->report);
	free(s);
}
