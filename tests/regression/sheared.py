# SPDX-License-Identifier: MIT
"""Grains where the flow shears: a band around a rotor becomes grains and the rest stays continuum; what falls freely stays what it is;
the oracle's memory of marks and means goes on over a resume, for any number of threads."""
import pathlib

import h5py
import numpy

import lab

THRESHOLD = 10  # 1/s
CELL = 4e-3  # m, of both scenes
SURFACE = 0.1  # m, two cells below the top of the bed
# A small form of configs/shear.yaml: a bed of continuum around a square rotor.
ROTOR = """
quern: 1
dimension: 2
seed: 3
gravity: [0, -9.81]
domain: {lower: [-64 mm, 0], upper: [64 mm, 128 mm]}
time: {end: 0.3 s}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}
  contact: {linear: {stiffness: 2e5, restitution: 0.5, friction: 0.4}}
  overlap: {most: 20 %}
  fill: {region: {box: {lower: [-64 mm, 0], upper: [64 mm, 112 mm]}}, settle: true}
bodies:
  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}
  - plane: {point: [-64 mm, 0], normal: [1, 0]}
  - plane: {point: [64 mm, 0], normal: [-1, 0]}
  - box:
      lower: [-9 mm, 41 mm]
      upper: [9 mm, 59 mm]
      boundary: sticky
      motion:
        about: [0, 50 mm]
        table: [{time: 0}, {time: 50 ms, angle: 0.1}, {time: 0.1 s, angle: 0.4}, {time: 0.15 s, angle: 0.9}, {time: 0.2 s, angle: 1.7},
                {time: 10.2 s, angle: 241.7}]
continuum: {cell: 4 mm, material: {mu_i: {critical_density: 1975, bulk_modulus: 1e5}}}
hybrid:
  oracle: {strain_rate: {shear_rate: 10, depth: 8 mm, half_width: 4 mm}}
  average: 8
output: {every: 10 ms, fields: [grain.velocity, point.velocity, cell.shear_rate]}
observe: [discrete_share, ledger]
"""
# A block of continuum falls and shears by 20/s: without pressure its inertial number is beyond any threshold.
FALL = """
quern: 1
dimension: 2
seed: 3
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.16, 0.16]}
time: {end: 0.1 s}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}
  contact: {linear: {stiffness: 2e5, restitution: 0.5, friction: 0.4}}
  file: falling.txt
bodies: [plane: {point: [0, 0], normal: [0, 1], boundary: sticky}]
continuum: {cell: 4 mm, material: {mu_i: {critical_density: 1975, bulk_modulus: 1e5}}}
hybrid: {oracle: {strain_rate: {inertial_number: 0.1, depth: 8 mm, half_width: 4 mm}}}
output: {every: 10 ms}
observe: [discrete_share]
"""


def band(folder):
    """The band are the cells that begin as continuum and shear half as fast again as the threshold, on average over the last five frames.
    Those of the free surface are none: what lies loose there bears nothing, and the oracle leaves it out.
    By frame: time, mean shear rate of the band, share of it that is discrete."""
    frames = []
    for path in lab.frames(folder)[1:]:
        with h5py.File(path) as file:
            x, zone, rate = (file["cells"][name][:] for name in ("position", "zone", "shear_rate"))
            frames.append((float(file.attrs["time"]), {tuple(numpy.round(at, 6)): (r, z) for at, r, z in zip(x, rate, zone)}))
    last = [cells for _, cells in frames[-5:]]
    mean = {at: numpy.mean([cells.get(at, (0, 0))[0] for cells in last]) for at in frames[0][1]}
    fast = [at for at, (_, zone) in frames[0][1].items() if zone == 2 and mean[at] > 1.5 * THRESHOLD and at[1] < SURFACE]
    print(f"rotor: a band of {len(fast)} cells")
    return [(time, numpy.mean([cells[at][0] for at in fast]), numpy.mean([cells[at][1] == 0 for at in fast])) for time, cells in frames]


def shares(folder):
    header, rows = lab.series(folder)
    at = [name.split(" ")[0] for name in header].index("discrete_share.share")
    return [(row[0], row[at]) for row in rows]


