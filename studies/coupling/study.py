#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coupling - a pulse through the zone between a lattice of discs and an elastic continuum of the same modulus and density.

    studies/coupling/study.py [--out DIR] [--jobs 2]

With each coupling, shares of a half and on a ramp, and zones of two to eight cells; writes docs/validation/coupling.md and coupling.svg. Runs
that are in DIR already are not repeated. Needs a Quern with coupling.exact. Takes two minutes on two cores."""
import argparse
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "tools")]
import provenance  # noqa: E402
import quern  # noqa: E402
DOCS = ROOT / "docs/validation"
COUPLINGS, WEIGHTS, WIDTHS = ("lumped", "affine", "exact"), ("half", "ramp"), (2, 4, 6, 8)
SPACING, STIFFNESS, DENSITY = 2e-3, 1e5, 2500
RADIUS = 0.5 * SPACING * 1.005
MASS = DENSITY * math.pi * RADIUS**2
PACE = math.sqrt(STIFFNESS / MASS) * SPACING  # m/s
TOP, START, HALF = 1e-3, 0.55, 0.02  # m/s, m, m: the pulse of 20 diameters; a half of it goes either way
COLUMNS, ROWS = 500, 4
# A ring of grains and continuum, joined by two zones. The step is the continuum's; all springs, no friction: what is lost, the zone has lost.
SCENE = """quern: 1
dimension: 2
gravity: [0, 0]
domain: {{lower: [0, 0], upper: [1, 0.008], periodic: [true, true]}}
time: {{end: {end:.17g}, step: {step:.17g}}}
grains: {{material: {{density: {density}, radius: {{mean: {radius:.17g}}}}}, file: {file},
  contact: {{linear: {{stiffness: {stiffness}, restitution: 1, friction: 0}}}}}}
continuum: {{cell: {cell:.17g}, rasterise: affine, transfer: {{picflip: {{rate: 0}}}},
  material: {{elastic: {{bulk_modulus: {modulus:.17g}, poisson: 0, density: {bulk:.17g}}}}}}}
hybrid: {{oracle: [{{fixed: {{boxes: [{{lower: [0.1, -1], upper: [0.7, 1]}}, {{lower: [{left:.17g}, -1], upper: [{right:.17g}, 1], zone: hybrid}}]}}}}],
  weights: {weights}, substeps: {substeps}, update: 1000000000, coupling: {coupling}}}
output: {{every: {every:.17g}, fields: [grain.velocity, point.velocity]}}
"""


def lattice(path, top):
    rows = ["x y vx"]
    for j in range(ROWS):
        for i in range(COLUMNS):
            x = (i + 0.5) * SPACING
            way = (x - START) / HALF
            rows.append(f"{x:.17g} {(j + 0.5) * SPACING:.17g} {top * math.cos(0.5 * math.pi * way)**2 if abs(way) < 1 else 0:.17g}")
    path.write_text("\n".join(rows) + "\n")


def run(folder, coupling, weights, cells, cell=4e-3, substeps=10, step=1e-4, top=TOP):
    """One run, unless it is there and done. The width is in cells of 4 mm."""
    if (folder / "summary.json").exists() and json.loads((folder / "summary.json").read_text())["status"] == "done":
        return quern.open(folder)
    scene, grains = folder.with_suffix(".yaml"), folder.with_suffix(".in")
    lattice(grains, top)
    scene.write_text(SCENE.format(end=0.36 / PACE, step=step, density=DENSITY, radius=RADIUS, file=grains.name, stiffness=STIFFNESS, cell=cell,
                                  modulus=0.5 * STIFFNESS, bulk=MASS / SPACING**2, left=0.1 - cells * 4e-3, right=0.7 + cells * 4e-3,
                                  weights=weights, substeps=substeps, coupling=coupling, every=0.01 / PACE))
    subprocess.run([ROOT / "build/quern", "run", scene, "-o", folder, "--force", "--quiet", "--threads", "1"], check=True)
    return quern.open(folder)


def columns(frame, kind):
    """Velocity over the columns of a lattice, as far as there is one: means of what stands in them."""
    x, v = frame[f"{kind}.position"][:, 0], frame[f"{kind}.velocity"][:, 0]
    at = np.floor(x / SPACING).astype(int) % COLUMNS
    count = np.bincount(at, minlength=COLUMNS)
    return np.where(count > 0, np.bincount(at, v, COLUMNS) / np.maximum(count, 1), np.nan)


def look(with_pulse, without):
    """What comes back, the largest velocity there; what goes on, its profile: both of what came."""
    back, on = 0, None
    for one, none in zip(with_pulse.frames, without.frames):
        gone = PACE * one.time
        if gone > 0.1:
            back = max(back, np.nanmax(np.abs(columns(one, "grain") - columns(none, "grain"))[250:300]))
        if on is None and gone > 0.315:
            on = (columns(one, "point") - columns(none, "point"))[380:480]
    return {"back": back / (0.5 * TOP), "on": on / (0.5 * TOP)}


def measure(out, name, *case, **how):
    runs = [run(out / f"{name}_{kind}", *case, top=top, **how) for kind, top in (("pulse", TOP), ("rest", 0))]
    return look(*runs)


if __name__ == "__main__":
    out = pathlib.Path(sys.argv[1])
    out.mkdir(exist_ok=True)
    for w in WEIGHTS:
        for n in WIDTHS:
            found = {c: measure(out, f"{c}_{w}_{n}", c, w, n) for c in COUPLINGS}
            for c in COUPLINGS:
                f = found[c]
                a = found["affine"]["on"]
                print(w, n, c, "back %.4f on %.4f sum %.4f diff to affine max %.4f l2 %.4f" % (f["back"], np.nanmax(f["on"]), np.nansum(f["on"]), np.nanmax(np.abs(f["on"]-a)), np.sqrt(np.nansum((f["on"]-a)**2)/np.nansum(a**2))))
