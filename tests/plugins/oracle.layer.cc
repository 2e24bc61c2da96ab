/* SPDX-License-Identifier: MIT */
/* oracle.layer - a plugin in C++17: grains above a height, continuum below. The tables are constant, as in C: nothing runs
 * when the object is loaded. */
#include <quern/contact.h>
#include <quern/grid.h>
#include <quern/math.h>
#include <quern/oracle.h>
#include <quern/vec.h>

namespace {

struct layer {
	quern_real height, depth;
};

constexpr quern_param length(const char *name, uint32_t offset, uint32_t flags, quern_real min, const char *doc) {
	quern_param row {};
	row.name = name;
	row.unit = "m";
	row.doc = doc;
	row.offset = offset;
	row.type = QUERN_T_REAL;
	row.flags = static_cast<uint8_t>(QUERN_REQUIRED | flags);
	row.min = min;
	row.max = 1e6;
	return row;
}

constexpr quern_param params[] = {
	length("height", offsetof(layer, height), 0, -1e6, "Above it, along the last axis, everything is grains."),
	length("depth", offsetof(layer, depth), QUERN_MIN_OPEN, 0, "Of the hybrid zone below that height."),
	quern_param {} };
constexpr quern_use uses[] = { quern_use {} };

void mark(const void *self, const quern_cell_batch *b) {
	const quern_vec up = QUERN_VALUE(quern_vec, 0, b->dim == 2 ? 1.0 : 0.0, b->dim == 3 ? 1.0 : 0.0);
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_vec x = QUERN_VEC_AT(b->centre, i, b->dim);
		b->level[i] = static_cast<const layer *>(self)->height - quern_vec_dot(x, up, 3);
	}
}

void decide(const void *self, const quern_cell_batch *b) {
	for (uint32_t i = 0; i < b->n; i++) {
		const quern_real d = b->distance[i];
		b->wish[i] = d <= 0 ? QUERN_DISCRETE
			: d <= static_cast<const layer *>(self)->depth ? QUERN_HYBRID
								       : QUERN_CONTINUUM;
	}
}

constexpr quern_oracle_ops operations() {
	quern_oracle_ops out {};
	out.size = sizeof out;
	out.mark = mark;
	out.decide = decide;
	return out;
}
constexpr quern_oracle_ops ops = operations();

constexpr quern_plugin table() {
	quern_plugin out {};
	out.size = sizeof out;
		out.revision = 1;
	out.dims = QUERN_2D | QUERN_3D;
	out.id = "oracle.layer";
	out.brief = "Grains above a height.";
	out.instance_size = sizeof(layer);
	out.params = params;
	out.uses = uses;
	out.ops = &ops;
	return out;
}
constexpr quern_plugin plugin = table();

} // namespace

QUERN_LIBRARY(plugin, "0.1.0", "MIT");
