# SPDX-License-Identifier: MIT
"""A scene of several materials: the same bits for threads, batches, instruction sets and compilers, and across stops; its plan and
the tables show what a scene may say of them; the resolved scene says it again; and a scene of one material has none of it."""
import json
import pathlib
import subprocess

import lab

SHORT = lab.sets(time__end="0.1 s", output__every="10 ms", output__fields="[grain.velocity, grain.spin, contact.force, contact.slip, touch.slip]")
# walls that say something themselves, and a law of two plugins whose keys have to be told apart
MORE = ["--set=grains.contact=[{linear: {stiffness: 1e6, restitution: 0.5, friction: 0.5}}, {rolling: {stiffness: 1e5, friction: 0.1}}]",
        "--set=grains.pairs=[{between: [steel, sand], restitution: 0.7, linear: {friction: 0.3}, rolling: {friction: 0}}, "
        "{between: [steel, rubber], linear: {friction: 0}}, {between: [rubber, sand], rolling: {friction: 0.4}}]",
        "--set=bodies=[{plane: {point: [0, -2 mm], normal: [0, 1], material: rubber, contact: {restitution: 0.2}}}]"]


def check_bits(folder, options, what):
    base = folder / "base"
    lab.run("mixture", base, *options)
    lab.same_ways("mixture", base, folder, *options, what=f"{what}, ", batches=(8, 97), levels=("v1", "v3", "v4"))
    out = folder / "stopped"
    lab.run("mixture", out, *options, "--until=33 ms")
    lab.run("mixture", out, *options, resume=True)
    lab.same(base, out, f"{what}, stopped at 33 ms and resumed")
    done = subprocess.run([lab.QUERN, "run", base / "scene.yaml", "-o", folder / "again", "--quiet"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lab.same(base, folder / "again", f"{what}, the resolved scene", checkpoint=False)


def check_tables():
    fields = {field["name"] for set in lab.plan("mixture")["sets"] for field in set["fields"]}
    assert "grain.material" in fields, sorted(fields)
    assert "two lightest grains of sand" in lab.plan("mixture")["step_set_by"]
    alone = {field["name"] for set in lab.plan("two_grains")["sets"] for field in set["fields"]}
    assert "grain.material" not in alone
    told = json.loads(subprocess.run([lab.QUERN, "describe", "grains", "--json"], check=True, capture_output=True, text=True).stdout)
    rows = {row["name"]: row for row in told["params"]}
    assert rows["materials"]["named_by"] == "name" and rows["material.density"]["unless"] == "materials"
    assert [row["name"] for row in rows["pairs"]["rows"]] == ["between"]
    assert next(slot for slot in told["slots"] if slot["name"] == "contact")["refine"] == "pairs"
    said = subprocess.run([lab.QUERN, "describe", "grains"], check=True, capture_output=True, text=True).stdout
    assert "required without materials" in said and "map or list" in said
    print("plan and describe know materials and pairs")


def check_stages(folder):
    """A stage of the scene may give a pair other parameters, also in the middle of a contact; it cannot take a material from its grains."""
    smooth = "--set=stages=[{for: 30 ms}, {set: {grains.pairs.0.friction: 0, grains.pairs.1.restitution: 0.3}}]"
    lab.run("mixture", folder / "one", *SHORT)
    lab.run("mixture", folder / "two", *SHORT, smooth)
    lab.run("mixture", folder / "threads", *SHORT, smooth, "--set=run.batch=8", threads=2)
    lab.same(folder / "two", folder / "threads", "two stages, 2 threads and run.batch: 8")
    last = [lab.contents(lab.frames(folder / name)[k])["grains/position"] for name in ("one", "two") for k in (3, 10)]
    assert (last[0] == last[2]).all() and abs(last[1] - last[3]).max() > 1e-5, "the stage changes nothing, or too early"
    one, steel = "{density: 2500, radius: {mean: 2 mm}}", "{density: 7800, radius: {mean: 1.5 mm}}"
    said = lab.run("mixture", folder / "fewer", *SHORT, f"--set=grains.materials={{sand: {one}, glass: {one}, steel: {steel}}}",
                   f"--set=stages=[{{for: 10 ms}}, {{set: {{grains.materials: {{sand: {one}, steel: {steel}}}}}}}]", status=2)
    assert "stages: grains.materials cannot change in the course of a run" in said, said
    print("stages change pairs, not materials")


def check_name_alone(folder):
    """One material by name is one material, also for a hybrid, whose grains come and go; a wall's word changes nothing by itself."""
    options = [*lab.SMALL["column"], "--set=time.end=20 ms", "--set=grains.settle.energy=0.02"]
    lab.run("column", folder / "short", *options)
    lab.run("column", folder / "named", *options, "--set=grains.material=null", "--set=bodies.0.plane.material=sand",
            "--set=grains.materials={sand: {density: 2500, radius: {mean: 1 mm, spread: 10 %}}}")
    one, two = lab.frames(folder / "short"), lab.frames(folder / "named")
    assert len(one) == len(two) > 2
    for a, b in zip(one, two):
        assert lab.differences(a, b) == ["@scene_hash"], f"{a.name}: {lab.differences(a, b)[:5]}"
    assert (folder / "short/series.csv").read_bytes() == (folder / "named/series.csv").read_bytes()
    print(f"a hybrid of one material with a name: {len(one)} frames the same")


if __name__ == "__main__":
    check_tables()
    with lab.workplace() as name:
        check_bits(pathlib.Path(name) / "plain", SHORT, "mixture")
    with lab.workplace() as name:
        check_bits(pathlib.Path(name) / "more", [*SHORT, *MORE], "two laws and walls")
    with lab.workplace() as name:
        check_stages(pathlib.Path(name))
    with lab.workplace() as name:
        check_name_alone(pathlib.Path(name))
