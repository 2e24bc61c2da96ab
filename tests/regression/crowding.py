# SPDX-License-Identifier: MIT
"""What is full is measured within the material. A column of grains that runs out into cells of continuum, of which the first one holds a grain's splash, is as far
as its grains alone while it falls. (With that one cell as the measure all others were crowded, and were pressed until contacts gave way.) A column that is all
continuum is measured where its surface is not. Sand that falls or flows has the density without stress for what is full."""
import csv
import pathlib

import h5py

import lab

SMALL = lab.sets(
    domain__upper="[0.8, 0.16]", time__end="0.25 s", output__fields="[total.full]", observe="[{runout: {origin: 0}}, ledger]",
    grains__fill__0__region__box__upper="[0.8, -0.7 mm]", grains__fill__1__region__box__upper="[0.059, 0.13]",
    bodies__2__plane__point="[0.06, 0]", continuum__fill__region__box__upper="[0.06, 0.12]")
ALONE = ["--set=model=grains", "--set=output.fields=[]"]


def drawn(face):
    """Grains to the left of it, continuum to the right."""
    return lab.sets(hybrid__oracle=f"[{{fixed: {{half_spaces: [{{point: [{face}, 0], normal: [1, 0], zone: discrete}}], ramp: 16 mm}}}}]")


def last(folder, *options):
    lab.run("column", folder, *SMALL, *options)
    with open(folder / "series.csv") as file:
        return {name.split(" [")[0]: float(value) for name, value in list(csv.DictReader(file))[-1].items() if value}


def full(folder):
    """Of the last frame."""
    with h5py.File(lab.frames(folder)[-1]) as file:
        return float(file["total/full"][()].item())


def runs_into_continuum(place):
    both, grains = last(place / "both", *drawn(0.1)), last(place / "grains", *ALONE)
    densest, measure = lab.summary(place / "both")["sums"]["densest"]["value"], full(place / "both")
    far, wanted, points = both["runout.front"], grains["runout.front"], both["points"]
    print(f"front {far:.4f} m, of grains {wanted:.4f}; {points:.0f} points; carried {both['ledger.carried']:+.1e}; densest {densest:.3f}; full {measure}")
    assert points > 500 and abs(both["ledger.carried"]) < 0.01
    assert abs(far / wanted - 1) < 0.05 and densest < 1.1
    assert measure == 1


def surfaces_do_not_count(place):
    """A bed between walls that is all continuum, one whose continuum lies deep, and one that has few cells of it."""
    found = []
    for name, zones in (("all", drawn(-1)), ("deep", []), ("few", drawn(0.04))):
        last(place / name, "--set=time.end=1 ms", "--set=bodies.2.plane.while=always", *zones)
        found.append(full(place / name))
    print(f"full, of a bed that is all continuum, where continuum lies deep, and where there is little of it: {found}")
    assert max(found) - min(found) < 0.005 and min(found) > 1


def falling_is_not_full(place):
    """Grains that nobody let settle are looser than the continuum; they end as dense as others."""
    last(place / "loose", "--set=time.end=20 ms", "--set=grains.fill.1.settle=false", "--set=bodies.2.plane.while=always", *drawn(-1))
    value = full(place / "loose")
    print(f"full, of grains that fall: {value:.4f}")
    assert value == 1


def poured_is_not_full(place):
    """Sand of a heap has not settled when its continuum begins. Once it lies, its cells are a little denser than the continuum without stress."""
    lab.run("pile", place / "poured", *lab.sets(time__end="0.95 s", output__fields="[total.full]"))
    value = full(place / "poured")
    print(f"full, of a heap: {value:.4f}")
    assert lab.summary(place / "poured")["points"] > 100 and value == 1


if __name__ == "__main__":
    with lab.workplace() as name:
        runs_into_continuum(pathlib.Path(name))
        surfaces_do_not_count(pathlib.Path(name))
        falling_is_not_full(pathlib.Path(name))
        poured_is_not_full(pathlib.Path(name))
