/* SPDX-License-Identifier: MIT */
/* check_setting - instances with parameters of ordinary size, at their bounds, or mixed; written as a scene would */
#include "check.h"
#include "random.h"
#include "scene.h"
#include "text.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef enum { ORDINARY, LOW, HIGH, ANY, NEAR } choice;

/* Settings from here on lie around the ordinary values, for what refuses these. */
static const uint64_t nearby = 1u << 20;

double quern_check_ordinary(const quern_check *open, const char *unit) {
	static const struct {
		const char *unit;
		double value;
	} sizes[] = { { "m", 1e-3 }, { "Pa", 1e7 }, { "N/m", 1e5 }, { "kg/m^3", 1500 }, { "m/s", 1 },
		{ "1/s", 10 }, { "s", 1e-3 }, { "kg", 1e-3 }, { "m/s^2", 9.81 }, { "1", 0.5 }, { "N", 1 },
		{ "J", 1e-3 }, { "rad/s", 10 }, { "rad", 0.5 }, { "m^3", 1e-9 }, { "kg m^2", 1e-9 }, { "J/kg", 1 },
		{ "N m", 1e-3 } };
	const check *c = (const check *)(const void *)open;
	if (!unit || !*unit) return 0.5;
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
		if (!strcmp(unit, sizes[i].unit) || quern_units_equal(c->units, unit, sizes[i].unit))
			return sizes[i].value;
	return 1;
}

static bool bounded(const quern_param *row) { return row->min != row->max; }

static double within(const quern_param *row, double x) {
	if (!bounded(row)) return x;
	const double inset = isfinite(row->max - row->min) ? 1e-3 * (row->max - row->min) : 1e-3;
	if (x < row->min || (x == row->min && row->flags & QUERN_MIN_OPEN)) x = row->min + inset;
	if (x > row->max || (x == row->max && row->flags & QUERN_MAX_OPEN)) x = row->max - inset;
	return x;
}

/* Nobody publishes anything here. */
static bool needs_a_value(const quern_param *row) {
	return row->flags & QUERN_REQUIRED || (row->from && !(row->flags & QUERN_MAYBE));
}

static double usual(const check *c, uint32_t dim, const quern_param *row) {
	if (needs_a_value(row) || row->from || row->flags & QUERN_MAYBE)
		return within(row, quern_check_ordinary(&c->open, row->unit));
	return quern_param_default(row, dim);
}

/* An open bound is neared by a factor of 1e-9 of the ordinary size. */
static double bound(const check *c, uint32_t dim, const quern_param *row, choice how) {
	const double near = 1e-9 * (fabs(usual(c, dim, row)) + 1e-300);
	if (how == LOW) return row->min + (row->flags & QUERN_MIN_OPEN ? near : 0);
	return row->max - (row->flags & QUERN_MAX_OPEN ? near + 1e-12 * fabs(row->max) : 0);
}

/* Between the bounds, evenly on a scale of decades where they are of one sign and far apart. */
static double anywhere(const check *c, uint32_t dim, const quern_param *row, uint64_t key, uint64_t counter) {
	const double low = bound(c, dim, row, LOW), high = bound(c, dim, row, HIGH);
	if (low >= 0 && high > 1e3 * (low + 1e-30)) {
		const double least = log(low > 0 ? low : 1e-6 * fabs(usual(c, dim, row)) + 1e-30);
		return within(row, exp(quern_check_uniform(key, counter, least, log(high))));
	}
	return quern_check_uniform(key, counter, low, high);
}

static void put_number(quern_node *map, const char *name, double value) {
	char text[32];
	quern_number(value, text);
	quern_node_put(map, name, text);
}

