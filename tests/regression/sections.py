# SPDX-License-Identifier: MIT
"""No more than a scene needs: which objects are mapped, which sets and fields exist and what an entry weighs."""
import pathlib
import re
import subprocess

import lab

INDEX = {"contact.first", "contact.second", "touch.grain", "touch.body", "grain.fixed", 
         "cell.zone", "waiting.draw"}  # four bytes; all the rest has eight
OF_GRAINS = {"contact", "neighbours", "integrator", "packer"}
OF_CONTINUUM = {"material", "shape", "transfer", "strain"}
OF_HYBRID = {"coupling", "oracle"}


def loaded(name, folder, *options):
    """Plugins that the dynamic linker loads for a run, without the instruction set, and the objects."""
    log = folder / "linker"
    lab.run(name, folder / "run", *options, "--until=0", LD_DEBUG="files", LD_DEBUG_OUTPUT=str(log))
    text = "".join(file.read_text(errors="replace") for file in folder.glob("linker.*"))
    # solvers are asked which section they read, and are let go again
    asked = re.findall(r"file=(\S+\.so) \[\d+\];\s+destroying link map", text)
    begun = re.findall(r"calling init: (\S+\.so)\b", text)
    files = {pathlib.Path(file) for file in begun if begun.count(file) > asked.count(file)}
    files = {file for file in files if file.parent == lab.PLUGINS.resolve()}
    return {".".join(file.name.split(".")[:2]) for file in files}, files


def solvers_of(ids):
    return {id.split(".")[1] for id in ids if id.startswith("solver.")}


class Scene:
    """What the plan says and what the linker does, compared at once."""

    def __init__(self, name, *options):
        self.plan = lab.plan(name, *options)
        self.sets = {one["name"]: one for one in self.plan["sets"]}
        self.fields = {field["name"]: field for one in self.plan["sets"] for field in one["fields"]}
        self.ids = {plugin["id"] for plugin in self.plan["plugins"]}
        with lab.workplace() as place:
            ids, files = loaded(name, pathlib.Path(place), *options)
        assert ids == self.ids, f"{name}: mapped {sorted(ids - self.ids)}, not mapped {sorted(self.ids - ids)}"
        assert {str(file) for file in files} == {plugin["file"] for plugin in self.plan["plugins"]}
        assert len(files) == len(ids), f"{name}: one plugin mapped for several instruction sets"
        self.check_bytes(name, options)

    def check_bytes(self, name, options):
        done = subprocess.run([lab.QUERN, "plan", lab.scene(name), *options], capture_output=True, text=True)
        for one in self.plan["sets"]:
            if one["rows"]:
                continue
            weight = sum(f["components"] * (4 if f["name"] in INDEX else 8) * (1 + f["twice"])
                         for f in one["fields"] if not f["scratch"])
            if one["name"] != "total":
                assert weight == one["bytes_per_entry"], f"{name}: {one['name']}: {weight} bytes, not as planned"
                assert f"  {one['name']}, {weight} bytes each" in done.stdout, done.stdout

    def bytes(self, name):
        return self.sets[name]["bytes_per_entry"]

    def kinds(self):
        return {id.split(".")[0] for id in self.ids}

    def components(self, field):
        return self.fields[field]["components"]


def without_continuum(name, scene, solvers):
    assert solvers_of(scene.ids) == solvers, f"{name}: {solvers_of(scene.ids)}"
    assert not scene.kinds() & (OF_CONTINUUM | OF_HYBRID), f"{name}: {sorted(scene.ids)}"
    assert not set(scene.sets) & {"point", "cell", "node", "motion", "mixture"}, f"{name}: {sorted(scene.sets)}"
    assert {"continuum", "hybrid", "grid"} <= set(scene.plan["skipped"])
    print(f"{name}: {len(scene.ids)} objects, no continuum, no grid; a grain has {scene.bytes('grain')} bytes")


def grains_alone():
    without_continuum("two grains", Scene("two_grains"), {"dem"})
    without_continuum("a grain on an incline", Scene("incline"), {"dem", "bodies"})
    for name in lab.SMALL:
        without_continuum(f"{name} of grains", Scene(name, *lab.SMALL[name], "--set=model=grains",
                                                     "--set=output.fields=[grain.velocity]"), {"dem", "bodies"})


