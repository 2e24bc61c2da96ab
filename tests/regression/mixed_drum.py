# SPDX-License-Identifier: MIT
"""Sand and steel in a closed drum that turns, for 100 000 steps: every grain is there at the end, of its material and with its mass, none is
outside, the budget of energy closes over what the drum has done, and the small and dense ones have gone to the core. In 2-D over three
seeds, and once in 3-D."""
import csv
import math
import pathlib
import statistics

import h5py
import numpy

import lab

SCENE = """
quern: 1
dimension: {dim}
seed: {seed}
gravity: {gravity}
domain: {{lower: {lower}, upper: {upper}}}
time: {{end: {end}, step: {step}}}
grains:
  materials:
    sand: {{density: 2500, radius: {{mean: 2 mm, spread: 10 %}}}}
    steel: {{density: 7800, radius: {{mean: {steel}}}}}
  contact: {{linear: {{stiffness: {stiffness}, restitution: 0.5, friction: 0.5}}}}
  pairs: [{{between: [steel, steel], restitution: 0.8, friction: 0.2}}]
  fill: {{region: {{box: {{lower: {lower}, upper: {middle}}}}}, mix: {{sand: 50 %, steel: 50 %}}, settle: true}}
bodies:
  - cylinder: {{name: drum, centre: {centre}, radius: {radius}, {cylinder}inside: true, motion: {{spin: {spin}, {axis}about: {centre}}}}}
output: {{every: {every}, fields: [grain.mass, grain.material, grain.velocity]}}
observe: [energy]
"""
# The drum turns so fast that grains roll and fall in a thick layer, Fr = spin^2 radius/g = 0.05; 1.7 turns in 2-D, 1.8 in 3-D.
PLANE = dict(dim=2, gravity="[0, -9.81]", lower="[-0.04, -0.04]", upper="[0.04, 0.04]", middle="[0.04, 0]", centre="[0, 0]", steel="1.2 mm",
             stiffness=2.5e5, radius=0.04, cylinder="", axis="", spin=-3.5, step=3e-5, end=3, every=0.12)
SPACE = dict(dim=3, gravity="[0, -9.81, 0]", lower="[-0.022, -0.022, -0.006]", upper="[0.022, 0.022, 0.006]", middle="[0.022, 0, 0.006]",
             centre="[0, 0, 0]", steel="1.3 mm", stiffness=700, radius=0.022, cylinder="length: 12 mm, ", axis="axis: [0, 0, 1], ", spin=-4.5,
             step=2.5e-5, end=2.5, every=0.1)


def scene(place, values, seed=1):
    path = place / f"{values['dim']}_{seed}.yaml"
    path.write_text(SCENE.format(**values, seed=seed))
    return path


def read(path):
    """What is known of all grains, in the order of their ids."""
    with h5py.File(path) as file:
        grains = {name: file[f"grains/{name}"][:] for name in ("id", "position", "radius", "mass", "material")}
    order = numpy.argsort(grains["id"])
    return {name: column[order] for name, column in grains.items()}


def apart(grains):
    """How much farther from the drum's axis sand lies than steel, both by volume, m."""
    distance = numpy.hypot(grains["position"][:, 0], grains["position"][:, 1])
    volume = grains["mass"] / numpy.array([2500, 7800])[grains["material"]]
    sand, steel = (numpy.average(distance[grains["material"] == k], weights=volume[grains["material"] == k]) for k in (0, 1))
    return sand - steel


def look(out, values):
    """Nothing is lost; returns how far apart both materials are at first and at last, and the error of the budget over the drum's work."""
    assert lab.summary(out)["status"] == "done" and lab.summary(out)["steps"] == 100000
    frames = [read(path) for path in lab.frames(out)]
    for grains in frames[1:]:
        for name in ("id", "material", "mass", "radius"):
            assert grains[name].tobytes() == frames[0][name].tobytes(), f"{out.name}: {name} of a grain is not what it was"
        distance = numpy.hypot(grains["position"][:, 0], grains["position"][:, 1]) + grains["radius"]
        assert distance.max() < values["radius"] + 0.1 * grains["radius"].min(), f"{out.name}: a grain is {distance.max():.5f} m from the axis"
        if values["dim"] == 3:
            assert (abs(grains["position"][:, 2]) + grains["radius"]).max() < 0.006 + 0.1 * grains["radius"].min()
    with open(out / "series.csv", newline="") as file:
        rows = [{key.split(" ")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    work = -rows[-1]["energy.driven"]
    off = (rows[-1]["energy.budget"] - rows[0]["energy.budget"]) / work
    last = frames[-len(frames) // 3:]
    many = [int((frames[0]["material"] == k).sum()) for k in (0, 1)]
    found = apart(frames[0]), statistics.mean(apart(grains) for grains in last), off
    print(f"{out.name}: {many[0]} grains of sand, {many[1]} of steel, all there; work of the drum {work:.4g} J, budget off by {off:.1e} of it; "
          f"steel nearer to the axis by {1e3 * found[0]:+.2f} mm at first, {1e3 * found[1]:+.2f} mm at last")
    assert min(many) > 50 and work > 0 and abs(off) < 2e-3
    return found


def plane(place):
    """Three seeds: well mixed at first, by far not at last."""
    found = []
    for seed in (1, 2, 3):
        out = place / f"2-D, seed {seed}"
        lab.run(scene(place, PLANE, seed), out)
        found.append(look(out, PLANE))
    first, last = ([one[k] for one in found] for k in (0, 1))
    error = statistics.stdev(last) / math.sqrt(3)
    print(f"core of steel: {1e3 * statistics.mean(first):+.2f} mm at first, {1e3 * statistics.mean(last):+.2f} mm at last, standard error {1e3 * error:.2f} mm")
    assert abs(statistics.mean(first)) < 1e-3 and statistics.mean(last) > 2e-3 and statistics.mean(last) - statistics.mean(first) > 4 * error


def space(place):
    lab.run(scene(place, SPACE), place / "3-D")
    first, last, _ = look(place / "3-D", SPACE)
    assert last - first > 0.5e-3


def bits(place):
    """Of the first 2000 steps."""
    for values in (PLANE, SPACE):
        path, short = scene(place, values), [f"--set=time.end={2000 * values['step']:g}", "--set=output.every=0.01"]
        one, two = (place / f"bits_{values['dim']}_{threads}" for threads in (1, 2))
        lab.run(path, one, *short)
        lab.run(path, two, *short, "--set=run.batch=8", threads=2)
        lab.same(one, two, f"{values['dim']}-D, 2 threads")


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (plane, space, bits):
            test(pathlib.Path(name))
