# SPDX-License-Identifier: MIT
"""`quern render`: pictures of frames of every sort, looked at pixel by pixel, and its refusals."""
import fcntl
import json
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

import h5py
import numpy as np

import lab
from png import QUERN, SOURCE, place, read_png, run, write_frame


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
    comes_back(folder / "periodic")
    floor_is_shown(folder / "floor")


def comes_back(folder):
    """A point beyond a periodic face is drawn where it comes in again: as in the picture of one that is there."""
    pictures_of = []
    for name, beyond in (("within", 0), ("beyond", 0.08)):
        x = lattice(2, 12, 4e-3)
        x[5, 0] += beyond  # the period of configs/chute.yaml
        write_frame(folder / name, 2, "a point", {"points": {"position": ("m", x), "volume": ("m^2", np.full(len(x), 9e-6))}})
        shutil.copy(SOURCE / "configs/chute.yaml", folder / name / "scene.yaml")
        pictures_of.append(picture_of(folder / name, folder / f"{name}.png"))
    assert (pictures_of[0] == pictures_of[1]).all(), "a point beyond a periodic face is drawn there"


def floor_is_shown(folder):
    """The domain's floor belongs to the picture of what lies above it, and not where nothing falls."""
    lows = {}
    for name, gravity in (("falls", "[0, -9.81 m/s^2]"), ("floats", "[0, 0]")):
        sets = cloud(200, 0.5)
        sets["grains"]["position"][1][:, 1] += 8e-3
        write_frame(folder / name, 2, name, sets)
        scene = (SOURCE / "configs/column.yaml").read_text()
        assert scene.count("gravity: [0, -9.81 m/s^2]") == 1
        (folder / name / "scene.yaml").write_text(scene.replace("gravity: [0, -9.81 m/s^2]", f"gravity: {gravity}"))
        lows[name] = measure(folder / name)["view"][1]
    assert lows["falls"] <= 0 < 4e-3 < lows["floats"], f"views begin at {lows}"


def cloud(n, value, far=None):
    """n grains in a heap 40 mm wide, perhaps one of them elsewhere; the first stands at (10 mm, 5 mm) and has the value."""
    x = np.random.default_rng(3).uniform(0, 0.04, (n, 3)) * [1, 0.5, 0]
    x[0], speed = (0.01, 0.005, 0), np.zeros((n, 3))
    x[np.hypot(*(x - x[0])[:, :2].T) < 2e-3] += [0, 0.01, 0]  # nothing lies over it
    x[0], x[1] = (0.01, 0.005, 0), far or x[1]
    speed[:, 0] = np.linspace(0, 2 * value, n)
    speed[0] = value, 0, 0
    return {"grains": {"position": ("m", x), "radius": ("m", np.full(n, 5e-4)), "velocity": ("m/s", speed)}}


def measure(folder, *options):
    return json.loads(run("render", folder, "--measure", *options))


def views(folder):
    """A fixed view and range: the same grain at the same pixel in the same colour, whatever else is in the frame; and strays."""
    view, at = [-0.01, -0.005, 0.05, 0.03], []
    write_frame(folder / "v", 2, "few", cloud(30, 0.5), 0)
    write_frame(folder / "v", 2, "many", cloud(900, 0.5, far=(3, 2, 0)), 1)
    for k, width in ((0, 600), (1, 600), (1, 1100)):
        x, y = place(view, width, (0.01, 0.005))
        picture = picture_of(folder / "v", folder / "v.png", "--frame", k, "--view", ",".join(map(str, view)), "--range",
                             "0,1000 mm/s", width=width)
        at.append(picture[y, x])
        assert (picture[y - 1:y + 2, x - 1:x + 2] == at[0]).all(), f"the grain at pixel {x}, {y} is {picture[y, x]}, not {at[0]}"
    middle = has_colour(picture[:, :200], at[0])  # the bar has it in its middle
    assert middle and len({tuple(a) for a in at}) == 1, at
    write_frame(folder / "v", 2, "no stray", cloud(900, 0.5), 2)
    write_frame(folder / "v", 2, "a front", cloud(900, 0.5, far=(0.055, 0.01, 0)), 3)
    stray, none, front = (measure(folder / "v", "--frame", k) for k in (1, 2, 3))
    share = (none["view"][2] - none["view"][0]) / (stray["view"][2] - stray["view"][0])
    assert 0.98 < share < 1.02 and stray["view"][2] < 0.05, f"a stray changes the view: {stray}, {none}"
    assert front["view"][2] > 0.0555, f"the front is cut off: {front}"
    assert none["range"] == [0, 1], none
    # what is measured draws the same picture again; only its legend keeps all rows
    fixed = [f"--{key}={','.join(map(repr, none[key]))}" for key in ("view", "range")]
    own, again = (picture_of(folder / "v", folder / f"{k}.png", "--frame", 2, *words) for k, words in (("own", ()), ("again", fixed)))
    assert (own[:-70] == again[:len(own) - 70]).all() and len(again) > len(own), "a measured view is another one"
    write_frame(folder / "v", 3, "space", cloud(900, 0.5, far=(3, 2, 1)), 4)
    box = measure(folder / "v", "--frame", 4)["view"]
    assert len(box) == 6 and max(box) < 0.05, box
    picture_of(folder / "v", folder / "box.png", "--frame", 4, f"--view={','.join(map(repr, box))}")
    print(f"one grain at one pixel, colour {at[0]}; a stray at 3 m widens the view by {1 / share - 1:.1%}")


