# SPDX-License-Identifier: MIT
"""Lines of chains and arrows, read back from SVG: how many, where, how wide, against closed forms; pages that are no images."""
import pathlib
import re
import tempfile
import xml.etree.ElementTree as tree

import h5py
import numpy as np

import lab
from png import run, write_frame

MASS, GRAVITY = 2500 * np.pi * 0.005 ** 2, 10  # kg per m of depth, m/s^2
STACK = """
quern: 1
dimension: 2
gravity: [0, -10]
domain: {lower: [-0.05, -0.01], upper: [0.05, 0.05]}
time: {end: 0.5 s}
grains:
  material: {density: 2500, radius: {mean: 5 mm}}
  contact: {linear: {stiffness: 1e5, restitution: 0.2, friction: 0}}
  place: [{position: [0, 5 mm]}, {position: [0, 15 mm]}]
bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]
output: {every: 0.1 s, fields: [contact.force, touch.force]}
"""
BOX = """
quern: 1
dimension: 2
gravity: [0, -10]
domain: {lower: [0, 0], upper: [0.1, 0.1], periodic: [true, false]}
time: {end: 1}
grains: {material: {density: 2500, radius: {mean: 5 mm}}, contact: {linear: {stiffness: 1e5}}, place: [{position: [0.05, 0.05]}]}
bodies: [{plane: {point: [0, 0], normal: [0, 1]}}]
"""
VIEW = (0, 0, 0.1, 0.05)
SCALE = 1520 / 0.1  # pixels per m: a page of 1600 has margins of 40


def numbers(text):
    return [float(x) for x in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)]


def paths(page):
    """Style and points of each path, in pixels of the page."""
    for path in tree.parse(page).getroot().iter("{http://www.w3.org/2000/svg}path"):
        at = np.array(numbers(path.get("d"))).reshape(-1, 2) if path.get("d") else np.zeros((0, 2))
        a, b, c, d, *shift = numbers(path.get("transform") or "1 0 0 1 0 0")
        assert (a, b, c, d) == (1, 0, 0, 1), path.get("transform")
        yield path.get("style") or "", at + shift


def chains(page):
    """(width, from, to) of each line of a chain, in pixels of the picture if it is as wide as the page."""
    return [(float(re.search(r"stroke-width:([\d.]+)", style)[1]), *(at - (40, 84))) for style, at in paths(page)
            if "stroke-linecap:round" in style and len(at) == 2]


def arrows(page):
    """(tail, tip) of each arrow, the legend's last: a head follows its shaft."""
    found, tail = [], None
    for style, at in paths(page):
        if "stroke:rgb(13%,13%,15%)" in style and len(at) == 2:
            tail = at[0]
        elif "fill:rgb(13%,13%,15%)" in style and len(at) == 4:
            found.append((tail, at[0]))
    return found


def stacked(folder):
    """Two discs on a floor: the lower contact bears two weights, the upper one one."""
    (folder / "stack.yaml").write_text(STACK)
    lab.run(folder / "stack.yaml", folder / "stack")
    run("render", folder / "stack", "--chains", "-o", folder / "stack.svg")
    lines = chains(folder / "stack.svg")
    assert len(lines) == 2, f"{len(lines)} lines of two contacts"
    (upper, *_), (lower, center, touch) = sorted(lines, key=lambda line: line[0])
    assert abs(lower / upper - 2) < 0.002, f"the lower line is {lower / upper} times as wide"
    with h5py.File(folder / "stack/frames/000005.h5") as file:
        forces = [file["contacts/force"][0, 1], file["touches/force"][0, 1]]
    assert abs(forces[1] / (2 * MASS * GRAVITY) - 1) < 1e-6 and abs(abs(forces[0]) / (MASS * GRAVITY) - 1) < 1e-6, forces
    assert np.allclose(center[0], touch[0], atol=0.01)
    print(f"stacked discs: {forces[1]:.6f} N on the floor of 2 m g = {2 * MASS * GRAVITY:.6f} N, widths {lower:g} and {upper:g}")


def forged(folder, name, grains, contacts=None, touches=None, scene=BOX):
    """A frame of discs at given places, with contacts (first, second, force) and touches (grain, body, force)."""
    sets = {"grains": {"position": ("m", np.array(grains, float)), "radius": ("m", np.full(len(grains), 5e-3))}}
    for group, ends, rows in (("contacts", ("first", "second"), contacts), ("touches", ("grain", "body"), touches)):
        if rows is not None:
            sets[group] = {end: ("1", np.array([row[k] for row in rows], np.int32)) for k, end in enumerate(ends)}
            sets[group]["force"] = ("N", np.array([row[2] for row in rows], float).reshape(-1, 3))
    write_frame(folder / name, 2, name, sets)
    (folder / name / "scene.yaml").write_text(scene)
    return folder / name


def drawn(frame, widest):
    """Share of the widest line, and both ends in m, of each line of a frame in VIEW."""
    page = frame.with_suffix(".svg")
    run("render", frame, "--chains", "-o", page, "--view", ",".join(map(str, VIEW)), "--widest", widest)
    return sorted((round(width / 16, 4), *sorted(tuple(np.round([at[0] / SCALE, VIEW[3] - at[1] / SCALE], 5)) for at in ends))
                  for width, *ends in chains(page))


