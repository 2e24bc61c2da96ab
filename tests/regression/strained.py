# SPDX-License-Identifier: MIT
"""A box that is strained leaves the same bits for any number of threads, batch, instruction set and compiler, and wherever it is stopped:
under a pressure and in shear that a stage turns back, in two dimensions, and on its way to a packing fraction, in three. What it has made
of grains is a state that another scene starts from, and observers that count images of the domain say that they do not know it."""
import pathlib

import cache
import h5py
import lab

SHEAR = ["--set=time.end=0.16 s", "--set=output.every=20 ms", "--set=output.fields=[grain.velocity, contact.force, total.box_length]",
         "--set=stages=[{for: 75 ms}, {set: {grains.box: {shear: -2 1/s, pressure: 2 Pa, along: all}}}]"]
PACK = """
quern: 1
dimension: 3
seed: 3
gravity: [0, 0, 0]
domain: {lower: [0, 0, 0], upper: [20 mm, 20 mm, 20 mm], periodic: [true, true, true]}
time: {end: 10 ms}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 20 %, law: uniform}}
  contact: [{hertz: {young: 1e7 Pa, impact_speed: 1 m/s, friction: 0.3}}, {rolling: {stiffness: 100, friction: 0.1}}]
  integrator: velocity_verlet
  neighbours: hgrid
  fill: [{packer: random, region: {box: {lower: [0, 0, 0], upper: [20 mm, 20 mm, 20 mm]}}}]
  box: {packing: 0.55, rate: 30 1/s, shear: 20 1/s}
output: {every: 1 ms, fields: [grain.velocity, grain.spin, contact.force, total.box_length]}
observe: [stress, box, energy, momentum]
"""
STILL = """
quern: 1
dimension: 3
gravity: [0, 0, 0]
domain: {{lower: [0, 0, 0], upper: [{0}, {0}, {0}], periodic: [true, true, true]}}
time: {{end: 1 ms}}
grains:
  material: {{density: 2500, radius: {{mean: 1 mm, spread: 20 %, law: uniform}}}}
  contact: [{{hertz: {{young: 1e7 Pa, impact_speed: 1 m/s, friction: 0.3}}}}, {{rolling: {{stiffness: 100, friction: 0.1}}}}]
  integrator: velocity_verlet
  from: {1}
output: {{every: 1 ms}}
observe: [stress, {{packing_fraction: {{region: {{box: {{lower: [0, 0, 0], upper: [{0}, {0}, {0}]}}}}}}}}]
"""


def last(folder):
    header, rows = lab.series(folder)
    return {name.split(" [")[0]: number for name, number in zip(header, rows[-1])}


def strain(place, name, options, stops, what):
    base = place / "base"
    lab.run(name, base, *options)
    numbers = last(base)
    print(f"{what}: {lab.summary(base)['steps']} steps, packing fraction {numbers['box.packing']:.4f}, shear strain {numbers['box.strain']:.3g}, "
          f"normal stress {numbers['stress.yy']:.4g} Pa")
    lab.same_ways(name, base, place, *options, what="", batches=(8, 96), levels=("v1", "v3", "v4"))
    for k, stop in enumerate(stops):
        out = place / f"stop{k}"
        lab.run(name, out, *options, f"--until={stop}")
        lab.run(name, out, *options, resume=True)
        lab.same(base, out, f"stopped at {stop} s")
    return base


def goes_on(place, base):
    """The grains of a box that was closed stand in a domain of its size, with the contacts that they had."""
    was = last(base)
    path = place / "still.yaml"
    path.write_text(STILL.format(f"{was['box.x']:.17g}", base))
    lab.run(path, place / "still")
    header, rows = lab.series(place / "still")
    found = dict(zip((name.split(" [")[0] for name in header), rows[0]))
    print(f"from it: packing fraction {found['packing_fraction.fraction']:.4f}, normal stress {found['stress.yy']:.4g} Pa")
    assert abs(found["packing_fraction.fraction"] / was["box.packing"] - 1) < 0.01
    assert abs(found["stress.yy"] / was["stress.yy"] - 1) < 1e-9, (found["stress.yy"], was["stress.yy"])


