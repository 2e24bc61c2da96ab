#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""coupling - a pulse through the zone between a lattice of discs and an elastic continuum of the same modulus and density.

    studies/coupling/study.py [--out DIR] [--jobs 2]

With each coupling, shares of a half and on a ramp, and zones of two to eight cells, then with longer pulses; and a small column of
configs/column.yaml that collapses, three seeds. Writes docs/validation/coupling.md and coupling.svg. Runs that are in DIR already are not repeated. Needs a Quern with coupling.exact, h5py and numpy. Takes three minutes on two cores."""
import argparse
import concurrent.futures
import json
import math
import pathlib
import statistics
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "python"), str(ROOT / "tools")]
import provenance  # noqa: E402
import quern  # noqa: E402
DOCS = ROOT / "docs/validation"
COUPLINGS, WEIGHTS, WIDTHS = ("lumped", "affine", "exact"), ("half", "ramp"), (2, 4, 6, 8)
LONG = (4, 8)  # widths that longer pulses are sent through
SPACING, STIFFNESS, DENSITY, CELL = 2e-3, 1e5, 2500, 4e-3
RADIUS = 0.5 * SPACING * 1.005
MASS = DENSITY * math.pi * RADIUS**2
PACE = math.sqrt(STIFFNESS / MASS) * SPACING  # m/s
TOP, START = 1e-3, 0.55  # m/s, m: of the pulse; a half of it goes either way
LENGTHS = (20, 40, 80)  # diameters
COLUMNS, ROWS = 500, 4
# A ring of grains and continuum, joined by two zones. The step is the continuum's; all springs, no friction: what is lost, the zone has lost.
SCENE = """quern: 1
dimension: 2
gravity: [0, 0]
domain: {{lower: [0, 0], upper: [1, 0.008], periodic: [true, true]}}
time: {{end: {end:.17g}, step: 1e-4}}
grains: {{material: {{density: {density}, radius: {{mean: {radius:.17g}}}}}, file: {file},
  contact: {{linear: {{stiffness: {stiffness}, restitution: 1, friction: 0}}}}}}
continuum: {{cell: {cell:.17g}, rasterise: affine, transfer: {{picflip: {{rate: 0}}}},
  material: {{elastic: {{bulk_modulus: {modulus:.17g}, poisson: 0, density: {bulk:.17g}}}}}}}
hybrid: {{oracle: [{{fixed: {{boxes: [{{lower: [0.1, -1], upper: [0.7, 1]}}, {{lower: [{left:.17g}, -1], upper: [{right:.17g}, 1], zone: hybrid}}]}}}}],
  weights: {weights}, substeps: 10, update: 1000000000, coupling: {coupling}}}
