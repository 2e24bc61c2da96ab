# SPDX-License-Identifier: MIT
"""`quern render`: pictures of frames of every sort, looked at pixel by pixel, and its refusals."""
import os
import pathlib
import subprocess
import tempfile
import zlib

import h5py
import numpy as np

QUERN = pathlib.Path(os.environ["QUERN"])
SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])


def run(*words, status=0):
    done = subprocess.run([str(w) for w in (QUERN, *words)], capture_output=True, text=True, timeout=60)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stdout if status == 0 else done.stderr


def unfilter(kind, row, above):
    """Undoes what PNG did to a row before packing it."""
    if kind == 2:
        return bytearray((a + b) & 255 for a, b in zip(row, above))
    for x in range(len(row) if kind else 0):
        left, up, corner = (row[x - 3], above[x], above[x - 3]) if x > 2 else (0, above[x], 0)
        if kind == 1:
            guess = left
        elif kind == 3:
            guess = (left + up) >> 1
        else:
            to_left, to_up, to_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            guess = left if to_left <= to_up and to_left <= to_corner else up if to_up <= to_corner else corner
        row[x] = (row[x] + guess) & 255
    return row


def read_png(path):
    """Rows x columns x 3 of a picture with eight bits per colour."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is no PNG"
    place, packed, width, height = 8, b"", 0, 0
    while place < len(data):
        length, name = int.from_bytes(data[place:place + 4], "big"), data[place + 4:place + 8]
        body = data[place + 8:place + 8 + length]
        if name == b"IHDR":
            width, height = (int.from_bytes(body[k:k + 4], "big") for k in (0, 4))
            assert body[8:10] == b"\x08\x02", "not eight bits of red, green, blue"
        packed += body if name == b"IDAT" else b""
        place += length + 12
    raw, stride = zlib.decompress(packed), 3 * width
    above, picture = bytearray(stride), bytearray()
    for y in range(height):
        begin = y * (stride + 1)
        above = unfilter(raw[begin], bytearray(raw[begin + 1:begin + 1 + stride]), above)
        picture += above
    return np.frombuffer(picture, np.uint8).reshape(height, width, 3).astype(int)


def write_frame(folder, dimension, name, sets, number=0):
    (folder / "frames").mkdir(parents=True, exist_ok=True)
    with h5py.File(folder / f"frames/{number:06d}.h5", "w") as file:
        for key, value in {"format": np.bytes_("quern-frame 1"), "time": 0.35, "dimension": np.int64(dimension),
                           "name": np.bytes_(name)}.items():
            file.attrs.create(key, value)
        for group, columns in sets.items():
            for field, (unit, table) in columns.items():
                file.create_dataset(f"{group}/{field}", data=table).attrs.create("unit", np.bytes_(unit))


def lattice(dimension, n, step):
    axes = np.meshgrid(*[(np.arange(n) + 0.5) * step] * dimension, indexing="ij")
    table = np.zeros((n ** dimension, 3))
    table[:, :dimension] = np.stack([a.ravel() for a in axes], 1)
    return table


def hybrid(folder, dimension):
    """Grains on top, points below, a layer of both; one grain is fixed."""
    step, n = 2e-3, 24 if dimension == 2 else 10
    x = lattice(dimension, n, step)
    up, top = x[:, dimension - 1], n * step
    grain, point = up > 0.4 * top, up < 0.6 * top
    fixed = np.zeros(grain.sum(), np.int32)
    fixed[0] = 1
    write_frame(folder, dimension, "a hybrid", {
        "grains": {"position": ("m", x[grain]), "radius": ("m", np.full(grain.sum(), 0.5 * step)), "fixed": ("1", fixed),
                   "velocity": ("m/s", x[grain] * 10), "weight": ("1", np.where(up[grain] < 0.6 * top, 0.5, 1.0))},
        "points": {"position": ("m", x[point]), "volume": ("m^2", np.full(point.sum(), step ** dimension)),
                   "velocity": ("m/s", x[point] * 10), "pressure": ("Pa", 1e4 * (top - up[point]))},
        "cells": {"position": ("m", x), "packing_fraction": ("1", 0.5 + 0 * up),
                  "zone": ("1", np.where(up > 0.6 * top, 0, np.where(up > 0.4 * top, 1, 2)).astype(np.int32))}})


def picture_of(folder, out, *options, width=600):
    said = run("render", folder, "-o", out, "--width", width, *options)
    assert said == f"{out}\n", f"it does not say where the picture is: {said}"
    picture = read_png(out)
    assert picture.shape[1] == width, f"{out.name} is {picture.shape[1]} pixels wide, not {width}"
    rim = np.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
    assert (rim == 255).all(), f"{out.name}: something reaches the edge of the page"
    inked = (picture < 250).any(axis=2).mean()
    assert 0.01 < inked < 0.9, f"{out.name}: {inked:.1%} of the page are inked"
    print(f"{out.name}: {picture.shape[1]} x {picture.shape[0]}, {inked:.1%} inked")
    return picture


def has_colour(picture, colour):
    return (np.abs(picture - np.array(colour)).max(axis=2) <= 3).any()


def lightness_rises(folder):
    """Along a row of points whose field rises, the colours get lighter all the way."""
    n = 60
    row = np.zeros((n, 3))
    row[:, 0] = np.arange(n)
    write_frame(folder, 2, "a row", {"points": {"position": ("m", row), "volume": ("m^2", np.ones(n)),
                                                "rise": ("Pa", np.linspace(0, 1, n))}})
    picture = picture_of(folder, folder / "row.png", "--field", "point.rise", width=800)
    level = next(y for y in range(40, picture.shape[0]) if (picture[y:y + 8] < 250).any(axis=2).mean() > 0.6) + 6
    inked = np.flatnonzero((picture[level] < 250).any(axis=1))
    points = [part[len(part) // 2] for part in np.split(inked, np.flatnonzero(np.diff(inked) > 1) + 1)]
    light = picture[level, points] @ [0.2126, 0.7152, 0.0722]
    assert len(light) == n and (np.diff(light) > 0).all() and light[-1] > light[0] + 120, f"it does not rise: {light}"


def pictures(folder):
    run("run", SOURCE / "configs/two_grains.yaml", "-o", folder / "two", "--quiet")
    said = run("render", folder / "two")
    assert said == f"{folder}/two/frame_000020.png\n", said
    picture_of(folder / "two", folder / "two.png", "--frame", 3)
    picture_of(folder / "two", folder / "radius.png", "--field", "grain.radius")
    for d in (2, 3):
        hybrid(folder / f"h{d}", d)
        plain = picture_of(folder / f"h{d}", folder / f"hybrid{d}.png")
        picture_of(folder / f"h{d}", folder / f"pressure{d}.png", "--field", "point.pressure")
        picture_of(folder / f"h{d}", folder / f"cells{d}.png", "--field", "cell.packing_fraction")
        assert has_colour(plain, (184, 184, 184)), f"{d}-D: the fixed grain is not grey"
    bytes_of = [run("render", folder / "h3", "-o", folder / f"{k}.png") and (folder / f"{k}.png").read_bytes()
                for k in "ab"]
    assert bytes_of[0] == bytes_of[1], "two pictures of one frame differ"
    picture_of(folder / "h2", folder / "large.png", width=1000)
    lightness_rises(folder / "row")


def refusals(folder):
    damaged = folder / "damaged/frames"
    damaged.mkdir(parents=True)
    (damaged / "000004.h5").write_bytes(b"no such thing")
    write_frame(folder / "void", 2, "nothing", {})
    write_frame(folder / "nan", 2, "no places", {"grains": {"position": ("m", np.full((3, 3), np.nan))}})
    write_frame(folder / "huge", 2, "a lie", {})
    with h5py.File(folder / "huge/frames/000000.h5", "a") as file:
        file.create_dataset("grains/position", shape=(1 << 50, 3), chunks=(1 << 10, 3))
    for words, status, part in [([folder / "two", "--frame", 99], 2, "its frames are 0 to 20"),
                                ([folder / "nowhere"], 2, "holds no frames"),
                                ([folder / "damaged"], 2, "missing or damaged"),
                                ([folder / "void"], 2, "neither grains nor points"),
                                ([folder / "nan"], 2, "is damaged"), ([folder / "huge"], 2, "is damaged"),
                                ([folder / "h2", "--field", "point.presure"], 1, "point.pressure, point.velocity"),
                                ([folder / "h2", "--field", "grain.radius", "-o", folder / "no/a.png"], 4, "written"),
                                ([folder / "h2", "--field", "grain.radius.y"], 1, "no field"),
                                ([folder / "h2", "--width", 10], 1, "between 600 and 8000"),
                                ([folder / "h2", "--colour"], 1, "unknown option '--colour'"), ([], 1, "is missing")]:
        said = run("render", *words, status=status)
        assert part in said, f"render {words}: {said}"
    print("every fault is refused in one sentence")


with tempfile.TemporaryDirectory() as name:
    pictures(pathlib.Path(name))
    refusals(pathlib.Path(name))
