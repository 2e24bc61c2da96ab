#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""fits - friction and packing fraction over the inertial number, through what studies/plane_shear.yaml has found.

    studies/plane_shear/fits.py [--sweep out/plane_shear] [--page docs/validation/plane_shear.md]

Writes between the marks of the page. Straight lines are by least squares over I <= 0.1, the curve mu_s + (mu_2 - mu_s)/(I_0/I + 1) over all I, each
seed by itself: a constant is the mean over seeds, with the standard deviation between them. I is that of the normal stress that was there."""
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
PRESSURE = 0.01  # Pa, times 1/I^2: of the study
CRUZ = np.sqrt(np.pi) / 2  # I of da Cruz et al., with the root of a disc's mass, over ours


def found(folder):
    """By seed: I asked, friction, packing fraction, normal stress over what was asked, and I, each by I asked."""
    seeds = {}
    for row in findings.rows(folder):
        at = float(row["inertial_number"])
        normal = float(row["normal"]) + float(row["normal_kinetic"])
        shear = float(row["shear"]) + float(row["shear_kinetic"])
        over = normal * at ** 2 / PRESSURE
        seeds.setdefault(int(row["seed"]), []).append((at, -shear / normal, float(row["packing"]), over, at / np.sqrt(over)))
    return {seed: np.array(sorted(rows)).T for seed, rows in seeds.items()}


def straight(x, y):
    """Value at 0 and slope."""
    few = x <= 0.1 * 1.05
    slope, start = np.polyfit(x[few], y[few], 1)
    return start, slope


def bent(x, y):
    """mu_s, mu_2 and I_0: for each I_0 the other two are those of a straight line over 1/(I_0/I + 1)."""
    def line(at):
        share = x / (at + x)
        slope, start = np.polyfit(share, y, 1)
        return np.sum((start + slope * share - y) ** 2), start, start + slope

    low, high = np.log(1e-3), np.log(100)
    for _ in range(60):
        grid = np.linspace(low, high, 21)
        best = int(np.argmin([line(np.exp(at))[0] for at in grid]))
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, 20)]
    at = np.exp((low + high) / 2)
    return (*line(at)[1:], at)


def spread(values, digits=3):
    return f"{np.mean(values):.{digits}f} ± {np.std(values, ddof=1):.{digits}f}"


def tables(seeds):
    each = list(seeds.values())
    rows = ["| I asked | normal stress over what was asked | friction | packing fraction |", "|---|---|---|---|"]
    for k, at in enumerate(each[0][0]):
        rows.append(f"| {at:g} | " + " | ".join(spread([of[c][k] for of in each], digits) for c, digits in ((3, 3), (1, 4), (2, 4))) + " |")
    friction = np.array([straight(of[4], of[1]) for of in each])
    packing = np.array([straight(of[4], of[2]) for of in each])
    curve = np.array([bent(of[4], of[1]) for of in each])
    rows += ["", "| what | here | da Cruz et al. (2005) |", "|---|---|---|",
             f"| friction at I = 0, by the line over I ≤ 0.1 | {spread(friction[:, 0])} | 0.25 |",
             f"| its slope over I | {spread(friction[:, 1])} | |",
             f"| its slope over their I | {spread(friction[:, 1] / CRUZ)} | 1.1 |",
             f"| packing fraction at I = 0, by the line over I ≤ 0.1 | {spread(packing[:, 0], 4)} | 0.81 |",
             f"| its slope over I | {spread(packing[:, 1])} | |",
             f"| its slope over their I | {spread(packing[:, 1] / CRUZ)} | -0.3 |",
             f"| μ_s of the curve over all I | {spread(curve[:, 0])} | |",
             f"| μ_2 | {spread(curve[:, 1])} | |",
             f"| I_0 | {spread(curve[:, 2])} | |"]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    findings.write(__doc__, "plane_shear", "fits", lambda folder: tables(found(folder)))
