#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A body with a displacement is to the continuum the same body set so far before itself, whatever its shape and wherever the domain ends, and to grains
it is where it stands. In a hybrid the lowest cells have the less room, of which the floor's own grains take no further part."""
import pathlib

import h5py
import lab
import numpy

CONTINUUM = """
quern: 1
dimension: {dim}
gravity: {gravity}
domain: {{lower: {lower}, upper: {upper}}}
time: {{end: 40 ms}}
bodies: [{body}]
continuum:
  cell: 4 mm
  material: {{mu_i: {{bulk_modulus: 1e5 Pa, diameter: 2 mm, grain_density: 2500, critical_density: 2000}}}}
  fill: {{region: {{box: {{lower: {from_}, upper: {to}}}}}, stress: at_rest}}
output: {{every: 40 ms, fields: [point.velocity, point.pressure]}}
"""
FLAT = {"dim": 2, "gravity": "[2, -9.81]", "lower": "[0, 0]", "upper": "[0.1, 0.12]", "from_": "[0, 0.006]", "to": "[0.06, 0.05]"}
DEEP = {"dim": 3, "gravity": "[2, 1, -9.81]", "lower": "[0, 0, 0]", "upper": "[24 mm, 16 mm, 48 mm]", "from_": "[0, 0, 0]", "to": "[24 mm, 16 mm, 24 mm]"}
OUT = 0.6  # mm
CASES = [  # what, the domain, the body, its places with and without a displacement, and which points, in mm, must lie where
    ("a floor on the domain's face", FLAT, "{{plane: {{point: [0, {0} mm], normal: [0, 1], boundary: {{rough: 5}}{1}}}}}", OUT, 0, lambda x: x[:, 1] >= OUT),
    ("a floor within a cell", FLAT, "{{plane: {{point: [0, {0} mm], normal: [0, 1], boundary: {{frictional: 0.3}}{1}}}}}", 5 + OUT, 5, lambda x: x[:, 1] >= 5 + OUT),
    ("a floor that rises and is sticky", FLAT, "{{plane: {{point: [0, {0} mm], normal: [0, 1], boundary: sticky, motion: {{velocity: [0, 0.05]}}{1}}}}}", 4 + OUT, 4, None),
    ("a box", FLAT, "{{box: {{lower: [30 mm, 0], upper: [1, {0} mm], boundary: {{frictional: 0.3}}{1}}}}}", None, 20,
     lambda x: (x[:, 0] <= 30 - OUT) | (x[:, 1] >= 20 + OUT)),
    ("a drum from within", dict(FLAT, from_="[0.03, 0.01]"),
     "{{cylinder: {{centre: [50 mm, 50 mm], radius: {0} mm, inside: true, boundary: {{frictional: 0.3}}{1}}}}}", 45 - OUT, 45, None),
    ("a floor in space", DEEP, "{{plane: {{point: [0, 0, {0} mm], normal: [0, 0, 1], boundary: {{rough: 5}}{1}}}}}", 1 + OUT, 1, lambda x: x[:, 2] >= 1 + OUT),
]
HYBRID = """
quern: 1
dimension: 2
seed: 5
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [80 mm, 80 mm], periodic: [true, false]}
time: {end: 1 ms}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %, law: normal}}
  contact: {linear: {stiffness: 1e5 N/m, restitution: 0.5, friction: 0.4}}
  overlap: {most: 20 %}
  fill:
    - {region: {box: {lower: [0, -0.7 mm], upper: [80 mm, -0.7 mm]}}, fixed: true}
    - {region: {box: {lower: [0, 1 mm], upper: [80 mm, 40 mm]}}, settle: true}
bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 5}, displacement: 0.6 mm}}]
continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 1e5 Pa, diameter: 2 mm, grain_density: 2500, critical_density: 2000}}}
hybrid: {oracle: [{fixed: {otherwise: discrete}}], substeps: 30}
output: {every: 1 ms, fields: [cell.packing_fraction]}
observe: [ledger]
"""


def last(folder):
    with h5py.File(lab.frames(folder)[-1]) as frame:
        return {name: frame[f"points/{name}"][()] for name in ("position", "velocity", "pressure")}


def look(place, keys, body, at, extra=""):
    path = place / "scene.yaml"
    path.write_text(CONTINUUM.format(body=body.format(at, extra), **keys))
    lab.run(path, place / "out", "--force")
    return last(place / "out")