def places(folder):
    """Where lines begin and end: grains, walls, periodic faces; what is listed twice; what pulls; friction does not tilt."""
    discs = [(0.02, 0.005, 0), (0.03, 0.005, 0), (0.003, 0.03, 0), (0.095, 0.03, 0)]
    frame = forged(folder, "places", discs, [(0, 1, (-2, 1, 0)), (0, 1, (-2, 1, 0)), (2, 3, (1, 0, 0)), (1, 2, (-3, 3, 0))],
                   [(0, 0, (1, 4, 0))])
    found = drawn(frame, "4 N")
    # the line between the first two is as wide as the force along it, and so is that to the floor, straight down
    wanted = sorted([(0.5, (0.02, 0.005), (0.03, 0.005)), (1.0, (0.02, 0.0), (0.02, 0.005)),
                     (0.25, (-0.001, 0.03), (0.003, 0.03)), (0.25, (0.095, 0.03), (0.099, 0.03))])
    assert found == wanted, f"{found}\nnot {wanted}"
    print("lines from centre to centre, to the wall, in halves through a periodic face, once each")


def corner(folder):
    """A disc in an inside corner touches both edges of one body: each force goes to its own, be there friction."""
    angle = BOX.replace("{plane: {point: [0, 0], normal: [0, 1]}}",
                        "{polygon: {vertices: [[0, 0], [0.1, 0], [0.1, 0.01], [0.02, 0.01], [0.02, 0.05], [0, 0.05]]}}")
    frame = forged(folder, "corner", [(0.0249, 0.0149, 0)], touches=[(0, 0, (3, 1, 0)), (0, 0, (-1, 4, 0))], scene=angle)
    found = drawn(frame, "4 N")
    assert found == [(0.75, (0.02, 0.0149), (0.0249, 0.0149)), (1.0, (0.0249, 0.01), (0.0249, 0.0149))], found
    print("a disc in a corner: a line to each of its walls")


def vectors(folder):
    """One arrow a square, along the mean, as long as it says."""
    velocity = [(3, 4, 0), (-2.5, 0, 0), (0, -1.25, 0)]
    frame = forged(folder, "vectors", [(0.02, 0.02, 0), (0.05, 0.02, 0), (0.08, 0.02, 0), (0.0801, 0.02, 0)])
    with h5py.File(frame / "frames/000000.h5", "a") as file:
        file.create_dataset("grains/velocity", data=np.array([*velocity, (0, -1.25, 0)])).attrs["unit"] = np.bytes_("m/s")
    run("render", frame, "--vectors", "velocity", "-o", folder / "vectors.svg", "--view", "0,0,0.1,0.05", "--longest", "5 m/s")
    *drawn, legend = arrows(folder / "vectors.svg")
    assert len(drawn) == 3, f"{len(drawn)} arrows"
    for (tail, tip), v in zip(sorted(drawn, key=lambda a: a[0][0]), velocity):
        assert np.allclose(tip - tail, np.array([v[0], -v[1]]) / 5 * 52, atol=0.02), (tip - tail, v)
    assert np.allclose(legend[1] - legend[0], (52, 0), atol=0.02), legend
    print("arrows: 5, 2.5 and 1.25 m/s are", [round(float(np.hypot(*(tip - tail))), 2) for tail, tip in drawn], "pixels long")


def pages(folder):
    """SVG and PDF of few and of many grains: whole, the same each time, of a size that opens."""
    for n, most in ((1000, 1e6), (100000, 1e7)):
        r = np.random.default_rng(2)
        x = np.zeros((n, 3))
        x[:, :2] = r.uniform(0, 0.1, (n, 2))
        write_frame(folder / f"n{n}", 2, "many", {"grains": {
            "position": ("m", x), "radius": ("m", np.full(n, 0.02 / n ** 0.5)), "velocity": ("m/s", x * 10)}})
        for form in ("svg", "pdf"):
            made = []
            for k in "ab":
                run("render", folder / f"n{n}", "-o", folder / f"{k}.{form}")
                made.append((folder / f"{k}.{form}").read_bytes())
            assert made[0] == made[1], f"two pages of one frame differ: {form}"
            assert len(made[0]) < most, f"{n} grains are {len(made[0])} bytes of {form}"
            print(f"{n} grains: {len(made[0]) / 1e6:.2f} MB of {form}")
            if form == "svg":
                root = tree.fromstring(made[0])
                discs = sum("fill:rgb" in style and len(at) > 8 for style, at in paths(folder / "a.svg"))
                assert root.get("width") == "1600px" and (discs >= n) == (n == 1000), (root.attrib, discs)
            else:
                assert made[0].startswith(b"%PDF-1.") and made[0].rstrip().endswith(b"%%EOF") and b"/Page" in made[0]


def damage(folder):
    discs, push = [(0.02, 0.005, 0), (0.03, 0.005, 0)], (-1, 0, 0)
    for name, contacts, touches, status in (
            ("beyond", [(0, 2, push)], None, 2), ("below", [(-1, 1, push)], None, 2), ("endless", [(0, 1, (np.nan, 0, 0))], None, 2),
            ("no_body", None, [(0, 99, (0, 1, 0))], 0), ("itself", [(1, 1, push)], None, 0), ("none", [], None, 0),
            ("below_bodies", None, [(0, -1, (0, 1, 0))], 2), ("huge", [(0, 1, (-1e29, 0, 0))], None, 0)):
        said = run("render", forged(folder, name, discs, contacts, touches), "--chains", status=status)
        assert status == 0 or "contacts cannot be read" in said, said
    frame = forged(folder, "cut", discs, [(0, 1, push)])
    with h5py.File(frame / "frames/000000.h5", "a") as file:
        del file["contacts/first"]
    assert "contacts cannot be read" in run("render", frame, "--chains", status=2)
    print("contacts of grains that are not there are refused")


with tempfile.TemporaryDirectory() as at:
    for test in (stacked, places, corner, vectors, pages, damage):
        test(pathlib.Path(at))
