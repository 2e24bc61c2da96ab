# SPDX-License-Identifier: MIT
"""Stopped in the last step of settling, before anything was written of the run itself: it goes on to the same first frame, series
and checkpoint, with all that frames and observers look at. A contact law of our own stops the run, at a call that it counts."""
import os
import pathlib
import signal
import subprocess

import lab
import workshop

SCENE = """
quern: 1
dimension: 2
seed: 3
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.012, 0.03]}
time: {end: 4 ms}
output: {every: 1 ms, fields: [contact.force, touch.force, grain.force, grain.velocity, grain.spin]}
checkpoint: {every: %s}
bodies:
  - plane: {point: [0, 0], normal: [0, 1]}
  - plane: {point: [0, 0], normal: [1, 0]}
  - plane: {point: [0.012, 0], normal: [-1, 0]}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 20 %%}}
  contact: {mine: {stiffness: 1e5, restitution: 0.3, friction: 0.4}}
  integrator: velocity_verlet
  fill: {region: {box: {lower: [0.001, 0.001], upper: [0.011, 0.012]}}, settle: true}
  settle: {energy: 0.05}
observe: [energy, momentum, {wall_force: {body: 0}}]
"""
ADD = "static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }"
COUNTED = """
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
static long calls;
static __attribute__((destructor)) void report(void) {
	FILE *file = getenv("COUNT") ? fopen(getenv("COUNT"), "w") : NULL;
	if (file) fprintf(file, "%ld", calls), fclose(file);
}
static void force_2d(const void *self, const quern_contact_batch *b) {
	force(2, self, b);
	if (b->dt < 1e-200) return; /* somebody looks at the state, and nothing moves */
	calls++;
	if (getenv("STOP_AT") && calls == atol(getenv("STOP_AT"))) raise(atoi(getenv("STOP_BY")));
}
"""


def run(scene, folder, *options, status=0, resume=False, **environment):
    words = [lab.QUERN, "run", "--quiet", "--threads", "1", str(scene), "-o", str(folder), *options]
    done = subprocess.run(words + ["--resume"] * resume, capture_output=True, text=True, timeout=120,
                          env={**os.environ, "QUERN_PLUGIN_PATH": str(scene.parent), **environment})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"


def check(place):
    law = workshop.source("dem/contact.linear.c", ('.id = "contact.linear"', '.id = "contact.mine"'), (ADD, COUNTED))
    workshop.compile(law, "contact.mine", place)
    scene, often = place / "scene.yaml", place / "often.yaml"
    scene.write_text(SCENE % "5 min")
    often.write_text(SCENE % "0.02")
    base = place / "base"
    run(scene, base)
    run(scene, place / "settled", "--until", "0", COUNT=str(place / "count"))
    calls = int((place / "count").read_text())
    assert lab.summary(place / "settled")["steps"] == 0 and calls > 100
    for k, at in enumerate((calls, calls - 1, calls // 2)):
        out = place / f"stopped{k}"
        run(scene, out, status=130, STOP_AT=str(at), STOP_BY=str(int(signal.SIGINT)))
        assert not lab.frames(out), "it was stopped too late"
        run(scene, out, resume=True)
        lab.same(base, out, f"Ctrl-C in call {at} of {calls} while settling")
    for k, at in enumerate((calls, calls + 1)):
        out = place / f"killed{k}"
        run(often, out, status=-signal.SIGKILL, STOP_AT=str(at), STOP_BY=str(int(signal.SIGKILL)))
        run(scene, out, resume=True)
        lab.same(base, out, f"kill -9 in call {at} of {calls}", checkpoint=True)


if __name__ == "__main__":
    with lab.workplace() as name:
        check(pathlib.Path(name))
