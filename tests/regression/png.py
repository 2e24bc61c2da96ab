# SPDX-License-Identifier: MIT
"""Pictures that are read back, and frames written by hand to be drawn."""
import os
import pathlib
import subprocess
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


def place(view, width, x):
    """The pixel at which a point of the plane stands in a picture of that view, by the page's own measures."""
    x0, y0, x1, y1 = view
    unit = max(width / 1600, 0.5)
    scale = min((width - 80 * unit) / (x1 - x0), 0.8 * width / (y1 - y0))
    left, top = np.floor(0.5 * (width - scale * (x1 - x0))), np.floor(84 * unit)
    return int(left + scale * (x[0] - x0)), int(top + scale * (y1 - x[1]))
