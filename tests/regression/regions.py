# SPDX-License-Identifier: MIT
"""Regions of any shape in whole runs: the same bits for threads, batches, instruction sets and compilers, across stops and from the
resolved scene; shares of sources that a stage changes; and a region is no body."""
import json
import os
import pathlib
import subprocess

import h5py
import numpy

import bits
import lab

SCENE = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, -0.01], upper: [0.2, 0.25], open: [upper_x]}
time: {end: 0.2 s}
bodies:
  - plane: {point: [0, 0], normal: [0, 1], name: floor}
  - plane: {point: [0, 0], normal: [1, 0]}
  - polygon: {vertices: [[0.05, 0], [0.15, 0], [0.1, 0.03]], name: roof}
grains:
  materials:
    sand: {density: 2500, radius: {mean: 1.5 mm, spread: 10 %}}
    steel: {density: 7800, radius: {mean: 1 mm}}
    cork: {density: 300, radius: {mean: 2 mm, spread: 20 %, law: uniform}}
  contact: {linear: {stiffness: 5e5}}
  fill:
    - {region: {sphere: {centre: [0.03, 0.1], radius: 0.02}}, mix: {sand: 50 %, cork: 50 %}}
    - {region: {box: {lower: [0.05, 0], upper: [0.15, 0.05]}}, above: roof, packer: {lattice: {spacing: 5 mm, jitter: 50 %}}}
  source:
    - {region: {cylinder: {centre: [0.1, 0.2], radius: 0.03}}, rate: 30, velocity: [0, -1], mix: {sand: 60 %, steel: 30 %, cork: 10 %}}
    - {region: {polygon: {vertices: [[0.15, 0.18], [0.19, 0.18], [0.17, 0.22]]}}, rate: 10, velocity: [0, -1], material: cork}
observe: [mass, outflow, {wall_force: {body: roof}}]
output: {every: 10 ms, fields: [grain.velocity, contact.force, grain_share.mass, grain_share.share, grain_source.draws, body.impulse]}
"""
DENSITY = numpy.array([2500.0, 7800.0, 300.0])
SHARE = {0: numpy.array([0.6, 0.3, 0.1]), 1: numpy.array([0.1, 0.8, 0.1])}


def shares(path):
    with h5py.File(path) as file:
        return file["grain_shares/mass"][()].reshape(2, 3)[0]


def same(place, scene):
    base = place / "base"
    lab.run(scene, base)
    ways = {"2 threads": ([], {"threads": 2}), "run.batch: 8": (["--set=run.batch=8"], {}), "run.batch: 97": (["--set=run.batch=97"], {"threads": 2})}
    ways |= {level: ([f"--set=run.instructions={level}"], {}) for level in ("v1", "v3", "v4")}
    if os.environ.get("QUERN_OTHER"):
        ways["another compiler"] = ([], {"program": os.environ["QUERN_OTHER"]})
    for name, (more, how) in ways.items():
        out = place / name.replace(" ", "_")
        lab.run(scene, out, *more, **how)
        lab.same(base, out, f"regions, {name}")
    for until in ("3 ms", "77 ms"):
        out = place / ("until_" + until[:2].strip())
        lab.run(scene, out, f"--until={until}")
        lab.run(scene, out, resume=True, threads=2)
        lab.same(base, out, f"regions, stopped at {until} and resumed")
    bits.killed(scene, base, place, None, [], lab.seeded())
    lab.run(base / "scene.yaml", place / "again")
    lab.same(base, place / "again", "regions, the resolved scene", checkpoint=False)
    return base


def poured(base):
    """No share is ever missed by more than the heaviest grain, in every frame."""
    heaviest = max(DENSITY * numpy.pi * numpy.array([1.8e-3, 1e-3, 2.4e-3]) ** 2)
    worst = 0.0
    for path in lab.frames(base):
        mass = shares(path)
        worst = max(worst, abs(mass - SHARE[0] * mass.sum()).max() / heaviest)
    print(f"{mass.sum():.4g} kg of a mix poured, {mass / mass.sum()}; worst {worst:.2f} of the heaviest grain")
    assert worst < 1 and mass.sum() > 4, (worst, mass)
    s = lab.summary(base)
    assert abs(s["mass_defect"]) < 1e-12, s


def stage(place, scene, base):
    """New shares, and a narrower region, count from then on; before, nothing changes."""
    one, other = "mix: {sand: 60 %, steel: 30 %, cork: 10 %}", "{sand: 10 %, steel: 80 %, cork: 10 %}"
    assert one in SCENE
    change = f"--set=stages=[{{for: 93 ms}}, {{set: {{grains.source.0.mix: {other}, grains.source.0.region.cylinder.radius: 0.01}}}}]"
    lab.run(scene, place / "two", change)
    lab.run(scene, place / "two_stopped", change, "--until=0.1", threads=2)
    lab.run(scene, place / "two_stopped", change, resume=True)
    lab.same(place / "two", place / "two_stopped", "two mixes, stopped")
    a, b = lab.frames(base), lab.frames(place / "two")
    assert (shares(a[9]) == shares(b[9])).all() and (shares(a[-1]) != shares(b[-1])).any()
    highest = []
    for path in (a[-1], b[-1]):
        with h5py.File(path) as file:
            x, y = file["grains/position"][:, :2].T
            highest.append(y[abs(x - 0.1) < 0.03].max())  # beside it the other source reaches 0.218
    assert highest[0] > 0.215 > highest[1], highest
    mass = shares(b[-1])
    print(f"after the stage {mass.sum():.4g} kg, {mass / mass.sum()}")
    assert abs(mass / mass.sum() - SHARE[1]).max() * mass.sum() < 0.03 and mass.sum() > 2, mass


def no_body(base):
    """Three bodies are there, and the plan and the tables know the slots."""
    with h5py.File(lab.frames(base)[-1]) as file:
        materials = numpy.bincount(file["grains/material"][()], minlength=3)
        impulse = file["bodies/impulse"][()]
        assert (materials > 30).all() and len(impulse) == 3 and (impulse[[0, 2], 1] > 0).all(), (materials, impulse)
    plan = lab.plan(base / "scene.yaml")
    said = json.loads(subprocess.run([lab.QUERN, "describe", "grains", "--json"], check=True, capture_output=True, text=True).stdout)
    slots = {slot["name"]: slot["kind"] for slot in said["slots"]}
    assert slots["fill.region"] == slots["source.region"] == "body", slots
    counted = {entry["name"] for entry in plan["sets"]}
    assert "grain_share" in counted and {"grain_share.mass", "grain_share.share"} <= {
        field["name"] for entry in plan["sets"] for field in entry["fields"]}, counted
    plain = {entry["name"] for entry in lab.plan("mixture")["sets"]}
    assert "grain_share" not in plain, plain
    print("a region is no body, and books of shares are there where a source pours a mix")


if __name__ == "__main__":
    with lab.workplace() as name:
        folder = pathlib.Path(name)
        text = folder / "regions.yaml"
        text.write_text(SCENE)
        first = same(folder, text)
        poured(first)
        stage(folder, text, first)
        no_body(first)
