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
                {"name": "last_energy", "summary": "observers.energy.grains.last"},
                {"name": "late", "series": "energy.grains", "at": "max", "from": "3 ms"}, {"name": "early", "series": "energy.grains", "at": "min", "until": "1 ms"},
                {"name": "never", "series": "energy.grains", "from": "5 ms"}]
    e = "grains.contact.linear.restitution"
    path = write(here, "two", set={"time.end": "4 ms", "observe": ["energy", PROFILE]}, axes={"e": {"key": e, "list": [0.5, 0.8]}}, measure=measures,
                 repeats={"seeds": 2}, reference={"name": "full", "set": {e: 1}})
    out = here / "two"
    sweep(path, out)
    rows, units = table(out)
    points, point_units = table(out, "points")
    assert all(row["message"] == "never: series.csv has no row between 'from' and 'until'" for row in rows), rows
    for row in rows:
        run = out / "runs" / row["run"]
        times, energies = column(run, "time"), column(run, "energy.grains")
        assert float(row["late"]) == energies[times >= 3e-3].max() and float(row["early"]) == energies[times <= 1e-3].min() and len(set(energies)) > 1
        restitution = 1 if row["model"] else float(row["e"])
        near(row["radius"], 0.005, 1e-15, "mean radius")
        near(row["speed"], restitution, 0.005 / restitution, "the faster grain's velocity is e")
        assert row["count"] == "2.0" and abs(float(row["sum"])) < 1e-12 and float(row["spread"]) == 1, row
        near(row["each"], MASS / 2 * restitution ** 2, 2 * 0.005 / restitution, "energy for each of two grains")
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


def check_frames(here):
    """Fields of a frame of a column whose floor is of fixed grains, against the file; a component of points; fields that are not there."""
    small = dict(one.removeprefix("--set=").split("=", 1) for one in lab.SMALL["column"])
    measures = [{"name": f"radius_{of}", "frame": "grain.radius", "of": of} for of in ("mean", "deviation", "min", "max", "sum", "count")]
    measures += [{"name": "down", "frame": "grain.velocity.y", "of": "mean", "at": "first"}, {"name": "stress", "frame": "point.stress.1", "of": "min"},
                 {"name": "colour", "frame": "grain.colour", "of": "mean"}, {"name": "velocity", "frame": "grain.velocity", "of": "mean"},
                 {"name": "part", "frame": "grain.radius.x", "of": "mean"}, {"name": "share", "summary": "discrete_share", "per": "mass_initial"},
                 {"name": "still", "summary": "steps", "per": "sums.left"}, {"name": "nothing", "summary": "sums.heat"}, {"name": "word", "summary": "name"},
                 {"name": "columns", "series": "runout.front_*"}]
    sweep(write(here, "frames", base=lab.scene("column"), set={**{key: yaml.safe_load(value) for key, value in small.items()}, "time.end": "5 ms"},
                measure=measures), here / "frames")
    row, units = table(here / "frames")
    row, run = row[0], here / "frames/runs" / row[0]["run"]
    first, last = (h5py.File(run / f"frames/00000{k}.h5") for k in (0, 1))
    fixed = last["grains/fixed"][()] != 0
    radius = last["grains/radius"][()][~fixed]
    assert fixed.any() and float(row["radius_count"]) == len(radius), row
    for of, wanted in (("mean", radius.mean()), ("deviation", radius.std()), ("min", radius.min()), ("max", radius.max()), ("sum", radius.sum())):
        near(row[f"radius_{of}"], wanted, 1e-12, of)
    near(row["down"], first["grains/velocity"][()][first["grains/fixed"][()] == 0, 1].mean(), 1e-9, "mean velocity")
    near(row["stress"], last["points/stress"][()][:, 1].min(), 1e-15, "stress")
    near(row["share"], lab.summary(run)["discrete_share"] / lab.summary(run)["mass_initial"], 1e-15, "a number per number")
    assert units["share"] == "1/kg" and units["stress"] == "Pa" and units["radius_count"] == "1", units
    said = row["message"]
    for words in ("still: 'sums.left' is 0: nothing can be divided by it", "colour: 000001.h5 has no 'grain.colour'; it has ", "velocity: grain.velocity is a vector; name a component, such as grain.velocity.x",
                  "part: grain.radius has no component 'x'", "nothing: summary.json has no 'sums.heat'", "word: name of summary.json is no number",
                  "columns: the series have no 'runout.front_*'; they have time, "):
        assert words in said, (words, said)
    print(f"ok  fields of a frame: {len(radius)} grains that are not fixed, {fixed.sum()} that are")


