# SPDX-License-Identifier: MIT
"""From outside: a run that goes past its limit ends with exit status 3 and one sentence that names the culprit, and what it
wrote before is whole: frames, summary, series and the last checkpoint. docs/stability.md"""
import json
import os
import pathlib
import re
import subprocess
import tempfile

import h5py

QUERN = os.environ["QUERN"]

# Sound at the start and too fast for its step later on: gravity accelerates what the step was chosen for.
GRAINS = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.02, 0.2]}
time: {end: 1, step: %s, force: true}
output: {every: 5 ms}
checkpoint: {every: 1 ms}
bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]
grains:
  material: {density: 2500, radius: {mean: 1 mm}}
  contact: {linear: {stiffness: 1e5, friction: 0.5}}
  place:
    - {position: [0.01, 0.05]}
    - {position: [0.0102, 0.0521]}
"""
CONTINUUM = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [1, 1.5]}
time: {end: 5, step: %s, force: true}
output: {every: 50 ms}
checkpoint: {every: 1 ms}
bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]
continuum:
  cell: 0.1
  material: {elastic: {bulk_modulus: 1e6, density: 1500}}
  fill: {region: {box: {lower: [0.2, 0.6], upper: [0.8, 1.1]}}}
"""
HYBRID = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.04, 0.12]}
time: {end: 0.3, step: %s, force: true}
output: {every: 3 ms}
checkpoint: {every: 0.1 s}
bodies:
  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}
  - plane: {point: [0, 0], normal: [1, 0]}
  - plane: {point: [0.04, 0], normal: [-1, 0]}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %%}}
  contact: {linear: {stiffness: 1e5, friction: 0.4}}
  fill: {region: {box: {lower: [0.001, 0.001], upper: [0.039, 0.04]}}, settle: true}
continuum:
  cell: 4 mm
  material: {mu_i: {bulk_modulus: 3e4, critical_density: 1975}}
hybrid: {oracle: [{packing_fraction: {depth: 10 mm, half_width: 4 mm}}], substeps: %d}
"""
# name: scene, what it must say besides a time, the smallest number of frames
CASES = {
    "grains": (GRAINS % "0.4 ms", r"dem\.forces, at t = [0-9.e-]+ s \(step \d+\): grain( \d+)?: ", 3),
    "continuum": (CONTINUUM % "8 ms", r"mpm\.gather, at t = [0-9.e-]+ s \(step \d+\): point \d+: ", 3),
    "hybrid": (HYBRID % ("3 ms", 300), r"(mpm\.\w+|dem\.\w+|hybrid\.\w+), at t = [0-9.e-]+ s \(step \d+\): ", 2),
}


def run(folder, scene, *options):
    path = pathlib.Path(folder) / "scene.yaml"
    path.write_text(scene)
    return subprocess.run([QUERN, "run", "--quiet", "--threads", "1", str(path), "-o", str(folder / "out"), *options],
                          capture_output=True, text=True, timeout=120)


def check_failure(name, folder, scene, sentence, least):
    done = run(folder, scene)
    assert done.returncode == 3, f"{name}: exit status {done.returncode}\n{done.stderr}"
    errors = [line for line in done.stderr.splitlines() if "error:" in line]
    assert len(errors) == 1, f"{name}: {len(errors)} errors\n{done.stderr}"
    assert re.search("^quern: error: " + sentence, errors[0]), f"{name}: {errors[0]}"
    assert "nan" not in errors[0].lower(), f"{name}: {errors[0]}"
    warnings = [line for line in done.stderr.splitlines() if "beyond the limit" in line]
    assert warnings, f"{name}: no warning of the step\n{done.stderr}"
    summary = json.loads((folder / "out/summary.json").read_text())
    assert summary["status"] == "failed", f"{name}: {summary['status']}"
    assert summary["message"] == errors[0].removeprefix("quern: error: "), f"{name}: {summary.get('message')}"
    frames = sorted((folder / "out/frames").glob("*"))
    numbers = [path for path in frames if path.suffix == ".h5"]
    assert not [path for path in frames if "tmp" in path.name], f"{name}: half a file among {frames}"
    assert len(numbers) >= least, f"{name}: {len(numbers)} frames"
    for path in numbers:
        with h5py.File(path) as frame:
            assert len(frame), f"{name}: {path} is empty"
    assert len((folder / "out/series.csv").read_text().splitlines()) == len(numbers) + 1, f"{name}: series"
    assert (folder / "out/checkpoint.h5").exists(), f"{name}: no checkpoint"
    print(f"{name}: {len(numbers)} frames, {errors[0]}")


def check_checkpoint(name, folder, scene):
    """The checkpoint is from before the failure: resuming leads to the same end, at the same time."""
    with h5py.File(folder / "out/checkpoint.h5") as state:
        assert len(state), f"{name}: the checkpoint is empty"
    first = json.loads((folder / "out/summary.json").read_text())["message"]
    done = run(folder, scene, "--resume")
    assert done.returncode == 3, f"{name}: resumed, exit status {done.returncode}\n{done.stderr}"
    assert first in done.stderr, f"{name}: resumed\n{done.stderr}\n{first}"


def check_refusal(name, folder, scene):
    """Without force the step is refused before anything is computed."""
    done = run(folder, scene.replace("force: true", "force: false"))
    assert done.returncode == 2, f"{name}: exit status {done.returncode}\n{done.stderr}"
    assert "is beyond the limit of" in done.stderr and "recommended" in done.stderr, f"{name}: {done.stderr}"


def main():
    for name, (scene, sentence, least) in CASES.items():
        with tempfile.TemporaryDirectory() as text:
            folder = pathlib.Path(text)
            check_failure(name, folder, scene, sentence, least)
            check_checkpoint(name, folder, scene)
        with tempfile.TemporaryDirectory() as text:
            check_refusal(name, pathlib.Path(text), scene)


main()
