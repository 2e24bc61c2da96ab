# SPDX-License-Identifier: MIT
"""Physics from outside: tests/outside/heat, a solver of another field with a kind of its own, is built against an
installed Quern alone and works beside everything else in a scene."""
import concurrent.futures
import json
import math
import os
import pathlib
import shutil

import numpy

import lab
import new
import sections

PACKAGE = lab.SOURCE / "tests/outside/heat"
IDS = ["solver.heat", "conductivity.constant", "conductivity.linear", "observer.temperature"]
STAGES = {"setup": "heat.fill", "begin": "heat.begin", "deposit": "heat.scatter", "exchange": "heat.flux",
          "advance": "heat.gather", "end": "heat.measure"}
SECTION = """
heat:
  conductivity: {constant: {value: 100}}
  hot: {lower: [0, 0], upper: [0.02, 0.3], temperature: 393.15}
  sensors: [{position: [0.01, 0.01]}, {position: [0.02, 0.01]}, {position: [0.03, 0.01]}]
"""
SECTION_3D = SECTION.replace("[0, 0]", "[0, 0, 0]").replace("0.3]", "0.02, 0.3]").replace("0.01]}", "0.004, 0.01]}")
BLOCK = """quern: 1
name: block
dimension: 2
gravity: [0, 0]
domain: {{lower: [0, 0], upper: [{length}, {width}]}}
time: {{end: {end}}}
continuum:
  cell: {cell}
  shape: {shape}
  material: {{elastic: {{bulk_modulus: 1e-4 Pa, density: 1000}}}}
  fill: {{region: {{box: {{lower: [0, 0], upper: [{length}, {width}]}}}}}}
heat: {{capacity: 1000, conductivity: {{constant: {{value: 10}}}}, hot: [{hot}]}}
output: {{every: {end}, fields: [point.mass]}}
observe: [temperature]
"""


# ---- the package ----

def install(place):
    """Quern below a folder, its quern.pc as it would be there; the package is built by that and put beside it."""
    program, environment = new.install(place)
    package = pathlib.Path(environment["PKG_CONFIG_PATH"]) / "quern.pc"
    package.write_text(package.read_text().replace("prefix=/", f"prefix={place}/", 1))
    environment.pop("PKG_CONFIG_SYSROOT_DIR")
    environment["CFLAGS"] = "-Werror -Wshadow -Wconversion -Wundef -Wmissing-prototypes -Wstrict-prototypes"
    shutil.copytree(PACKAGE, place / "heat")
    for command in ("meson setup build", "ninja -C build", "meson install -C build --quiet"):
        new.run(*command.split(), cwd=place / "heat", env=environment)
    objects, = place.glob("**/solver.mpm.so")
    lab.use(program, objects.parent)
    return environment


def quern(*words, status=0):
    return new.run(lab.QUERN, *words, status=status)


def tables():
    listed = quern("list")
    for id in IDS:
        assert f"{id} " in listed, f"quern list does not show {id}"
        said = quern("check", lab.PLUGINS / f"{id}.so")
        assert not id.startswith("conductivity") or "finite and not negative" in said, said
    said = quern("describe", "heat")
    for part in ("solver.heat 0.1.0", "J/(kg K)", "section    heat", "needs      continuum", "Counted.",
                 "heat.measure"):
        assert part in said, said
    assert "W/(m K)" in quern("describe", "conductivity.linear")
    own = json.loads(quern("schema"))["properties"]["heat"]["else"]["properties"]
    assert {"capacity", "hot", "sensors", "conductivity"} <= set(own), sorted(own)
    for name in ("constant", "linear"):
        assert f'"{name}"' in json.dumps(own["conductivity"]), f"the schema does not know conductivity.{name}"
    print("ok  listed, described, checked, in the schema")


def kind(place, environment):
    """What comes with a kind of one's own: `quern new` and `quern check` know it like any other."""
    new.make("conductivity", lab.QUERN, place, environment)
    source = place / "conductivity.mine/conductivity.mine.c"
    text = source.read_text()
    assert text.count("p.value * p.reference") == 1
    source.write_text(text.replace("p.value * p.reference", "(p.value - 1) * p.reference"))
    new.run("ninja", "-C", "build", cwd=source.parent, env=environment)
    said = quern("check", source.parent / "build/conductivity.mine.so", status=2)
    assert "FAILED  finite and not negative" in said, said
    source.write_text(text)
    new.run("ninja", "-C", "build", cwd=source.parent, env=environment)
    os.environ["QUERN_PLUGIN_PATH"] = str(source.parent / "build")
    options = [*lab.SMALL["column"], "--set=heat.conductivity=mine", "--set=time.end=5 ms"]
    lab.run(str(place / "column"), place / "mine", *options)
    assert "conductivity.mine" in {plugin["id"] for plugin in lab.summary(place / "mine")["provenance"]["plugins"]}
    del os.environ["QUERN_PLUGIN_PATH"]
    print("ok  conductivity.mine: made, built, checked, found wanting once it is wrong, and run")


