#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""distances - of the columns of studies/continuum_references.yaml from those in cells of 1 mm by each of four settings.

    studies/continuum_references/distances.py [--sweep out/continuum_references] [--page docs/validation/continuum-cost.md]

A distance is that of studies/continuum_cost.yaml: of the mean profiles over seeds, the sum over slabs of the difference of shares of mass along the floor, at the end, so
that what lies elsewhere counts twice. Errors are those over the seeds of what is compared, by leaving out one at a time (jackknife)."""
import csv
import math
import pathlib
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there

FINE = ["gimp, affine, 1 mm", "gimp, velocity alone, 1 mm", "bspline, affine, 1 mm", "bspline, velocity alone, 1 mm"]


def profile_of(run):
    """Shares of the mass in the slabs along the floor, at the end of a run."""
    with open(run / "series.csv") as file:
        header, *rows = csv.reader(file)
    own = [float(rows[-1][k]) for k, name in enumerate(header) if name.startswith("profile.density_")]
    return [value / sum(own) for value in own]


def distance(one, other):
    return sum(abs(a - b) for a, b in zip(one, other))


def found(folder):
    """Profiles by material and setting. A reference has no setting."""
    by = {}
    for row in findings.rows(folder):
        by.setdefault(row["material"], {}).setdefault(row["setting"] or FINE[0], []).append(profile_of(folder / "runs" / row["run"]))
    return by


def mean_of(profiles):
    return [statistics.mean(values) for values in zip(*profiles)]


def compared(profiles, fine):
    """Distance of the mean from a fine setting, and its error, in per cent."""
    n = len(profiles)
    whole = distance(mean_of(profiles), fine)
    without = [distance(mean_of(profiles[:k] + profiles[k + 1:]), fine) for k in range(n)] if n > 1 else []
    error = math.sqrt((n - 1) / n * sum((value - statistics.mean(without)) ** 2 for value in without)) if without else math.nan
    return f"{100 * whole:.2f} ± {100 * error:.2f}"


def table(folder):
    text = ""
    for material, settings in found(folder).items():
        missing = [name for name in FINE if name not in settings]
        if missing:
            sys.exit(f"{folder}: no run of {material} by {missing[0]} has come to its end")
        fine = [mean_of(settings[name]) for name in FINE]
        text += f"| {material}, off by, % | " + " | ".join(FINE) + " |\n|---|" + "---|" * len(FINE) + "\n"
        for name, profiles in settings.items():
            text += f"| {name} | " + " | ".join("" if name == own else compared(profiles, other) for own, other in zip(FINE, fine)) + " |\n"
        text += "\n"
    return text


if __name__ == "__main__":
    findings.write(__doc__, "continuum_references", "distances", table, page="continuum-cost")
