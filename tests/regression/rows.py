# SPDX-License-Identifier: MIT
"""A solver of our own whose node rows begin with a field that is written: what is added in the other lanes begins every
step at nothing all the same, and what is written stays."""
import pathlib

import lab
import workshop

SOLVER = """#include <quern/grid.h>
#include <quern/solver.h>
typedef struct { quern_real cell; } spots;
static const quern_param params[] = { QUERN_PARAM(spots, cell, "m", "Cell.", .def = 0.1, .min = 0.01, .max = 1),
	QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_set sets[] = { { .name = "spot", .doc = "Nodes.", .rows = 8 }, { .name = NULL } };
#define F(name, how, form, ...) { .field = name, .unit = "1", .doc = "It.", .access = how, .shape = form, __VA_ARGS__ }
static const quern_use first_uses[] = { F("spot.two", QUERN_READ, QUERN_SCALAR), QUERN_END_USES };
static const quern_use mark_uses[] = { F("spot.mark", QUERN_WRITE, QUERN_SCALAR), QUERN_END_USES };
static const quern_use one_uses[] = { F("spot.one", QUERN_ADD, QUERN_VECTOR), QUERN_END_USES };
static const quern_use two_uses[] = { F("spot.two", QUERN_ADD, QUERN_SCALAR), QUERN_END_USES };
static const quern_use look_uses[] = { F("spot.mark", QUERN_READ, QUERN_SCALAR),
	F("spot.one", QUERN_READ, QUERN_VECTOR), F("spot.two", QUERN_READ, QUERN_SCALAR),
	F("total.looks", QUERN_UPDATE, QUERN_SCALAR), QUERN_END_USES };
static quern_status begin(const void *self, const quern_step *s) {
	const int32_t block[1][3] = { { 0 } };
	(void)self;
	return s->host->cover(s->run, 1, block);
}
static quern_status give(const quern_step *s, quern_real value) {
	for (uint32_t i = 0; i < s->host->grid(s->run)->n_blocks * QUERN_BLOCK_CELLS; i++)
		s->use[0].real[0][8 * i] += value;
	return QUERN_OK;
}
static quern_status mark(const void *self, const quern_step *s) {
	(void)self;
	for (uint32_t i = 0; i < s->host->grid(s->run)->n_blocks * QUERN_BLOCK_CELLS; i++)
		s->use[0].real[0][8 * i] = 7;
	return QUERN_OK;
}
static quern_status one(const void *self, const quern_step *s) { (void)self; return give(s, 1); }
static quern_status two(const void *self, const quern_step *s) { (void)self; return give(s, 2); }
static quern_status look(const void *self, const quern_step *s) {
	(void)self;
	s->use[3].real[0][0] += 1;
	for (uint32_t i = 0; i < s->host->grid(s->run)->n_blocks * QUERN_BLOCK_CELLS; i++) {
		const quern_real m = s->use[0].real[0][8 * i], a = s->use[1].real[0][8 * i], b = s->use[2].real[0][8 * i];
		if (m != 7 || a != 1 || b != 2)
			return s->host->stop(s->run, QUERN_E_NUMERIC, "spot", i, "%g %g %g, not 7 1 2", m, a, b);
	}
	return QUERN_OK;
}
static const quern_stage stages[] = { { .name = "spots.begin", .phase = QUERN_SETUP, .uses = none, .run = begin },
	{ .name = "spots.mark", .phase = QUERN_DEPOSIT, .uses = mark_uses, .run = mark },
	{ .name = "spots.one", .phase = QUERN_DEPOSIT, .uses = one_uses, .run = one },
	{ .name = "spots.two", .phase = QUERN_EXCHANGE, .uses = two_uses, .run = two },
	{ .name = "spots.look", .phase = QUERN_END, .uses = look_uses, .run = look }, { .name = NULL } };
static quern_real cell(const void *self) { return ((const spots *)self)->cell; }
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	(void)self, (void)s, (void)reason;
	return *hard = 0.1;
}
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .sets = sets, .stages = stages, .limit = limit,
	.cell = cell };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1,
	.dims = QUERN_2D | QUERN_3D, .id = "solver.spots", .brief = "Spots.", .instance_size = sizeof(spots),
	.params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "0", "MIT");
"""
SCENE = """quern: 1
dimension: 2
gravity: [0, 0]
domain: {lower: [0, 0], upper: [1, 1]}
time: {end: 1}
output: {every: 1, fields: [total.looks]}
spots: {solver: spots}
"""

if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        (place / "spots.yaml").write_text(SCENE)
        # lanes follow the order in which fields are first named: what is written comes first, or what is added last
        for instead in (".uses = none, .run = begin", ".uses = first_uses, .run = begin"):
            workshop.compile(SOLVER.replace(".uses = none, .run = begin", instead), "solver.spots", place)
            lab.run(str(place / "spots"), place / "out", "--force", QUERN_PLUGIN_PATH=str(place))
            found = lab.contents(lab.frames(place / "out")[-1])
            assert found["total/looks"][0] == 10, found["total/looks"]
