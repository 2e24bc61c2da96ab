# SPDX-License-Identifier: MIT
"""The JSON Schema of scenes: it knows what the tables say, takes every scene that this tree ships or a run leaves, and refuses
most that the program refuses."""
import copy
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import lab
import workshop

QUERN, SOURCE = os.environ["QUERN"], pathlib.Path(os.environ["QUERN_SOURCE"])
MALFORMED = SOURCE / "tests/regression/malformed"


def said(*words, **options):
    done = subprocess.run([QUERN, *map(str, words)], capture_output=True, text=True, timeout=120, **options)
    assert done.returncode == 0, f"{words}: {done.stderr}"
    return done.stdout


SCHEMA = json.loads(said("schema"))


def check_tables():
    """Types, ranges, defaults and what is required come from the rows, at every depth."""
    scene = SCHEMA["properties"]
    assert set(SCHEMA["required"]) == {"quern", "dimension", "gravity", "domain", "time"}
    assert set(scene["domain"]["required"]) == {"lower", "upper"} and scene["time"]["required"] == ["end"]
    quantity = {"$ref": "#/definitions/quantity"}
    step = scene["time"]["properties"]["step"]["anyOf"]
    assert {"type": "number"} in step and quantity in step and {"const": "auto"} in step
    end = scene["time"]["properties"]["end"]
    assert {"type": "number", "minimum": 0.0, "maximum": 1e12} in end["anyOf"] and quantity in end["anyOf"]
    assert scene["output"]["properties"]["compress"]["default"] is True
    assert scene["checkpoint"]["properties"]["every"]["default"] == 300
    grains = scene["grains"]["else"]
    assert not grains["additionalProperties"] and "contact" in grains["required"]
    assert grains["allOf"] == [{"anyOf": [{"required": ["material"]}, {"required": ["materials"]}]}]
    assert {"density", "radius"} <= set(grains["properties"]["material"]["required"])
    law = next(one for one in grains["properties"]["contact"]["anyOf"][0]["anyOf"] if "properties" in one)["properties"]
    assert law["linear"]["required"] == ["stiffness"] and not law["linear"]["additionalProperties"]
    assert {"type": "number", "exclusiveMinimum": 0.0, "maximum": 1e15} in law["linear"]["properties"]["stiffness"]["anyOf"]
    pattern = re.compile(SCHEMA["definitions"]["quantity"]["pattern"])
    for text in ("5 mm", "5", "-.5e-3 m/s^2", "24 deg", "10 %", "3 1/s", "5mm", "1e5"):
        assert pattern.match(text), text
    for text in ("", "mm", "5 5", "five", "0,1 s", "5 -m"):
        assert not pattern.match(text), text
    print("the schema says what the tables say")


# lists in every form, whose items a slot opens or stands in, and two keys that another one stands for each
FORMS = """#include <quern/packer.h>
#include <quern/solver.h>
typedef struct { const char *name; quern_real size; } part;
typedef struct { quern_list named, couple, bare; quern_real a, b, c, d; } forms;
static const quern_param named_rows[] = { QUERN_PARAM(part, name, NULL, "N.", .flags = QUERN_REQUIRED),
	QUERN_PARAM(part, size, "m", "S."), QUERN_PARAM_AS(part, size, "width", "m", "S."), QUERN_END_PARAMS };
static const quern_param size_rows[] = { QUERN_PARAM(part, size, "m", "S."), QUERN_END_PARAMS };
#define LIST(m, rows_, ...) QUERN_PARAM(forms, m, NULL, "L.", .rows = rows_, .item_size = sizeof(part), __VA_ARGS__)
#define EITHER(m, other) QUERN_PARAM(forms, m, "1", "E.", .flags = QUERN_REQUIRED, .unless = #other), \
	QUERN_PARAM(forms, other, "1", "O.", .flags = QUERN_MAYBE)
static const quern_param params[] = { LIST(named, named_rows, .text = "name"), LIST(couple, size_rows, .min = 2, .max = 4),
	LIST(bare, size_rows, .max = 4), EITHER(a, b), EITHER(c, d), QUERN_END_PARAMS };
static const quern_use none[] = { QUERN_END_USES };
static const quern_set sets[] = { { .name = "bead", .doc = "S." }, { .name = NULL } };
#define SLOT(name_, ...) { .name = name_, .doc = "P.", .kind = &quern_packer_kind, __VA_ARGS__ }
static const quern_slot slots[] = { SLOT("couple.packer", .def = "random"), SLOT("bare.packer", .def = "random"),
	SLOT("one", .def = "random", .refine = "named"), { .name = NULL } };
static quern_status nothing(const void *self, const quern_step *s) { return (void)self, (void)s, QUERN_OK; }
static const quern_stage stages[] = { { .name = "forms.do", .doc = "D.", .phase = QUERN_END, .uses = none, .run = nothing }, { .name = NULL } };
static const quern_solver_ops ops = { QUERN_SOLVER_SIZES, .section = "forms", .sets = sets, .slots = slots, .stages = stages };
static const quern_plugin plugin = { .size = sizeof plugin, .revision = 1, .dims = 3, .id = "solver.forms", .brief = "F.",
	.instance_size = sizeof(forms), .params = params, .uses = none, .ops = &ops };
QUERN_LIBRARY(plugin, "1", "MIT");
"""


