/* SPDX-License-Identifier: MIT */
#include "loader.h"
#include "param.h"
#include "plugin_table_read.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What interface 2.0 has of each table: less was built with none of our headers. */
#define UP_TO(type, member) (offsetof(type, member) + sizeof(((type *)0)->member))
enum {
	LIBRARY_2_0 = UP_TO(quern_library, plugin),
	PLUGIN_2_0 = UP_TO(quern_plugin, ops),
	PARAM_2_0 = UP_TO(quern_param, pad),
	USE_2_0 = UP_TO(quern_use, hook),
	WIDEST_ROW = 1024,
	LONGEST_DOC = 1 << 16,
	MOST_IN_ALL = 4096
};

bool quern_table_refuse(quern_table_reader *r, const char *fmt, ...) {
	va_list list;
	quern_text_add(r->why, "has a faulty table: ");
	va_start(list, fmt);
	quern_text_addv(r->why, fmt, list);
	va_end(list);
	return false;
}

void *quern_table_keep(quern_table_reader *r, size_t bytes) {
	quern_table *t = r->table;
	t->owned = quern_grow(t->owned, t->n_owned, &t->capacity, sizeof(void *));
	return t->owned[t->n_owned++] = quern_take(bytes, 1);
}

void quern_table_finish(quern_table *t) {
	for (size_t i = 0; i < t->n_owned; i++) free(t->owned[i]);
	free(t->owned);
	*t = (quern_table) { 0 };
}

/* ---- texts ---- */

bool quern_table_text(const char *text, size_t longest) {
	if (!text) return true;
	const size_t n = strnlen(text, longest + 1);
	for (size_t i = 0; i < n; i++)
		if ((unsigned char)text[i] < 32 && text[i] != '\n' && text[i] != '\t') return false;
	return n <= longest;
}

static bool is_doc(const char *text) { return quern_table_text(text, LONGEST_DOC); }
static bool is_unit(const char *text) { return quern_table_text(text, QUERN_LONGEST_NAME); }

/* Words with dots between them; `parts` 0: any number of them. */
static bool is_dotted(const char *name, size_t parts) {
	char part[QUERN_LONGEST_NAME + 1];
	if (!name || strnlen(name, QUERN_LONGEST_NAME + 1) > QUERN_LONGEST_NAME) return false;
	for (size_t k = 1;; k++) {
		const size_t n = strcspn(name, ".");
		snprintf(part, sizeof part, "%.*s", (int)n, name);
		if (!quern_is_name(part)) return false;
		if (!name[n]) return !parts || k == parts;
		name += n + 1;
	}
}

/* "SET.NAME", short enough for every place that keeps one */
static bool is_field(const char *field) {
	return is_dotted(field, 2) && strcspn(field, ".") < 24 && strlen(field) < 56;
}

/* ---- parameters ---- */

static size_t size_of(uint32_t type) {
	static const size_t sizes[] = { 0, sizeof(quern_real), sizeof(int32_t), sizeof(bool),
		sizeof(const char *), 3 * sizeof(quern_real), sizeof(quern_list) };
	return type < sizeof sizes / sizeof *sizes ? sizes[type] : 0;
}

static size_t alignment(uint32_t type) { return size_of(type) < 8 ? size_of(type) : 8; }

static bool choices(quern_table_reader *r, const char *of, const quern_param *row) {
	int n = 0;
	if (!row->choices) return true;
	while (n <= QUERN_MOST_CHOICES && row->choices[n]) {
		const char *word = row->choices[n++];
		if (!*word || !quern_table_text(word, QUERN_LONGEST_NAME))
			return quern_table_refuse(r, "%s: a choice of '%s' is no word", of, row->name);
	}
	if (!n || n > QUERN_MOST_CHOICES)
		return quern_table_refuse(
			r, "%s: the choices of '%s' must be 1 to %d, then NULL", of, row->name, QUERN_MOST_CHOICES);
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double def = quern_param_default(row, dim);
		if (!(def >= 0 && def < n && def == trunc(def)))
			return quern_table_refuse(
				r, "%s: the default %g of '%s' is none of its %d choices", of, def, row->name, n);
	}
	return row->type == QUERN_T_INT ||
		   quern_table_refuse(r, "%s: '%s' has choices, so its type must be int32_t", of, row->name);
}

