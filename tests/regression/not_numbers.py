# SPDX-License-Identifier: MIT
"""A material that gives what is no number once it is pressed ends the run with exit status 3: the point, the stage, the time and the
plugin are named, and the checkpoint is from before."""
import pathlib
import re

import lab
import workshop

SCENE = """quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.4, 0.4]}
time: {end: 1}
continuum:
  cell: 20 mm
  material: {mine: {bulk_modulus: 1e5, density: 1000}}
  fill: {region: {box: {lower: [0.1, 0.1], upper: [0.3, 0.3]}}}
output: {every: 20 ms}
checkpoint: {every: 1 ms}
"""
PRESSED = ("open ? 0 :", "open ? 0 : b->density[i] > 1.01 * m->density ? 0.0 / 0.0 :")
SAID = r"mpm\.gather, at t = [0-9.e-]+ s \(step \d+\): point \d+: point\.stress .*not a number after material\.mine"


def main():
    with lab.workplace() as place:
        folder = pathlib.Path(place)
        workshop.compile(workshop.source("material", PRESSED), "material.mine", folder)
        scene = folder / "scene.yaml"
        scene.write_text(SCENE)
        how = {"QUERN_PLUGIN_PATH": str(folder), "status": 3}
        said = lab.run(scene, folder / "out", **how)
        assert re.search(SAID, said), said
        summary = lab.summary(folder / "out")
        assert summary["status"] == "failed" and summary["message"] in said, summary["message"]
        step, kept = summary["steps"], int(lab.whole(folder / "out/checkpoint.h5")["@step"])
        frames = len(lab.frames(folder / "out"))
        assert 0 < kept <= step and frames > 3, f"a checkpoint of step {kept} of {step}, {frames} frames"
        again = lab.run(scene, folder / "out", resume=True, **how)
        assert summary["message"] in again, again
        print(f"{frames} frames, a checkpoint of step {kept}, {summary['message']}")


if __name__ == "__main__":
    main()
