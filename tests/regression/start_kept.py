# SPDX-License-Identifier: MIT
"""What a scene that starts from another run's state keeps of it: numbers, what integrators and transfers keep from step to step, one
moment of a run that is still at work; and what it says where something is not there."""
import os
import pathlib
import re
import shutil
import threading
import time

import h5py
import numpy

import lab
from start import BED, ELASTIC, PLASTIC, layer, refused, same_from, started, table, write

REST = "[0, -10]"
FALLS = """
quern: 1
dimension: 2
gravity: [0, -10]
domain: {lower: [0, 0], upper: [1, 1], open: [lower_y]}
time: {end: 0.5}
"""
GRAINS = FALLS + """grains:
  material: {density: 2500, radius: {mean: 4 mm}}
  contact: {linear: {stiffness: 1e5}}
  fill: {region: {box: {lower: [0.3, 0.1], upper: [0.7, 0.2]}}}
output: {every: 0.25, fields: [grain.velocity]}
"""
POINTS = FALLS + """continuum:
  cell: 0.1
  material: {elastic: {bulk_modulus: 1e4, poisson: 0.2, density: 1000}}
  fill: {region: {box: {lower: [0.3, 0.1], upper: [0.7, 0.3]}}}
output: {every: 0.25, fields: [point.velocity, point.stress, point.mass]}
"""


def log_of(folder):
    return (folder / "log.txt").read_text()


def accelerations(place):
    """An integrator that keeps accelerations goes on to the bit from a checkpoint; from another one's, or from a frame, they are said."""
    own = BED.replace("  overlap:", "  integrator: velocity_verlet\n  overlap:")
    names = ("id", "position", "velocity", "spin", "radius")
    lab.run(write(place, "verlet", own), place / "verlet")
    lab.run(write(place, "verlet_later", started(own, "verlet", 0.25, "[4, -9]")), place / "verlet_later")
    long = own.replace("time: {end: 0.125}", "time: {end: 0.375}")
    lab.run(write(place, "verlet_stages", long + "stages: [{for: 0.125}, {set: {gravity: [4, -9]}}]\n"), place / "verlet_stages")
    count = same_from(place / "verlet_stages", place / "verlet_later", 4, "grains", names)
    assert "anew" not in log_of(place / "verlet_later")
    print(f"velocity_verlet: {count} frames to the bit")
    lab.run(write(place, "bed", BED), place / "bed")
    for name, source in (("frame", "verlet:4"), ("euler", "bed")):
        lab.run(write(place, f"verlet_{name}", started(own, source, 0.03125, REST)), place / f"verlet_{name}")
        assert "grain.acceleration of integrator.velocity_verlet" in log_of(place / f"verlet_{name}"), log_of(place / f"verlet_{name}")


def affine(place):
    """The affine part that apic keeps is taken from a frame that shows it, and named where it does not."""
    own = layer(2, ELASTIC).replace("{picflip: {rate: 2}}", "apic").replace("[0, -10]", "[1, -10]")
    shows = own.replace("point.mass]", "point.mass, point.affine]")
    ends = {}
    lab.run(write(place, "apic", shows), place / "apic")
    lab.run(place / "apic.yaml", place / "hides", "--set=output.fields=[point.velocity, point.stress, point.mass]")
    for name, source in (("whole", "apic"), ("shown", "apic:4"), ("hidden", "hides:4")):
        lab.run(write(place, f"apic_{name}", started(own, source, 0.0625, "[1, -10]")), place / f"apic_{name}")
        log, ends[name] = log_of(place / f"apic_{name}"), table(lab.frames(place / f"apic_{name}")[-1], "points", "velocity")
        assert ("begins anew: point.affine" in log) == (name == "hidden"), log
    off = [numpy.abs(ends[name] - ends["whole"]).max() for name in ("shown", "hidden")]
    print(f"apic from a frame: velocities off by {off[0]:.2g} m/s with point.affine, {off[1]:.2g} m/s without")
    assert 100 * off[0] < off[1]  # from a frame the material makes its volume from the stress