static bool numbers(quern_table_reader *r, const char *of, const quern_param *row) {
	const bool whole = row->type == QUERN_T_INT;
	if (!(row->min <= row->max))
		return quern_table_refuse(r, "%s: the range of '%s' is empty", of, row->name);
	for (uint32_t dim = 2; dim <= 3; dim++) {
		const double def = quern_param_default(row, dim);
		if (isnan(def) || (whole && !(def == trunc(def) && fabs(def) <= INT32_MAX)))
			return quern_table_refuse(
				r, "%s: the default %g of '%s' is no %snumber", of, def, row->name, whole ? "whole " : "");
	}
	return true;
}

static bool param(quern_table_reader *r, const char *of, const quern_param *row, uint64_t size) {
	const uint64_t bytes = size_of(row->type);
	if (!is_dotted(row->name, 0))
		return quern_table_refuse(r, "%s: '%.60s' is no name of a parameter", of, row->name);
	if (!bytes) return quern_table_refuse(r, "%s: '%s' has the unknown type %u", of, row->name, row->type);
	if (row->offset + bytes > size)
		return quern_table_refuse(r, "%s: '%s' lies at bytes %u to %llu of %llu", of, row->name, row->offset,
			(unsigned long long)(row->offset + bytes), (unsigned long long)size);
	if (row->offset % alignment(row->type))
		return quern_table_refuse(
			r, "%s: '%s' lies at byte %u, where its type cannot", of, row->name, row->offset);
	if (row->flags & QUERN_FILE && row->type != QUERN_T_TEXT)
		return quern_table_refuse(r, "%s: '%s' is a file, so its type must be const char *", of, row->name);
	if (!is_unit(row->unit) || !is_doc(row->doc) || !is_doc(row->text) ||
		(row->from && !is_dotted(row->from, 0)))
		return quern_table_refuse(r, "%s: unit, doc, text or from of '%s' is no plain text", of, row->name);
	if (row->unless && !is_dotted(row->unless, 0))
		return quern_table_refuse(r, "%s: unless of '%s' is no name of a parameter", of, row->name);
	return choices(r, of, row) && numbers(r, of, row);
}

static bool list(quern_table_reader *r, const char *of, quern_param *row, uint32_t depth) {
	quern_param *rows;
	size_t n;
	if (!row->rows || !row->item_size || row->item_size > QUERN_LARGEST_INSTANCE)
		return quern_table_refuse(
			r, "%s: the list '%s' has no rows, or items of %u bytes", of, row->name, row->item_size);
	char *path = quern_format("%s.%s", of, row->name);
	const bool good = quern_table_params(r, path, row->rows, row->item_size, depth + 1, &rows, &n);
	free(path);
	if (!good) return false;
	row->rows = rows;
	const quern_param *key = row->text ? quern_param_find(rows, row->text) : NULL;
	if (row->text && (!key || key->type != QUERN_T_TEXT))
		return quern_table_refuse(r,
			"%s: '%.60s', which shall take the keys of the list '%s', is no text of its items", of, row->text,
			row->name);
	for (; rows->name; rows++) /* items follow each other */
		if (row->item_size % alignment(rows->type))
			return quern_table_refuse(r, "%s: items of %u bytes of the list '%s' do not keep '%s' in line",
				of, row->item_size, row->name, rows->name);
	return true;
}

