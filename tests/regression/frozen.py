# SPDX-License-Identifier: MIT
"""Plugins as they were written for an interface that is frozen (tests/abi): compiled with its headers, they load and run, and do
what they did. growth.py runs them in this program and in one whose structs have grown."""
import csv
import json
import os
import pathlib
import subprocess

import h5py
import numpy

import lab
from workshop import FLAGS, PLUGINS, SOURCE

FOLDERS = sorted(path for path in (SOURCE / "tests/abi").iterdir() if path.is_dir())
NAMES = {"body", "contact", "material", "observer", "oracle", "recipe", "solver"}
BAKERY = """quern: 1
dimension: 2
gravity: [0, 0]
domain: {lower: [0, 0], upper: [1, 1]}
time: {end: 4}
bakery: {loaves: 1000, recipe: [frozen, {frozen: {loss: 0.25, times: 2}}]}
output: {every: 1, fields: [loaf.kneaded]}
"""


def compile_all(folder, to):
    sources = list(folder.glob("*.c"))
    assert {path.name.split(".")[0] for path in sources} == NAMES, sorted(sources)
    for path in sources:
        words = ["cc", *FLAGS, "-Wall", "-Werror", "-shared", "-I", folder / "include", path, "-o", to / path.with_suffix(".so").name, "-lm"]
        subprocess.run(list(map(str, words)), check=True)


def values(folder, frame, name):
    with h5py.File(folder / f"frames/{frame:06d}.h5") as file:
        return file[name][()]


class Host:
    """A program with the frozen plugins on its path, before those that it was built with."""

    def __init__(self, program, frozen, place):
        self.program, self.place, self.count = program, place, 0
        self.path = f"{frozen}:{PLUGINS}"

    def run(self, scene, *options, **more):
        self.count += 1
        folder = self.place / f"run{self.count}"
        lab.run(scene, folder, *options, program=self.program, QUERN_PLUGIN_PATH=self.path, **more)
        return folder

    def ask(self, *words):
        done = subprocess.run([self.program, *words], capture_output=True, text=True, env={**os.environ, "QUERN_PLUGIN_PATH": self.path})
        assert done.returncode == 0, done.stderr
        return done.stdout


def grains(host):
    """A law with history, a floor, an observer: two grains swap their velocities, and one rests on the floor."""
    folder = host.run("two_grains", "--set=grains.contact=frozen", "--set=observe=frozen", "--set=grains.step=0.02")
    velocity = values(folder, 20, "grains/velocity")[:, 0]
    assert numpy.allclose(sorted(velocity), [-1, 1], atol=1e-3), velocity
    age = max(values(folder, k, "contacts/age").max(initial=0) for k in range(21))
    assert age > 0, "the law's own field stays empty"
    rows = list(csv.DictReader((folder / "series.csv").open()))
    assert {row["frozen.count [1]"] for row in rows} == {"2"} and float(rows[0]["frozen.top [m]"]) == 0
    folder = host.run("two_grains", "--set=gravity=[0, -9.81]", "--set=time.end=0.1", "--set=output.every=0.01",
                      "--set=bodies={frozen: {height: -20 mm}}")
    assert values(folder, 10, "grains/position")[:, 1].min() > -0.0151, "a grain has fallen through the floor"
    return folder


def continuum(host):
    """A material: the bar swings as one that knows pressure alone does."""
    folder = host.run("elastic_bar", "--set=continuum.material=frozen", "--set=time.end=4")
    pressure = values(folder, 8, "points/pressure")
    assert numpy.isfinite(pressure).all() and abs(pressure).max() > 0.01
    return folder


def hybrid(host):
    """An oracle: grains above a height."""
    folder = host.run("column", *lab.SMALL["column"], "--set=hybrid.oracle={frozen: {height: 0.04}}", "--set=time.end=5 ms")
    summary = json.loads((folder / "summary.json").read_text())
    assert 0 < summary["discrete_share"] < 1 and summary["invariant_defect"] < 1e-12
    return folder


def bakery(host):
    """A solver with a kind of its own."""
    scene = host.place / "bakery.yaml"
    scene.write_text(BAKERY)
    folder = host.run(f"{host.place}/bakery")
    left, kneaded = values(folder, 4, "loaves/dough"), values(folder, 4, "loaves/kneaded")
    assert numpy.allclose(left, (0.5 * 0.75 * 0.75) ** 4, rtol=1e-12) and (kneaded == 1 + 4 * 3).all(), (left[0], kneaded[0])
    summary = json.loads((folder / "summary.json").read_text())
    assert abs(summary["sums"]["dough"]["value"] / left.sum() - 1) < 1e-12 and summary["sums"]["largest"]["value"] == left[0]
    assert summary["loaves"] == 1000 and summary["loaf_steps"] == 4000 and summary["status"] == "done"
    resumed = host.run(f"{host.place}/bakery", "--until=2")
    lab.run(f"{host.place}/bakery", resumed, program=host.program, resume=True, QUERN_PLUGIN_PATH=host.path)
    lab.same(folder, resumed, "a bakery, stopped on the way")
    return folder


SCENES = [grains, continuum, hybrid, bakery]


def check(programs, place):
    """{name: program}: all of them do the same with the frozen plugins."""
    for folder in FOLDERS:
        frozen = place / f"frozen{folder.name}"
        frozen.mkdir()
        compile_all(folder, frozen)
        left = {}
        for name, program in programs.items():
            (place / f"{name}{folder.name}").mkdir()
            host = Host(program, frozen, place / f"{name}{folder.name}")
            described = json.loads(host.ask("describe", "contact.frozen", "--json"))
            assert described["version"] == folder.name and described["file"] == str((frozen / "contact.frozen.so").resolve())
            left[name] = [scene(host) for scene in SCENES]
        first, *others = left.values()
        for other in others:
            for a, b in zip(first, other):
                lab.same(a, b, f"frozen {folder.name}, {a.name}")
        print(f"{len(NAMES)} plugins of interface {folder.name} run in {', '.join(programs)}")
