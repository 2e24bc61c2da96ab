#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""alignment - how the grains of studies/strip_long.yaml lie to each other, along the chute.

    studies/strip_long/alignment.py [--sweep out/strip_long] [--page docs/validation/strip_long.md]

Writes between the marks of the page: for the grains 12 to 52 mm above the floor in four slices along the flow, the mean of cos 6 theta over all neighbours of each, those whose
centres are less than 1.3 mean diameters away, with the angle theta of the line between the two to the flow; from 5 s on. It is 0 where they lie in any direction and 1 in a
lattice whose rows lie along the flow."""
import math
import pathlib
import sys

import h5py
import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
LENGTH, DIAMETER, LOWEST, HIGHEST, FROM = 0.16, 2e-3, 12e-3, 52e-3, 5.0  # of configs/strip.yaml; s
SLICES = [(130, 145), (145, 160), (0, 15), (15, 30)]  # mm, from the strip's exit on to its entry


def aligned(position):
    """Sums of cos 6 theta and numbers of neighbours, by slice: of each grain in it, to all others."""
    x, y = position[:, 0] % LENGTH, position[:, 1]
    found = []
    for low, high in SLICES:
        here = (x >= 1e-3 * low) & (x < 1e-3 * high) & (y >= LOWEST) & (y < HIGHEST)
        way = x[here, None] - x
        way -= LENGTH * numpy.round(way / LENGTH)
        up = y[here, None] - y
        distance2 = way**2 + up**2
        near = (distance2 > 0) & (distance2 < (1.3 * DIAMETER) ** 2)
        found.append((numpy.cos(6 * numpy.arctan2(up[near], way[near])).sum(), near.sum()))
    return numpy.array(found)


def of_run(folder):
    sums = numpy.zeros((len(SLICES), 2))
    for path in sorted(folder.glob("frames/*.h5")):
        with h5py.File(path) as frame:
            if frame.attrs["time"] >= FROM:
                sums += aligned(frame["grains/position"][:])
    return sums[:, 0] / sums[:, 1]


def runs(folder):
    """Folders of runs, by spread and model."""
    found = {}
    for row in findings.rows(folder):
        found.setdefault((row["spread"], row["model"] or "hybrid"), []).append(folder / "runs" / row["run"])
    return found


def table(folder):
    rows = ["| spread | method | " + " | ".join(f"{low} to {high} mm" for low, high in SLICES) + " |", "|---" * (len(SLICES) + 2) + "|"]
    for (spread, method), folders in sorted(runs(folder).items()):
        values = numpy.array([of_run(one) for one in folders])
        error = values.std(axis=0, ddof=1) / math.sqrt(len(values)) if len(values) > 1 else numpy.zeros(len(SLICES))
        rows.append(f"| {float(spread):g} % | {method} | " + " | ".join(f"{m:.3f} ± {e:.3f}" for m, e in zip(values.mean(axis=0), error)) + " |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    findings.write(__doc__, "strip_long", "alignment", table)
