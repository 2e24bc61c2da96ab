# SPDX-License-Identifier: MIT
"""Runs to experiment with: small columns that convert within a second, runs stopped on the way, folders compared."""
import json
import os
import pathlib
import re
import random
import shutil
import signal
import subprocess
import tempfile
import time

import h5py
import numpy

QUERN = os.environ["QUERN"]
SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
PLUGINS = pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])


def use(program, plugins):
    """From now on all of this works with another program."""
    global QUERN, PLUGINS
    QUERN, PLUGINS = str(program), pathlib.Path(plugins)


def sets(**values):
    """--set options; `__` in a name stands for a dot."""
    return [f"--set={key.replace('__', '.')}={value}" for key, value in values.items()]


FIELDS = "[grain.velocity, grain.spin, grain.weight, point.velocity, point.stress, point.volume, point.weight, " \
    "cell.zone, cell.packing_fraction, contact.force, contact.slip]"
# The columns of configs/, smaller, softer and shallower, so that every one of their parts is at work within a second.
SMALL = {
    "column": sets(
        domain__upper="[0.2, 0.32]", time__end="80 ms", output__every="5 ms", hybrid__update=100, output__fields=FIELDS,
        grains__fill__0__region__box="{lower: [0, -0.7 mm], upper: [0.2, -0.7 mm]}",
        grains__fill__1__region__box="{lower: [0.001, 0.001], upper: [0.039, 0.045]}",
        bodies__2__plane__point="[0.04, 0]", grains__contact__linear__stiffness="1e5 N/m", grains__overlap__most=0,
        grains__settle__energy=1e-3, hybrid__oracle="[{packing_fraction: {depth: 8 mm, half_width: 4 mm}}]"),
    "column_3d": sets(
        domain__upper="[0.1, 0.008, 0.16]", time__end="20 ms", output__every="5 ms", hybrid__update=100,
        output__fields=FIELDS,
        grains__fill__0__region__box="{lower: [0, 0, -0.7 mm], upper: [0.1, 0.008, -0.7 mm]}",
        grains__fill__1__region__box="{lower: [0.001, 0, 0.001], upper: [0.019, 0.008, 0.04]}",
        bodies__2__plane__point="[0.02, 0, 0]", grains__contact__linear__stiffness="100 N/m", grains__overlap__most=0,
        continuum__fill__region__box__upper="[0.084, 0.008, 0.124]", grains__settle__energy=1e-3,
        hybrid__oracle="[{packing_fraction: {depth: 8 mm, half_width: 4 mm}}]")}


def interface():
    """Major and minor version of the plugin interface, from its header."""
    text = (SOURCE / "include/quern/abi.h").read_text()
    return tuple(int(re.search(rf"#define QUERN_ABI_{part} (\d+)u", text)[1]) for part in ("MAJOR", "MINOR"))


def scene(name):
    """A scene of configs/ by its name, or any by its path."""
    return str(name if isinstance(name, pathlib.Path) else SOURCE / "configs" / (name + ".yaml"))


def command(name, folder, *options, threads=1, program=None):
    return [program or QUERN, "run", scene(name), "--quiet", "--threads", str(threads), "-o", str(folder), *options]


def run(name, folder, *options, status=0, threads=1, program=None, resume=False, timeout=3600, **environment):
    """A run to its end; returns what it says on the way."""
    words = command(name, folder, *options, *(["--resume"] if resume else []), threads=threads, program=program)
    done = subprocess.run(words, capture_output=True, text=True, timeout=timeout, env={**os.environ, **environment})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stderr


def summary(folder):
    return json.loads((pathlib.Path(folder) / "summary.json").read_text())


def plan(name, *options, **environment):
    words = [QUERN, "plan", "--json", scene(name), *options]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


# ---- stopping a run on the way ----

def start(name, folder, *options, threads=1, resume=False):
    words = command(name, folder, *options, *(["--resume"] if resume else []), threads=threads)
    return subprocess.Popen(words, stdout=subprocess.DEVNULL)