def check_paths():
    """Keys of a summary that hold dots: the longest that fits, then shorter ones."""
    sys.path.insert(0, str(lab.SOURCE / "python"))
    from quern.measure import number_of, unit_over
    tree = {"a": {"b": {"c": 1}, "b.c": 2, "b.d": {"e": 3}, "unit": "m"}, "a.b": {"f": {"unit": "s", "value": 4}}, "list": [5, {"g.h": 6}], "momentum": [7, 8]}
    for path, wanted in (("a.b.c", (2, "m")), ("a.b.d.e", (3, "m")), ("a.b.f", (4, "s")), ("list.0", (5, "1")), ("list.1.g.h", (6, "1")),
                         ("momentum.1", (8, "kg m/s"))):
        assert number_of(tree, path) == wanted, (path, number_of(tree, path))
    for path in ("a", "a.b", "a.x", "list.2", "list.-1", "list", "a.b.c.d", "", "a..b"):
        try:
            raise AssertionError(f"{path}: {number_of(tree, path)}")
        except (KeyError, ValueError):
            pass
    assert [unit_over(*units) for units in (("s", "1"), ("1", "kg"), ("J", "kg m/s"))] == ["s", "1/kg", "J/(kg m/s)"]
    print("ok  paths of a summary")


def check_closed_form(here):
    """A closed form as the reference: two discs that move apart at e, the energy that e leaves, speeds that are all the same."""
    (here / "theory.csv").write_text(f"""e,left [J],apart [m/s],time [s],all [J],speeds [m/s],share [1],slabs [kg/m^3]
0.5,{MASS / 4},0.5,0,{MASS},-0.5,0.5,
0.5,,,0.02,{MASS / 4},0.5,0.5,
0.5,,,,,0.5,1,
0.8,{MASS * 0.64},0.8,0,{MASS},-0.8,0.5,
0.8,,,0.02,{MASS * 0.64},,,

""" + "".join(f"0.5,,,,,,,{k}\n" for k in range(12)))
    measures = [{"name": "left", "series": "energy.grains", "relative": True}, {"name": "apart", "frame": "grain.velocity.x", "of": "max"},
                {"name": "all", "series": "energy.grains", "at": "every"}, {"name": "speeds", "frame": "grain.velocity.x", "of": "all"},
                {"name": "slabs", "series": "profile.density_*"}, {"name": "other", "series": "step"}]
    study = {"set": {"time.end": "4 ms", "observe": ["energy", PROFILE]}, "repeats": {"seeds": 2}, "measure": measures,
             "axes": {"e": {"key": "grains.contact.linear.restitution", "list": [0.5, 0.8]}}}
    form = {"reference": {"name": "theory", "csv": "theory.csv", "follows": ["e"]}}
    sweep(write(here, "closed", **study, **form), here / "closed")
    rows, points = table(here / "closed")[0], table(here / "closed", "points")[0]
    assert len(rows) == 4 and [row["model"] for row in rows] == [""] * 4, rows
    first = here / "closed/runs" / rows[0]["run"]
    near(points[0]["left.error"], abs(column(first, "energy.grains")[-1] / (MASS / 4) - 1), 1e-9, "relative error against a closed form")
    assert float(points[0]["left.error"]) < 2 * 0.005 / 0.5 and abs(float(points[0]["apart.error"])) < 0.005, points[0]
    times, energy = column(first, "time"), column(first, "energy.grains")
    line = MASS + (MASS / 4 - MASS) * times / 0.02
    near(points[0]["all.error"], math.sqrt(np.mean((energy - line) ** 2)), 1e-12, "a course, from line to line of the file")
    profile = np.array([column(first, f"profile.density_{k}")[-1] for k in range(12)])
    near(points[0]["slabs.error"], math.sqrt(np.mean((profile - np.arange(12)) ** 2)), 1e-12, "a profile")
    # speeds -v and v against a step of a half at -0.5 and one at 0.5; the discs are a little off, so that it is a half
    near(points[0]["speeds.error"], 0.5, 1e-12, "distance of two speeds from two of theory")
    assert all(row[f"{name}.scatter"] == "0.0" for row in points for name in ("left", "apart", "all")) and points[0]["other.error"] == "", points
    assert rows[2]["message"] == "slabs.error: theory.csv has no slabs for e 0.8" and points[1]["slabs.error"] == "", rows[2]
    assert rows[0]["message"] == "", rows[0]
    # the same runs do for another file; what it does not reach, and other units, are said
    (here / "theory.csv").write_text(f"e,left [mJ],all [J],time [s]\n0.5,1,{MASS},0\n0.5,,{MASS / 4},3e-3\n0.8,1,1,0\n0.8,,1,4e-3\n")
    said = sweep(here / "closed.yaml", here / "closed")
    rows = table(here / "closed")[0]
    assert "4 of 4 runs are there already" in said
    assert rows[0]["message"] == "left.error: it is in 'J', and the reference in 'mJ'; " \
        "all.error: theory.csv goes from 0 s to 0.003 s, the run from 0 s to 0.004 s", rows[0]["message"]
    assert rows[2]["all.error"] and rows[2]["left.error"] == "", rows[2]
    print(f"ok  closed forms: energy left is off by {100 * float(points[0]['left.error']):.2f} % of e^2's, a course, a profile, a distribution")