def rotor(scene, place):
    """The band is discrete before its rate peaks, the rest stays continuum."""
    lab.run(scene, place / "rotor")
    rows = band(place / "rotor")
    for row in rows:
        print("rotor: t = %.2f s, rate %5.1f 1/s, discrete %.2f" % row)
    peak = max(rows, key=lambda row: row[1])
    discrete = next(row for row in rows if row[2] >= 0.8)
    share = [value for time, value in shares(place / "rotor") if time > 0]
    print(f"rotor: discrete at {discrete[0]:.2f} s at a rate of {discrete[1]:.1f}/s, peak of {peak[1]:.1f}/s at {peak[0]:.2f} s; "
          f"share of grains up to {max(share):.3f}, {share[0]:.3f} at first")
    assert share[0] == 0 and max(share) < 0.4
    assert discrete[0] < peak[0] and discrete[1] < 0.8 * peak[1] and rows[-1][2] > 0.9


def block(scene, x, y):
    """Grains of the block, moved by x and y."""
    rows = [(0.0602 + x + 0.00201 * i, 0.09 + y + 0.00201 * j, 0.0402 * (j - 15)) for j in range(30) for i in range(20)]
    (scene.parent / "falling.txt").write_text("x y vx\n" + "".join(f"{x:.17g} {y:.17g} {v:.17g}\n" for x, y, v in rows))


def fall(scene, place):
    """In free fall there is no pressure: what is continuum stays so, but for cells that the block has just come into. Single points that are
    as dense as at rest press for a moment, and may turn a part of the block: how it lies in the cells decides, so the middle of fifteen drawn
    places counts."""
    mean = []
    for x, y in numpy.random.default_rng(5).uniform(0, CELL, (15, 2)):
        block(scene, x, y)
        lab.run(scene, place / f"fall_{x:g}_{y:g}")
        mean.append(numpy.mean([value for time, value in shares(place / f"fall_{x:g}_{y:g}") if time > 0]))
    print("free fall over 50 mm at 20/s: mean share of grains " + ", ".join(f"{value:.4f}" for value in mean))
    assert numpy.median(mean) < 0.02
    lab.run(scene, place / "naive", "--set=hybrid.oracle.strain_rate.least_pressure=0", "--set=hybrid.oracle.strain_rate.most_agitation=1e6",
            "--set=time.end=60 ms")
    naive = numpy.mean([value for time, value in shares(place / "naive") if time > 0])
    print(f"  without a floor {naive:.3f}")
    assert naive > 0.5


def shipped(place):
    """configs/shear.yaml settles and begins as a continuum."""
    lab.run("shear", place / "shipped", "--set=time.end=20 ms", "--set=output.every=10 ms", "--set=grains.settle.energy=1e-3")
    found = [value for time, value in shares(place / "shipped") if time > 0]
    print(f"configs/shear.yaml: share of grains {max(found):.3f} at first")
    assert max(found) < 0.02


def goes_on(scene, place):
    """Stopped half way and resumed, on other threads, it ends in the same bits."""
    short = ["--set=time.end=0.12 s", "--set=hybrid.most_changes=0.05"]
    lab.run(scene, place / "whole", *short)
    lab.run(scene, place / "parts", *short, "--until=0.07", threads=3)
    lab.run(scene, place / "parts", *short, resume=True, threads=2)
    for one, other in zip(lab.frames(place / "whole"), lab.frames(place / "parts"), strict=True):
        differ = lab.differences(one, other)
        assert not differ, f"{one.name}: {differ}"
    print(f"resumed on other threads: {len(lab.frames(place / 'whole'))} frames to the bit")


if __name__ == "__main__":
    with lab.workplace() as name:
        folder = pathlib.Path(name)
        for kind, text in (("rotor", ROTOR), ("fall", FALL)):
            (folder / f"{kind}.yaml").write_text(text)
        rotor(folder / "rotor.yaml", folder)
        fall(folder / "fall.yaml", folder)
        goes_on(folder / "rotor.yaml", folder)
        shipped(folder)