# ---- in the column ----

def write(place):
    """The columns with a section more."""
    for name, section in (("column", SECTION), ("column_3d", SECTION_3D)):
        text = pathlib.Path(lab.scene(name)).read_text()
        assert text.count("\nobserve: [") == 1
        (place / f"{name}.yaml").write_text(text.replace("\nobserve: [", "\nobserve: [temperature, ") + section)


def planned(scene, options):
    plan = lab.plan(scene, *options)
    stages = {stage["name"]: stage["phase"] for stage in plan["stages"]}
    fields = {field["name"]: field for one in plan["sets"] for field in one["fields"]}
    for phase, name in STAGES.items():
        assert stages.get(name) == phase, f"stage {name} is not in phase {phase}"
    order = [stage["name"] for stage in plan["stages"]]
    assert order.index("mpm.sort") < order.index("heat.scatter")
    assert order.index("heat.gather") < order.index("mpm.gather")
    assert {"thermal", "sensor"} <= {one["name"] for one in plan["sets"]}
    for name in ("point.temperature", "sensor.position", "sensor.temperature"):
        assert fields[name]["state"], f"{name} is no state"
    assert {"thermal.capacity", "thermal.heat", "thermal.rate"} <= set(fields)
    assert plan["entries"]["sensors"] == 3 and not plan["skipped"]
    assert set(IDS) - {plugin["id"] for plugin in plan["plugins"]} == {"conductivity.linear"}
    said = quern("check", lab.PLUGINS / "solver.heat.so", "--scene", f"{scene}.yaml", *options)
    assert "FAILED" not in said, said
    print("ok  the plan names stages, sets, fields and plugins; the solver passes its checks in the scene")


def results(folder):
    head, rows = lab.series(folder)
    column = {name.split(" ")[0]: [row[k] for row in rows] for k, name in enumerate(head)}
    assert {"sensors", "temperature.mean", "temperature.min", "temperature.max", "grains"} <= set(column), head
    assert set(column["sensors"]) == {3}
    assert max(column["temperature.max"]) > 390 and min(column["temperature.min"][1:]) >= 293.149
    last = lab.contents(lab.frames(folder)[-1])
    summary = lab.summary(folder)
    assert last["points/temperature"].size == summary["points"] > 0
    assert last["sensors/position"].shape[0] == 3 and last["sensors/temperature"].max() > 300
    assert summary["sensors"] == 3 and summary["sensor_steps"] == 3 * summary["steps"]
    heat = summary["sums"]["heat"]
    assert heat["unit"] == "J" and heat["value"] > 0 and abs(summary["mass_defect"]) < 1e-12
    used = {plugin["id"]: plugin for plugin in summary["provenance"]["plugins"]}
    for id in IDS[:2] + IDS[3:]:
        assert used[id]["version"] == "0.1.0" and used[id]["hash"], f"{id} is not in the provenance"
    assert {"mean", "min", "max"} <= set(summary["observers"]["temperature"])
    print("ok  series, frames and summary hold them")


def column(place, name, whole=True):
    """Same bits however it runs; with `whole`, everything else that can be said of it."""
    scene, options = str(place / name), lab.SMALL[name]
    end = lab.sets(time__end="60 ms") if whole else []
    runs = {"one": [], "two": []}
    if whole:
        runs |= {"v1": ["--set=run.instructions=v1"],
                 "other": ["--set=heat.conductivity={linear: {value: 100, slope: 0.01}}"]}
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        todo = [pool.submit(lab.run, scene, place / f"{name}.{run}", *options, *end, *more,
                            threads=2 if run == "two" else 1)
                for run, more in runs.items()]
        for one in todo:
            one.result()
    once, cut = place / f"{name}.one", place / f"{name}.cut"
    lab.same(once, place / f"{name}.two", f"{name}, 1 and 2 threads")
    half = "31.7 ms" if whole else "11.3 ms"
    lab.run(scene, cut, *options, *end, f"--until={half}")
    lab.run(scene, cut, *options, *end, resume=True, threads=2)
    lab.same(once, cut, f"{name}, stopped and resumed")
    if not whole:
        return
    lab.same(once, place / f"{name}.v1", f"{name}, objects of the lowest instruction set")
    planned(scene, options)
    results(once)
    with lab.workplace() as folder:
        bare, _ = sections.loaded("column", pathlib.Path(folder), *options)
    assert not [id for id in bare if "heat" in id or "conductivity" in id or "temperature" in id], sorted(bare)
    a, b = (lab.contents(lab.frames(place / f"{name}.{run}")[-1])["points/temperature"] for run in ("one", "other"))
    assert a.shape == b.shape and numpy.abs(a - b).max() > 0.1, "another conductivity changes nothing"
    print("ok  another conductivity by one --set; without a section nothing is mapped")