def numbers_go_on(place):
    """Numbers of grains that have all left are not given again; a state without any is refused, unless something else comes."""
    lab.run(write(place, "leave", GRAINS), place / "leave")
    with h5py.File(lab.frames(place / "leave")[0]) as file:
        most = file["grains/id"][:].max()
    assert lab.summary(place / "leave")["grains"] == 0 < most
    later = started(GRAINS, "leave", 0.01, REST).replace("  contact:", "  place: [{position: [0.5, 0.5], radius: 0.01}]\n  contact:")
    lab.run(write(place, "new", later), place / "new")
    number = table(lab.frames(place / "new")[0], "grains", "id")
    print(f"grains up to number {most} have left, the next one is {number[0]}")
    assert list(number) == [most + 1]
    refused(place, "none_left", started(GRAINS, "leave", 0.01, REST), "has no grains left")
    lab.run(write(place, "melts", POINTS), place / "melts")
    assert lab.summary(place / "melts")["points"] == 0
    gone = started(POINTS, "melts", 0.1, REST)
    refused(place, "no_points", gone, "has no points left")
    source = "\n  source: {region: {box: {lower: [0.3, 0.1], upper: [0.7, 0.3]}}, keep: full}\n  cell:"
    lab.run(write(place, "pours", gone.replace("\n  cell:", source)), place / "pours")
    assert lab.summary(place / "pours")["points"] > 0


def huge_numbers(place):
    """A settled state of grains with numbers near 2^50 is kept and taken with the memory of any other."""
    cache, folder = place / "cache", place / "large" / "frames"
    folder.mkdir(parents=True)
    lab.run(place / "bed.yaml", place / "first", "--until=0")
    shutil.copy(lab.frames(place / "first")[0], folder / "000000.h5")
    with h5py.File(folder / "000000.h5", "r+") as file:
        file["grains/id"][...] = file["grains/id"][:] + 2**33
    fill = "from: large:0\n  settle: {energy: 1e-14}\n  fill: {region: {box: {lower: [0.01, 0.12], upper: [0.24, 0.2]}}, settle: true}"
    scene = write(place, "large", re.sub(r"fill: .*", fill, BED))
    for name in ("kept", "taken"):
        lab.run(scene, place / f"large_{name}", "--until=0", QUERN_CACHE=str(cache))
    lab.same(place / "large_kept", place / "large_taken", "numbers near 2^33")
    assert "settled already" in log_of(place / "large_taken"), log_of(place / "large_taken")
    size = lab.summary(place / "large_taken")["peak_rss_bytes"]
    print(f"numbers from 2^33 on: {size / 2**20:.0f} MiB")
    assert size < 2**29


def still_at_work(place):
    """A run whose files are replaced all the time: what is known of the state, what is read and what is copied are one moment's."""
    work, ends, files = place / "work", threading.Event(), {"checkpoint.h5": [], "frames/000000.h5": []}
    for k in range(2):
        lab.run(place / "bed.yaml", place / f"moment{k}", f"--set=time.end={0.03125 * (k + 1)}")
        for path, moments in files.items():
            moments.append((lab.frames(place / f"moment{k}")[-1] if "/" in path else place / f"moment{k}" / path).read_bytes())
    (work / "frames").mkdir(parents=True)

    def replace():
        k = 0
        while not ends.is_set():
            k += 1
            for path, moments in files.items():
                (work / "part").write_bytes(moments[k % 2])
                os.replace(work / "part", work / path)
            time.sleep(2e-4)

    writer = threading.Thread(target=replace)
    writer.start()
    try:
        while not (work / "frames/000000.h5").exists():
            time.sleep(0.01)
        for k in range(12):
            scene = write(place, f"watches{k}", started(BED, "work:0" if k % 2 else "work", 0.03125, REST))
            lab.run(scene, place / f"watches{k}", "--until=0")
    finally:
        ends.set()
        writer.join()
    for k in range(12):
        lab.run(place / f"watches{k}" / "scene.yaml", place / f"again{k}", "--until=0")
        lab.same(place / f"watches{k}", place / f"again{k}", f"of a run at work, {k}", checkpoint=False)


def once_more(place):
    """The scene that a run leaves is the same run, also where that started from one that started from another, a hybrid's twin."""
    column = [*lab.SMALL["column"], "--set=time.end=5 ms", "--set=model=grains"]
    lab.run("column", place / "twin0", *column)
    for k in (1, 2):
        lab.run("column", place / f"twin{k}", *column, f"--set=grains.from={place / f'twin{k - 1}'}", "--set=grains.fill=null")
    lab.run(place / "twin2" / "scene.yaml", place / "twin_again")
    lab.same(place / "twin2", place / "twin_again", "a twin of a twin, from the scene that it left", checkpoint=False)
    hashes = [lab.summary(place / name)["provenance"]["scene_hash"] for name in ("twin2", "twin_again")]
    assert hashes[0] == hashes[1], hashes


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (accelerations, affine, numbers_go_on, huge_numbers, still_at_work, once_more):
            test(pathlib.Path(name))
