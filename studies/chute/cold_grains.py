#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cold_grains - velocity, shear rate and fluctuation of the grains by height in the chute of studies/chute/cold_grains.yaml.

    studies/chute/cold_grains.py [--sweep out/cold_grains] [--page docs/validation/cold_grains.md]

Writes between the marks of the page. From 2 s on, in rows of 4 mm; grains and points by the mass that they carry. Fluctuation is the root of the mean square, over both
directions, of what a grain's velocity is off from a straight line over height through its row, frame by frame."""
import pathlib
import sys

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
ROW, ROWS, BEGIN, EVERY = 4e-3, 18, 2.0, 20e-3  # m, s


def look(frame):
    """By row: mass, momentum, points' mass; of grains: degrees of freedom, sum of squares of what they are off by."""
    sums = np.zeros((5, ROWS))
    grains = frame["grains"]
    free = grains["fixed"][:] == 0
    place, velocity, radius = (grains[name][:][free] for name in ("position", "velocity", "radius"))
    mass = np.pi * radius ** 2 * 2500 * (grains["weight"][:][free] if "weight" in grains else 1)
    row = np.clip((place[:, 1] / ROW).astype(int), 0, ROWS - 1)
    sums[0], sums[1] = np.bincount(row, mass, ROWS), np.bincount(row, mass * velocity[:, 0], ROWS)
    for k in range(ROWS):
        own = row == k
        if own.sum() < 10:
            continue
        line = np.stack([np.ones(own.sum()), place[own, 1]], axis=1)
        off = velocity[own, :2] - line @ np.linalg.lstsq(line, velocity[own, :2], rcond=None)[0]
        sums[3, k], sums[4, k] = own.sum() - 2, (off ** 2).sum() / 2  # a line takes two
    if "points" in frame:
        points = frame["points"]
        mass = points["mass"][:] * (points["weight"][:] if "weight" in points else 1)
        row = np.clip((points["position"][:, 1] / ROW).astype(int), 0, ROWS - 1)
        sums[:3] += np.stack([np.bincount(row, mass, ROWS), np.bincount(row, mass * points["velocity"][:, 0], ROWS), np.bincount(row, mass, ROWS)])
    return sums


def profile(runs):
    """By row, each with its standard error over the runs: velocity, shear rate, share of points, fluctuation."""
    each = []
    for run in runs:
        sums = 0
        for path in sorted((run / "frames").glob("*.h5"))[round(BEGIN / EVERY):]:
            with h5py.File(path) as frame:
                sums = sums + look(frame)
        mass, momentum, points, count, squares = sums
        speed = momentum / mass
        each.append([speed, np.gradient(speed, ROW), points / mass, np.sqrt(squares / np.where(count > 0, count, np.nan))])
    return np.mean(each, axis=0), np.std(each, axis=0, ddof=1) / np.sqrt(len(each))


def table(folder):
    runs = {}
    for row in findings.rows(folder):
        runs.setdefault(row["method"], []).append(folder / "runs" / row["run"])
    (grains, grains_off), (hybrid, hybrid_off) = profile(runs["grains"]), profile(runs["hybrid"])
    lines = ["| height [mm] | share of points | velocity, grains [m/s] | hybrid | shear rate, grains [1/s] | hybrid | fluctuation, grains [mm/s] | hybrid |",
             "| --- " * 8 + "|"]
    for k in range(ROWS):
        said = [f"{one[q][k] * by:.{digits}f} ± {off[q][k] * by:.{digits}f}" if np.isfinite(one[q][k]) else ""
                for q, by, digits in ((0, 1, 3), (1, 1, 1), (3, 1e3, 0)) for one, off in ((grains, grains_off), (hybrid, hybrid_off))]
        lines.append(f"| {1e3 * ROW * (k + 0.5):.0f} | {hybrid[2][k]:.2f} | " + " | ".join(said) + " |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    findings.write(__doc__, "cold_grains", "cold_grains.py", table)
