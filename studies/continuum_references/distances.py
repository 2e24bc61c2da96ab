#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""distances - of the columns of studies/continuum_references.yaml from those in cells of 1 mm by each of four settings.

    studies/continuum_references/distances.py [--sweep out/continuum_references] [--page docs/validation/continuum-cost.md]

A distance and its error are those of studies/continuum_cost.yaml: of profiles along the floor at the end, `norm: share` (docs/studies.md)."""
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "python")]
import findings  # noqa: E402: found there
import numpy as np  # noqa: E402
from quern.errors import error, standard_error  # noqa: E402
from quern.runs import Series  # noqa: E402

FINE = ["gimp, affine, 1 mm", "gimp, velocity alone, 1 mm", "bspline, affine, 1 mm", "bspline, velocity alone, 1 mm"]


def profile_of(run):
    series = Series(run / "series.csv")
    return np.array([series[name][-1] for name in series if name.startswith("profile.density_")])


def found(folder):
    """Profiles by material, setting and seed. A reference has no setting."""
    by = {}
    for row in findings.rows(folder):
        by.setdefault(row["material"], {}).setdefault(row["setting"] or FINE[0], {})[row["seed"]] = profile_of(folder / "runs" / row["run"])
    return by


def compared(own, fine):
    """In per cent, over the seeds that both have."""
    seeds = [seed for seed in own if seed in fine]
    runs, twins = (np.array([profiles[seed] for seed in seeds]) for profiles in (own, fine))
    return f"{100 * error(runs, twins, 'share'):.2f} ± {100 * standard_error(runs, twins, 'share'):.2f}"


def table(folder):
    text = ""
    for material, settings in found(folder).items():
        missing = [name for name in FINE if name not in settings]
        if missing:
            sys.exit(f"{folder}: no run of {material} by {missing[0]} has come to its end")
        text += f"| {material}, off by, % | " + " | ".join(FINE) + " |\n|---|" + "---|" * len(FINE) + "\n"
        for name, own in settings.items():
            text += f"| {name} | " + " | ".join("" if name == fine else compared(own, settings[fine]) for fine in FINE) + " |\n"
        text += "\n"
    return text


if __name__ == "__main__":
    findings.write(__doc__, "continuum_references", "distances", table, page="continuum-cost")
