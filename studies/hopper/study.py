#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""hopper - the flow out of a hopper beside Beverloo's law.

    studies/hopper/study.py [--run DIR]... [--from 0.2] [--to 0.6]

Without --run it runs configs/hopper.yaml with four widths of the orifice, into out/hopper_study, and writes docs/validation/hopper.md. With
--run it prints the same numbers of runs that are there. In two dimensions, per metre of slab, W = C rho_b sqrt(g) (L - k D)^(3/2): L is the
width, D the mean diameter, rho_b the bulk density above the orifice, and k D the rim that no grain's centre passes."""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys

import yaml

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import provenance  # noqa: E402
K = 1.4  # D, of Beverloo, Leniger & van de Velde 1961 for round grains
WIDTHS = (8, 10, 12, 16)  # D


def series(folder):
    with open(folder / "series.csv") as file:
        rows = list(csv.reader(file))
    return [dict(zip((name.split(" ")[0] for name in rows[0]), map(float, row))) for row in rows[1:]]


def mean_flow(rows, begin, end):
    """Slope of the mass that has left, by least squares, and the mean packing fraction above."""
    rows = [row for row in rows if begin <= row["time"] <= end]
    n = len(rows)
    t, m = ([row[name] for row in rows] for name in ("time", "outflow.mass"))
    tm, mm = sum(t) / n, sum(m) / n
    slope = sum((a - tm) * (b - mm) for a, b in zip(t, m)) / sum((a - tm) ** 2 for a in t)
    return slope, sum(row["packing_fraction.fraction"] for row in rows) / n


def look(folder, begin, end):
    s = json.loads((folder / "summary.json").read_text())
    if s["time_end"] < end:
        sys.exit(f"{folder} has come to {s['time_end']:g} s, and the flow is taken up to {end:g} s: resume that run, or give --to")
    scene = yaml.safe_load((folder / "scene.yaml").read_text())
    grains = scene["grains"]["material"]
    gate = next(body["segment"] for body in scene["bodies"] if body.get("segment", {}).get("name") == "gate")
    width, diameter = float(gate["to"][0]) - float(gate["from"][0]), 2 * float(grains["radius"]["mean"])
    flow, fraction = mean_flow(series(folder), begin, end)
    bulk = fraction * float(grains["density"])
    law = bulk * math.sqrt(9.81) * (width - K * diameter) ** 1.5
    return {"width": width / diameter, "flow": flow, "fraction": fraction, "C": flow / law, "grains": s["observers"]["outflow"]["count"]["last"]}


def run(out, width):
    """The hopper of configs/ with another orifice, unless it has run to its end there."""
    half = width * 1e-3  # D/2 = 1 mm
    left, right = 0.06 - half, 0.06 + half
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "done":
        subprocess.run([ROOT / "build/quern", "run", ROOT / "configs/hopper.yaml", "-o", out, "--force", "--quiet", "--no-cache"]
                       + [f"--set=bodies.{key}=[{x:.6g}, 0]" for key, x in (("left_slope.to", left), ("right_slope.to", right),
                                                                            ("gate.from", left), ("gate.to", right))], check=True)
    return out


def table(rows):
    lines = ["| L/D | W, kg/s | packing fraction above | C | grains that left |", "|---|---|---|---|---|"]
    lines += [f"| {r['width']:.0f} | {r['flow']:.2f} | {r['fraction']:.3f} | {r['C']:.2f} | {r['grains']:.0f} |" for r in rows]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="append", type=pathlib.Path, default=[])
    parser.add_argument("--from", dest="begin", type=float, default=0.2)
    parser.add_argument("--to", type=float, default=0.6)
    args = parser.parse_args()
    if args.run:
        print(table([look(folder, args.begin, args.to) for folder in args.run]))
        return
    rows = [look(run(ROOT / "out/hopper_study" / str(width), width), args.begin, args.to) for width in WIDTHS]
    (ROOT / "docs/validation/hopper.md").write_text(PAGE.format(table=table(rows), k=K, begin=args.begin, end=args.to,
                                                                 provenance=provenance.line(provenance.of())))
    print(table(rows))


PAGE = """<!-- written by studies/hopper/study.py -->

# A hopper

Discs flow out of the hopper of `configs/hopper.yaml` through orifices of several widths $L$. W. A. Beverloo, H. A. Leniger and J. van de
Velde (Chem. Eng. Sci. 15, 1961, 260) found that the flow does not depend on how much lies above, and that a rim of about $k D/2$ on either
side stays without grains. In two dimensions their law reads
$$
W = C\\,\\rho_b\\sqrt{{g}}\\,(L - kD)^{{3/2}},
$$
with the bulk density $\\rho_b$ above the orifice. $C$ lies between 1.0 and 1.6 for discs, and $k$ is {k} here. The flow is the slope of the
mass that has left through the open face, from {begin} s to {end} s; by then the surface has not come down to where $\\rho_b$ is taken.

{table}

$C$ should be one number for all widths: that is the law's exponent.

{provenance}
"""

if __name__ == "__main__":
    main()