bool quern_table_params(quern_table_reader *r, const char *of, const quern_param *rows, uint64_t bytes,
	uint32_t depth, quern_param **copy, size_t *n) {
	const size_t stride = r->table->library.param_size;
	const char *from = (const char *)rows;
	if (depth > QUERN_MOST_DEPTH)
		return quern_table_refuse(
			r, "%.120s: lists nest deeper than %d, or contain themselves", of, QUERN_MOST_DEPTH);
	for (*n = 0; *(const char *const *)(const void *)(from + *n * stride); ++*n)
		if (*n >= QUERN_MOST_ROWS || ++r->rows > MOST_IN_ALL)
			return quern_table_refuse(r,
				"%.120s: more than %d parameters, so the last row is no QUERN_END_PARAMS", of,
				QUERN_MOST_ROWS);
	*copy = quern_table_keep(r, (*n + 1) * sizeof **copy);
	for (size_t i = 0; i < *n; i++) {
		quern_param *row = &(*copy)[i];
		memcpy(row, from + i * stride, stride < sizeof *row ? stride : sizeof *row);
		if (!param(r, of, row, bytes)) return false;
		if (row->type == QUERN_T_LIST && !list(r, of, row, depth)) return false;
		if (row->type != QUERN_T_LIST && row->rows)
			return quern_table_refuse(r, "%s: '%s' has rows, so its type must be quern_list", of, row->name);
	}
	return true;
}

/* ---- uses ---- */

static bool use(quern_table_reader *r, const char *of, const quern_use *row, const quern_param *params) {
	if (!is_field(row->field)) return quern_table_refuse(r, "%s: '%.60s' is no SET.NAME", of, row->field);
	if (row->access < QUERN_READ || row->access > QUERN_ADD || row->shape < QUERN_SCALAR ||
		row->shape > QUERN_ID || row->hook > 2 || row->flags > 2 * QUERN_EXISTS - 1 ||
		(row->flags & QUERN_EXISTS && row->access != QUERN_READ))
		return quern_table_refuse(r, "%s: access, shape, hook or flags of %s are unknown", of, row->field);
	const bool number = row->shape != QUERN_INDEX && row->shape != QUERN_ID;
	if (row->rule > QUERN_OWN || ((row->rule == QUERN_SUMS || row->rule == QUERN_MEANS) && !number))
		return quern_table_refuse(
			r, "%s: the rule of %s is unknown, or asks for sums of what is no number", of, row->field);
	if (row->rule && row->access == QUERN_READ)
		return quern_table_refuse(r, "%s: a rule is for who changes the field: %s is read", of, row->field);
	if (!is_unit(row->unit) || !is_doc(row->doc))
		return quern_table_refuse(r, "%s: unit or doc of %s is no plain text", of, row->field);
	if (row->when && (!is_dotted(row->when, 0) || !quern_param_find(params, row->when)))
		return quern_table_refuse(
			r, "%s: %s hangs on '%.60s', which is no parameter", of, row->field, row->when);
	if (row->with && !is_field(row->with))
		return quern_table_refuse(
			r, "%s: %s goes with '%.60s', which is no SET.NAME", of, row->field, row->with);
	if (row->target && (row->shape != QUERN_INDEX || !is_dotted(row->target, 1)))
		return quern_table_refuse(
			r, "%s: only an index has a target, and the target is a set: %s", of, row->field);
	if (row->access != QUERN_READ && row->flags & (QUERN_OTHERS | QUERN_BEFORE))
		return quern_table_refuse(r, "%s: OTHERS and BEFORE are for what is read: %s", of, row->field);
	return true;
}

bool quern_table_uses(quern_table_reader *r, const char *of, const quern_use *rows, size_t most,
	const quern_param *params, quern_use **copy, size_t *n) {
	const size_t stride = r->table->library.use_size;
	const char *from = (const char *)rows;
	for (*n = 0; *(const char *const *)(const void *)(from + *n * stride); ++*n)
		if (*n >= most)
			return quern_table_refuse(
				r, "%s: more than %zu uses, or the last row is no QUERN_END_USES", of, most);
	*copy = quern_table_keep(r, (*n + 1) * sizeof **copy);
	for (size_t i = 0; i < *n; i++) {
		memcpy(&(*copy)[i], from + i * stride, stride < sizeof **copy ? stride : sizeof **copy);
		if ((r->table->library.abi & 0xffffu) < 1) (*copy)[i].rule = 0; /* it lies where 2.0 had nothing */
		if (!use(r, of, &(*copy)[i], params)) return false;
	}
	return true;
}

quern_use *quern_table_uses_for(const quern_table *t, const quern_library *reader) {
	const size_t stride = reader->use_size, known = stride < sizeof(quern_use) ? stride : sizeof(quern_use);
	char *rows = quern_take(t->n_uses + 1, stride);
	for (size_t i = 0; i < t->n_uses; i++) memcpy(rows + i * stride, &t->uses[i], known);
	return (quern_use *)(void *)rows;
}

