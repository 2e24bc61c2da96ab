# SPDX-License-Identifier: MIT
"""A hybrid in a vessel that is closed all around: its surface is that of a void, if the scene says so. A drum that turns lifts grains and
continuum as it lifts grains alone."""
import csv
import math
import pathlib
import statistics

import lab
import rerun

DRUM = """
quern: 1
dimension: 2
seed: 1
gravity: [0, -9.81]
domain: {lower: [-48 mm, -48 mm], upper: [48 mm, 48 mm]}
time: {end: 1 s}
output: {every: 10 ms}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}
  contact: {linear: {stiffness: 5e5, restitution: 0.5, friction: 0.5}}
  fill: {region: {box: {lower: [-40 mm, -40 mm], upper: [40 mm, 10 mm]}}, settle: true}
bodies:
  - cylinder: {name: drum, centre: [0, 0], radius: 40 mm, inside: true, boundary: sticky, motion: {spin: -1 rad/s, about: [0, 0]}}
continuum: {cell: 4 mm, material: {mu_i: {critical_density: 1950, bulk_modulus: 1e5}}}
hybrid: {oracle: {packing_fraction: {depth: 14 mm, half_width: 5 mm, voids: true}}}
observe: [discrete_share, {repose: {from: -30 mm, to: 30 mm}}, {wall_torque: {body: drum}}]
"""
# a drum at rest, and all that a scene may say of surfaces
EVERYTHING = ["--set=bodies.0.cylinder.motion=null", "--set=time.end=10 ms", "--set=output.every=5 ms",
              "--set=hybrid.oracle.packing_fraction.closed=[upper_y]", "--set=hybrid.oracle.packing_fraction.bodies=[drum]"]


def surfaces(scene, place):
    """Without a surface all becomes continuum; a drum that is surface too keeps more grains than one that is not. What the resolved scene
    says of it is the same scene."""
    shares = {}
    for name, more in {"void": EVERYTHING[:3], "void and drum": EVERYTHING, "none": [*EVERYTHING[:3], "--set=hybrid.oracle.packing_fraction.voids=false"]}.items():
        said = lab.run(scene, place / name, *more)
        assert ("packing_fraction finds no surface" in said) == (name == "none"), said
        shares[name] = lab.summary(place / name)["observers"]["discrete_share"]["share"]["last"]
        rerun.again(place / name, f"surface: {name}, share of grains {shares[name]:.3f}")
    assert shares["none"] == 0 and 0.2 < shares["void"] < 0.6 and shares["void"] + 0.1 < shares["void and drum"] < 1, shares


def turned(scene, out, *options):
    """From half a second on, once the surface gives way again and again: its slope in the mean, in degrees, and the work of the drum."""
    lab.run(scene, out, *options)
    with open(out / "series.csv", newline="") as file:
        rows = [{key.split(" ")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)][-51:]
    return -math.degrees(statistics.mean(row["repose.angle"] for row in rows)), rows[-1]["wall_torque.work"] - rows[0]["wall_torque.work"]


def lifted(scene, place):
    """In the mean over three seeds: each has avalanches of its own. Friction of the continuum is the material's default here, not that of these
    grains."""
    mean = {}
    for model in ("grains", "all"):
        found = [turned(scene, place / f"{model}_{seed}", f"--set=model={model}", f"--set=seed={seed}") for seed in (1, 2, 3)]
        mean[model] = [statistics.mean(one) for one in zip(*found)]
        print(f"drum, model {model}: from 0.5 s on the surface leans by " + ", ".join(f"{angle:.1f}" for angle, _ in found)
              + " degrees, work " + ", ".join(f"{work:.4f}" for _, work in found) + " J")
    (angle, work), (hybrid_angle, hybrid_work) = mean["grains"], mean["all"]
    assert 15 < angle < 30 and abs(hybrid_angle - angle) < 3 and abs(hybrid_work / work - 1) < 0.1     # five seeds: 1.5 degrees, 1.3 % less


if __name__ == "__main__":
    with lab.workplace() as name:
        path = pathlib.Path(name) / "drum.yaml"
        path.write_text(DRUM)
        for test in (surfaces, lifted):
            test(path, pathlib.Path(name))