def models(place):
    """`model: heat` keeps what heat needs."""
    scene, options = str(place / "column"), lab.SMALL["column"]
    end = lab.sets(time__end="5 ms", output__fields="[point.velocity, point.mass]")
    plan = lab.plan(scene, *options, *end, "--set=model=heat")
    solvers = {plugin["id"] for plugin in plan["plugins"] if plugin["id"].startswith("solver.")}
    assert solvers == {"solver.mpm", "solver.bodies", "solver.heat"}, sorted(solvers)
    assert {"grains", "hybrid"} <= set(plan["skipped"]), plan["skipped"]
    lab.run(scene, place / "alone", *options, *end, "--set=model=heat")
    lab.run(scene, place / "alone_2", *options, *end, "--set=model=heat", threads=2)
    lab.same(place / "alone", place / "alone_2", "heat and its continuum, 1 and 2 threads")
    first, last = (lab.contents(lab.frames(place / "alone")[k]) for k in (0, -1))
    before, after = (math.fsum(one["points/mass"] * one["points/temperature"]) for one in (first, last))
    assert abs(after / before - 1) < 1e-12 and numpy.abs(last["points/velocity"]).max() > 0.01, after / before - 1
    for model in ("grains", "continuum"):
        lab.run(scene, place / model, *options, *end, f"--set=model={model}", "--set=output.fields=[]")
        assert "points/temperature" not in lab.contents(lab.frames(place / model)[-1])
    text = (place / "column.yaml").read_text()
    for change, part in [(("continuum:", "contineum:"), "did you mean 'continuum'"),
                         (("[0.03, 0.01]", "[0.03, -1]"), "outside of the domain"),
                         (("upper: [0.02, 0.3]", "upper: [0, 0.3]"), "above the lower one"),
                         (("{constant: {value: 100}}", "linaer"), "did you mean 'linear'")]:
        assert text.count(change[0]) == 1, change
        (place / "wrong.yaml").write_text(text.replace(*change))
        said = quern("plan", place / "wrong.yaml", status=2)
        assert part in said, said
    first = quern("plan", lab.scene("two_grains"), "--set=heat={}", status=2)
    assert "heat needs continuum" in first, first
    print(f"ok  model: heat keeps the continuum alone, and its heat to {after / before - 1:.1e}; faults are named")


# ---- physics ----

def profile(place, cells, shape, length=0.24, rows=2, end=600):
    """Decay of a cosine, over theory, and the change of heat, relative."""
    cell, n = length / cells, 2 * cells
    hot = ", ".join(f"{{lower: [{i * length / n}, 0], upper: [{(i + 1) * length / n}, 1], "
                    f"temperature: {300 + 50 * math.cos(math.pi * (i + 0.5) / n)}}}" for i in range(n))
    scene, out = place / f"block_{cells}_{shape}", place / f"out_{cells}_{shape}"
    scene.with_suffix(".yaml").write_text(
        BLOCK.format(cell=cell, length=length, width=rows * cell, end=end, shape=shape, hot=hot))
    lab.run(str(scene), out, threads=2)
    size, heat = [], []
    for file in lab.frames(out):
        found = lab.contents(file)
        wave, temperature = numpy.cos(math.pi * found["points/position"][:, 0] / length), found["points/temperature"]
        size.append(2 * float(numpy.mean(wave * temperature)))
        heat.append(1000 * math.fsum(found["points/mass"] * temperature))
    theory = math.exp(-10 / (1000 * 1000) * (math.pi / length) ** 2 * end)
    assert abs(lab.summary(out)["sums"]["heat"]["value"] / heat[1] - 1) < 1e-12
    assert "conduction of heat" in lab.summary(out)["step_limited_by"], lab.summary(out)["step_limited_by"]
    return size[1] / size[0] / theory - 1, heat[1] / heat[0] - 1


def physics(place):
    errors = {}
    for cells, shape in ((16, "gimp"), (32, "gimp"), (16, "linear")):
        errors[cells, shape], lost = profile(place, cells, shape)
        assert abs(lost) < 1e-12, f"{cells} cells, {shape}: heat changes by {lost:.2g}"
        assert abs(errors[cells, shape]) < 0.02, f"{cells} cells, {shape}: decay is off by {errors[cells, shape]:.2g}"
        print(f"ok  {cells} cells, {shape}: decay is off by {errors[cells, shape]:.2%}, heat by {lost:.1e}")
    said = quern("run", place / "block_16_gimp.yaml", "--set=time.step=20 s", "-o", place / "long", status=2)
    assert "conduction of heat" in said and "beyond the limit" in said, said
    order = math.log2(errors[16, "gimp"] / errors[32, "gimp"])
    assert order > 1.8, f"the error falls with order {order:.2f}"


if __name__ == "__main__":
    with lab.workplace() as name:
        place = pathlib.Path(name)
        environment = install(place / "installed")
        tables()
        write(place)
        kind(place, environment)
        column(place, "column")
        column(place, "column_3d", whole=False)
        models(place)
        physics(place)