def check_continuum(place):
    """A box has no place before itself: displaced, it is larger to all sides, and none may lie within 0.6 mm of it, where points of one that is not do."""
    for what, keys, body, before, own, there in CASES:
        displaced, plain = look(place, keys, body, own, f", displacement: {OUT} mm"), look(place, keys, body, own)
        n, without = len(displaced["position"]), len(plain["position"])
        assert n < without or numpy.abs(plain["position"] - displaced["position"]).max() > 1e-5, what
        assert there is None or there(1e3 * displaced["position"] + 1e-9).all(), what
        if before is None:
            assert not there(1e3 * plain["position"]).all(), what
            print(f"{what}: {n} points, without displacement {without}; none near it")
            continue
        ahead = look(place, keys, body, before)
        off = max(numpy.abs(ahead[name] - displaced[name]).max() / numpy.abs(ahead[name]).max() for name in ahead)
        print(f"{what}: {n} points, without displacement {without}; before itself and displaced they are apart by {off:.1e}")
        assert off < 1e-9, (what, off)


FLOW = """
quern: 1
dimension: 2
gravity: [3.36, -9.22]
domain: {lower: [0, 0], upper: [40 mm, 80 mm], periodic: [true, false]}
time: {end: 0.4 s}
bodies: [{plane: {point: [0, 0], normal: [0, 1], boundary: {rough: 7}, displacement: 0.6 mm}}]
continuum:
  cell: 4 mm
  shape: gimp # whose points stand for boxes
  material: {mu_i: {bulk_modulus: 1e5 Pa, diameter: 2 mm, grain_density: 2500, critical_density: 2000}}
  fill: {region: {box: {lower: [0, 0.6 mm], upper: [40 mm, 60.6 mm]}}, stress: at_rest}
output: {every: 0.4 s, fields: [point.pressure]}
"""


def check_room(place):
    """Nodes on the domain's face have neither the half of their room that lies beyond it nor what lies between it and the floor: sand that fills the rest is
    full. Were both taken one after the other, it would look too dense there, and would be pressed apart as it flows."""
    (place / "flow.yaml").write_text(FLOW)
    lab.run(place / "flow.yaml", place / "flow")
    with h5py.File(lab.frames(place / "flow")[-1]) as frame:
        y, pressure = frame["points/position"][:, 1], frame["points/pressure"][()]
    rows = [(y >= k * 4e-3) & (y < (k + 1) * 4e-3) for k in range(4)]
    bears = [pressure[row].mean() / (60.6e-3 - y[row].mean()) for row in rows]
    print(f"a layer that flows: {rows[0].sum()} points in the lowest cells, pressure over depth {bears[0] / numpy.mean(bears[1:]):.3f} of that above")
    # points of the cut cells bear 4/3.4 of the pressure above; 1.09 if what is counted there were that of whole cells, 1.64 if nodes lost their room twice
    assert rows[0].sum() == 40 and abs(bears[0] / numpy.mean(bears[1:]) * 3.4 / 4 - 1) < 0.05


def check_hybrid(place):
    """Grains rest on the plane itself. What they fill of the lowest cells is over the room before the surface, which the tops of fixed grains lie behind."""
    (place / "hybrid.yaml").write_text(HYBRID)
    fractions = []
    for name, displacement in (("plain", "0"), ("hybrid", "0.6 mm")):
        lab.run(place / "hybrid.yaml", place / name, f"--set=bodies.0.plane.displacement={displacement}")
        with h5py.File(lab.frames(place / name)[-1]) as frame:
            low = frame["cells/position"][:, 1] < 4e-3
            fractions.append(frame["cells/packing_fraction"][()][low].mean())
            grains = frame["grains/position"][:, 1] - frame["grains/radius"]
            lowest = grains[frame["grains/position"][:, 1] > 0].min()
            fixed = frame["grains/position"][:, 1] < 0
            caps = sum(r * r * numpy.arccos(-y / r) + y * numpy.sqrt(r * r - y * y)
                       for y, r in zip(frame["grains/position"][fixed, 1], frame["grains/radius"][fixed]))
    ratio = fractions[1] / fractions[0]
    wanted = (1 - 2500 / 2000 * caps / (80e-3 * 4e-3)) / (1 - 0.6 / 4)
    print(f"hybrid: lowest moving grain {lowest * 1e3:.3f} mm above the floor; the lowest cells are {ratio:.4f} times as full, by their room {wanted:.4f}")
    assert lowest < 0.3e-3 and abs(ratio / wanted - 1) < 0.01


if __name__ == "__main__":
    with lab.workplace() as name:
        check_continuum(pathlib.Path(name))
        check_room(pathlib.Path(name))
        check_hybrid(pathlib.Path(name))