def inode(path):
    return path.stat().st_ino if path.exists() else None  # of a file that is replaced as a whole another one


def until_true(what):
    deadline = time.monotonic() + 60
    while not what():
        assert time.monotonic() < deadline, "it does not come"
        time.sleep(0.02)


def watching(folder):
    """A run at work is drawn again and again until it ends, or until somebody does not want to see more."""
    scene, out = lab.scene("two_grains"), folder / "watched"
    endless = ["--set=time.end=1e6", "--set=output.every=4e-3", "--set=grains.place.0.velocity=[0, 0]", "--set=grains.place.1.velocity=[0, 0]"]
    at_work = subprocess.Popen([str(QUERN), "run", scene, "-o", str(out), "--quiet", *endless])
    try:
        until_true(lambda: (out / "frames/000001.h5").exists())
        watch = [str(QUERN), "render", str(out), "--watch", "--width", "600"]
        one, two = (subprocess.Popen([*watch, "-o", str(folder / f"w{k}.png")], stdout=subprocess.PIPE, text=True) for k in "12")
        seen = set()
        until_true(lambda: seen.add(inode(folder / "w1.png")) or len(seen - {None}) > 2)
        one.send_signal(signal.SIGINT)
        assert one.wait(timeout=20) == 130
        assert two.poll() is None
        at_work.terminate()
        assert at_work.wait(timeout=20) == 130 and two.wait(timeout=20) == 0
    finally:
        at_work.kill()
    drawn = len(two.stdout.read().splitlines())
    run("render", out, "-o", folder / "last.png", "--width", 600)
    assert (folder / "last.png").read_bytes() == (folder / "w2.png").read_bytes(), "the last frame was not drawn"
    assert run("render", out, "--watch") == f"{out}/newest.png\n", "a run that is over is drawn once"
    print(f"watched: {drawn} pictures, the last one of the last frame")


def begins_anew(folder):
    """A run that somebody starts anew by --force has no frames for a while: whoever watches waits for the next one."""
    out, picture = folder / "anew", folder / "anew.png"
    write_frame(out, 2, "old", cloud(30, 0.5), 3)
    with open(out / ".quern.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        watch = subprocess.Popen([str(QUERN), "render", str(out), "--watch", "--width", "600", "-o", str(picture)], stdout=subprocess.DEVNULL)
        until_true(lambda: inode(picture))
        before = inode(picture)
        shutil.rmtree(out / "frames")
        time.sleep(0.5)
        assert watch.poll() is None, "it does not wait for the first frame"
        write_frame(folder / "aside", 2, "new", cloud(30, 0.5), 0)
        (folder / "aside/frames").rename(out / "frames")
        until_true(lambda: inode(picture) != before)
    assert watch.wait(timeout=20) == 0
    print("a run that begins anew is watched on")


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
                                ([folder / "h2", "-o", folder / "a.jpg"], 1, "PNG, SVG and PDF can be written"),
                                ([folder / "h2", "--view", "0,0,1"], 1, "needs 4 numbers between commas, found 3"),
                                ([folder / "h3", "--view", "0,0,1,1"], 1, "needs 6 numbers"),
                                ([folder / "h2", "--view", "1,0,0,1"], 1, "give the lower corner first"),
                                ([folder / "h2", "--view", "0,0,1e-310,1e-310"], 1, "nothing lies between"),
                                ([folder / "h2", "--view", "0,0,1 s,1"], 1, "1 s"),
                                ([folder / "h2", "--view", "0,0,1e99,1"], 1, "beyond"),
                                ([folder / "h2", "--range", "1,1"], 1, "give the lower end first"),
                                ([folder / "h2", "--range", "0,1 kg"], 1, "kg"), ([folder / "h2", "--range", "0,nan"], 1, "nan"),
                                ([folder / "h2", "--chains"], 2, "contact.force and touch.force in output.fields"),
                                ([folder / "h2", "--vectors", "pressure"], 1, "no vectors 'pressure'"),
                                ([folder / "h2", "--vectors", "velocity", "--longest", "0"], 1, "above 0"),
                                ([folder / "h2", "--widest", "1"], 1, "give both"), ([folder / "h2", "--longest", "1"], 1, "give both"),
                                ([folder / "h2", "--watch", "--frame", 0], 1, "leave out --frame"),
                                ([folder / "h2", "--measure", "-o", folder / "a.png"], 1, "leave out --output"),
                                ([folder / "nowhere", "--watch"], 2, "holds no frames"),
                                ([folder / "h2", "--colour"], 1, "unknown option '--colour'"), ([], 1, "is missing")]:
        said = run("render", *words, status=status)
        assert part in said, f"render {words}: {said}"
    print("every fault is refused in one sentence")


with tempfile.TemporaryDirectory() as name:
    pictures(pathlib.Path(name))
    views(pathlib.Path(name))
    watching(pathlib.Path(name))
    begins_anew(pathlib.Path(name))
    refusals(pathlib.Path(name))