output: {{every: {every:.17g}, fields: [grain.velocity, point.velocity]}}
"""


def lattice(path, top, length):
    rows, half = ["x y vx"], 0.5 * length * SPACING
    for j in range(ROWS):
        for i in range(COLUMNS):
            x = (i + 0.5) * SPACING
            way = (x - START) / half
            rows.append(f"{x:.17g} {(j + 0.5) * SPACING:.17g} {top * math.cos(0.5 * math.pi * way)**2 if abs(way) < 1 else 0:.17g}")
    path.write_text("\n".join(rows) + "\n")


def run(folder, coupling, weights, cells, length, top):
    """One run, unless it is there and done."""
    if not (folder / "summary.json").exists() or json.loads((folder / "summary.json").read_text())["status"] != "done":
        scene, grains = folder.with_suffix(".yaml"), folder.with_suffix(".in")
        lattice(grains, top, length)
        scene.write_text(SCENE.format(end=0.36 / PACE, density=DENSITY, radius=RADIUS, file=grains.name, stiffness=STIFFNESS, cell=CELL,
                                      modulus=0.5 * STIFFNESS, bulk=MASS / SPACING**2, left=0.1 - cells * CELL, right=0.7 + cells * CELL,
                                      weights=weights, coupling=coupling, every=0.01 / PACE))
        subprocess.run([ROOT / "build/quern", "run", scene, "-o", folder, "--force", "--quiet", "--threads", "1"], check=True)
    return quern.open(folder)


def columns(frame, kind):
    """Velocity over the columns of the lattice: means of what stands in them."""
    x, v = frame[f"{kind}.position"][:, 0], frame[f"{kind}.velocity"][:, 0]
    at = np.floor(x / SPACING).astype(int) % COLUMNS
    count = np.bincount(at, minlength=COLUMNS)
    return np.where(count > 0, np.bincount(at, v, COLUMNS) / np.maximum(count, 1), np.nan)


def look(with_pulse, without, length):
    """What comes back, the largest velocity before the zone, and what goes on, by columns of the continuum: over what came."""
    back, on, passed = 0, None, 0.06 + 0.5 * length * SPACING  # m: until the half that goes the other way is out of sight
    for one, none in zip(with_pulse.frames, without.frames):
        gone = PACE * one.time
        if gone > passed:
            back = max(back, np.nanmax(np.abs(columns(one, "grain") - columns(none, "grain"))[250:300]))
        if on is None and gone > 0.315:
            on = (columns(one, "point") - columns(none, "point"))[370:498]
    return {"back": back / (0.5 * TOP), "on": np.nan_to_num(on) / (0.5 * TOP)}


def measure(out, coupling, weights, cells, length):
    name = f"{coupling}_{weights}_{cells}_{length}"
    return look(*(run(out / f"{name}_{kind}", coupling, weights, cells, length, top) for kind, top in (("pulse", TOP), ("rest", 0))), length)


def against(found, case):
    """Peak of what goes on and its energy, over those of coupling.affine, per cent."""
    one, base = found[case]["on"], found[("affine", *case[1:])]["on"]
    return 100 * (one.max() / base.max() - 1), 100 * ((one**2).sum() / (base**2).sum() - 1)


def table_widths(found):
    lines = ["| shares | cells | " + " | ".join(f"{c}: back | on" + (" | against affine" if c != "affine" else "") for c in COUPLINGS) + " |",
             "|---|---|" + "---|" * 8]
    for weights in WEIGHTS:
        for cells in WIDTHS:
            words = []
            for c in COUPLINGS:
                case = (c, weights, cells, LENGTHS[0])
                words += [f"{found[case]['back']:.3f}", f"{found[case]['on'].max():.3f}"]
                words += [f"{against(found, case)[0]:+.1f} %"] if c != "affine" else []
            lines.append(f"| {weights} | {cells} | " + " | ".join(words) + " |")
    return "\n".join(lines)


def table_lengths(found):
    lines = ["| cells | length, diameters | affine: back | exact: back | exact: peak against affine | exact: energy against affine |", "|---|---|---|---|---|---|"]
    for cells in LONG:
        for length in LENGTHS:
            peak, energy = against(found, ("exact", "ramp", cells, length))
            back = [found[(c, "ramp", cells, length)]["back"] for c in ("affine", "exact")]
            lines.append(f"| {cells} | {length} | {back[0]:.3f} | {back[1]:.3f} | {peak:+.1f} % | {energy:+.1f} % |")
    return "\n".join(lines)


# configs/column.yaml, narrower and lower
COLUMN = ["domain.upper=[0.6, 0.32]", "bodies.2.plane.point=[0.08, 0]", "observe.3.runout.origin=0.08", "time.end=0.5",
          "grains.fill.0.region.box={lower: [0, -0.7 mm], upper: [0.6, -0.7 mm]}",
          "grains.fill.1.region.box={lower: [0.001, 0.001], upper: [0.079, 0.125]}"]
MODELS, SEEDS = {"grains": "model=grains", "affine": "hybrid.coupling=affine", "exact": "hybrid.coupling=exact"}, (7, 8, 9)


def collapse(out, model, seed):
    """Front and height at the end, in m, J that the coupling took, and s of processor time after settling."""
    folder = out / f"column_{model}_{seed}"
    if not (folder / "summary.json").exists() or json.loads((folder / "summary.json").read_text())["status"] != "done":
        subprocess.run([ROOT / "build/quern", "run", ROOT / "configs/column.yaml", "-o", folder, "--force", "--quiet", "--threads", "1",
                        *(f"--set={one}" for one in [*COLUMN, MODELS[model], f"seed={seed}"])], check=True)
    s = json.loads((folder / "summary.json").read_text())
    seen = s["observers"]
    return (seen["runout"]["front"]["last"], seen["runout"]["height"]["last"], seen["energy"]["exchanged"]["last"],
            s["processor_seconds"] - s["settle_processor_seconds"])


def table_columns(found):
    lines = ["| model | front, mm: mean (seeds) | height, mm: mean (seeds) | taken by the coupling, J | processor time, s |", "|---|---|---|---|---|"]
    for model, runs in found.items():
        front, height, taken, cost = zip(*runs)
        words = [f"{1e3 * statistics.mean(some):.1f} ({', '.join(f'{1e3 * one:.1f}' for one in some)})" for some in (front, height)]
        lines.append(f"| {model} | {words[0]} | {words[1]} | {statistics.mean(taken):.2f} | {statistics.mean(cost):.1f} |")
    return "\n".join(lines)


def draw(found):
    """What comes back over the width, a line for each coupling and way to share."""
    width, height, left, top, bottom, high = 640, 420, 70, 40, 60, 0.08
    x = lambda n: left + (n - 1) / 8 * (width - left - 170)
    y = lambda r: height - bottom - r / high * (height - top - bottom)
    right = x(9)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="DejaVu Sans, sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="white"/>',
           f'<text x="{left}" y="22" font-size="15" font-weight="bold">Share of a pulse of 20 diameters that comes back</text>',
           f'<path d="M{left},{top} V{y(0)} H{right}" fill="none" stroke="black"/>',
           f'<path d="M{left},{y(0.05):.1f} H{right}" stroke="#999" stroke-dasharray="2,3"/>']
    out += [f'<path d="M{left - 5},{y(r):.1f} h5" stroke="black"/><text x="{left - 9}" y="{y(r) + 4:.1f}" text-anchor="end">{r:.2f}</text>'
            for r in (0, 0.02, 0.04, 0.06, 0.08)]
    out += [f'<path d="M{x(n):.1f},{y(0)} v5" stroke="black"/><text x="{x(n):.1f}" y="{y(0) + 19}" text-anchor="middle">{n}</text>' for n in WIDTHS]
    out += [f'<text x="{(left + right) / 2}" y="{height - 16}" text-anchor="middle">cells across the zone</text>',
            f'<text transform="translate(24,{(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle">largest velocity over the pulse</text>']
    for k, (coupling, weights) in enumerate((c, w) for w in WEIGHTS for c in COUPLINGS):
        colour, dash = {"lumped": "#7f8c8d", "affine": "#2c6e9b", "exact": "#c0392b"}[coupling], "6,4" if weights == "half" else "none"
        at = [(x(n), y(found[(coupling, weights, n, LENGTHS[0])]["back"])) for n in WIDTHS]
        out.append(f'<path d="M{" L".join(f"{a:.1f},{b:.1f}" for a, b in at)}" fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dash}"/>')
        out += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{colour}"/>' for a, b in at]
        out.append(f'<path d="M{right + 20},{top + 12 + 20 * k} h28" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dash}"/>'
                   f'<text x="{right + 55}" y="{top + 16 + 20 * k}">{coupling}, {weights}</text>')
    return "\n".join([*out, "</svg>\n"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/coupling_study")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, of one thread each")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    cases = [(c, w, n, LENGTHS[0]) for c in COUPLINGS for w in WEIGHTS for n in WIDTHS]
    cases += [(c, "ramp", n, length) for c in ("affine", "exact") for n in LONG for length in LENGTHS[1:]]
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        found = dict(zip(cases, pool.map(lambda case: measure(args.out, *case), cases)))
        fallen = {model: list(pool.map(lambda seed: collapse(args.out, model, seed), SEEDS)) for model in MODELS}
    (DOCS / "coupling.svg").write_text(draw(found))
    page = DOCS / "coupling.md"
    _, mark, words = (page.read_text() if page.exists() else "<!-- end -->\n").partition("<!-- end -->")
    page.write_text(PAGE.format(widths=table_widths(found), lengths=table_lengths(found), columns=table_columns(fallen),
                                provenance=provenance.line(provenance.of())) + mark + words)
    print(table_widths(found), table_lengths(found), table_columns(fallen), sep="\n\n")


PAGE = """<!-- written by studies/coupling/study.py -->

# A pulse through the hybrid zone

A square lattice of discs that touch and an elastic continuum of the same modulus and density lie in a strip that repeats itself, with a hybrid zone
between them ([theory](../theory/hybrid.md), sections 1 and 2). A pulse of the velocity cos², 20 diameters long, runs from the lattice into the
continuum. The cell is two diameters, ten substeps a step, points send their gradient with every coupling. *back* is the largest velocity that returns
into the lattice, *on* the peak of what runs in the continuum afterwards, both over the pulse that came, in a run with a pulse less one without.

{widths}

![what comes back, over the width](coupling.svg)

**Longer pulses**, with shares on a ramp:

{lengths}

**A small column**, that of `configs/column.yaml` 40 diameters wide and 60 high, half a second after its release, seeds 7, 8 and 9:

{columns}

Measured on {provenance}.

"""

if __name__ == "__main__":
    main()