/* ---- the plugin and its library ---- */

static bool is_stride(uint32_t size, size_t least) {
	return size >= least && size <= WIDEST_ROW && size % 8 == 0;
}

static const char *text_or_none(const char *text) { return text ? text : ""; }

static bool library(quern_table_reader *r, const quern_library *lib) {
	quern_library *l = &r->table->library;
	uint32_t head[2]; /* size and abi, which every version has */
	memcpy(head, lib, sizeof head);
	if (head[1] >> 16 != QUERN_ABI_MAJOR || (head[1] & 0xffffu) > QUERN_ABI_MINOR || head[0] < LIBRARY_2_0) {
		quern_text_add(r->why,
			"is built for interface %u.%u, this program speaks %u.%u: rebuild it with this header",
			head[1] >> 16, head[1] & 0xffffu, QUERN_ABI_MAJOR, QUERN_ABI_MINOR);
		return false;
	}
	memcpy(l, lib, head[0] < sizeof *l ? head[0] : sizeof *l);
	if (l->real_size != sizeof(quern_real) || l->lanes != QUERN_LANES) {
		quern_text_add(r->why, "is built for another number format: rebuild it with this program's header");
		return false;
	}
	if (!is_stride(l->param_size, PARAM_2_0) || !is_stride(l->use_size, USE_2_0))
		return quern_table_refuse(
			r, "rows of %u and %u bytes: end the source with QUERN_LIBRARY(...)", l->param_size, l->use_size);
	if (!is_doc(l->name) || !is_doc(l->version) || !is_doc(l->license) || !is_doc(l->build))
		return quern_table_refuse(r, "name, version, license or build of the library is no plain text");
	l->name = text_or_none(l->name), l->version = text_or_none(l->version);
	l->license = text_or_none(l->license), l->build = text_or_none(l->build);
	return true;
}

static bool identity(quern_table_reader *r, const quern_plugin *p) {
	const size_t n = p->id ? strcspn(p->id, ".") : 0;
	if (!is_dotted(p->id, 2) || n >= sizeof r->table->kind) {
		quern_text_add(r->why, "has an id that is not KIND.NAME, two words");
		return false;
	}
	snprintf(r->table->kind, sizeof r->table->kind, "%.*s", (int)n, p->id);
	if (!p->dims || p->dims & ~(uint32_t)(QUERN_2D | QUERN_3D))
		return quern_table_refuse(r, "dims is %u, must be QUERN_2D, QUERN_3D or both", p->dims);
	if (!p->instance_size || p->instance_size > QUERN_LARGEST_INSTANCE)
		return quern_table_refuse(
			r, "instance_size is %u, must be 1 to %d", p->instance_size, QUERN_LARGEST_INSTANCE);
	if (!is_doc(p->brief) || !is_doc(p->doc) || !is_doc(p->cite))
		return quern_table_refuse(r, "brief, doc or cite is no plain text");
	return true;
}

static bool plugin(quern_table_reader *r) {
	quern_table *t = r->table;
	quern_plugin *p = &t->plugin;
	const quern_plugin *from = t->library.plugin;
	if (from && from->size >= PLUGIN_2_0) memcpy(p, from, from->size < sizeof *p ? from->size : sizeof *p);
	if (!p->id || !p->ops || !p->params || !p->uses) {
		quern_text_add(r->why, "describes no plugin: its table lacks id, params, uses or ops");
		return false;
	}
	if (!identity(r, p) ||
		!quern_table_params(r, "params", p->params, p->instance_size, 0, &t->params, &t->n_params) ||
		!quern_table_uses(r, "uses", p->uses, QUERN_MOST_USES, t->params, &t->uses, &t->n_uses))
		return false;
	p->params = t->params;
	p->uses = t->uses;
	return quern_table_ops(r, p->ops);
}

bool quern_table_read(quern_table *table, const quern_library *lib, quern_text *why) {
	quern_table_reader r = { .table = table, .why = why };
	*table = (quern_table) { 0 };
	return library(&r, lib) && plugin(&r);
}
