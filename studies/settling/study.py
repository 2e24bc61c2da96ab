#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""settling - what the quick way to settle leaves, beside a slow one: packing fraction, and the run that follows.

    studies/settling/study.py [--out DIR] [--seeds 3] [--threads 2]

Settles the grains of configs/column.yaml by default and slowly, with the step of a run and without local damping, lets both
collapse, and writes docs/validation/settling.md. Runs that are in DIR already, as those of studies/column, are not
repeated. Takes about ten minutes on two cores."""
import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import provenance  # noqa: E402
WAYS = {"default": ("column_grains", []),
        "slow": ("settling_slow", ["grains.settle.step=0.02", "grains.settling={damped: {local: 0}}"])}
BOX = (0.01, 0.15, 0.01, 0.2)  # m, away from the walls and the surface


def run(out, seed, threads, sets):
    """Runs the twin of grains into `out` unless it is there; returns its summary."""
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "done":
        subprocess.run([ROOT / "build/quern", "run", ROOT / "configs/column.yaml", "-o", out, "--force", "--quiet", "--no-cache",
                        "--threads", str(threads), "--set", "model=grains", "--set", f"seed={seed}"]
                       + [word for one in sets for word in ("--set", one)], check=True)
    return json.loads(summary.read_text())


def fraction(out):
    """Packing fraction in the box, at the release: area of the discs whose centre is in it."""
    with h5py.File(out / "frames/000000.h5") as frame:
        x, r = frame["grains/position"][:], frame["grains/radius"][:]
    inside = (x[:, 0] > BOX[0]) & (x[:, 0] < BOX[1]) & (x[:, 1] > BOX[2]) & (x[:, 1] < BOX[3])
    return np.pi * (r[inside] ** 2).sum() / ((BOX[1] - BOX[0]) * (BOX[3] - BOX[2]))


def figures(out, s):
    """What is compared, by name."""
    seen = s["observers"]["runout"]
    return {"packing fraction": fraction(out), "run-out": seen["front"]["last"], "height": seen["height"]["last"]}


def row(way, seed, s, f):
    return (f"| {way} | {seed} | {s['settle_steps']} | {s['settle_seconds']:.1f} | {s['wall_seconds'] - s['settle_seconds']:.0f} "
            f"| {f['packing fraction']:.4f} | {f['run-out']:.4f} | {f['height']:.4f} |")


def report(found):
    lines = ["| settling | seed | steps | settling, s | from release on, s | packing fraction | run-out, m | height, m |",
             "|---|---|---|---|---|---|---|---|"]
    lines += [row(way, seed, *one) for way in WAYS for seed, one in enumerate(found[way], 1)]
    lines += ["", "**Default against slow, of means over seeds**", "",
              "| figure | difference | twice its standard error | scatter of the slow way's seeds |", "|---|---|---|---|"]
    for name in found["slow"][0][1]:
        quick, slow = ([f[name] for _, f in found[way]] for way in ("default", "slow"))
        base = statistics.mean(slow)
        error = math.sqrt(sum(statistics.variance(side) / len(side) for side in (quick, slow)))
        lines.append(f"| {name} | {100 * (statistics.mean(quick) / base - 1):+.2f} % | {200 * error / base:.2f} % "
                     f"| {100 * statistics.stdev(slow) / base:.2f} % |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default=str(ROOT / "out/column_study"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    out = pathlib.Path(args.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    found = {way: [] for way in WAYS}
    for way, (name, sets) in WAYS.items():
        for seed in range(1, args.seeds + 1):
            s = run(out / f"{name}_{seed}", seed, args.threads, sets)
            found[way].append((s, figures(out / f"{name}_{seed}", s)))
            print(row(way, seed, *found[way][-1]), flush=True)
    lines = ["<!-- written by studies/settling/study.py -->", "", "# Settling, quick and slow", "",
             f"Measured on {provenance.line(provenance.of())}.", "",
             f"The grains of `configs/column.yaml`, {args.threads} threads. *Slow* is the step of a run and drag alone, without local",
             "damping. The packing fraction is that of a box away from walls and surface, at the release.", ""]
    (ROOT / "docs/validation/settling.md").write_text("\n".join(lines + report(found)) + "\n")
    print("\n".join(report(found)))


if __name__ == "__main__":
    main()
