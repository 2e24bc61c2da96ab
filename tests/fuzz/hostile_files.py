# SPDX-License-Identifier: MIT
"""Checkpoints and frames that were damaged: bits and words overwritten, ends cut off; and checkpoints whose values, counters
and sizes were changed by somebody who puts the checksum right. Each is resumed from or drawn, under a limit of time; what
a run leaves that ends well is looked at (nonsense.py).

hostile_files.py [--seed N] [--count N] [--only K] [--keep FOLDER]; the same seed makes the same damage.
"""
import argparse
import pathlib
import random
import shutil
import struct
import sys
import tempfile

try:
    import yaml  # noqa: F401
except ImportError:
    print("python3-yaml is not installed: skipped")
    sys.exit(77)

import h5py
import numpy

import hostile_scenes
import nonsense
from nonsense import call, check_end, lab, look, need

USER_BLOCK = 512
BASES = {"column": "4 ms", "column_3d": "2 ms", "bed": "2 ms", "continuum": "4 ms"}  # when they were stopped
NUMBERS = [float("nan"), float("inf"), -float("inf"), 1e300, -1e300, 1e15, -1.0, 0.0, 5e-324, 1e9]
INTEGERS = [-1, 0, 1, 1 << 31, 1 << 40, 1 << 62, -(1 << 62), 10**9, -2]


# ---- damage of the bytes ----

def damage(data, r):
    """Bits, words, whole pages, the end."""
    data, kind = bytearray(data), r.randrange(6)
    if kind == 0:
        del data[r.randrange(len(data)):]
    for _ in range(r.choice([1, 1, 3, 30])):
        # what a file says about itself stands in front
        place = r.randrange(len(data) if r.random() < 0.4 else min(len(data), 12288)) if data else 0
        if kind in (1, 2) and data:
            data[place] ^= 1 << r.randrange(8)
        elif kind == 3 and data:
            place &= ~7
            word = r.choice([b"\xff" * 8, b"\0" * 8, r.randbytes(8), struct.pack("<Q", 1 << r.randrange(63))])
            data[place:place + 8] = word[:len(data[place:place + 8])]
        elif kind == 4:
            data[place:place + 4096] = b"\0" * len(data[place:place + 4096])
        elif kind == 5:
            data[place:place] = r.randbytes(r.randrange(1, 64))
    return bytes(data)


# ---- changes that keep the form ----

def seal(path):
    """FNV-1a of what is behind the first 512 bytes stands behind the mark."""
    data, value = bytearray(path.read_bytes()), 1469598103934665603
    for byte in memoryview(data)[USER_BLOCK:]:
        value = (value ^ byte) * 1099511628211 & 0xffffffffffffffff
    data[:USER_BLOCK] = b"quern checksum\n\0" + struct.pack("<Q", value) + bytes(USER_BLOCK - 24)
    path.write_bytes(data)


def change_value(file, name, r):
    values = file[name][()]
    if not values.size:
        return
    place = r.randrange(values.size)
    if values.dtype.kind == "f":
        new = r.choice(NUMBERS) if r.random() < 0.6 else values.flat[place] * 10.0 ** r.uniform(-9, 9)
    else:
        info = numpy.iinfo(values.dtype)
        new = min(max(r.choice(INTEGERS), info.min), info.max)
    values.flat[place] = new
    if r.random() < 0.2:
        values[...] = new
    file[name][...] = values


def change_size(file, name, r):
    values = file[name][()]
    del file[name]
    kind = r.randrange(4)
    if kind == 0:
        return
    shape = {1: (max(values.shape[0] + r.choice([-1, 1]), 0), *values.shape[1:]), 2: (*values.shape, 2),
             3: values.shape}[kind]
    dtype = r.choice([values.dtype, "f4", "i8", "S4"]) if kind == 3 else values.dtype
    file[name] = numpy.resize(values, shape).astype(dtype) if values.size else numpy.zeros(shape, dtype)


def change_attribute(thing, key, r):
    old = thing.attrs[key]
    if isinstance(old, (bytes, str, numpy.bytes_)):
        thing.attrs[key] = r.choice(["", "quern-checkpoint 3", "x" * 4000, "\xff"])
    elif numpy.issubdtype(type(old), numpy.floating):
        thing.attrs[key] = numpy.float64(r.choice(NUMBERS) if r.random() < 0.6 else old * r.uniform(0, 3))
    else:
        thing.attrs[key] = numpy.int64(r.choice(INTEGERS) if r.random() < 0.6 else old + r.randrange(-3, 4))


