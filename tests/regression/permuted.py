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
# an observer that sums up over nodes, and one that maps
NODES = """#include <quern/observer.h>
typedef struct { int32_t unused; } nodes;
static const quern_param params[] = { QUERN_END_PARAMS };
static const quern_use uses[] = { { .field = "node.mass", .unit = "kg", .access = QUERN_READ, .shape = QUERN_SCALAR }, QUERN_END_USES };
static const quern_output outputs[] = { { "sum", "kg", "All.", QUERN_SUM, 0 }, { "in_order", "kg", "All.", QUERN_SUM, 0 }, { .name = NULL } };
static quern_status whole(const void *self, const quern_observer_batch *b, quern_real *out, const quern_host *host, quern_run *run) {
	const quern_parts *p = host->parts(run, "node");
	quern_real *mass = host->memory(run, (p->n + 1) * sizeof *mass);
	(void)self;
	for (uint32_t i = 0; i < p->n; i++) mass[i] = b->use[0].real[0][8 * i];
	out[0] = host->sum_set(run, "node", mass);
	for (uint32_t q = 0; q < p->n; q++) out[1] += mass[quern_nth(p->entry, q)];
	return QUERN_OK;
}
static const quern_observer_ops ops = { .size = sizeof ops, .output_size = sizeof(quern_output), .outputs = outputs, .whole = whole };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = QUERN_2D | QUERN_3D, .id = "observer.nodes",
	.brief = "Nodes.", .instance_size = sizeof(nodes), .params = params, .uses = uses, .ops = &ops };
QUERN_LIBRARY(plugin, "0", "MIT");
"""
# many grains that leave the domain in one step: the message names the first by place
FALL = """quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [1, 0.1]}
time: {end: 0.3}
grains:
  material: {density: 2500, radius: {mean: 2 mm}}
  contact: {linear: {stiffness: 1e5, restitution: 0.5, friction: 0.5}}
  fill: {region: {box: {lower: [0.01, 0.03], upper: [0.99, 0.03]}}}
bodies: [segment: {from: [0, 0.02], to: [0.52, 0.02]}]
"""
HYBRID = [*flow.HYBRID, f"--set=observe={OBSERVED}, ledger, outflow]"]
SCENES = {
    "grains and continuum in two dimensions": ("column", [*COLUMN, f"--set=observe={OBSERVED}, ledger]"]),
    "a wide column, seen by an observer that maps": ("column", [*WIDE, "--set=observe=[mine, nodes, mass]"]),
    "in three dimensions": ("column_3d", lab.SMALL["column_3d"]),
    "a source and an open face, two threads": ("column", HYBRID),
    "a floor that moves": ("column", [*COLUMN, "--set=bodies.0.plane.motion={velocity: [0.2, 0]}", f"--set=observe={OBSERVED}, ledger]"]),
    "weights on a ramp, apic": ("column", [*HYBRID, "--set=hybrid.weights=ramp", "--set=continuum.transfer=apic"]),
    "xpic, lumped coupling, two oracles": ("column", [*HYBRID, *lab.sets(
        continuum__transfer="{xpic: {order: 3}}", hybrid__coupling="lumped", hybrid__packer="random",
        hybrid__oracle="[{packing_fraction: {depth: 4.1 mm, half_width: 4 mm}}, {near_bodies: {distance: 3 mm, width: 8 mm}}]")]),
    "oracles that look at the flow, few changes at once": ("column", [*COLUMN, *lab.sets(
        hybrid__most_changes=0.05, hybrid__average=3, hybrid__oracle_cells=2,
        hybrid__oracle="[{layered: {depth: 8.1 mm, half_width: 4 mm}}, "
                       "{strain_rate: {rate_change: 40, shear_rate: 20, depth: 5 mm, half_width: 4 mm}}]")]),
    "continuum alone, with a source": ("column", flow.CONTINUUM),
    "continuum alone, holes filled": ("column", [*flow.CONTINUUM, "--set=continuum.resample=5"]),
    "continuum alone, volume averaged over cells": ("column", [*flow.CONTINUUM, "--set=continuum.strain=averaged"]),
    "a hopper that is filled and runs out": ("hopper", flow.HOPPER),
    "a drum that turns": ("drum", ["--set=model=grains", "--set=time.end=0.05", "--set=output.every=10 ms"]),
    "two materials": ("mixture", ["--set=time.end=0.05"]),
    "a box that is strained": ("plane_shear", ["--set=time.end=0.1 s", "--set=output.every=10 ms"]),
}


