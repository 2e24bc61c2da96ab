#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""beverloo - Beverloo's law through the rates that studies/silo.yaml has found.

    studies/silo/beverloo.py [--sweep out/silo] [--page docs/validation/silo.md]

Writes between the marks of the page. W^(2/3) is a straight line over the width L: its zero is at k D, and its slope gives C in
W = C rho_b sqrt(g) (L - k D)^(3/2). R^2 is that of the line."""
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
DENSITY, DIAMETER, GRAVITY = 2008, 2e-3, 9.81  # of configs/silo.yaml


def rates(folder):
    """Widths in m and mean rates in kg/s, by method."""
    found = {}
    for row in findings.rows(folder):
        method = row["model"] or row["method"]
        found.setdefault(method, {}).setdefault(float(row["opening"]) * DIAMETER, []).append(float(row["rate"]))
    return {method: sorted((width, sum(w) / len(w)) for width, w in by.items()) for method, by in found.items()}


def straight(points):
    """Slope, zero and R^2 of y over x by least squares."""
    n = len(points)
    xm, ym = (sum(point[k] for point in points) / n for k in (0, 1))
    xx, xy, yy = (sum((p[a] - m) * (p[b] - o) for p in points) for a, b, m, o in ((0, 0, xm, xm), (0, 1, xm, ym), (1, 1, ym, ym)))
    return xy / xx, xm - ym * xx / xy, xy * xy / (xx * yy)


def table(folder):
    rows = ["| method | C | k | R² |", "|---|---|---|---|"]
    for method, points in rates(folder).items():
        slope, zero, square = straight([(width, rate ** (2 / 3)) for width, rate in points])
        rows.append(f"| {method} | {slope ** 1.5 / (DENSITY * math.sqrt(GRAVITY)):.3f} | {zero / DIAMETER:.2f} | {square:.5f} |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    findings.write(__doc__, "silo", "beverloo", table)
