# SPDX-License-Identifier: MIT
"""Stages of a scene: values change when they shall, and nothing else does; runs with them are the same for any number of threads,
stopped anywhere, and from the scene that they leave."""
import json
import math
import os
import pathlib

import h5py

import lab
from workshop import quern

FLIGHT = """
quern: 1
dimension: 2
gravity: [0, -10]
domain: {{lower: [-10, -10], upper: [10, 10]}}
time: {{end: 1.0, step: 1e-3}}
grains: {{material: {{density: 2500, radius: {{mean: 0.01}}}}, contact: [], place: [{{position: [0, 0]}}]}}
stages: {stages}
output: {{every: 0.1, fields: [grain.velocity]}}
"""

SLIDE = """
quern: 1
dimension: 2
gravity: [0, -10]
domain: {lower: [-1, 0], upper: [3, 1]}
time: {end: 0.6}
continuum:
  cell: 0.1
  material: {elastic: {bulk_modulus: 1e5, poisson: 0.2, density: 1000}}
  transfer: {picflip: {rate: 0}}
  fill: {region: {box: {lower: [0, 0], upper: [0.6, 0.3]}}, stress: at_rest}
bodies: [{plane: {name: floor, point: [0, 0], normal: [0, 1]}}]
stages:
  - {for: 0.25 s}
  - {set: {gravity: [2, -10]}}
output: {every: 0.1, fields: [point.velocity]}
"""


def write(place, name, text):
    path = place / f"{name}.yaml"
    path.write_text(text)
    return path


def last(folder):
    return h5py.File(lab.frames(folder)[-1])


def gravity_turns(place):
    """In free flight what each stage gives is its gravity times its length, also where a stage ends between two frames."""
    stages = "[{for: 0.25, set: {}}, {for: 0.33, set: {gravity: [3, 0]}}, {set: {gravity: [0, 5]}}]"
    for name, text, wanted in (("plain", "[{}]", (0, -10)), ("turns", stages, (0.33 * 3, -0.25 * 10 + 0.42 * 5))):
        out = place / name
        lab.run(write(place, name, FLIGHT.format(stages=text)), out)
        times = []
        for path in lab.frames(out):
            with h5py.File(path) as file:
                times.append(float(file.attrs["time"]))
        assert all(abs(t - 0.1 * i) < 1e-12 for i, t in enumerate(times)) and len(times) == 11, times
        with last(out) as file:
            found = file["grains/velocity"][0]
        print(f"{name}: velocity {found[0]:.9g}, {found[1]:.9g}, asked {wanted[0]:.9g}, {wanted[1]:.9g}")
        assert all(abs(a - b) < 1e-12 for a, b in zip(found, wanted))


def a_block_begins_to_slide(place):
    """The continuum too: at rest on a smooth floor until gravity is tilted, then at its acceleration along the floor."""
    out = place / "slide"
    lab.run(write(place, "slide", SLIDE), out)
    with last(out) as file:
        speed = file["points/velocity"][:, 0].mean()
    print(f"slide: {speed:.6g} m/s, asked {2 * 0.35:.6g}")
    assert abs(speed / (2 * 0.35) - 1) < 1e-3


SHORT = ["--set=grains.material.radius.mean=3 mm", "--set=time.end=0.5 s", "--set=stages.0.for=0.0333 s", "--set=stages.1.for=0.2 s",
         "--set=output.every=50 ms", "--set=run.batch=64"]


def a_gate_opens(place):
    """Behind a gate nothing leaves; once it is gone grains run out, and further when gravity is tilted. All of it to the bit whatever
    is stopped: in a stage, where two meet, at a frame, and right after."""
    out = place / "gate"
    lab.run("gate", out, *SHORT)
    farthest = []
    for path in lab.frames(out):
        with h5py.File(path) as file:
            moves = file["grains/fixed"][:] == 0
            farthest.append(file["grains/position"][moves, 0].max())
    print("gate: farthest grain", " ".join(f"{x:.3g}" for x in farthest))
    assert farthest[0] < 0.06 < farthest[2] and farthest[-1] > 0.2
    lab.run("gate", place / "threads", *SHORT, threads=2)
    lab.same(out, place / "threads", "a gate, 1 and 2 threads")
    lab.run(out / "scene.yaml", place / "again")
    lab.same(out, place / "again", "a gate, from the scene that it left", checkpoint=False)
    for time in ("0.02", "0.0333", "0.0334", "0.05", "0.2333", "0.24"):
        other = place / f"until_{time}"
        lab.run("gate", other, *SHORT, f"--until={time}")
        lab.run("gate", other, *SHORT, resume=True)
        lab.same(out, other, f"a gate, stopped at {time} s")
    # without stages it never opens
    lab.run("gate", place / "shut", *SHORT[:2], "--set=stages=null", *SHORT[4:])
    with last(place / "shut") as file:
        moves = file["grains/fixed"][:] == 0
        assert file["grains/position"][moves, 0].max() < 0.06


