# SPDX-License-Identifier: MIT
"""Measures of a study against what the runs themselves hold and what two grains must do: vectors, frames, costs, shares; closed forms as
references; tables of runs that were damaged."""
import csv
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys

import h5py
import numpy as np

import lab

try:
    import yaml
except ImportError:
    print("python3-yaml is not there")
    sys.exit(77)

MASS = 2500 * math.pi * 0.005 ** 2  # kg of a disc
PROFILE = {"profile": {"axis": 0, "bins": 12, "region": {"box": {"lower": [-0.05, -0.05], "upper": [0.05, 0.05]}}}}


def write(folder, name, **study):
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump({"study": 1, "base": lab.scene("two_grains"), **study}, sort_keys=False))
    return path


def sweep(path, out, *options, status=0):
    done = subprocess.run([lab.QUERN, "sweep", path, "-o", out, *options], capture_output=True, text=True, timeout=300)
    assert done.returncode == status and "Traceback" not in done.stderr, f"{path}: exit status {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stderr


def table(out, name="table"):
    """Rows by column, units by column."""
    with open(out / f"{name}.csv") as file:
        rows = list(csv.DictReader(file))
    return [{key.split(" [")[0]: value for key, value in row.items()} for row in rows], dict(key[:-1].split(" [") for key in rows[0] if "[" in key)


def column(run, name):
    names, rows = lab.series(run)
    return np.array([row[[word.split(" [")[0] for word in names].index(name)] for row in rows])


def near(found, wanted, relative, what):
    assert abs(float(found) / wanted - 1) <= relative, f"{what}: {found}, not {wanted}"


def check_two_grains(here):
    """Two discs at 1 m/s meet and part at e: every measure of it is known."""
    measures = [{"name": "slabs", "series": "profile.density_*", "norm": "share"}, {"name": "mean_slabs", "series": "profile.density_*", "at": "mean"},
                {"name": "course", "series": "profile.density_*", "at": "every", "norm": "share"}, {"name": "left", "series": "energy.grains", "relative": True},
                {"name": "each", "series": "energy.grains", "per": "grains"}, {"name": "radius", "frame": "grain.radius", "of": "mean"},
                {"name": "count", "frame": "grain.radius", "of": "count"}, {"name": "speed", "frame": "grain.velocity.x", "of": "max"},
                {"name": "sum", "frame": "grain.velocity.x", "of": "sum"}, {"name": "spread", "frame": "grain.velocity.x", "of": "deviation", "at": "first"},
                {"name": "speeds", "frame": "grain.velocity.x", "of": "all"}, {"name": "step_cost", "cost": "wall_seconds", "per": "grain_steps"},
                {"name": "fill", "cost": "seconds_by_stage.dem.fill"}, {"name": "kinetic", "summary": "sums.kinetic"},
                {"name": "last_energy", "summary": "observers.energy.grains.last"}]
    e = "grains.contact.linear.restitution"
    path = write(here, "two", set={"time.end": "4 ms", "observe": ["energy", PROFILE]}, axes={"e": {"key": e, "list": [0.5, 0.8]}}, measure=measures,
                 repeats={"seeds": 2}, reference={"name": "full", "set": {e: 1}})
    out = here / "two"
    sweep(path, out)
    rows, units = table(out)
    points, point_units = table(out, "points")
    assert not any(row["message"] for row in rows), rows
    for row in rows:
        run = out / "runs" / row["run"]
        restitution = 1 if row["model"] else float(row["e"])
        near(row["radius"], 0.005, 1e-15, "mean radius")
        near(row["speed"], restitution, 0.005, "the faster grain's velocity is e")
        assert row["count"] == "2.0" and abs(float(row["sum"])) < 1e-12 and float(row["spread"]) == 1, row
        near(row["each"], MASS / 2 * restitution ** 2, 0.01, "energy for each of two grains")
        summary = lab.summary(run)
        near(row["cost.step_cost"], summary["wall_seconds"] / summary["grain_steps"], 1e-15, "a cost per step of a grain")
        assert float(row["cost.fill"]) == summary["seconds_by_stage"]["dem.fill"] and float(row["kinetic"]) == summary["sums"]["kinetic"]["value"]
        assert float(row["last_energy"]) == summary["observers"]["energy"]["grains"]["last"] == column(run, "energy.grains")[-1]
    wanted = {"radius": "m", "count": "1", "speed": "m/s", "each": "J", "cost.step_cost": "s", "cost.fill": "s", "kinetic": "J", "last_energy": "J",
              "slabs.error": "1", "mean_slabs.error": "kg/m^3", "left.error": "1", "left": "J", "speeds.error": "1", "course.error": "1"}
    assert {name: units[name] for name in wanted} == wanted, units
    assert not {"slabs", "course", "speeds"} & set(units) and point_units["cost.fill.mean"] == "s" and "cost.fill.error" not in point_units
    # errors by hand, from the runs' own files
    first, twin = (out / "runs" / next(row for row in rows if row["model"] == model and row["seed"] == "1")["run"] for model in ("", "full"))
    own, other = (np.array([column(run, f"profile.density_{k}") for k in range(12)]) for run in (first, twin))
    share = abs(own[:, -1] - other[:, -1]).sum() / other[:, -1].sum()
    near(points[0]["slabs.error"], share, 1e-12, "share of the profile")
    near(points[0]["course.error"], abs(own - other).sum() / other.sum(), 1e-12, "share of the profile over time")
    near(points[0]["mean_slabs.error"], math.sqrt(np.mean((own.mean(axis=1) - other.mean(axis=1)) ** 2)), 1e-12, "rms of the mean profile")
    for row, restitution in zip(points, (0.5, 0.8)):
        near(row["left.error"], 1 - restitution ** 2, 0.01, "relative loss of energy, 1 - e^2")
        near(row["left.reference"], MASS, 0.01, "energy of the reference")
        near(row["speeds.error"], 0.5, 1e-15, "distance of two speeds within another two")
        assert float(row["speeds.scatter"]) == 0 and float(row["left.error.standard_error"]) == 0, row
    with h5py.File(out / "table.h5") as file:
        group = file["vectors/slabs"]
        assert list(group.attrs["columns"]) == [f"profile.density_{k}" for k in range(12)] and group.attrs["unit"] == "kg/m^3"
        assert group["mean"].shape == (2, 12) and (group["mean"][0] == own[:, -1]).all() and (group["reference"][1] == other[:, -1]).all()
        assert (group["standard_error"][()] == 0).all() and (group["scatter"][()] == 0).all() and "course" not in file["vectors"]
    print(f"ok  measures of two grains: share of the profile {share:.4f}, relative loss {points[0]['left.error'][:6]} (1 - e^2 = 0.75)")


with lab.workplace() as name:
    os.environ["QUERN_CACHE"] = ""
    for check in (check_two_grains,):
        place = pathlib.Path(name) / check.__name__
        place.mkdir()
        check(place)
