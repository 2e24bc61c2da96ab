# SPDX-License-Identifier: MIT
"""scene.yaml reruns the same, to the byte and from any folder: every scene of configs/, its twins, and a scene whose grains stand
in a file. Such a file is known by what is in it, not by how its path is spelt."""
import os
import pathlib
import shutil
import subprocess

import lab

LAYER = lab.sets(time__end="20 ms", output__every="5 ms")
# Two numbers follow from the size of gravity by themselves, and so anew in the stage that turns it, where its digits make it another one in the
# sixth place; scene.yaml has one number for both.
TURNED = [*LAYER, *lab.sets(continuum__transfer__picflip__rate=11.7, hybrid__continuum__rest=0.35)]
SHORT = {"bed": LAYER, "chute": TURNED, "strip": TURNED, "shear": LAYER, "silo": lab.sets(time__end="4 ms", output__every="2 ms"),
         "hourglass": lab.sets(time__end="4 ms", output__every="2 ms"),
         "two_grains": lab.sets(time__end="5 ms"), "mixture": lab.sets(time__end="20 ms", output__every="5 ms"),
         "incline": lab.sets(time__end="50 ms"),
         "elastic_bar": lab.sets(time__end="2"), "block": lab.sets(time__end="60 ms"), "throw": lab.sets(time__end="60 ms"),
         "impact": lab.sets(time__end="6 ms"), "disc": [*lab.sets(time__end="60 ms", output__every="10 ms"), "--set=stages.0.for=30 ms"],
         "column": [*lab.SMALL["column"], *lab.sets(time__end="20 ms")],
         "column_3d": [*lab.SMALL["column_3d"], *lab.sets(time__end="5 ms")],
         "drum": lab.sets(time__end="50 ms", output__every="10 ms"),
         "gate": [*lab.sets(grains__material__radius__mean="3 mm", time__end="60 ms", output__every="10 ms"),
                  "--set=stages.0.for=15 ms", "--set=stages.1.for=20 ms"],
         "heap": lab.sets(time__end="60 ms", output__every="20 ms"), "pile": lab.sets(time__end="60 ms", output__every="20 ms"),
         "packing": lab.sets(), "shear": lab.sets(time__end="20 ms", output__every="10 ms"),
         "plane_shear": lab.sets(time__end="20 ms", output__every="10 ms"),
         "hopper": lab.sets(
             time__end="60 ms", output__every="20 ms", grains__contact__linear__stiffness="1e5 N/m", grains__settle__energy=1e-2,
             grains__fill__region__box="{lower: [0.02, 0.051], upper: [0.1, 0.08]}", grains__overlap__most=0)}
TWINS = {"column": ("all", "grains", "continuum"), "column_3d": ("all", "grains")}
TWIN = ["--set=output.fields=[grain.velocity, point.velocity]"]
FILED = """
quern: 1
name: "grains from a file: \\"two\\", \\x7f and \\u2028"
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.1, 0.1]}
time: {end: 10 ms}
output: {every: 1 ms}
bodies: [{plane: {point: [0, 0], normal: [0, 1], contact: {friction: 0}}}]
grains:
  material: {density: 2500, radius: {mean: 2 mm}}
  contact: {linear: {stiffness: 1e5, friction: 0.3}}
  file: grains.txt
observe: [mass, {mass: {label: again}}, {runout: {quantile: 0.5}}]
"""


def quern(*words, cwd=None, status=0):
    done = subprocess.run([lab.QUERN, *map(str, words)], cwd=cwd, capture_output=True, text=True, timeout=300)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stderr


def same_bytes(one, two, what):
    for pattern in ("scene.yaml", "series.csv", "frames/*.h5", "files/*", "run.xdmf"):
        names = [path.relative_to(one) for path in sorted(one.glob(pattern))]
        assert names == [path.relative_to(two) for path in sorted(two.glob(pattern))], f"{what}: {pattern}"
        for name in names:
            assert (one / name).read_bytes() == (two / name).read_bytes(), f"{what}: {name} differs"
    print(f"{what}: scene.yaml, series and {len(lab.frames(one))} frames the same to the byte", flush=True)


def again(out, what):
    """Runs out/scene.yaml from a folder far away, into another one; draws it; makes a plan of it."""
    away = out.with_name("far") / "away"
    away.mkdir(parents=True, exist_ok=True)
    there = out.with_name(out.name + "_again")
    quern("run", os.path.relpath(out / "scene.yaml", away), "-o", there, "--quiet", "--threads", 2, cwd=away)
    same_bytes(out, there, what)
    quern("plan", out / "scene.yaml")
    said = quern("render", there, "-o", there.with_suffix(".png"))
    assert "left out" not in said and "error" not in said, f"{what}: render leaves something out: {said}"
    shutil.rmtree(there)


def configs(place):
    names = sorted(path.stem for path in (lab.SOURCE / "configs").glob("*.yaml"))
    assert names == sorted(SHORT), f"scenes without options that make them short: {set(names) ^ set(SHORT)}"
    for name in names:
        for model in TWINS.get(name, ("all",)):
            out = place / f"{name}_{model}"
            lab.run(name, out, *SHORT[name], *(TWIN + [f"--set=model={model}"] if model != "all" else []))
            again(out, f"{name}, model {model}")


def filed(place):
    (place / "cf").mkdir()
    scene, out = place / "cf/s.yaml", place / "filed"
    scene.write_text(FILED)
    (place / "cf/grains.txt").write_text("x y radius vx vy\n0.02 0.01 0.002 0.1 0\n0.0241 0.0101 0.002 -0.1 0\n")
    quern("run", "cf/s.yaml", "-o", "filed", "--quiet", cwd=place)
    assert (out / "input.yaml").read_text() == FILED, "input.yaml is not the scene as it was written"
    stopped = place / "stopped"
    quern("run", "cf/s.yaml", "-o", "stopped", "--until", "3 ms", cwd=place)
    for k, spelling in enumerate(("./cf/s.yaml", scene, "cf/../cf/s.yaml")):
        quern("run", spelling, "-o", "stopped", "--resume", "--until", f"{5 + 2 * k} ms", cwd=place)
    shutil.rmtree(place / "cf")  # the run has all that it needs
    quern("run", "stopped/scene.yaml", "-o", "stopped", "--resume", cwd=place)
    assert (stopped / "input.yaml").read_text() == FILED, "resumed from scene.yaml, input.yaml is replaced"
    same_bytes(out, stopped, "resumed by another spelling")
    again(out, "grains from a file")
    # another content is another scene
    (place / "cf").mkdir()
    scene.write_text(FILED)
    (place / "cf/grains.txt").write_text("x y radius\n0.02 0.01 0.002\n")
    said = quern("run", "cf/s.yaml", "-o", "stopped", "--resume", cwd=place, status=2)
    assert "grains.file was 'a file with the hash" in said, said


if __name__ == "__main__":
    with lab.workplace() as name:
        filed(pathlib.Path(name))
        configs(pathlib.Path(name))
