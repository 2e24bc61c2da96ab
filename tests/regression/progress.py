# SPDX-License-Identifier: MIT
"""What a run says while it goes: a line on a terminal, progress.json for programs, no control characters elsewhere; and that saying it
changes nothing and costs next to nothing."""
import contextlib
import fcntl
import json
import os
import pathlib
import pty
import re
import signal
import struct
import subprocess
import termios
import threading
import time

import h5py
import numpy

import lab

BED = """
quern: 1
dimension: 2
seed: 3
gravity: [0, -10]
domain: {lower: [0, -0.05], upper: [0.25, 0.5]}
time: {end: 1.5}
grains:
  material: {density: 2500, radius: {mean: 4 mm, spread: 10 %}}
  contact: {linear: {stiffness: 1e5, restitution: 0.5, friction: 0.5}}
  overlap: {most: 0}
  settle: {energy: 1e-14}
  fill: {region: {box: {lower: [0.01, 0.01], upper: [0.24, 0.4]}}, settle: true}
bodies:
  - {plane: {point: [0, 0], normal: [0, 1]}}
  - {plane: {point: [0, 0], normal: [1, 0]}}
  - {plane: {point: [0.25, 0], normal: [-1, 0]}}
output: {every: 0.5, fields: [grain.velocity]}
observe: [coordination]
"""


def on_terminal(scene, out, *options, columns=200):
    """What a run writes to a terminal of that width; None where none can be had."""
    try:
        master, slave = pty.openpty()
    except OSError:
        return None
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    words = [word for word in lab.command(scene, out, *options) if word != "--quiet"]
    process, said, looked = subprocess.Popen(words, stderr=slave), b"", []
    os.close(slave)
    with contextlib.suppress(OSError):
        while part := os.read(master, 4096):
            said += part
            with contextlib.suppress(FileNotFoundError):
                looked.append(json.loads((out / "progress.json").read_text()))  # never half of one
    assert process.wait() == 0, said
    return said.decode(), looked


def a_line(place):
    scene = place / "bed.yaml"
    scene.write_text(BED)
    both = on_terminal(scene, place / "terminal", "--set=time.end=9")  # some seconds: no speed is known before the second line
    if not both:
        print("no terminal can be had here")
        return
    said, looked = both
    lines = [line for line in re.findall(r"\r\x1b\[K([^\r\n]*)", said)]
    settling = [line for line in lines if line.startswith("settling: ")]
    running = [line for line in lines if line.startswith("t = ")]
    print(*settling[-1:], *running[-1:], sep="\n")
    number = r"[-+.e\d]+"
    assert settling and running
    assert re.search(rf"settling: \d+ steps, \d+ s(, {number} steps/s)?, kinetic {number} J/grain, residual {number}, overlap {number} %$", settling[0])
    assert re.search(rf"t = {number} of 9 s \(\d+ %\), step \d+, \d+ s left, {number} steps/s, kinetic {number} J/grain, overlap {number} %$", running[-1])
    residual = [float(re.search(r"residual ([^ ,]+)", line)[1]) for line in settling]
    assert residual[0] > 1 and "residual" not in running[-1], residual
    status = [one["status"] for one in looked]
    assert "running" in status and json.loads((place / "terminal/progress.json").read_text())["status"] == "done"
    narrow, _ = on_terminal(scene, place / "narrow", "--set=time.end=0.5", columns=40)
    assert max(len(line) for line in re.findall(r"\r\x1b\[K((?:t = |settling: )[^\r\n]*)", narrow)) == 39


def numbers(place):
    """progress.json says what the last frame says."""
    out = place / "numbers"
    done = subprocess.run([lab.QUERN, "run", str(place / "bed.yaml"), "-o", str(out), "--threads", "1", "--set=time.end=0.5"],
                          capture_output=True, text=True, check=True)
    assert "\r" not in done.stderr and "\x1b" not in done.stderr, "control characters without a terminal"
    found = json.loads((out / "progress.json").read_text())
    assert (found["status"], found["time"], found["time_end"], found["seconds_left"], found["frame"]) == ("done", 0.5, 0.5, 0, 1)
    with h5py.File(lab.frames(out)[-1]) as file:
        x, v, r = (file["grains"][name][:] for name in ("position", "velocity", "radius"))
    mass = 2500 * numpy.pi * r ** 2
    kinetic = 0.5 * (mass * (v ** 2).sum(1)).mean()
    gap = numpy.sqrt(((x[:, None] - x[None]) ** 2).sum(-1)) - r[:, None] - r[None]
    deep = (-gap / numpy.minimum(r[:, None], r[None]))[~numpy.eye(len(r), dtype=bool)].max()
    looks = found["looks"]["grains"]
    print(f"kinetic {looks['kinetic']['value']:.6g}, by the frame {kinetic:.6g}; overlap {looks['overlap']['value']:.6g} %, by the frame {100 * deep:.6g}")
    assert abs(looks["kinetic"]["value"] / kinetic - 1) < 1e-6 and looks["kinetic"]["unit"] == "J/grain"
    assert abs(looks["overlap"]["value"] / (100 * deep) - 1) < 1e-6 and looks["overlap"]["unit"] == "%"


