#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""law - laws of run-out through the columns of studies/columns.yaml, or of studies/collapse.yaml.

    studies/columns/law.py [--sweep out/columns]
    studies/columns/law.py --sweep out/collapse     and how the run-out converges with the cell
    studies/columns/law.py --sweep out/affine     that alone: laws take columns of all aspects
    studies/columns/law.py --sweep out/fine       both, with drucker_prager in cells down to 1 mm

The aspect is a = H/L with the width L of the column before the gate goes and H twice the height below
which half of its mass lies; the run-out is r = (front - L)/L at the end. Broad columns: r = c a through a <= 2, with R^2 of that line. Slender ones:
r = k a^n through a >= 4, by least squares of the logarithms. Errors are those over seeds, by leaving out one at a time (jackknife). `meet` is the aspect at
which both laws say the same, `time` when the front has come 95 % of its way, in sqrt(H/g), for aspects
of 1 and more. Seeds of which a column is missing, as where a sweep was stopped, are left out of the laws."""
import argparse
import csv
import math
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import findings  # noqa: E402: found there
GRAVITY, MOST_BROAD, LEAST_SLENDER = 9.81, 2.5, 3.5
WIDTH = {"0.5": 0.282, "1": 0.198, "2": 0.14, "4": 0.099, "6": 0.081, "8": 0.07}  # m, of the cases of studies/columns.yaml


def columns_of(run):
    """The columns of a run's series by their names."""
    with open(run / "series.csv") as file:
        header, *rows = csv.reader(file)
    return {name.split(" [")[0]: [float(row[k]) if row[k] else math.nan for row in rows] for k, name in enumerate(header)}


def look(run, width):
    """Aspect, run-out and time of arrival of one run."""
    series = columns_of(run)
    front, height = series["runout.front"], 2 * series["middle.height"][0]
    near = width + 0.95 * (front[-1] - width)
    k = next(k for k, x in enumerate(front) if x >= near)
    time = series["time"]
    arrived = time[k - 1] + (time[k] - time[k - 1]) * (near - front[k - 1]) / (front[k] - front[k - 1])
    return height / width, (front[-1] - width) / width, arrived / math.sqrt(height / GRAVITY)


def found(folder):
    """For each method and seed, by the case of the aspect: aspect, run-out and time."""
    by = {}
    for row in findings.rows(folder):
        seeds = by.setdefault(name_of(row), {})
        case = f"{float(row['aspect']):g}"
        seeds.setdefault(row["seed"], {})[case] = look(folder / "runs" / row["run"], WIDTH[case])
    return by


def name_of(row):
    """Of the method of a run: all axes but the aspect, or that of the reference."""
    if row.get("model"):
        return row["model"]
    return ", ".join(f"{float(row[axis]):g} mm" if axis == "cell" else row[axis] for axis in ("method", "material", "cell") if row.get(axis))


def laws(columns):
    """c, R^2, k, n, the aspect at which both laws meet."""
    broad = [(a, r) for a, r, _ in columns if a < MOST_BROAD]
    c = sum(a * r for a, r in broad) / sum(a * a for a, _ in broad)
    mean = sum(r for _, r in broad) / len(broad)
    square = 1 - sum((r - c * a) ** 2 for a, r in broad) / sum((r - mean) ** 2 for _, r in broad)
    slender = [(math.log(a), math.log(r)) for a, r, _ in columns if a > LEAST_SLENDER]
    am, rm = (sum(one[k] for one in slender) / len(slender) for k in (0, 1))
    n = sum((a - am) * (r - rm) for a, r in slender) / sum((a - am) ** 2 for a, _ in slender)
    k = math.exp(rm - n * am)
    return c, square, k, n, (k / c) ** (1 / (1 - n))


def jackknife(values):
    n = len(values)
    mean = sum(values) / n
    return math.sqrt((n - 1) / n * sum((x - mean) ** 2 for x in values))


def table(by):
    rows = ["| method | c | R² | k | n | meet | time |", "|---|---|---|---|---|---|---|"]
    for method, seeds in sorted(by.items(), key=lambda item: item[0] != "grains"):
        whole = laws([one for columns in seeds.values() for one in columns.values()])
        parts = [laws([one for seed, columns in seeds.items() if seed != out for one in columns.values()]) for out in seeds if len(seeds) > 1]
        cells = [f"{value:.3g}" + (f" ± {jackknife([part[k] for part in parts]):.2g}" if parts else "") if k != 1 else f"{value:.4f}" for k, value in enumerate(whole)]
        times = [one[2] for columns in seeds.values() for one in columns.values() if one[0] > 0.8]
        rows.append(f"| {method} | {' | '.join(cells)} | {min(times):.2f} to {max(times):.2f} |")
    return "\n".join(rows) + "\n"


def mean_of(values):
    """The mean and its standard error; infinite of one value alone."""
    n = len(values)
    mean = sum(values) / n
    return mean, math.sqrt(sum((x - mean) ** 2 for x in values) / (n - 1) / n) if n > 1 else math.inf


def order_of(three):
    """log2 of one difference over the next, and its error, of three means with theirs; nothing where the last two may be equal: 95 % of Student's
    distribution with four degrees of freedom, as three seeds of two cells have, lie within 2.8 errors."""
    (coarse, c), (middle, m), (fine, f) = three
    first, last = coarse - middle, middle - fine
    if not abs(last) > 2.8 * math.hypot(m, f):
        return ""
    if first * last <= 0:
        return "to and fro"
    error = math.hypot(c / first, m * (1 / first + 1 / last), f / last) / math.log(2)
    return f"{math.log2(first / last):.1f} ± {error:.1f}"


def cases_of(by):
    return {case for seeds in by.values() for columns in seeds.values() for case in columns}


def whole_seeds(by):
    """Methods and their seeds of which all columns are there."""
    whole = {method: {seed: columns for seed, columns in seeds.items() if set(columns) == set(WIDTH)} for method, seeds in by.items()}
    return {method: seeds for method, seeds in whole.items() if seeds}


def cells_of(by):
    """Widths of cells in mm, the coarsest first."""
    return sorted({name.rpartition(", ")[2].removesuffix(" mm") for name in by}, key=float, reverse=True)


def convergence(by):
    """Run-outs of each aspect by cell, and the order in which the last two are nearer than the two before."""
    cells = cells_of(by)
    rows = [f"| material | aspect | {' | '.join(f'{cell} mm' for cell in cells)} | order |", "|---|---|" + "---|" * len(cells) + "---|"]
    for material in sorted({name.rpartition(", ")[0] for name in by}, reverse=True):
        for case in sorted(cases_of(by), key=float):
            found = [mean_of([columns[case][1] for columns in by[f"{material}, {cell} mm"].values() if case in columns]) for cell in cells]
            rows.append(f"| `{material}` | {case} | {' | '.join(f'{mean:.3f} ± {error:.3f}' for mean, error in found)} | {order_of(found[-3:])} |")
    return "\n".join(rows) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweep", type=pathlib.Path, default=ROOT / "out/columns")
    by = found(parser.parse_args().sweep)
    whole = whole_seeds(by)
    if whole:
        print(table(whole), end="")
    if all(" mm" in name for name in by):
        print(f"\n{convergence(by)}", end="")


if __name__ == "__main__":
    main()
