#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""jumps - what friction lacks of mu(I) while volume changes, after each jump of studies/plane_shear/jumps.yaml.

    studies/plane_shear/jumps.py [--sweep out/jumps] [--page docs/validation/jumps.md]

Writes between the marks of the page. With the stress of contacts and of velocities: p is the mean of both normal stresses, friction what the stress bears along the strain rate less its
trace, over p. That rate is the box's shear and its stretch across. psi is the rate at which the volume grows over that of all shear, and I that of all shear and p. mu(I) and the density of
steady flow are straight lines, over log I and over I, between what the last two fifths of the stages show; at I = 0.003 these are shears of 0.13 to 0.21. Means over the seeds of what stands above and
below each quotient. The slope of friction over psi is that of each seed by itself, with one mu(I) for all, and its error that of their mean."""
import csv
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
STAGES = ((6, 0.3), (5, 0.03), (4, 0.3), (7, 0.003), (4, 0.3), (5, 0.01), (4, 0.1), (5, 0.01), (4, 0.1), (7, 0.003), (5, 0.03), (10, 0.01))  # s, I
STRAINS = (0.01, 0.02, 0.03, 0.06, 0.1, 0.17, 0.3, 0.55, 1)  # shear of the box since the jump
FROM = (0.03, 0.06)  # slopes are taken from there on
RATE = 10  # 1/s for each unit of I, at 1 Pa


def series(run):
    """Time, and the columns shear stress, normal stresses along and across, packing fraction."""
    with open(run / "series.csv") as file:
        header, *rows = csv.reader(file)
    at = {name.split(" [")[0]: k for k, name in enumerate(header)}
    values = np.array([[float(x) if x else np.nan for x in row] for row in rows])
    of = lambda name: values[:, at[f"stress.{name}"]] + values[:, at[f"stress.kinetic_{name}"]]  # noqa: E731
    return values[:, at["time"]], np.stack([-of("xy"), of("xx"), of("yy"), values[:, at["box.packing"]]], axis=1)


def quotients(xy, xx, yy, swell=0):
    """p and friction, where the box swells by so much for each unit of its shear."""
    p = (xx + yy) / 2
    return p, (xy - swell * (yy - xx) / 2) / np.hypot(1, swell) / p


def steady(time, values):
    """I, friction and packing fraction of steady flow, from the last two fifths of the stages."""
    seen, begin = {}, 0
    for length, inertial in STAGES:
        end = begin + length
        mean = values[(time > begin + 0.6 * length) & (time <= end)].mean(axis=0)
        p, friction = quotients(*mean[:3])
        seen.setdefault(inertial, []).append((inertial / np.sqrt(p), friction, mean[3]))
        begin = end
    return np.array([np.mean(seen[one], axis=0) for one in sorted(seen)]).T


def looks(time, values, law):
    """For each jump and step of strain: I before and after, strain, friction less mu(I), psi, and density over that of steady flow, less one."""
    number, friction, packing = law
    begin = STAGES[0][0]
    for (_, before), (length, inertial) in zip(STAGES, STAGES[1:]):
        for low, high in zip(STRAINS, STRAINS[1:]):
            first, last = begin + np.array((low, high)) / (RATE * inertial)
            within = (time > first) & (time <= last)
            if last > begin + length or within.sum() < 3:
                continue
            mean, (a, b) = values[within].mean(axis=0), np.flatnonzero(within)[[0, -1]]
            swell = -np.log(values[b, 3] / values[a, 3]) / (RATE * inertial * (time[b] - time[a]))
            p, bears = quotients(*mean[:3], swell)
            here = np.clip(inertial * np.hypot(1, swell) / np.sqrt(p), number[0], number[-1])
            yield (before, inertial, (low + high) / 2, bears - np.interp(np.log(here), np.log(number), friction), swell / np.hypot(1, swell),
                   mean[3] / np.interp(here, number, packing) - 1)
        begin += length


def slope(rows, falls, least):
    """Of what friction lacks over psi, through nothing, where the rate has fallen, or risen, and the box has been sheared so far."""
    few = np.array([row for row in rows if (row[1] < row[0]) == falls and row[2] > least])
    return few[:, 4] @ few[:, 3] / (few[:, 4] @ few[:, 4])


def table(folder):
    runs = [series(folder / "runs" / row["run"]) for row in findings.rows(folder)]
    time, law = runs[0][0], steady(runs[0][0], np.mean([values for _, values in runs], axis=0))
    lines = ["| I before | after | shear since | friction less mu(I) | psi | off in density, % |", "| --- | --- | --- | --- | --- | --- |"]
    for before, after, strain, lack, psi, off in looks(time, np.mean([values for _, values in runs], axis=0), law):
        lines.append(f"| {before:g} | {after:g} | {strain:.3f} | {lack:+.3f} | {psi:+.3f} | {100 * off:+.2f} |")
    each = [list(looks(*one, law)) for one in runs]
    for falls, word in ((True, "falls"), (False, "rises")):
        for least in FROM:
            slopes = [slope(rows, falls, least) for rows in each]
            lines.append(f"\nWhere the rate {word}, from a shear of {least:g} on: {np.mean(slopes):.2f} ± {np.std(slopes, ddof=1) / np.sqrt(len(slopes)):.2f} times psi.")
    number, friction, packing = law
    lines.append("\nSteady: " + ", ".join(f"friction {f:.3f}, packing fraction {v:.4f} at I = {i:.3g}" for i, f, v in zip(number, friction, packing)) + ".")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    findings.write(__doc__, "jumps", "jumps.py", table)
