# SPDX-License-Identifier: MIT
"""Discs that resist rolling lie steeper: a poured heap with a coefficient of 0.2 is steeper than one with 0 by several standard errors.
Coarser, softer and shorter than studies/repose, which measures the angle of flanks over the coefficient: of these few grains a flank scatters
by five degrees, so that here the whole heap counts."""
import math
import pathlib
import statistics

import h5py
import numpy

import lab

SEEDS = range(1, 5)
COARSE = ["--set=grains.material.radius.mean=2 mm", "--set=grains.contact.0.linear.stiffness=1e5", "--set=grains.contact.1.rolling.stiffness=1e4",
          "--set=domain.lower=[-0.2, 0]", "--set=domain.upper=[0.2, 0.13]", "--set=time.end=2.2 s", "--set=grains.source.rate=10 kg/s",
          "--set=grains.source.until=1.2 s", "--set=grains.fill.region.box={lower: [-0.2, -1 mm], upper: [0.2, -1 mm]}",
          "--set=observe=[outflow, granular_temperature, {repose: {from: 0.02, to: 0.07}}]"]


def heap(out, rolling, seed):
    """Slope in degrees of the triangle, two equal flanks on the floor, with the heap's mean height and its spread along the floor; of a
    triangle of height h and half width w these are h/3 and w/sqrt(6). Beside it the slope of the right flank by the observer."""
    lab.run("heap", out, *COARSE, f"--set=seed={seed}", f"--set=grains.contact.1.rolling.friction={rolling}")
    header, rows = lab.series(out)
    last = dict(zip([name.split(" ")[0] for name in header], rows[-1]))
    speed = math.sqrt(2 * last["granular_temperature.temperature"])
    assert speed < 5e-3, f"{out.name}: the heap does not rest, its grains have {speed:.2g} m/s"
    assert last["outflow.poured"] > 11.9 and last["outflow.mass"] == 0
    with h5py.File(lab.frames(out)[-1]) as file:
        place, radius = file["grains/position"][:], file["grains/radius"][:]
    x, y = place[place[:, 1] > 0].T[:2]
    mass = radius[place[:, 1] > 0] ** 2
    middle, height = (numpy.average(one, weights=mass) for one in (x, y))
    spread = math.sqrt(numpy.average((x - middle) ** 2, weights=mass))
    return math.degrees(math.atan(3 * height / (math.sqrt(6) * spread))), -math.degrees(last["repose.angle"])


if __name__ == "__main__":
    found = {}
    with lab.workplace() as name:
        for rolling in (0, 0.2):
            found[rolling], flanks = zip(*(heap(pathlib.Path(name) / f"{rolling}_{seed}", rolling, seed) for seed in SEEDS))
            print(f"rolling friction {rolling}: " + ", ".join(f"{angle:.1f}" for angle in found[rolling]) + " degrees; right flanks "
                  + ", ".join(f"{angle:.1f}" for angle in flanks))
    apart = statistics.mean(found[0.2]) - statistics.mean(found[0])
    error = math.sqrt(sum(statistics.variance(angles) / len(angles) for angles in found.values()))
    print(f"apart by {apart:.2f} degrees, {apart / error:.1f} standard errors")
    assert apart > 4 * error and apart > 3