def is_permuted(folder):
    """Blocks of grains are many, and their numbers do not follow their places."""
    with h5py.File(folder / "checkpoint.h5") as file:
        for name in ("grain", "point"):
            place = list(file[f"{name}/by_place"]) if f"{name}/by_place" in file else []
            if len(place) > 2 and place != sorted(place):
                return True
    return False


def starts(place, other):
    """A state that either program has left, all of it or a frame, goes on to the same bits in either."""
    for what, name, options in (("grains", "column", [*WIDE, "--set=model=grains", "--set=observe=[mass, energy]"]), ("continuum", "column", flow.CONTINUUM)):
        shown = "[grain.velocity]" if what == "grains" else "[point.velocity, point.stress, point.mass]"
        short = [*options, "--set=time.end=10 ms", "--set=output.every=5 ms", f"--set=output.fields={shown}"]
        ends = []
        for left, program in (("here", None), ("there", other)):
            lab.run(name, place / f"{what}_{left}", *short, program=program)
        for state in ("", ":2"):
            for left in ("here", "there"):
                for at, program in (("here", None), ("there", other)):
                    out = place / f"{what}_{left}{len(state)}_{at}"
                    lab.run(name, out, *short, f"--set={what}.fill=null", f"--set={what}.from={place / f'{what}_{left}'}{state}", program=program)
                    ends.append((state, out))
        for state, out in ends:
            first = next(one for kind, one in ends if kind == state)
            for a, b in zip(lab.frames(first), lab.frames(out), strict=True):
                differ = [field for field in lab.differences(a, b) if field != "@scene_hash"]  # two checkpoints are two files
                assert not differ, f"{what} from {state or 'a checkpoint'}: {out.name}, {a.name} differs in {', '.join(differ)}"
        print(f"  {what} start from either's state, to the same bits")


def main():
    other = os.environ.get("QUERN_PERMUTED")
    if not other:
        print("QUERN_PERMUTED names no program")
        sys.exit(77)
    permuted = 0
    plugins = tempfile.TemporaryDirectory()
    workshop.compile(workshop.source("observer"), "observer.mine", plugins.name)
    workshop.compile(NODES, "observer.nodes", plugins.name)
    for what, (name, options) in SCENES.items():
        with lab.workplace() as place:
            here, there = pathlib.Path(place) / "here", pathlib.Path(place) / "there"
            lab.run(name, here, *options, QUERN_PLUGIN_PATH=plugins.name)
            lab.run(name, there, *options, program=other, threads=2, QUERN_PLUGIN_PATH=plugins.name)
            lab.same(here, there, what, checkpoint=False)
            assert not is_permuted(here), f"{what}: the blocks of this program are not in order"
            permuted += is_permuted(there)
    with lab.workplace() as place:
        scene = pathlib.Path(place) / "fall.yaml"
        scene.write_text(FALL)
        said = [lab.run(scene, scene.with_name(name), status=3, program=program) for name, program in (("here", None), ("there", other))]
        lost = [lab.summary(scene.with_name(name))["message"] for name in ("here", "there")]
        assert lost[0] == lost[1] and "left the domain" in lost[0], (lost, said)
        print(f"  {lost[0]}")
    with lab.workplace() as place:
        starts(pathlib.Path(place), other)
    print(f"{permuted} of {len(SCENES)} scenes had blocks in another order")
    assert permuted >= len(SCENES) // 2


if __name__ == "__main__":
    main()