def check_forms():
    """Keys of a slot are known in the items of its list in whatever form that may be given; each key that another one stands for is wanted."""
    with tempfile.TemporaryDirectory() as folder:
        workshop.compile(FORMS, "solver.forms", folder)
        section = json.loads(said("schema", env={**os.environ, "QUERN_PLUGIN_PATH": folder}))["properties"]["forms"]["else"]
    found = section["properties"]
    by_name, listed = found["named"]["anyOf"]
    for item in (by_name["additionalProperties"], listed["items"]):
        assert item["additionalProperties"] is True, item
    couple, bare = found["couple"], found["bare"]["anyOf"]
    packers = [item["anyOf"][0]["properties"]["packer"] for item in (couple["items"], bare[0], bare[1]["items"])]
    assert couple["minItems"] == 2 and len(packers[0]["anyOf"]) == 2 and packers[0] == packers[1] == packers[2], packers
    wanted = [[one["required"] for one in both["anyOf"]] for both in section["allOf"]]
    assert wanted == [[["a"], ["b"]], [["c"], ["d"]]], wanted
    print("lists take a slot's keys in every form")


def check_scenes(validator, yaml):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        # as resolved, with every default written out
        lab.run("two_grains", folder / "two_grains")
        lab.run("column", folder / "column", *lab.SMALL["column"], "--set=time.end=1 ms", "--set=output.every=1 ms")
        scenes = [*SOURCE.glob("configs/*.yaml"), *SOURCE.glob("tests/bench/*.yaml"), *folder.glob("*/scene.yaml")]
        texts = [path.read_text() for path in scenes]
    texts += re.findall(r"```yaml\n(.*?)```", (SOURCE / "README.md").read_text(), re.S)
    for path, text in zip([*map(str, scenes), "README.md"], texts):
        faults = [f"{list(e.absolute_path)}: {e.message}" for e in validator.iter_errors(yaml.safe_load(text))]
        assert not faults, f"{path}: {faults}"
    print(f"{len(texts)} scenes are good")


def check_malformed(validator, yaml):
    refused, passed = 0, []
    for path in sorted(MALFORMED.glob("*.yaml")):
        try:
            scene = yaml.safe_load(path.read_text())
        except (yaml.YAMLError, UnicodeDecodeError, ValueError):
            continue
        if list(validator.iter_errors(scene)):
            refused += 1
        else:
            passed.append(path.stem)
    assert refused >= 100, f"only {refused} malformed scenes are refused"
    for name in ("law_key_misspelt", "gravity_missing", "restitution_above", "material_case", "law_unknown", "section_list",
                 "points_fraction", "cell_missing", "fill_settle_word", "radius_law", "place_without_position"):
        assert name not in passed, f"{name} passes the schema"
    print(f"{refused} malformed scenes are refused, {len(passed)} need more than a schema")


def check_words(validator, yaml):
    """What the program takes in more than one form, the schema takes in each."""
    scene = yaml.safe_load((SOURCE / "configs/two_grains.yaml").read_text())
    for place, values in {("time", "end"): [0.02, "20 ms", "0.02 s"], ("output", "compress"): [True, "no", "on"],
                          ("time", "step"): ["auto", 1e-6, "1 us"], ("grains", "solver"): ["dem", "other"]}.items():
        for value in values:
            other = copy.deepcopy(scene)
            other[place[0]][place[1]] = value
            assert validator.is_valid(other), f"{place}: {value}"
    grains = scene["grains"]
    one = {"density": 2500, "radius": {"mean": "1 mm"}}
    pair = {"between": ["sand", "steel"], "friction": 0.2}
    for material in ({"materials": {"sand": one, "steel": one}, "pairs": [pair]}, {"materials": [{"name": "sand", **one}], "pairs": pair}):
        other = {**scene, "grains": {**{k: v for k, v in grains.items() if k != "material"}, **material}}
        assert validator.is_valid(other), list(validator.iter_errors(other))[:3]
    assert not validator.is_valid({**scene, "grains": {k: v for k, v in grains.items() if k != "material"}}), "no material passes"
    for place, value in {("time", "end"): "soon", ("output", "compress"): "maybe", ("time", "step"): "never",
                         ("seed",): 1.5, ("time", "end "): 1}.items():
        other = copy.deepcopy(scene)
        (other[place[0]] if len(place) == 2 else other)[place[-1]] = value
        assert not validator.is_valid(other), f"{place}: {value} passes"
    print("quantities and switches have all their forms")


if __name__ == "__main__":
    check_tables()
    check_forms()
    try:
        import jsonschema
        import yaml as reader
    except ImportError:
        print("python3-jsonschema or python3-yaml is missing: no scene was held against the schema")
        sys.exit(77)
    jsonschema.Draft7Validator.check_schema(SCHEMA)
    draft = jsonschema.Draft7Validator(SCHEMA)
    for test in (check_scenes, check_malformed, check_words):
        test(draft, reader)
