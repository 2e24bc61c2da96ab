# SPDX-License-Identifier: MIT
"""Results do not depend on how sets are cut: a program whose blocks have other numbers than the order of their places would give them
(-Dblocks=permuted) leaves the same frames and series, to the bit. QUERN_PERMUTED names it; without it the test is skipped.
"""
import os
import pathlib
import sys
import tempfile

import flow
import h5py
import lab
import workshop

OBSERVED = """[mass, momentum, energy, {runout: {axis: 0}}, coordination, granular_temperature, {repose: {axis: 0}},
    {packing_fraction: {region: {box: {lower: [0, 0], upper: [0.1, 0.02]}}}}, {profile: {axis: 1, bins: 6}}, {flux: {axis: 0, at: 0.05}},
    {wall_torque: {body: 0}}, {wall_force: {body: 0}}"""
COLUMN = lab.SMALL["column"]
# so wide that grains of several blocks stand in one block of the grid, and meet continuum there
WIDE = [*COLUMN, *lab.sets(
    grains__fill__1__region__box="{lower: [0.001, 0.001], upper: [0.099, 0.07]}", bodies__2__plane__point="[0.1, 0]",
    grains__settle__energy=1e-2, time__end="20 ms")]
HYBRID = [*flow.HYBRID, f"--set=observe={OBSERVED}, ledger, outflow]"]
SCENES = {
    "grains and continuum in two dimensions": ("column", [*COLUMN, f"--set=observe={OBSERVED}, ledger]"]),
    "a wide column, seen by an observer that maps": ("column", [*WIDE, "--set=observe=[mine, mass]"]),
    "in three dimensions": ("column_3d", lab.SMALL["column_3d"]),
    "a source and an open face, two threads": ("column", HYBRID),
    "a floor that moves": ("column", [*COLUMN, "--set=bodies.0.plane.motion={velocity: [0.2, 0]}", f"--set=observe={OBSERVED}, ledger]"]),
    "weights on a ramp, apic": ("column", [*HYBRID, "--set=hybrid.weights=ramp", "--set=continuum.transfer=apic"]),
    "xpic, lumped coupling, two oracles": ("column", [*HYBRID, *lab.sets(
        continuum__transfer="{xpic: {order: 3}}", hybrid__coupling="lumped", hybrid__packer="random",
        hybrid__oracle="[{packing_fraction: {depth: 4.1 mm, half_width: 4 mm}}, {near_bodies: {distance: 3 mm, width: 8 mm}}]")]),
    "continuum alone, with a source": ("column", flow.CONTINUUM),
    "a hopper that is filled and runs out": ("hopper", flow.HOPPER),
    "a drum that turns": ("drum", ["--set=time.end=0.05", "--set=output.every=10 ms"]),
    "two materials": ("mixture", ["--set=time.end=0.05"]),
}


def is_permuted(folder):
    """Blocks of grains are many, and their numbers do not follow their places."""
    with h5py.File(folder / "checkpoint.h5") as file:
        for name in ("grain", "point"):
            place = list(file[f"{name}/by_place"]) if f"{name}/by_place" in file else []
            if len(place) > 2 and place != sorted(place):
                return True
    return False


def main():
    other = os.environ.get("QUERN_PERMUTED")
    if not other:
        print("QUERN_PERMUTED names no program")
        sys.exit(77)
    permuted = 0
    plugins = tempfile.TemporaryDirectory()
    workshop.compile(workshop.source("observer"), "observer.mine", plugins.name)
    for what, (name, options) in SCENES.items():
        with lab.workplace() as place:
            here, there = pathlib.Path(place) / "here", pathlib.Path(place) / "there"
            lab.run(name, here, *options, QUERN_PLUGIN_PATH=plugins.name)
            lab.run(name, there, *options, program=other, threads=2, QUERN_PLUGIN_PATH=plugins.name)
            lab.same(here, there, what, checkpoint=False)
            assert not is_permuted(here), f"{what}: the blocks of this program are not in order"
            permuted += is_permuted(there)
    print(f"{permuted} of {len(SCENES)} scenes had blocks in another order")
    assert permuted >= len(SCENES) // 2


if __name__ == "__main__":
    main()
