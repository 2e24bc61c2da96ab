# SPDX-License-Identifier: MIT
"""Transfers with matrices and round trips, and shares on a ramp, leave the same bits: for any number of threads, batch and
instruction set, and across a stop; with QUERN_OTHER, of another compiler's program too."""
import pathlib

import lab

SCENES = {
    "apic, shares on a ramp": ["--set=continuum.transfer=apic", "--set=hybrid.weights=ramp"],
    "xpic for both, half shares": ["--set=continuum.transfer={xpic: {order: 3}}", "--set=hybrid.transfer={xpic: {order: 2}}"],
    "mixed for both": ["--set=continuum.transfer=mixed", "--set=hybrid.transfer=mixed"],
    "volume averaged over cells": ["--set=continuum.strain=averaged"],
    "zones that are drawn": ["--set=continuum.transfer=apic", "--set=hybrid.oracle=[{fixed: {boxes: [{lower: [0.02, -1], "
                             "upper: [1, 1]}], ramp: 12 mm}}, {near_bodies: {distance: 5 mm, width: 8 mm, bodies: [{body: 0}]}}]"]}
SHORT = ["--set=time.end=20 ms", "--set=output.every=5 ms", "--set=hybrid.update=100"]


def check(name, options, folder):
    options = [option for option in lab.SMALL["column"] if "time.end" not in option] + SHORT + options
    base = folder / "base"
    lab.run("column", base, *options)
    s = lab.summary(base)
    assert max(abs(s["mass_defect"]), abs(s["invariant_defect"])) < 1e-12, f"{name}: the books are open"
    assert s["points"] > 0, f"{name}: there is no continuum"
    print(f"{name}: {s['steps']} steps, {s['grains']} grains, {s['points']} points")
    lab.same_ways("column", base, folder, *options, levels=("v1", "v3"))
    out = folder / "stopped"
    lab.run("column", out, *options, "--until", "10 ms")
    lab.run("column", out, *options, resume=True)
    lab.same(base, out, "a stop at half the time")


if __name__ == "__main__":
    with lab.workplace() as place:
        for number, (name, options) in enumerate(SCENES.items()):
            (pathlib.Path(place) / str(number)).mkdir()
            check(name, options, pathlib.Path(place) / str(number))