def check_closed_scatter(here):
    """Standard errors against a closed form come from the points alone."""
    (here / "theory.csv").write_text("front [1],one [1]\n40,\n")
    path = write(here, "chance", axes={}, repeats={"seeds": [1, 2, 3, 4]}, set={"time.end": "1 ms"}, measure=[{"name": "front", "summary": "provenance.seed"}],
                 reference={"name": "theory", "csv": "theory.csv"})
    path.write_text(path.read_text().replace("axes: {}\n", ""))
    sweep(path, here / "chance", status=2)
    (here / "theory.csv").write_text("front [1]\n40\n")
    sweep(path, here / "chance")
    point = table(here / "chance", "points")[0][0]
    near(point["front.error"], 37.5, 1e-15, "mean of the seeds 1 to 4 less 40")
    near(point["front.error.standard_error"], math.sqrt((1.5 ** 2 * 2 + 0.5 ** 2 * 2) / 3 / 4), 1e-12, "standard error of 1, 2, 3, 4")
    assert point["front.reference"] == "40.0" and float(point["front.scatter"]) == 0, point
    print("ok  standard errors against a closed form")


def harm(run, kind):
    """Damages a run that is done, as disks, editors and killed copies do."""
    series, summary, record = run / "series.csv", run / "summary.json", run.with_name(run.name + ".json")
    tree, text = json.loads(summary.read_text()), series.read_text()
    put = {"null": {"energy": None}, "words": {"steps": "many"}, "huge": {"steps": 10 ** 400}, "bare": {"provenance": None}, "list": {"sums": [1, 2]}}
    if kind in put:
        summary.write_text(json.dumps(tree | put[kind]))
    elif kind == "no series":
        series.unlink()
    elif kind == "ragged":
        series.write_text(text + "0.005,1,2\n")
    elif kind == "bytes":
        series.write_bytes(b"\xff\xfe" + text.encode())
    elif kind == "nul":
        series.write_text(text.replace("0.001", "0.0\0"))
    elif kind == "no number":
        series.write_text(text.replace("0.001", "soon"))
    elif kind == "nan":
        series.write_text("time [s],step [1],energy.grains [J]\n0,0,nan\n")
    elif kind == "no unit":
        series.write_text(text.replace("step [1]", "step"))
    elif kind == "no rows":
        series.write_text(text.splitlines()[0] + "\n")
    elif kind == "empty":
        series.write_text("")
    elif kind == "no frames":
        shutil.rmtree(run / "frames")
    elif kind == "frame":
        for path in (run / "frames").iterdir():
            path.write_bytes(path.read_bytes()[:500])
    elif kind == "no summary":
        summary.unlink()
    elif kind == "half":
        summary.write_text(summary.read_text()[:300])
    elif kind == "message":
        record.write_text(json.dumps(json.loads(record.read_text()) | {"message": "a\0b \udcff c"}))
    elif kind == "record":
        record.write_text("[1, 2]")
    elif kind == "cost":
        record.write_text(json.dumps(json.loads(record.read_text()) | {"cost": {"wall": "long"}}))
    elif kind == "longer":
        series.write_text(text + text.splitlines()[-1].replace("0.004,", "0.005,") + "\n")
    elif kind == "other":
        series.write_text(text.replace("profile.density_11", "profile.else"))


