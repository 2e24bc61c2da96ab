# SPDX-License-Identifier: MIT
"""Tables of grains: what a column says is what the grains begin with, by whatever name the dimension knows it, with any ends of lines and
with remarks before the header."""
import pathlib
import subprocess

import h5py

import lab

SCENE = """quern: 1
dimension: {dim}
gravity: {zero}
domain: {{lower: {zero}, upper: {one}}}
time: {{end: 1 s}}
grains:
  material: {{density: 2500, radius: {{mean: 0.01}}}}
  contact: {{linear: {{stiffness: 1e5, friction: 0.5}}}}
  file: grains.txt
output: {{every: 1 s, fields: [grain.velocity, grain.spin]}}
"""
PLANE = {"x": 0.5, "y": 0.4, "vx": 1.5, "vy": -2.5, "w": 3.5, "radius": 0.02}
SPACE = {"x": 0.5, "y": 0.4, "z": 0.3, "vx": 1.5, "vy": -2.5, "vz": 0.5, "wx": 3.5, "wy": 4.5, "wz": -5.5, "radius": 0.02}


def begun(place, dim, table):
    """The one grain of a table, as the first frame shows it."""
    (place / "scene.yaml").write_text(SCENE.format(dim=dim, zero=[0] * dim, one=[1] * dim))
    (place / "grains.txt").write_bytes(table.encode())
    done = subprocess.run([lab.QUERN, "run", "scene.yaml", "-o", "out", "--force", "--quiet", "--until", "0"], cwd=place, capture_output=True, text=True)
    assert done.returncode == 0, f"{table!r}\n{done.stderr}"
    with h5py.File(sorted((place / "out/frames").glob("*.h5"))[0]) as file:
        grains = file["grains"]
        names = {"position": "xyz"[:dim], "velocity": ("vx", "vy", "vz")[:dim], "spin": ("wx", "wy", "wz"), "radius": ("radius",)}
        found = {to: float(value) for name, tos in names.items() for to, value in zip(tos, grains[name][:].ravel())}
    if dim == 2:  # turns about z alone
        assert found.pop("wx") == found.pop("wy") == 0
        found["w"] = found.pop("wz")
    return found


def check(place, dim, columns, end="\n", before="", rename=None, turn=False):
    items = list(columns.items())[::-1 if turn else 1]
    header = " ".join((rename or {}).get(name, name) for name, _ in items)
    table = f"{before}{header}{end}{', '.join(repr(value) for _, value in items)}{end}"
    found = begun(place, dim, table)
    assert found == columns, f"{table!r}: the grain has {found}"


with lab.workplace() as folder:
    folder = pathlib.Path(folder)
    for dim, columns in ((2, PLANE), (3, SPACE)):
        check(folder, dim, columns)
        check(folder, dim, columns, turn=True)
        check(folder, dim, columns, end="\r\n", before="\r\n# a remark\r\n")
        check(folder, dim, columns, before="\n\n# one\n# two\n")
    check(folder, 2, PLANE, rename={"w": "wz"})
print("what tables say is what grains begin with")
