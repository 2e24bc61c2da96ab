# SPDX-License-Identifier: MIT
"""A material that gives what is no number once it is pressed, and a point that somebody takes out of the domain, end the run with exit
status 3: the point, the stage, the time and the plugin are named, and the checkpoint is from before."""
import pathlib
import re

import lab
import workshop

SCENE = """quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.4, 0.4]}
time: {end: 1}
continuum:
  cell: 20 mm
  material: {mine: {bulk_modulus: 1e5, density: 1000}}
  fill: {region: {box: {lower: [0.1, 0.1], upper: [0.3, 0.3]}}}
output: {every: 20 ms}
checkpoint: {every: 1 ms}
"""
PRESSED = ("open ? 0 :", "open ? 0 : b->density[i] > 1.01 * m->density ? 0.0 / 0.0 :")
SAID = r"mpm\.gather, at t = [0-9.e-]+ s \(step \d+\): point \d+: point\.stress .*not a number after material\.mine"
# nothing of Quern's own takes a point out of the domain, so another solver does
THROWER = r"""
#include <quern/solver.h>
typedef struct { quern_real when; } thrower;
static const quern_param params[] = { QUERN_PARAM(thrower, when, "s", "When a point is taken out.", .def = 0.1, .max = 10), QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_use uses[] = { { .field = "point.position", .unit = "m", .access = QUERN_UPDATE, .shape = QUERN_VECTOR },
    { .field = "total.unsorted", .unit = "1", .access = QUERN_UPDATE, .shape = QUERN_INDEX }, QUERN_END_USES };
static const quern_set sets[] = { { .name = 0 } };
static const quern_slot slots[] = { { .name = 0 } };
static quern_status take_out(const void *self, const quern_step *s) {
    if (s->time < ((const thrower *)self)->when) return QUERN_OK;
    s->use[0].real[1][7] = s->upper[1] + 1e-3;
    s->use[1].index[0] = 1;
    return QUERN_OK;
}
static const quern_stage stages[] = { { .name = "thrower.throw", .doc = "Takes one out.", .phase = QUERN_END, .uses = uses, .run = take_out },
    { .name = 0 } };
static const char *const needs[] = { "continuum", 0 };
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "thrower", .needs = needs, .sets = sets, .slots = slots, .stages = stages };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = QUERN_2D | QUERN_3D, .id = "solver.thrower",
    .brief = "Takes a point out.", .instance_size = sizeof(thrower), .params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "0.1.0", "MIT");
"""
LEFT = r"mpm\.\w+, at t = 0\.1[0-9]* s \(step \d+\): point \d+: left the domain along axis 1, at 0\.401 m"


def ends(folder, scene, wanted):
    """The run ends as is wanted, keeps what was before, and ends the same way once more when it goes on from there."""
    how = {"QUERN_PLUGIN_PATH": str(folder), "status": 3}
    said = lab.run(scene, folder / "out", "--force", **how)
    assert re.search(wanted, said), said
    summary = lab.summary(folder / "out")
    assert summary["status"] == "failed" and summary["message"] in said, summary["message"]
    step, kept = summary["steps"], int(lab.whole(folder / "out/checkpoint.h5")["@step"])
    frames = len(lab.frames(folder / "out"))
    assert 0 < kept <= step and frames > 3, f"a checkpoint of step {kept} of {step}, {frames} frames"
    again = lab.run(scene, folder / "out", resume=True, **how)
    assert summary["message"] in again, again
    print(f"{frames} frames, a checkpoint of step {kept}, {summary['message']}")


def main():
    with lab.workplace() as place:
        folder = pathlib.Path(place)
        workshop.compile(workshop.source("material", PRESSED), "material.mine", folder)
        workshop.compile(THROWER, "solver.thrower", folder)
        scene = folder / "scene.yaml"
        scene.write_text(SCENE)
        ends(folder, scene, SAID)
        scene.write_text(SCENE.replace("mine:", "elastic:").replace("gravity: [0, -9.81]", "gravity: [0, 0]") + "thrower: {when: 0.1}\n")
        ends(folder, scene, LEFT)


if __name__ == "__main__":
    main()
