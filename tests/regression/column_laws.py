# SPDX-License-Identifier: MIT
"""studies/columns/law.py on columns of its own making, whose run-outs follow known laws: it finds these laws, the time of arrival and the order in
which cells converge, and a seed of which columns are missing changes no law."""
import csv
import math
import pathlib
import subprocess
import sys

import lab

C, K, N, ARRIVES = 2.5, 3.0, 0.7, 3.0   # r = C a and K a^N; sqrt(H/g)
WIDTHS = {"0.5": 0.282, "1": 0.198, "2": 0.14, "4": 0.099, "6": 0.081, "8": 0.07}
TABLE = ["run", "status", "material", "aspect [1]", "cell [mm]", "seed [1]"]


def write_run(folder, width, aspect, runout):
    """A front that comes 95 % of its way at the time of arrival and stops at twice that."""
    folder.mkdir(parents=True)
    height, way = aspect * width, runout * width
    arrives = ARRIVES * math.sqrt(height / 9.81)
    with open(folder / "series.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time [s]", "runout.front [m]", "middle.height [m]"])
        for time, part in ((0, 0), (arrives / 2, 0.5), (arrives, 0.95), (2 * arrives, 1)):
            rows.writerow([repr(time), repr(width + part * way), repr(height / 2)])


def made(folder, without=()):
    """Columns in cells of 4, 2 and 1 mm, which run out less by 2 % of the square of the cell in mm; seeds differ by a thousandth."""
    table = []
    for cell in (4, 2, 1):
        for seed in (1, 2, 3):
            for case, width in WIDTHS.items():
                if (seed, case) in without:
                    continue
                aspect, run = float(case), f"{cell}-{seed}-{case}"
                law = C * aspect if aspect < 3 else K * aspect**N
                write_run(folder / "runs" / run, width, aspect, law * (1 - 0.02 * cell**2) * (1 + 0.001 * (seed - 2)))
                table.append([run, "done", "sand", case, cell, seed])
    with open(folder / "table.csv", "w", newline="") as file:
        csv.writer(file).writerows([TABLE, *table])
    return folder


def told(folder):
    """Rows of both tables by their first cells."""
    done = subprocess.run([sys.executable, str(lab.SOURCE / "studies/columns/law.py"), "--sweep", str(folder)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in done.stdout.splitlines() if line.startswith("|")]
    return {row[0]: row[1:] for row in rows if row[0].startswith("sand")}, {row[1]: row[2:] for row in rows if row[0] == "`sand`"}


def number(text):
    return float(text.split(" ± ")[0])


def near(value, expected, by, what):
    assert abs(value - expected) <= by * abs(expected), f"{what}: {value} is not {expected}"


with lab.workplace() as place:
    out = pathlib.Path(place)
    laws, orders = told(made(out / "whole"))
    for cell in (4, 2, 1):
        c, square, k, n, meet, time = laws[f"sand, {cell} mm"]
        less = 1 - 0.02 * cell**2
        near(number(c), C * less, 0.005, f"c in cells of {cell} mm")
        near(number(k), K * less, 0.005, f"k in cells of {cell} mm")
        near(number(n), N, 0.001, f"n in cells of {cell} mm")
        near(float(square), 1, 1e-4, "R²")
        near(number(meet), (K / C) ** (1 / (1 - N)), 0.01, "the aspect at which both meet")
        assert time == f"{ARRIVES:.2f} to {ARRIVES:.2f}", f"times of arrival: {time}"
    assert len(orders) == len(WIDTHS), f"aspects with an order: {sorted(orders)}"
    for case, row in orders.items():
        near(number(row[-1]), 2, 0.001, f"order at aspect {case}")
    broken, _ = told(made(out / "broken", without={(3, "0.5"), (3, "1"), (3, "6"), (3, "8")}))
    two, _ = told(made(out / "two", without={(3, case) for case in WIDTHS}))
    assert broken == two, f"a broken seed changes the laws: {broken}, {two}"
    none, _ = told(made(out / "none", without={(seed, "8") for seed in (1, 2, 3)}))
    assert not none, f"laws of columns that lack an aspect: {none}"
print("laws, times and orders of columns come back; seeds in part are left out of the laws")
