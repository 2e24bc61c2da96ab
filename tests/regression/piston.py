#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A box that is pushed through a hybrid's bed does not make the watch on density end a sound run: what its cells held before it closed them is
not counted over the room that it leaves now."""
import json
import pathlib

import lab

SCENE = """
quern: 1
dimension: 2
seed: 7
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.16, 0.12]}
time: {end: 50 ms}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 10 %, law: normal}}
  contact: {linear: {stiffness: 1e6 N/m, restitution: 0.5, friction: 0.4}}
  fill: {region: {box: {lower: [0.041, 0.001], upper: [0.159, 0.07]}}, settle: true}
bodies:
  - plane: {point: [0, 0], normal: [0, 1], boundary: sticky}
  - plane: {point: [0.16, 0], normal: [-1, 0]}
  - box: {name: piston, lower: [-0.2, 0], upper: [0.04, 0.3], motion: {velocity: [0.2, 0]}}
continuum: {cell: 4 mm, material: {mu_i: {bulk_modulus: 3e5 Pa, diameter: 2 mm, grain_density: 2500, critical_density: 2000}}}
hybrid: {oracle: [{packing_fraction: {depth: 16 mm, half_width: 4 mm}}], substeps: 30}
output: {every: 50 ms}
"""

if __name__ == "__main__":
    with lab.workplace() as name:
        folder = pathlib.Path(name)
        (folder / "piston.yaml").write_text(SCENE)
        lab.run(folder / "piston.yaml", folder / "piston")
        densest = json.loads((folder / "piston/summary.json").read_text())["sums"]["densest"]["value"]
        print(f"a box that is pushed at 0.2 m/s for 50 ms: densest place {densest:.3f}")
        assert 1 < densest < 1.1  # 1.02 at rest; beside the box of pure grains 1.07
