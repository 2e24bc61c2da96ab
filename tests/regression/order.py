# SPDX-License-Identifier: MIT
"""A solver of our own whose first set points into its second: a resume does not depend on the order in which sets are named."""
import os
import pathlib
import subprocess

import lab
import workshop

SOLVER = """#include <quern/solver.h>
typedef struct { int32_t count; } chain;
static const quern_param params[] = { QUERN_PARAM(chain, count, "1", "Beads.", .def = 9, .min = 2, .max = 99),
	QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_set sets[] = { { .name = "link", .doc = "Beads in a row." }, { .name = "bead", .doc = "Points." },
	{ .name = NULL } };
#define F(name, how, form, ...) { .field = name, .unit = "1", .doc = "It.", .access = how, .shape = form, __VA_ARGS__ }
static const quern_use begin_uses[] = { F("link.from", QUERN_WRITE, QUERN_INDEX, .target = "bead"),
	F("bead.height", QUERN_WRITE, QUERN_SCALAR), QUERN_END_USES };
static const quern_use move_uses[] = { F("link.from", QUERN_READ, QUERN_INDEX, .target = "bead"),
	F("bead.height", QUERN_UPDATE, QUERN_SCALAR), QUERN_END_USES };
static quern_status begin(const void *self, const quern_step *s) {
	const uint32_t n = (uint32_t)((const chain *)self)->count;
	int32_t *from = s->host->memory(s->run, n * sizeof *from);
	for (uint32_t i = 0; i < n; i++) from[i] = -1;
	if (s->host->remap(s->run, "bead", n, from, 0, NULL) || s->host->remap(s->run, "link", n - 1, from, 0, NULL))
		return QUERN_E_MEMORY;
	for (uint32_t i = 0; i < n; i++) s->use[1].real[0][i] = i * i;
	for (uint32_t i = 0; i + 1 < n; i++) s->use[0].index[i] = (int32_t)i;
	return QUERN_OK;
}
static quern_status move(const void *self, const quern_step *s) {
	(void)self;
	for (uint32_t i = 0; i < s->host->set(s->run, "link").n; i++) {
		quern_real *height = s->use[1].real[0] + s->use[0].index[i];
		height[0] += 0.1 * (height[1] - height[0]);
	}
	return QUERN_OK;
}
static const quern_stage stages[] = { { .name = "chain.begin", .phase = QUERN_SETUP, .uses = begin_uses, .run = begin },
	{ .name = "chain.move", .phase = QUERN_SUBSTEP, .uses = move_uses, .run = move }, { .name = NULL } };
static quern_real limit(const void *self, const quern_step *s, quern_real *hard, char reason[160]) {
	(void)self, (void)s, (void)reason;
	return *hard = 0.1;
}
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .sets = sets, .stages = stages, .limit = limit };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1,
	.dims = QUERN_2D | QUERN_3D, .id = "solver.chain", .brief = "A chain.", .instance_size = sizeof(chain),
	.params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "0", "MIT");
"""
SCENE = """quern: 1
dimension: 2
gravity: [0, 0]
domain: {lower: [0, 0], upper: [1, 1]}
time: {end: 2}
output: {every: 0.5, fields: [link.from, bead.height]}
grains: {solver: chain}
"""


def run(scene, out, *options):
    done = subprocess.run([lab.QUERN, "run", "--quiet", str(scene), "-o", str(out), *options], text=True,
                          capture_output=True, timeout=60, env={**os.environ, "QUERN_PLUGIN_PATH": str(scene.parent)})
    assert done.returncode == 0, f"{options}: exit status {done.returncode}\n{done.stderr}"


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        workshop.compile(SOLVER, "solver.chain", place)
        scene = place / "chain.yaml"
        scene.write_text(SCENE)
        run(scene, place / "once")
        run(scene, place / "twice", "--until", "0.7")
        run(scene, place / "twice", "--resume")
        assert lab.contents(lab.frames(place / "once")[-1])["link/from"].size == 8
        lab.same(place / "once", place / "twice", "links and beads")