/* Vectors that must be given: different for every row, so that corners are apart and normals have a length. */
static void put_vector(const check *c, uint32_t dim, const quern_param *row, uint32_t index, choice how,
	uint64_t key, quern_node *map) {
	const double size = quern_check_ordinary(&c->open, row->unit);
	if (!needs_a_value(row) && how == ORDINARY) return;
	if (how != ORDINARY && how != ANY && !bounded(row)) return;
	quern_node *list = quern_node_put_list(map, row->name);
	for (uint32_t k = 0; k < dim; k++) {
		char text[32];
		double x = size * (index + 1) * (0.2 + 0.2 * k);
		if (how == ANY) x = quern_check_uniform(key, index * 8 + k, -size, size);
		else if (how != ORDINARY) x = bound(c, dim, row, how);
		quern_number(within(row, x), text);
		quern_node_append(list, text);
	}
}

static void put_real(const check *c, uint32_t dim, const quern_param *row, uint32_t index, choice how,
	uint64_t key, quern_node *map) {
	if (how == NEAR) {
		const double factor = exp(quern_check_uniform(key, index, -2, 2));
		if (needs_a_value(row) || quern_check_uniform(key, 500 + index, 0, 1) < 0.7)
			put_number(map, row->name, within(row, usual(c, dim, row) * factor));
	} else if (how == ORDINARY) {
		if (needs_a_value(row)) put_number(map, row->name, usual(c, dim, row));
	} else if (bounded(row) && isfinite(row->max)) {
		const double x = how == ANY ? anywhere(c, dim, row, key, index) : bound(c, dim, row, how);
		put_number(map, row->name, row->type == QUERN_T_INT ? trunc(x) : x);
	} else if (needs_a_value(row)) put_number(map, row->name, usual(c, dim, row));
}

static void put_choice(const quern_param *row, uint32_t index, choice how, uint64_t key, quern_node *map) {
	uint32_t n = 0;
	while (row->choices[n]) n++;
	if (!n || (how == ORDINARY && !needs_a_value(row))) return;
	const uint32_t any = (uint32_t)quern_check_uniform(key, index, 0, n);
	quern_node_put(map, row->name, row->choices[how == HIGH ? n - 1 : how == ANY && any < n ? any : 0]);
}

static void put_rows(const check *, uint32_t dim, const quern_param *rows, uint64_t setting, quern_node *map);

/* Corners of something: on a circle, none like another. */
static void put_corner(const check *c, uint32_t dim, const quern_param *row, double turn, quern_node *item) {
	const double size = quern_check_ordinary(&c->open, row->unit);
	quern_node *vector = quern_node_put_list(item, row->name);
	for (uint32_t k = 0; k < dim; k++) {
		char text[32];
		quern_number(within(row, size * (1 + sin(turn + 1.5 * k))), text);
		quern_node_append(vector, text);
	}
}

/* As few items as the row allows. */
static void put_list(const check *c, uint32_t dim, const quern_param *row, quern_node *map) {
	const uint32_t n = bounded(row) && row->min > 1 ? (uint32_t)ceil(row->min) : 1;
	const bool corners = n > 1 && row->rows->type == QUERN_T_VECTOR && !row->rows[1].name;
	quern_node *list = quern_node_put_list(map, row->name);
	for (uint32_t i = 0; i < n; i++) {
		quern_node *item = quern_node_append_map(list);
		if (corners) put_corner(c, dim, row->rows, 6.283185307179586 * i / n, item);
		else put_rows(c, dim, row->rows, 0, item);
	}
}

static void put_row(const check *c, uint32_t dim, const quern_param *row, uint32_t index, choice how,
	uint64_t key, quern_node *map) {
	switch (row->type) {
	case QUERN_T_REAL: put_real(c, dim, row, index, how, key, map); break;
	case QUERN_T_INT:
		if (row->choices) put_choice(row, index, how, key, map);
		else put_real(c, dim, row, index, how, key, map);
		break;
	case QUERN_T_BOOL:
		if (how != ORDINARY || needs_a_value(row))
			quern_node_put(map, row->name,
				how == HIGH || (how == ANY && quern_check_uniform(key, index, 0, 1) < 0.5) ? "true"
																						   : "false");
		break;
	case QUERN_T_VECTOR: put_vector(c, dim, row, index, how, key, map); break;
	case QUERN_T_TEXT:
		if (needs_a_value(row)) quern_node_put_quoted(map, row->name, "check");
		break;
	case QUERN_T_LIST:
		if (needs_a_value(row) || how == HIGH) put_list(c, dim, row, map);
		break;
	default: break;
	}
}

