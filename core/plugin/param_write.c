/* SPDX-License-Identifier: MIT */
/* param_write - from an instance back to a map */
#include "param.h"
#include "text.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void write_text(
	const quern_param *row, const char *text, const quern_naming *naming, quern_node *map) {
	if (!text) return;
	char *named = naming && row->flags & QUERN_FILE ? naming->name(naming->context, text) : NULL;
	quern_node_put_quoted(map, row->name, named ? named : text);
	free(named);
}

static void write_vector(const quern_param *row, const quern_real *v, uint32_t dim, quern_node *map) {
	char number[32];
	for (uint32_t k = 0; k < dim; k++)
		if (!isfinite(v[k])) return;
	quern_node *list = quern_node_put_list(map, row->name);
	for (uint32_t k = 0; k < dim; k++) {
		quern_number(v[k], number);
		quern_node_append(list, number);
	}
}

/* Beside what stands elsewhere in its place, a default must not be written. */
static bool gives_way(const quern_param *rows, const quern_param *row, const void *instance) {
	const quern_param *other = row->unless ? quern_param_find(rows, row->unless) : NULL;
	if (other && other->type == QUERN_T_TEXT)
		return *(const char *const *)(const void *)((const char *)instance + other->offset) != NULL;
	const double value = other ? quern_param_number(other, instance) : 0;
	return value > 0 || value < 0;
}

void quern_params_write(
	const quern_param *all, const void *instance, uint32_t dim, const quern_naming *naming, quern_node *map) {
	for (const quern_param *rows = all; rows && rows->name; rows++) {
		const void *member = (const char *)instance + rows->offset;
		char number[32];
		if (gives_way(all, rows, instance)) continue;
		switch (rows->type) {
		case QUERN_T_REAL:
			if (!isfinite(*(const quern_real *)member)) break;
			quern_number(*(const quern_real *)member, number);
			quern_node_put(map, rows->name, number);
			break;
		case QUERN_T_INT: {
			const int32_t value = *(const int32_t *)member;
			if (value == INT32_MIN) break;
			snprintf(number, sizeof number, "%d", value);
			quern_node_put(map, rows->name, rows->choices ? rows->choices[value] : number);
			break;
		}
		case QUERN_T_BOOL: quern_node_put(map, rows->name, *(const bool *)member ? "true" : "false"); break;
		case QUERN_T_TEXT: write_text(rows, *(const char *const *)member, naming, map); break;
		case QUERN_T_VECTOR: write_vector(rows, member, dim, map); break;
		case QUERN_T_LIST: {
			const quern_list *values = member;
			quern_node *list = quern_node_put_list(map, rows->name);
			for (uint32_t i = 0; i < values->n; i++)
				quern_params_write(rows->rows, (const char *)values->items + (size_t)i * values->item_size,
					dim, naming, quern_node_append_map(list));
			break;
		}
		default: break;
		}
	}
}
