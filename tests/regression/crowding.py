# SPDX-License-Identifier: MIT
"""What is full is measured within the material: a column of grains that runs out into cells of continuum, of which the first one holds a grain's splash,
comes as far as its grains alone. (With that one cell as the measure all others were crowded, and were pressed until contacts gave way.)"""
import csv
import pathlib

import lab

SMALL = lab.sets(
    domain__upper="[0.8, 0.16]", time__end="0.25 s", observe="[{runout: {origin: 0}}, ledger]",
    grains__fill__0__region__box__upper="[0.8, -0.7 mm]", grains__fill__1__region__box__upper="[0.059, 0.13]",
    bodies__2__plane__point="[0.06, 0]", continuum__fill__region__box__upper="[0.06, 0.12]")
INTO = lab.sets(hybrid__oracle="[{fixed: {half_spaces: [{point: [0.1, 0], normal: [1, 0], zone: discrete}], ramp: 16 mm}}]")


def last(folder, *options):
    lab.run("column", folder, *SMALL, *options)
    with open(folder / "series.csv") as file:
        return {name.split(" [")[0]: float(value) for name, value in list(csv.DictReader(file))[-1].items() if value}


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        both, grains = last(place / "both", *INTO), last(place / "grains", "--set=model=grains")
        densest = lab.summary(place / "both")["sums"]["densest"]["value"]
    far, wanted, points = both["runout.front"], grains["runout.front"], both["points"]
    print(f"front {far:.4f} m, of grains {wanted:.4f}; {points:.0f} points; carried {both['ledger.carried']:+.1e}; densest {densest:.3f}")
    assert points > 500 and abs(both["ledger.carried"]) < 0.01
    assert abs(far / wanted - 1) < 0.05
    assert densest < 1.1