def wait_for(path, process, newer=0.0, timeout=600):
    """Until there is such a file, or a newer one; False if the run ends before."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        try:
            if os.stat(path).st_mtime_ns > newer:
                return True
        except FileNotFoundError:
            pass
        if process.poll() is not None:
            return False
        time.sleep(0.002)
    raise AssertionError(f"{path} does not come")


def mapped(process):
    """Ids of the plugins whose objects a running process has mapped."""
    lines = pathlib.Path(f"/proc/{process.pid}/maps").read_text().splitlines()
    files = {pathlib.Path(line.split(maxsplit=5)[5]) for line in lines if line.endswith(".so")}
    return {".".join(file.name.split(".")[:2]) for file in files if file.parent == PLUGINS.resolve()}


def stop(process, number=signal.SIGKILL):
    process.send_signal(number)
    return process.wait(timeout=600)


def on_the_way(name, folder, options, number, wait, threads=1):
    """Starts or resumes a run and stops it with a signal once wait(process, share) is over. A run that has ended by then
    is put back and tried again with a smaller share of the waiting."""
    aside, begun = folder.with_name(folder.name + ".before"), folder / "scene.yaml"
    if folder.exists():
        shutil.copytree(folder, aside)
    for attempt in range(20):
        before = begun.stat().st_mtime_ns if begun.exists() else 0
        process = start(name, folder, *options, threads=threads, resume=aside.exists())
        wait_for(begun, process, newer=before)  # from here on Ctrl-C is waited for
        wait(process, 0.7 ** attempt)
        status = stop(process, number)
        if status == (130 if number == signal.SIGINT else -number):
            shutil.rmtree(aside, ignore_errors=True)
            return
        assert status == 0, f"{name}: exit status {status} after signal {number}"
        shutil.rmtree(folder)
        if aside.exists():
            shutil.copytree(aside, folder)
    raise AssertionError(f"{name}: twenty times over before signal {number}")


# ---- looking into what a run left ----

def frames(folder):
    return sorted((pathlib.Path(folder) / "frames").glob("*.h5"))


def contents(path):
    """Every dataset and every attribute of an HDF5 file, by path."""
    found = {}
    with h5py.File(path, "r") as file:
        def note(name, thing):
            if isinstance(thing, h5py.Dataset):
                found[name] = thing[()]
            for key, value in thing.attrs.items():
                found[f"{name}@{key}"] = value
        note("", file)
        file.visititems(note)
    return found


# What the run was made with, or how long it took; all the rest is the result.
PROVENANCE = {"@compiler", "@flags", "@program", "@wall", "@settle_wall", "@processor", "@settle_processor", "scene"}


def is_provenance(name):
    return name in PROVENANCE or name.startswith("plugins/")


def differences(one, two):
    """Names of what is not the same to the bit in two files."""
    a, b = contents(one), contents(two)
    names = [name for name in sorted(set(a) ^ set(b)) if not is_provenance(name)]
    for name in sorted(set(a) & set(b)):
        if is_provenance(name):
            continue
        x, y = numpy.asarray(a[name]), numpy.asarray(b[name])
        if x.dtype != y.dtype or x.shape != y.shape or x.tobytes() != y.tobytes():
            names.append(name)
    return names


def same(one, two, what, checkpoint=True):
    """Two runs left the same frames, series and checkpoint, to the bit; returns (frames, datasets, bytes)."""
    first, second = frames(one), frames(two)
    assert first and [p.name for p in first] == [p.name for p in second], \
        f"{what}: {len(first)} and {len(second)} frames"
    pairs = list(zip(first, second))
    if checkpoint:
        pairs.append((one / "checkpoint.h5", two / "checkpoint.h5"))
    size = count = 0
    one_program = contents(first[0])["@compiler"] == contents(second[0])["@compiler"]
    for a, b in pairs:
        names = differences(a, b)
        assert not names, f"{what}: {a.name} differs in {', '.join(names[:12])}"
        assert not one_program or a.name == "checkpoint.h5" or a.read_bytes() == b.read_bytes(), \
            f"{what}: {a.name} holds the same in other bytes"
        arrays = [v for name, v in contents(a).items() if "@" not in name]
        count += len(arrays)
        size += sum(v.nbytes for v in arrays)
    assert (one / "series.csv").read_bytes() == (two / "series.csv").read_bytes(), f"{what}: series.csv differs"
    print(f"  {what}: {len(first)} frames, {count} datasets, {size} bytes the same", flush=True)
    return len(first), count, size


def same_ways(name, base, folder, *options, what="", batches=(8,), levels=()):
    """A scene leaves what it has left in `base`, to the bit: with two threads, and so in other batches, with other instruction sets, and
    where QUERN_OTHER names a program of another compiler, by that one. Sanitizers, which look for other things, see two threads alone."""
    ways = {"2 threads": ([], {"threads": 2})}
    if os.environ.get("QUERN_WAYS") == "threads":
        batches, levels = (), ()
    ways |= {f"run.batch: {batch}": ([f"--set=run.batch={batch}"], {"threads": 2}) for batch in batches}
    ways |= {f"run.instructions: {level}": ([f"--set=run.instructions={level}"], {}) for level in levels}
    if os.environ.get("QUERN_OTHER"):
        ways["another compiler"] = ([], {"program": os.environ["QUERN_OTHER"]})
    for number, (way, (more, how)) in enumerate(ways.items()):
        out = folder / f"way{number}"
        run(name, out, *options, *more, **how)
        same(base, out, f"{what}{way}")


def whole(path):
    """Reads every byte of an HDF5 file; fails if it is not whole."""
    try:
        return contents(path)
    except (OSError, RuntimeError) as why:
        raise AssertionError(f"{path} is not whole: {why}") from None


def series(folder):
    """The header and the rows of series.csv; fails if a row is not whole."""
    text = (pathlib.Path(folder) / "series.csv").read_text()
    assert text.endswith("\n"), f"{folder}: series.csv ends within a row"
    lines = [line.split(",") for line in text.splitlines()]
    assert all(len(line) == len(lines[0]) for line in lines), f"{folder}: series.csv has a row of another length"
    return lines[0], [[float(word) for word in line] for line in lines[1:]]


def workplace():
    """A folder for a while, in memory where that can be: on a disk every file that is flushed takes its time."""
    memory = "/dev/shm"
    return tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None)


def seeded(seed=20260101):
    return random.Random(seed)
