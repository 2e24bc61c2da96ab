# SPDX-License-Identifier: MIT
"""A continuum alone of every shape, transfer and material leaves the same bits in 2-D and 3-D: with two threads and the instruction set
of any processor, stopped half-way and resumed with another set, and with the program of another compiler, if QUERN_OTHER names one."""
import concurrent.futures
import itertools
import os
import pathlib

import lab

SHAPES = ("gimp", "bspline", "linear")
TRANSFERS = ("picflip: {rate: 0}", "picflip: {rate: 30}", "picflip: {flip: 0.95}", "apic: {}", "xpic: {order: 3}")
SAND = "bulk_modulus: 1e5 Pa"
MATERIALS = (f"elastic: {{{SAND}, density: 1500}}", f"drucker_prager: {{{SAND}, density: 1500, friction: 0.4}}",
             f"mu_i: {{{SAND}, static_friction: 0.38, limit_friction: 0.64, inertial_number: 0.3, diameter: 2 mm, "
             "grain_density: 2500, critical_density: 1500}")
# a column falls against a wall and onto a floor that turns it: points slide, are pressed, are thrown and change blocks
SCENE = """quern: 1
dimension: {dim}
gravity: {gravity}
domain: {{lower: {lower}, upper: {upper}}}
time: {{end: 20 ms, step: 0.25 ms}}
continuum:
  cell: 10 mm
  shape: {shape}
  transfer: {{{transfer}}}
  material: {{{material}}}
  fill: {{region: {{box: {{lower: {first}, upper: {last}}}}}, velocity: {velocity}, jitter: 0.2}}
bodies:
  - plane: {{point: {lower}, normal: {normal}, boundary: {{frictional: 0.3}}}}
output: {{every: 10 ms, fields: [point.velocity, point.stress]}}
"""
SPACE = {2: dict(gravity=[0, -9.81], lower=[0, 0], upper=[0.5, 0.3], first=[0.021, 0.013], last=[0.101, 0.113], velocity=[-2, -1],
                 normal=[0.1, 1]),
         3: dict(gravity=[0, 0, -9.81], lower=[0, 0, 0], upper=[0.3, 0.1, 0.3], first=[0.021, 0.013, 0.013],
                 last=[0.071, 0.063, 0.063], velocity=[-2, 0.5, -1], normal=[0.1, 0, 1])}


def check(case):
    dim, shape, transfer, material = case
    name = f"{dim}-D, {shape}, {transfer}, {material.split(':')[0]}"
    with lab.workplace() as place:
        folder = pathlib.Path(place)
        scene = folder / "scene.yaml"
        scene.write_text(SCENE.format(dim=dim, shape=shape, transfer=transfer, material=material, **SPACE[dim]))
        base = folder / "base"
        lab.run(scene, base)
        moved = lab.summary(base)["steps"]
        assert moved == 80, f"{name}: {moved} steps"
        lab.run(scene, folder / "v1", "--set=run.instructions=v1", threads=2)
        lab.same(base, folder / "v1", f"{name}: baseline, two threads")
        lab.run(scene, folder / "v3", "--set=run.instructions=v3", "--until=10ms")
        lab.run(scene, folder / "v3", resume=True)
        lab.same(base, folder / "v3", f"{name}: AVX2, and resumed with the best there is")
        other = os.environ.get("QUERN_OTHER")
        if other:
            lab.run(scene, folder / "other", program=other)
            lab.same(base, folder / "other", f"{name}: another compiler")
    return name


def main():
    cases = list(itertools.product((2, 3), SHAPES, TRANSFERS, MATERIALS))
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        names = list(pool.map(check, cases))
    assert len(set(names)) == len(cases) == 2 * 3 * 5 * 3
    print(f"{len(cases)} continua: the same bits")


if __name__ == "__main__":
    main()