def forge(path, r):
    """One to three things that a sound file could not hold."""
    with h5py.File(path, "r+") as file:
        names, keys = [], [("/", key) for key in file.attrs]
        for group in sorted(file):
            if isinstance(file[group], h5py.Dataset):
                names.append(group)
            elif group != "plugins":
                names += [f"{group}/{name}" for name in sorted(file[group])]
                keys += [(group, key) for key in file[group].attrs]
        for _ in range(r.choice([1, 1, 1, 2, 3])):
            kind = r.random()
            if kind < 0.55:
                name = r.choice([n for n in names if n in file])
                change_value(file, name, r)
            elif kind < 0.7:
                change_size(file, r.choice([n for n in names if n in file]), r)
            else:
                where, key = r.choice(keys)
                change_attribute(file[where], key, r)
    seal(path)


# ---- trials ----

def begin(folder):
    """A run of each base that was stopped on the way, with its scene."""
    for name, until in BASES.items():
        scene = folder / f"{name}.yaml"
        scene.write_text(hostile_scenes.written(hostile_scenes.base(name)))
        status, _, said = call("run", scene, "-o", folder / name, "--quiet", "--threads", 1, "--until", until,
                               *hostile_scenes.OBSERVED[:1], "--set=output.fields=[grain.velocity, point.stress, contact.force, touch.force]", limit=60)
        assert status == 0, said


def resume(k, name, folder, own, r):
    checkpoint, rows = own / "checkpoint.h5", len((own / "series.csv").read_text().splitlines()) - 1
    if r.random() < 0.3:
        checkpoint.write_bytes(damage(checkpoint.read_bytes(), r))
    else:
        forge(checkpoint, r)
    words = ["run", folder / f"{name}.yaml", "-o", own, "--quiet", "--resume", "--threads", 1, *hostile_scenes.OBSERVED[:1],
             "--set=output.fields=[grain.velocity, point.stress, contact.force, touch.force]"]
    # a step that somebody has made smaller may be sound, and then a run takes as long as it says
    status, _, said = call(*words, limit=20, stop_after=5)
    check_end(words, status, said, allowed=(0, 2, 3, 4, 130))
    need(status != 130 or "estimated" in (own / "log.txt").read_text(), "interrupted, and it gave no estimate")
    if status == 0:
        look(own, since=rows)
    return {0: "goes on", 130: "takes long"}.get(status, f"ends with {status}")


def draw(k, folder, own, r):
    frame = r.choice(sorted((own / "frames").glob("*.h5")))
    frame.write_bytes(damage(frame.read_bytes(), r))
    field = r.choice([[], ["--field", "grain.velocity.x"], ["--field", "radius"], ["--field", "point.stress.xy"],
                      ["--chains"], ["--vectors", "velocity"], ["--view=-0.01,0,0.01,0.02"], ["--view=-0.01,0,0,0.01,0.02,0.03"],
                      ["--range=-1,1"]])
    words = ["render", own, "--frame", int(frame.stem), "--width", 600, "-o", own / "picture.png", *field]
    status, _, said = call(*words, limit=20)
    check_end(words, status, said, allowed=(0, 1, 2) if field else (0, 2))
    need(status or (own / "picture.png").stat().st_size > 3000, "a picture without anything in it")
    return "drawn" if status == 0 else f"not drawn: {status}"


def go_on_past(k, name, folder, own, r):
    """A run goes on though a frame that it wrote long ago is damaged."""
    frame = r.choice(sorted((own / "frames").glob("*.h5")))
    frame.write_bytes(damage(frame.read_bytes(), r))
    words = ["run", folder / f"{name}.yaml", "-o", own, "--quiet", "--resume", "--threads", 1, "--until",
             hostile_scenes.SMALL[name].get("time.end", "4 ms"), *hostile_scenes.OBSERVED[:1],
             "--set=output.fields=[grain.velocity, point.stress, contact.force, touch.force]"]
    status, _, said = call(*words, limit=20)
    check_end(words, status, said, allowed=(0,))
    return "goes on past a frame"


def attempt(k, seed, folder):
    r = random.Random(f"{seed} {k}")
    name = r.choice(list(BASES))
    own = folder / f"trial{k}"
    shutil.copytree(folder / name, own)
    if k % 2 == 0:
        word = resume(k, name, folder, own, r)
    else:
        word = go_on_past(k, name, folder, own, r) if k % 10 == 1 else draw(k, folder, own, r)
    shutil.rmtree(own)  # what has failed stays
    return word


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=20262)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--only", type=int)
    parser.add_argument("--keep", type=pathlib.Path)
    o = parser.parse_args()
    with tempfile.TemporaryDirectory() if o.keep else lab.workplace() as place:
        folder = o.keep or pathlib.Path(place)
        folder.mkdir(exist_ok=True)
        begin(folder)
        cases = [o.only] if o.only is not None else range(o.count)
        faults = nonsense.each(lambda k: attempt(k, o.seed, folder), cases, f"{len(cases)} damaged files, seed {o.seed}")
    for fault in faults:
        print(f"file {fault}\n  again: --seed {o.seed} --only {fault.split(':')[0]} --keep FOLDER")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
