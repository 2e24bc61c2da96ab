# SPDX-License-Identifier: MIT
"""A continuum alone that fills holes between its points and joins those that crowd: mass stays, and the bits are the same for any number of threads,
batch and instruction set, and across a stop; a hybrid, which has its own way, refuses it."""
import pathlib

import flow
import lab

FIELDS = "--set=output.fields=[point.velocity, point.stress, point.volume, point.mass]"
SCENES = {
    "a column with a source and an open face": ("column", [*flow.CONTINUUM, *lab.sets(continuum__transfer="apic"), FIELDS]),
    "a column that spreads, drucker_prager": ("column", [*lab.SMALL["column"], *lab.sets(
        model="continuum", time__end="150 ms", output__every="10 ms", continuum__fill="{region: {box: {lower: [0, 0], upper: [0.04, 0.12]}}}",
        continuum__material="{drucker_prager: {bulk_modulus: 1e5, density: 2000, friction: 0.3}}"), FIELDS]),
    "points whose volume is averaged over cells": ("column", [*flow.CONTINUUM, *lab.sets(continuum__strain="averaged"), FIELDS]),
    "in three dimensions": ("column_3d", [*lab.SMALL["column_3d"], *lab.sets(model="continuum", time__end="120 ms", output__every="10 ms"), FIELDS])}


def points(folder):
    header, rows = lab.series(folder)
    return [row[header.index("points [1]")] for row in rows]


def check(name, scene, options, folder):
    base, alone = folder / "base", folder / "alone"
    resampled = [*options, "--set=continuum.resample=5"]
    lab.run(scene, alone, *options)
    lab.run(scene, base, *resampled)
    s = lab.summary(base)
    assert abs(s["mass_defect"]) < 1e-12, f"{name}: mass is off by {s['mass_defect']}"
    differ = sum(a != b for a, b in zip(points(alone), points(base), strict=True))
    assert differ > 3, f"{name}: nothing is filled or joined"
    print(f"{name}: {s['steps']} steps, {points(alone)[-1]:.0f} points, {points(base)[-1]:.0f} where they are looked after")
    lab.same_ways(scene, base, folder, *resampled, levels=("v1", "v3"))
    out = folder / "stopped"
    lab.run(scene, out, *resampled, "--until", "23 ms")
    lab.run(scene, out, *resampled, resume=True)
    lab.same(base, out, "a stop on the way")


if __name__ == "__main__":
    with lab.workplace() as place:
        for number, (name, (scene, options)) in enumerate(SCENES.items()):
            (pathlib.Path(place) / str(number)).mkdir()
            check(name, scene, options, pathlib.Path(place) / str(number))
        said = lab.run("column", pathlib.Path(place) / "hybrid", *lab.SMALL["column"], "--set=continuum.resample=5", status=2)
        assert "continuum.resample" in said and "hybrid.update" in said, said