def stages_of_one_value_change_nothing(place):
    """Stages that set what stands there already, and end with a frame, leave every number as it is."""
    lab.run("two_grains", place / "one")
    text = pathlib.Path(lab.scene("two_grains")).read_text()
    same = "stages: [{for: 5 ms}, {for: 6 ms, set: {grains.contact.linear.friction: 0.5}}, {set: {gravity: [0, 0]}}]\n"
    lab.run(write(place, "same", text + same), place / "three")
    for one, three in zip(lab.frames(place / "one"), lab.frames(place / "three"), strict=True):
        with h5py.File(one) as a, h5py.File(three) as b:
            for field in ("position", "velocity", "radius"):
                assert (a["grains"][field][:] == b["grains"][field][:]).all(), f"{one.name}: {field}"
    print("two grains, with stages that change nothing: the same")


PADDLE = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [-0.05, -0.05], upper: [0.05, 0.05]}
time: {end: 60 ms}
grains:
  material: {density: 2500, radius: {mean: 3 mm}}
  contact: {linear: {stiffness: 1e5, restitution: 0.5, friction: 0.3}}
  fill: {region: {box: {lower: [-0.04, -0.04], upper: [0.04, -0.02]}}, settle: true}
bodies:
  - plane: {name: floor, point: [0, -0.05], normal: [0, 1]}
  - box: {name: paddle, lower: [-0.04, 0.02], upper: [-0.03, 0.04], motion: {velocity: [0.5, 0]}}
  - plane: {name: left, point: [-0.05, 0], normal: [1, 0]}
  - plane: {name: right, point: [0.05, 0], normal: [-1, 0]}
stages: STAGES
output: {every: 10 ms}
"""


def courses_lead_on(place):
    """A paddle that another stage leaves where it has come to goes on; one that would jump ends the run by a sentence."""
    def paddle(name, stages, status=0):
        out = place / name
        return out, lab.run(write(place, name, PADDLE.replace("STAGES", stages)), out, status=status)

    out, _ = paddle("on", "[{for: 25 ms}, {set: {bodies.paddle.motion: {velocity: [0.5, 0], until: 25 ms}}}]")
    with last(out) as file:
        assert abs(file["bodies/position"][1, 0] - 0.0125) < 1e-12
    _, said = paddle("jump", "[{for: 25 ms}, {set: {bodies.paddle.motion.velocity: [0.1, 0]}}]", status=3)
    assert "body 'paddle', a body.box would jump by 0.01 m" in said, said
    # gravity may go once all is at rest
    out, _ = paddle("off", "[{for: 20 ms}, {set: {gravity: [0, 0]}}]")
    print("courses lead on, or are refused; gravity may go")


def keys_that_stay(place):
    """Of the scene's own keys, a stage may change those alone of which `describe` does not say that none does."""
    keys = json.loads(quern("describe", "scene", "--json", status=0))["params"]
    assert [key["name"] for key in keys if not key["once"]] == ["gravity"]
    for key in [*(key["name"] for key in keys if key["once"]), "observe", "domain", "observe.0.mass"]:
        said = quern("plan", lab.scene("two_grains"), f"--set=stages=[{{for: 5 ms}}, {{set: {{{key}: 1}}}}]", status=2)
        assert f"stages: {key} cannot change in the course of a run" in said, said
    print(f"{len(keys) - 1} keys of the scene stay as they are")