def share_and_updates(place):
    """A hybrid says what its grains carry; its log has a line per update only where it is asked for."""
    options = [*lab.SMALL["column"], "--set=observe=[discrete_share]", "--set=time.end=20 ms"]
    lab.run("column", place / "short", *options)
    lab.run("column", place / "long", *options, "--verbose")
    lab.same(place / "short", place / "long", "with --verbose")
    logs = [(place / name / "log.txt").read_text() for name in ("short", "long")]
    updates = [len(re.findall(r"^update \d+ at step", log, re.M)) for log in logs]
    found = json.loads((place / "short/progress.json").read_text())["looks"]["hybrid"]["discrete"]
    share = lab.summary(place / "short")["observers"]["discrete_share"]["share"]["last"]
    print(f"lines of updates: {updates[0]}, with --verbose {updates[1]}; grains carry {found['value']:.6g} %, observed {100 * share:.6g}")
    assert updates[0] == 0 and updates[1] > 0
    assert abs(found["value"] - 100 * share) < 1e-6


def measured(scene, out, *options, stop=None, threads=2, status=0, **environment):
    """Seconds of the processor that the system counts for one run, and its summary; `stop`: s of it before it is asked to end."""
    words = [word if word != "1" else str(threads) for word in lab.command(scene, out, *options)]
    # what malloc fills by request would count
    process = subprocess.Popen(words, env={**os.environ, "MALLOC_PERTURB_": "0", **environment}, stderr=subprocess.PIPE)
    if stop:
        while not (out / "progress.json").exists():
            time.sleep(0.01)
        time.sleep(stop)
        process.send_signal(signal.SIGTERM)
    said = process.stderr.read()
    _, ended, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(ended)
    assert process.returncode == status, said
    return usage.ru_utime + usage.ru_stime, lab.summary(out)


def cost(place):
    """What a run has cost is what the system says, of all threads, over a stop while it settles and one after; what it took up to the
    release stands apart, and of a state that was kept that is little."""
    scene, sums, short = place / "bed.yaml", [], "--set=time.end=0.5"
    cache = str(place / "cache")
    first, second = (measured(scene, place / name, short, QUERN_CACHE=cache)[1] for name in ("keeps", "takes"))
    costs = [found[name] for found in (first, second) for name in ("settle_processor_seconds", "processor_seconds")]
    print("settled here: {:.3f} of {:.3f} s, taken: {:.3f} of {:.3f} s".format(*costs))
    assert costs[2] < costs[0] / 5 and costs[2] < costs[3] < costs[1]
    settling = first["settle_seconds"]  # a third of it is well inside it on any machine
    for k, how in enumerate([{"stop": settling / 3, "status": 130}, {"options": ["--until=0.2", "--resume"]}, {"options": ["--resume"]}]):
        used, found = measured(scene, place / "parts", short, *how.pop("options", []), **how)
        sums.append((used, found["processor_seconds"], found["settle_processor_seconds"], found["settle_seconds"]))
        print("of the system {:.3f} s; in all {:.3f} s, settling {:.3f} s, on the clock {:.3f} s".format(*sums[-1]))
        whole = sum(one[0] for one in sums)
        assert found["processor_seconds"] <= whole <= found["processor_seconds"] + 0.05 * (k + 1), (k, sums)
    assert 0.8 * sums[0][1] < sums[0][2] <= sums[0][1] < sums[1][2] == sums[2][2] < sums[1][1] < sums[2][1], sums
    # two threads use no more than twice what the clock says, on a busy machine less
    rest = 0.9 * (sums[1][2] - sums[0][2]) / 2
    assert sums[0][3] + rest < sums[1][3] == sums[2][3], "what had settled before the stop is forgotten"


def is_held(folder):
    """Whether a process holds a run's folder, as docs/run_folder.md says that one finds out."""
    try:
        with open(folder / ".quern.lock") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False


def who_is_at_work(place):
    """A killed run leaves its last word behind, and the lock tells that nobody is at work; one whose last word cannot be written leaves
    none, rather than one that says that it goes on."""
    scene = place / "bed.yaml"
    killed = lab.start(scene, place / "killed")
    assert lab.wait_for(place / "killed" / "progress.json", killed) and is_held(place / "killed")
    word = json.loads((place / "killed" / "progress.json").read_text())
    assert word["process"] == killed.pid
    killed.kill()
    killed.wait()
    word = json.loads((place / "killed" / "progress.json").read_text())
    assert word["status"] in ("settling", "running") and not is_held(place / "killed"), word
    blocked = lab.start(scene, place / "blocked", "--set=time.end=0.25")
    assert lab.wait_for(place / "blocked" / "progress.json", blocked)
    while blocked.poll() is None and not (place / "blocked" / "progress.json.part").is_dir():
        with contextlib.suppress(FileExistsError):
            (place / "blocked" / "progress.json.part").mkdir()  # as on a full disk: nothing can be written there
    assert blocked.wait() == 0 and lab.summary(place / "blocked")["status"] == "done"
    assert not (place / "blocked" / "progress.json").exists() and not is_held(place / "blocked")
    print(f"a killed run says '{word['status']}' and holds no lock; one that cannot write its last word has none")


def many_grains(place):
    """Whoever has mistaken a unit is told how many grains that makes, and how much memory, before they are placed."""
    scene = place / "many.yaml"
    scene.write_text(BED.replace("mean: 4 mm", "mean: 5 um"))
    with subprocess.Popen([lab.QUERN, "plan", scene], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        patience = threading.Timer(60, process.kill)
        patience.start()
        said = process.stderr.readline()
        process.kill()
        patience.cancel()
    print(said.strip())
    assert "hold about 9e+08 grains" in said and "538 GB" in said, said


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (a_line, many_grains, numbers, share_and_updates, cost, who_is_at_work):
            test(pathlib.Path(name))