static void put_rows(
	const check *c, uint32_t dim, const quern_param *rows, uint64_t setting, quern_node *map) {
	uint64_t n = 0;
	for (const quern_param *row = rows; row && row->name; row++) n++;
	for (uint32_t i = 0; i < n; i++) {
		choice how = ORDINARY;
		if (setting >= nearby) how = rows[i].type == QUERN_T_REAL ? NEAR : ORDINARY;
		else if (setting > 2 * n) how = (choice)quern_check_uniform(setting, 1000 + i, 0, 4);
		else if (setting && (setting - 1) / 2 == i) how = (setting - 1) % 2 ? HIGH : LOW;
		put_row(c, dim, &rows[i], i, how, setting, map);
	}
}

uint64_t quern_check_settings(const quern_check *c) {
	return 2 * (uint64_t)(((const check *)(const void *)c)->file->n_params) + 1;
}

/* ---- instances ---- */

static bool no_section(const quern_setup *setup, const char *section) {
	(void)setup, (void)section;
	return false;
}
static void no_publish(const quern_setup *setup, const char *name, const char *unit, quern_real value) {
	(void)setup, (void)name, (void)unit, (void)value;
}

static const void *no_extension(const char *id) { return (void)id, NULL; }

const quern_host quern_check_init_services = { .abi = QUERN_ABI,
	.fail = quern_scene_fail,
	.random = quern_random,
	.publish = no_publish,
	.keeps = no_section,
	.extension = no_extension };

static void say_why(check_instance *it, const char *fallback) {
	char *data = NULL;
	size_t size = 0;
	FILE *text = open_memstream(&data, &size);
	if (!text) return;
	quern_report_print(it->report, text);
	fclose(text);
	snprintf(it->why, sizeof it->why, "%.*s", (int)strcspn(data, "\n"), size ? data : fallback);
	free(data);
}

static check_outcome call_init(const check *c, check_instance *it) {
	const uint32_t dim = it->open.dim;
	quern_setup setup = { .dim = dim, .lanes = QUERN_LANES, .stream = 7, .host = &quern_check_init_services };
	quern_err err = { it->report, it->tree->root, { 0 }, c->file->plugin.id };
	for (uint32_t k = 0; k < dim; k++) setup.upper[k] = 1;
	setup.gravity[dim - 1] = -9.81;
	quern_check_place(&c->open, "init, %u-D, with setting %llu of its parameters", dim,
		(unsigned long long)it->open.setting);
	const quern_status status = c->file->plugin.init(it->open.self, &setup, &err);
	quern_check_environment(c);
	const bool spoke = quern_report_errors(it->report) > 0;
	it->ready = status == QUERN_OK;
	if (it->ready && !spoke) return CHECK_READY;
	say_why(it, "");
	if (!it->ready && spoke) return CHECK_REFUSED;
	snprintf(it->why, sizeof it->why,
		it->ready ? "init calls fail() and returns QUERN_OK" : "init returns a failure and calls no fail()");
	return CHECK_RUDE;
}

static void scale_rows(const check *c, const quern_param *rows, double factor, void *self) {
	for (; rows && rows->name; rows++) {
		quern_real *at = (quern_real *)(void *)((char *)self + rows->offset);
		const quern_list *list = (const quern_list *)(const void *)at;
		const double times = pow(factor, quern_check_mass_power(&c->open, rows->unit));
		const uint32_t n = rows->type == QUERN_T_REAL ? 1 : rows->type == QUERN_T_VECTOR ? 3 : 0;
		for (uint32_t k = 0; k < n; k++) at[k] *= times;
		for (uint32_t i = 0; rows->type == QUERN_T_LIST && i < list->n; i++)
			scale_rows(c, rows->rows, factor, (char *)list->items + (size_t)i * list->item_size);
	}
}

