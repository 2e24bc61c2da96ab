# SPDX-License-Identifier: MIT
"""kill -9 at any moment: what is there is whole, and the run goes on to the same end. Checkpoints that take long to write do not take
the place of the run.

`resume.py [KILLS]`, 50 by default.
"""
import pathlib
import re
import shutil
import sys
import time

import lab

OPTIONS = [*lab.SMALL["column"], "--set=time.end=12 ms", "--set=output.every=2 ms", "--set=checkpoint.every=0.02",
           "--set=grains.settle.energy=0.02"]


def look(folder):
    """Everything that a killed run left is whole; returns frames, rows of the series and the checkpoint's step."""
    frames = lab.frames(folder)
    assert [frame.name for frame in frames] == [f"{k:06d}.h5" for k in range(len(frames))], frames
    for frame in frames:
        lab.whole(frame)
    header, rows = lab.series(folder) if (folder / "series.csv").exists() else ([], [])
    times = [row[0] for row in rows]
    assert times == sorted(set(times)), f"series.csv: times {times}"
    known = [float(lab.contents(frame)["@time"]) for frame in frames]
    # what stands beyond the checkpoint in one of them is computed again
    assert known == times[:len(known)] or times == known[:len(times)], f"frames at {known}, rows at {times}"
    sidecar = folder / "run.xdmf"
    if sidecar.exists():
        named = set(re.findall(r"frames/\d+\.h5", sidecar.read_text()))
        there = {f"frames/{frame.name}" for frame in frames}
        assert named <= there, f"run.xdmf names {sorted(named - there)}, which is not there"
    checkpoint = folder / "checkpoint.h5"
    step = None
    if checkpoint.exists():
        state = lab.whole(checkpoint)
        step = int(state["@step"]) if state["@settled"] else -int(state["@settle_step"])
        assert state["@rows"] <= len(rows), "the checkpoint counts rows that series.csv does not hold"
        assert state["@frame"] < len(frames), "the checkpoint counts frames that are not there"
    return len(frames), len(rows), step


def kill(folder, moment):
    """True if the run was killed, False if it had ended."""
    process = lab.start("column", folder, *OPTIONS)
    time.sleep(moment)
    return lab.stop(process) != 0


def check(kills, place):
    base = place / "base"
    begin = time.monotonic()
    lab.run("column", base, *OPTIONS)
    length = time.monotonic() - begin
    moments, out, done = lab.seeded(), place / "run", []
    while len(done) < kills:
        shutil.rmtree(out, ignore_errors=True)
        if not kill(out, moments.uniform(0, length)):
            continue
        if out.exists():
            done.append(look(out))
        else:
            done.append((0, 0, None))
        lab.run("column", out, *OPTIONS, resume=True)
        look(out)
        left = [str(path) for path in out.rglob("*.part")]
        assert not left, f"left behind: {left}"
        last = lab.frames(base)[-1].name
        assert len(lab.frames(out)) == len(lab.frames(base))
        names = lab.differences(base / "frames" / last, out / "frames" / last)
        assert not names, f"kill {len(done)}, resumed at {done[-1]}: the last frame differs in {', '.join(names)}"
        assert (out / "series.csv").read_bytes() == (base / "series.csv").read_bytes(), "series.csv differs"
        names = lab.differences(base / "checkpoint.h5", out / "checkpoint.h5")
        assert not names, f"kill {len(done)}, resumed at {done[-1]}: the checkpoint differs in {', '.join(names)}"
    steps = [step for _, _, step in done if step is not None]
    print(f"{kills} kills in a run of {length:.2f} s: {sum(n for n, _, _ in done)} frames left, all whole; "
          f"{len(done) - len(steps)} before a checkpoint, {sum(s <= 0 for s in steps)} while settling, "
          f"{len({s for s in steps if s > 0})} different steps after; each went on to the same bits")


MANY = """
quern: 1
dimension: 3
gravity: [0, 0, -10]
domain: {lower: [0, 0, 0], upper: [0.2, 0.2, 0.4]}
time: {end: 6 ms}
grains:
  material: {density: 2500, radius: {mean: 4 mm}}
  contact: {linear: {stiffness: 1e4, friction: 0.5}}
  fill: {region: {box: {lower: [0.004, 0.004, 0.004], upper: [0.196, 0.196, 0.396]}}, packer: {random: {trials: 100}}}
bodies: [{plane: {point: [0, 0, 0], normal: [0, 0, 1]}}]
output: {every: 6 ms}
"""


def are_apart(place):
    """Between two checkpoints there is `checkpoint.every`, however long one takes to write: not one at each step."""
    scene, out, wall = place / "many.yaml", place / "many", {}
    scene.write_text(MANY)
    for every in (0, 1e-6):  # none between the release and the end; one after every step
        shutil.rmtree(out, ignore_errors=True)
        lab.run(scene, out, f"--set=checkpoint.every={every}")
        wall[every] = lab.summary(out)["wall_seconds"]
    steps = lab.summary(out)["steps"]
    one = (wall[1e-6] - wall[0]) / steps
    assert 0 < one and steps > 200
    shutil.rmtree(out)
    # half of what it takes to write one
    process, seen = lab.start(scene, out, f"--set=checkpoint.every={one / 2}"), set()
    while process.poll() is None:
        try:
            seen.add((out / "checkpoint.h5").stat().st_mtime_ns)
        except FileNotFoundError:
            pass
        time.sleep(0.001)
    assert process.returncode == 0
    print(f"{len(seen)} checkpoints in {steps} steps of {wall[0]:.2f} s, {1000 * one:.1f} ms to write each, half of that between two")
    assert 2 < len(seen) < steps / 2


if __name__ == "__main__":
    with lab.workplace() as name:
        are_apart(pathlib.Path(name))
        check(int(sys.argv[1]) if len(sys.argv) > 1 else 50, pathlib.Path(name))