DAMAGE = {
    "whole": "", "null": "energy of summary.json is no number", "words": "steps of summary.json is no number", "huge": "steps of summary.json is no number",
    "bare": "summary.json does not say what was run", "list": "mass: summary.json has no 'sums.mass'",
    "no series": "left: series.csv cannot be read: No such file or directory", "ragged": "left: series.csv, line 7: 3 cells, and the header names ",
    "bytes": "left: series.csv cannot be read: it is no table of text", "nul": "left: series.csv", "no number": "left: series.csv: could not convert string to float: 'soon'",
    "nan": "left: energy.grains is not finite", "no unit": "", "no rows": "left: series.csv has no row", "empty": "left: the series have no 'energy.grains'",
    "no frames": "radius: the run has no frame", "frame": "radius: frames/000004.h5 cannot be read: ", "no summary": "summary.json is missing or damaged",
    "half": "summary.json is missing or damaged", "message": "ab ? c", "record": "", "cost": "",
    "longer": "all.error: its 6 times until 0.005 s are not the 5 until 0.004 s of the reference", "other": "slabs.error: it has 11 columns, and the reference 12"}


def check_damage(here):
    """Every kind of damage is a row that says so, and the rest of the table is as it was."""
    measures = [{"name": "left", "series": "energy.grains"}, {"name": "all", "series": "energy.grains", "at": "every"}, {"name": "mass", "summary": "sums.mass"},
                {"name": "radius", "frame": "grain.radius", "of": "mean"}, {"name": "radii", "frame": "grain.radius", "of": "all"},
                {"name": "slabs", "series": "profile.density_*"}]
    path = write(here, "harmed", set={"time.end": "4 ms", "observe": ["energy", PROFILE]}, measure=measures, reference={"name": "twin", "set": {"time.step": "4e-6"}},
                 axes={"damage": {"cases": {name: {} for name in DAMAGE}}}, repeats={"seeds": 1})
    tree = yaml.safe_load(path.read_text())
    for k, case in enumerate(tree["axes"]["damage"]["cases"].values()):
        case["time.step"] = f"{5e-6 + k * 1e-9:.10g}"  # so that no two are one run
    path.write_text(yaml.safe_dump(tree, sort_keys=False))
    out = here / "harmed"
    sweep(path, out)
    whole = table(out)[0]
    for row in whole[1:]:
        harm(out / "runs" / row["run"], row["damage"])
    sweep(path, out, "--table")
    rows = {row["damage"]: row for row in table(out)[0][1:]}
    assert list(rows) == list(DAMAGE)
    for name, said in DAMAGE.items():
        assert said in rows[name]["message"] and bool(said) == bool(rows[name]["message"]), f"{name}: {rows[name]['message']}"
        assert rows[name]["status"] == ("missing" if name in ("record", "cost") else "done"), (name, rows[name])
    before = {row["damage"]: row for row in whole}
    assert rows["whole"] == before["whole"] and rows["no unit"] == before["no unit"]
    for name in ("null", "words", "bare", "no frames"):
        assert rows[name]["left.error"] == before[name]["left.error"] != "", name
    assert not rows["ragged"]["left"] and rows["ragged"]["mass"] == before["ragged"]["mass"] and rows["other"]["left.error"]
    assert "left out of /vectors" in rows["other"]["message"], rows["other"]
    with h5py.File(out / "table.h5") as file:
        assert file["runs/message"].shape == (len(DAMAGE) + 1,) and np.isnan(file["vectors/slabs/mean"][list(DAMAGE).index("other")]).all()
    # what lost its record, its summary or cannot be read is made again by the next sweep, the rest is not
    assert sweep(path, out).count("] done: ") == 4
    # the reference itself is harmed: no errors, and the table is there
    harm(out / "runs" / whole[0]["run"], "no series")
    sweep(path, out, "--table")
    rows = table(out)[0]
    assert rows[0]["message"].startswith("left: series.csv cannot be read") and rows[1]["left"] and not rows[1]["left.error"], rows[:2]
    # every run is refused
    path = write(here, "refused", set={"time.end": -1}, measure=measures, reference={"name": "twin", "set": {"time.step": "4e-6"}}, repeats={"seeds": 2},
                 axes={"e": {"key": "time.step", "list": ["1e-6", "2e-6"]}})
    sweep(path, here / "refused")
    assert [row["status"] for row in table(here / "refused")[0]] == ["refused"] * 6 and len(table(here / "refused", "points")[0]) == 2
    print(f"ok  {len(DAMAGE)} kinds of damage, each a row that says so")


with lab.workplace() as name:
    os.environ["QUERN_CACHE"] = ""
    check_paths()
    for check in (check_frames, check_two_grains, check_closed_form, check_closed_scatter, check_damage):
        place = pathlib.Path(name) / check.__name__
        place.mkdir()
        check(place)