static check_outcome read_and_init(const check *c, double factor, check_instance *it) {
	const quern_reading reading = { it->report, c->units, it->open.dim, NULL, 0, it->tree };
	put_rows(c, it->open.dim, c->file->params, it->open.setting, it->tree->root);
	quern_node_merge(it->tree->root, c->task->given);
	quern_params_read(&reading, c->file->plugin.id, c->file->params, it->tree->root, (quern_mark) { 0 }, NULL,
		it->open.self);
	if (quern_report_errors(it->report)) return say_why(it, ""), CHECK_REFUSED;
	if (factor != 1) scale_rows(c, c->file->params, factor, it->open.self);
	if (c->file->plugin.init) return call_init(c, it);
	it->ready = true;
	return CHECK_READY;
}

static check_instance *create(const check *c, uint32_t dim, uint64_t setting, double factor) {
	const size_t size = (c->file->plugin.instance_size + 127u) & ~(size_t)63;
	check_instance *it = quern_take(1, sizeof *it);
	*it = (check_instance) { .open = { .dim = dim, .setting = setting }, .check = c };
	it->report = quern_report_create();
	it->tree = quern_take(1, sizeof *it->tree);
	it->tree->root = quern_node_create(QUERN_NODE_MAP);
	it->open.self = aligned_alloc(64, size);
	if (!it->open.self) abort();
	memset(it->open.self, 0, size);
	it->outcome = read_and_init(c, factor, it);
	return it;
}

check_instance *quern_check_try(const check *c, uint32_t dim, uint64_t setting) {
	check_instance *it = create(c, dim, setting, 1);
	for (uint64_t i = 0; !setting && it->outcome == CHECK_REFUSED && i < 200; i++) {
		check_instance *other = create(c, dim, nearby + i, 1);
		const bool better = other->outcome == CHECK_READY;
		quern_check_instance_destroy(better ? &it->open : &other->open);
		if (better) return other;
	}
	return it;
}

bool quern_check_has_dim(const check *c, uint32_t dim) {
	return (!c->task->dimension || c->task->dimension == dim) &&
		   c->file->plugin.dims & (dim == 2 ? QUERN_2D : QUERN_3D);
}

static quern_check_instance *ready_one(check_instance *it) {
	if (it->outcome == CHECK_READY) return &it->open;
	quern_check_instance_destroy(&it->open);
	return NULL;
}

quern_check_instance *quern_check_instance_create(const quern_check *open, uint32_t dim, uint64_t setting) {
	const check *c = (const check *)(const void *)open;
	return quern_check_has_dim(c, dim) ? ready_one(quern_check_try(c, dim, setting)) : NULL;
}

quern_check_instance *quern_check_instance_scaled(
	const quern_check *open, const quern_check_instance *base, double factor) {
	return ready_one(create((const check *)(const void *)open, base->dim, base->setting, factor));
}

void quern_check_instance_destroy(quern_check_instance *open) {
	check_instance *it = (check_instance *)(void *)open;
	if (!it) return;
	const check *c = it->check;
	quern_check_place(&c->open, "finish, %u-D", open->dim);
	if (it->ready && c->file->plugin.finish) c->file->plugin.finish(open->self);
	quern_check_environment(c);
	quern_params_finish(c->file->params, open->self);
	free(open->self);
	quern_tree_destroy(it->tree);
	quern_report_destroy(it->report);
	free(it);
}

bool quern_check_counts(const quern_check *open, const quern_check_instance *it, const quern_use *row) {
	const quern_param *params = ((const check *)(const void *)open)->file->params;
	const quern_param *when = row->when ? quern_param_find(params, row->when) : NULL;
	return !row->when || (when && quern_param_number(when, it->self) != 0);
}