def others_do_not_know_it(place):
    for k, observer in enumerate(("{profile: {axis: 1, bins: 4}}", "{flux: {axis: 0, at: 0.01}}",
                     "{packing_fraction: {region: {box: {lower: [0, 0], upper: [0.01, 0.01]}}}}")):
        said = lab.run("plane_shear", place / f"other{k}", f"--set=observe=[{observer}]", status=2)
        assert "looks at a domain that keeps its shape, and grains.box strains it" in said, said
    said = lab.run("plane_shear", place / "part", "--set=observe=[{stress: {region: {box: {lower: [0, 0], upper: [0.01, 0.01]}}}}]", status=2)
    assert "a part of a box that is strained (grains.box) does not stay where it is" in said, said


def boxes_that_do_not_go(place):
    """A box that is too flat for its offset ends the run, and one that a file holds and that is none is not gone on with."""
    flat = ["--set=domain.upper=[160 mm, 12 mm]", "--set=grains.fill.0.region.box.upper=[160 mm, 12 mm]", "--set=output.every=10 ms"]
    said = lab.run("plane_shear", place / "flat", *flat, "--set=grains.box.shear=20 1/s", status=3)
    assert "the box that is strained (grains.box) is only 0.01" in said and "along axis 1: at its offset it must be" in said, said
    for field, number in (("box_length", 0.0), ("box_offset", 1e9), ("box_speed", 1e9)):
        out = place / f"of_{field}"
        lab.run("plane_shear", out, "--until=0.01", "--set=time.end=0.02 s", "--set=output.every=10 ms")
        with h5py.File(out / "checkpoint.h5", "r+") as file:
            file[f"total/{field}.0"][...] = number
        cache.seal(out / "checkpoint.h5")
        said = lab.run("plane_shear", out, "--set=time.end=0.02 s", "--set=output.every=10 ms", resume=True, status=2)
        assert "total.box_length and its like hold the numbers of no box" in said, said


FACE = """
quern: 1
dimension: 2
gravity: [0, 0]
domain: {lower: [0, 0], upper: [1, 0.6], periodic: [true, true]}
time: {end: 0.13, step: 2e-3}
grains:
  material: {density: 1000, radius: {mean: 5 mm}}
  contact: []
  place: [{position: [0.3, 0], velocity: [0.3, VY]}, {position: [0.7, 0.3]}]
  box: {shear: 1 1/s}
output: {every: 0.13}
observe: [momentum, box]
"""


def at_a_face(place):
    """A grain that lies on a face but for rounding goes where one exactly on it goes: it is brought back as a whole, place and velocity, or not at all."""
    ends = []
    for n, drift in enumerate(("0", "1e-20", "-1e-20")):
        scene = place / f"face{n}.yaml"
        scene.write_text(FACE.replace("VY", drift))
        lab.run(scene, place / f"face{n}")
        end = last(place / f"face{n}")
        ends.append((end["momentum.x"], end["box.work"]))
    first, *others = ends
    for other in others:
        assert all(abs(a - b) <= 1e-9 for a, b in zip(first, other)), ends
    print("a grain on a face stays with the others that are")


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        others_do_not_know_it(place)
        boxes_that_do_not_go(place)
        at_a_face(place)
        (place / "shear").mkdir()
        strain(place / "shear", "plane_shear", SHEAR, (0.03, 0.075, 0.0751, 0.14), "discs that shear under a pressure")
        (place / "pack").mkdir()
        (place / "pack.yaml").write_text(PACK)
        base = strain(place / "pack", place / "pack.yaml", [], (0.0031, 0.0083), "spheres on their way to a packing fraction")
        with h5py.File(lab.frames(base)[-1]) as file:
            assert len(set(file["total/box_length"][0] if file["total/box_length"].ndim > 1 else file["total/box_length"])) == 1
        assert abs(last(base)["box.packing"] / 0.55 - 1) < 1e-12
        (place / "plain.yaml").write_text(PACK.replace(", shear: 20 1/s", "").replace("0.55", "0.57"))
        lab.run(place / "plain.yaml", place / "plain")
        goes_on(place, place / "plain")