def friction():
    rough, smooth = Scene("two_grains"), Scene("two_grains", "--set=grains.contact.linear.friction=0")
    for field in ("grain.spin", "contact.slip"):
        assert field in rough.fields and field not in smooth.fields, f"{field} is there without friction"
    assert not [f for f in smooth.fields if re.search("spin|slip|torque|turn", f)], sorted(smooth.fields)
    assert smooth.components("grain.position") == smooth.components("grain.velocity") == 2
    assert max(field["components"] for field in smooth.fields.values()) == 2
    # position and velocity, the last acceleration, the place at the last list, radius, mass, id; two indices
    assert smooth.bytes("grain") == (4 + 2 + 2 + 3) * 8 and smooth.bytes("contact") == 8
    print(f"2-D grains: with friction {rough.bytes('grain')} and {rough.bytes('contact')} bytes each grain and contact, "
          f"without {smooth.bytes('grain')} and {smooth.bytes('contact')}")
    solid = Scene("column_3d", *lab.SMALL["column_3d"], "--set=model=grains", "--set=output.fields=[grain.velocity]")
    assert solid.components("grain.position") == solid.components("grain.spin") == 3


def continuum_alone():
    with lab.workplace() as place:  # nothing holds its end
        text = pathlib.Path(lab.scene("elastic_bar")).read_text()
        free = re.sub(r"bodies:\n(  .*\n)+", "", text)
        assert free != text
        pathlib.Path(place, "bar.yaml").write_text(free)
        bar = Scene(f"{place}/bar")
    assert solvers_of(bar.ids) == {"mpm"} and not bar.kinds() & (OF_GRAINS | OF_HYBRID)
    assert {id for id in bar.ids if id.startswith("body.")} == {"body.box"}, "the shape of its region alone"
    assert not set(bar.sets) & {"grain", "contact", "touch", "body", "cell", "mixture"}, sorted(bar.sets)
    assert bar.components("point.stress") == 3 and bar.components("point.position") == 2
    print(f"elastic bar: {len(bar.ids)} objects, no grains, no cells; a point has {bar.bytes('point')} bytes")


SAND = {"point.following": 1, "point.around": 1, "point.spreading": 2}  # what flows keeps its room
MATERIALS = {
    "mu_i": ("{bulk_modulus: 1e5, diameter: 2 mm, grain_density: 2500, critical_density: 2000}", SAND),
    "drucker_prager": ("{bulk_modulus: 1e5, density: 2000}", {**SAND, "point.volume_strain": 1}),
    "elastic": ("{bulk_modulus: 1e5, density: 2000}", {})}


def materials():
    """In two dimensions nothing of a point has a third component, and a material adds what it remembers and no more."""
    found = {}
    for material, (keys, _) in MATERIALS.items():
        scene = Scene("column", *lab.SMALL["column"], "--set=model=continuum", "--set=output.fields=[]",
                      *(f"--set=bodies.{k}.plane.boundary=sticky" for k in range(2)), f"--set=continuum.material={{{material}: {keys}}}")
        found[material] = {field["name"]: field["components"] for field in scene.sets["point"]["fields"]}
        # a symmetric tensor has three components in a plane
        assert all(n <= (3 if field in ("point.stress", "point.dashpot") else 2) for field, n in found[material].items()), found[material]
        assert found[material]["point.stress"] == 3 and found[material]["point.position"] == 2
    common = set.intersection(*map(set, found.values()))
    for material, fields in found.items():
        own = {field: n for field, n in fields.items() if field not in common}
        assert own == MATERIALS[material][1], f"{material} adds {own}"
        print(f"column of {material}: adds {own or 'nothing'}")


def hybrid():
    whole = Scene("column", *lab.SMALL["column"])
    books = {field for field in whole.fields if "owed" in field or field.endswith((".weight", ".zone"))}
    assert {"cell.owed", "grain.weight", "point.weight", "cell.zone"} <= books
    plain = "--set=output.fields=[]"
    for model in ("grains", "continuum"):
        alone = Scene("column", *lab.SMALL["column"], plain, f"--set=model={model}")
        left = books & set(alone.fields) | {f for f in alone.fields if re.search("owed|audit|draws|updates", f)}
        assert not left, f"{model}: keeps {sorted(left)}"
        set_name = {"grains": "grain", "continuum": "point"}[model]
        assert alone.bytes(set_name) < whole.bytes(set_name)
        print(f"column of {model}: {alone.bytes(set_name)} bytes each, in the hybrid {whole.bytes(set_name)}; "
              f"no ledger ({len(books)} fields less)")


def while_it_runs():
    """The same of a process at work."""
    for model in ("all", "grains"):
        with lab.workplace() as place:
            folder = pathlib.Path(place) / "run"
            options = [*lab.SMALL["column"], f"--set=model={model}", "--set=output.fields=[grain.velocity]"]
            process = lab.start("column", folder, *options)
            assert lab.wait_for(folder / "log.txt", process)
            found = lab.mapped(process)
            lab.stop(process)
            planned = {plugin["id"] for plugin in lab.plan("column", *options)["plugins"]}
            assert found == planned, f"mapped {sorted(found - planned)}, not mapped {sorted(planned - found)}"
            print(f"column, model: {model}: {len(found)} objects mapped in a running process, just as planned")


if __name__ == "__main__":
    grains_alone()
    friction()
    continuum_alone()
    materials()
    hybrid()
    while_it_runs()