def frames_stand_alone(place):
    """Where a stage ends with a frame but for round-off, there is one frame and no step of no length."""
    for every, first, second in (("10 ms", "10 ms", "50 ms"), ("0.3", "0.1", "0.2"), ("0.1", "0.1", "0.2")):
        out = place / f"frames_{every.replace(' ', '')}_{first.replace(' ', '')}"
        text = FLIGHT.format(stages=f"[{{for: {first}}}, {{for: {second}}}, {{set: {{gravity: [1, 0]}}}}]")
        text = text.replace("every: 0.1", f"every: {every}")
        lab.run(write(place, "frames", text), out)
        times = []
        for path in lab.frames(out):
            with h5py.File(path) as file:
                times.append(float(file.attrs["time"]))
        gaps = [b - a for a, b in zip(times, times[1:])]
        assert min(gaps) > 0.3 * max(gaps), f"{every}, {first}, {second}: frames at {times}"
    print("frames where stages end stand alone")


def walls_become_smooth(place):
    """Walls get a friction of their own in a stage, for which plugins are made that the scene does not have: grains move otherwise from then
    on, and not before. That this is no other start is seen beside solvers whose keys count before the first step alone."""
    held = [*lab.SMALL["column"], "--set=time.end=12 ms", "--set=output.every=4 ms", "--set=hybrid=null", "--set=continuum=null",
            "--set=observe=null", "--set=output.fields=[grain.velocity]"]
    stages = "--set=stages=[{for: 8 ms}, {set: {bodies.0.plane.contact: {friction: 0.1}, bodies.1.plane.contact.friction: 0.2}}]"
    lab.run("column", place / "held", *held)
    lab.run("column", place / "smooth", *held, stages)
    for number, same in ((1, True), (2, True), (3, False)):
        with h5py.File(lab.frames(place / "held")[number]) as a, h5py.File(lab.frames(place / "smooth")[number]) as b:
            assert (a["grains/velocity"][:] == b["grains/velocity"][:]).all() == same, number
    lab.plan("column", stages)
    said = quern("plan", lab.scene("column"), "--set=stages=[{for: 1 ms}, {set: {bodies.0.plane.contact: {friction: 0.1}, continuum.points: 3}}]",
                 status=2)
    assert "stages: continuum.points cannot change in the course of a run" in said, said


def bodies_stay(place):
    """A body moves by its motion: a stage that gave it another place or shape would have it there at once, by nobody's work."""
    for key, value in (("point", "[0, 4 mm]"), ("normal", "[0.1, 1]")):
        said = quern("plan", lab.scene("column"), f"--set=stages=[{{for: 1 ms}}, {{set: {{bodies.0.plane.{key}: {value}}}}}]", status=2)
        assert f"stages: bodies.{key} cannot change in the course of a run" in said, said


def substeps_change(place):
    """Another number of substeps from a stage on: bodies are where their time says, in every one of them."""
    text = lab.scene("column")
    out = place / "substeps"
    sets = [*lab.SMALL["column"], "--set=time.end=8 ms", "--set=output.every=2 ms", "--set=bodies.2.plane.motion.velocity=[1, 0]",
            "--set=bodies.2.plane.while=always", "--set=bodies.2.plane.motion.from=3 ms",
            "--set=stages=[{for: 3.3 ms}, {set: {hybrid.substeps: 7}}]"]
    lab.run(pathlib.Path(text), out, *sets)
    lab.run(pathlib.Path(text), place / "stopped", *sets, "--until=5 ms")
    lab.run(pathlib.Path(text), place / "stopped", *sets, resume=True)
    lab.same(out, place / "stopped", "a hybrid whose substeps change, stopped and resumed")
    with last(out) as file:
        assert abs(file["bodies/position"][2, 0] - 0.005) < 1e-12


if __name__ == "__main__":
    assert math.isclose(9.81 * math.sin(math.radians(25)), 4.15, rel_tol=2e-3)
    os.environ["QUERN_CACHE"] = ""
    with lab.workplace() as name:
        for test in (gravity_turns, a_block_begins_to_slide, a_gate_opens, stages_of_one_value_change_nothing, courses_lead_on,
                     walls_become_smooth, keys_that_stay, frames_stand_alone, bodies_stay, substeps_change):
            test(pathlib.Path(name))
