# SPDX-License-Identifier: MIT
"""Scenes that somebody has spoilt: types, units, signs, sizes, structure, extreme numbers. Each is planned and run for a
while under a limit of time, and what a run leaves that ends well is looked at (nonsense.py).

hostile_scenes.py [--seed N] [--count N] [--only K] [--keep FOLDER]; the same seed makes the same scenes.
"""
import argparse
import copy
import json
import pathlib
import random
import sys

try:
    import yaml
except ImportError:
    print("python3-yaml is not installed: skipped")
    sys.exit(77)

import nonsense
from nonsense import SOURCE, call, check_end, lab, look, need

CORPUS = [*sorted((SOURCE / "tests/regression/malformed").glob("*.yaml")),
          *sorted((SOURCE / "tests/fuzz/corpus/scene").glob("*.yaml"))]
# the scenes of configs/, so small that they take a moment: path, value
SMALL = {
    "column": {"domain.upper": [0.1, 0.2], "time.end": "10 ms", "output.every": "2 ms",
               "grains.contact.linear.stiffness": "1e5 N/m", "hybrid.update": 20,
               "grains.fill.0.region.box": {"lower": [0, "-0.7 mm"], "upper": [0.1, "-0.7 mm"]},
               "grains.fill.1.region.box": {"lower": [0.001, 0.001], "upper": [0.019, 0.03]},
               "grains.settle": {"energy": 0.1, "most": 3000}, "bodies.2.plane.point": [0.02, 0],
               "hybrid.oracle": [{"packing_fraction": {"depth": "8 mm", "half_width": "4 mm"}}],
               "continuum.fill.region.box.upper": [0.02, 0.04]},
    "column_3d": {"domain.upper": [0.1, 0.008, 0.16], "time.end": "5 ms", "output.every": "1 ms", "hybrid.update": 20,
                  "grains.fill.0.region.box": {"lower": [0, 0, "-0.7 mm"], "upper": [0.04, 0.008, "-0.7 mm"]},
                  "grains.fill.1.region.box": {"lower": [0.001, 0, 0.001], "upper": [0.011, 0.008, 0.02]},
                  "grains.contact.linear.stiffness": "200 N/m", "bodies.2.plane.point": [0.012, 0, 0],
                  "continuum.fill.region.box.upper": [0.012, 0.008, 0.02], "grains.settle": {"energy": 0.1, "most": 2000},
                  "hybrid.oracle": [{"packing_fraction": {"depth": "8 mm", "half_width": "4 mm"}}]},
    "elastic_bar": {"time.end": 4},
    "incline": {"time.end": "40 ms"},
    "two_grains": {},
    "continuum": {"model": "continuum", "domain.upper": [0.1, 0.2], "time.end": "10 ms", "output.every": "2 ms",
                  "continuum.fill.region.box.upper": [0.04, 0.06]},
    "bed": {},
}
BED = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, -0.02], upper: [0.05, 0.03]}
time: {end: 4 ms}
output: {every: 1 ms}
bodies:
  - plane: {point: [0, 0], normal: [0, 1]}
  - box: {lower: [0.02, 0], upper: [0.03, 0.004]}
grains:
  material: {density: 2500, radius: {mean: 1 mm, spread: 0.1}}
  contact: {hertz: {young: 1e7, poisson: 0.2, restitution: 0.5, friction: 0.5}}
  fill: {region: {box: {lower: [0.001, 0.006], upper: [0.049, 0.025]}}, packer: random}
"""
OBSERVED = ["--set=observe=[mass, momentum, energy]", "--set=output.fields=[grain.velocity]"]
EXTREMES = ["1e300", "-1e300", "5e-324", "1e-30", "1e9", "1e12", "4294967296", "-1", "0", "-0.0", ".inf", "-.inf", ".nan",
            "1e400", "0x10", "1_000", "9223372036854775808"]
UNITS = ["kg", "m", "mm", "s", "Pa", "%", "m/s", "N/m", "1/s", "degrees", "parsec", "kg/m^3", "km", "um"]
WORDS = ["true", "null", "no", "[]", "{}", "[[]]", "{a: {b: c}}", "\"\"", "'1'", "~", "auto", "all", "../../x", "*x", "&a 1",
         "linear", "grain.velocity", "1 m 2", "[1, 2, 3, 4]", "µ", "x" * 300]


# ---- scenes as trees ----

def at(tree, path):
    for word in path:
        tree = tree[word]
    return tree


def put(tree, dotted, value):
    *way, last = dotted.split(".")
    for word in way:
        if isinstance(tree, list):
            tree = tree[int(word)]
        else:
            tree = tree.setdefault(word, {})
    tree[int(last) if isinstance(tree, list) else last] = value


def base(name):
    file = {"continuum": "column"}.get(name, name)
    tree = yaml.safe_load(BED if name == "bed" else (SOURCE / f"configs/{file}.yaml").read_text())
    for dotted, value in SMALL[name].items():
        put(tree, dotted, copy.deepcopy(value))
    return tree


def text_of(tree):
    """Flow style, with every word as it is: what was text may become anything."""
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{key}: {text_of(value)}" for key, value in tree.items()) + "}"
    if isinstance(tree, list):
        return "[" + ", ".join(map(text_of, tree)) + "]"
    return "true" if tree is True else "false" if tree is False else "null" if tree is None else str(tree)


def written(tree):
    return "".join(f"{key}: {text_of(value)}\n" for key, value in tree.items()) if isinstance(tree, dict) else text_of(tree)


def nodes(tree, path=()):
    yield path
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ():
        yield from nodes(value, (*path, key))


def spoil_number(value, r):
    """Mostly other sizes and signs, which a scene could mean."""
    words = str(value).split(" ")
    kind = r.randrange(8)
    if kind < 3:
        words[0] = repr(float(words[0]) * 10.0 ** r.uniform(-8, 8))
    elif kind == 3:
        words[0] = repr(float(words[0]) * r.choice([0.3, 0.5, 0.9, 1.1, 2, 3, 10]))
    elif kind == 4:
        words[0] = repr(-float(words[0]))
    elif kind == 5:
        words[0] = r.choice(EXTREMES)
    elif kind == 6:
        words = [words[0], r.choice(UNITS)]
    else:
        return r.choice(WORDS)
    return " ".join(words)


def is_number(value):
    try:
        float(str(value).split(" ")[0])
        return not isinstance(value, bool)
    except ValueError:
        return False


def spoil_map(value, r):
    key = r.choice(list(value))
    kind = r.randrange(4)
    inner = value.pop(key)
    if kind == 0:
        value[str(key)[:-1] + r.choice("aex")] = inner
    elif kind == 1:
        value[r.choice(["solver", "place", "fixed", "friction", "cell", "step"])] = inner
        value[key] = inner
    elif kind == 2:
        value[key] = [inner, copy.deepcopy(inner)]


def spoil_list(value, r):
    kind = r.randrange(4)
    if kind == 0 and value:
        value.pop(r.randrange(len(value)))
    elif kind == 1 and value:
        value.append(copy.deepcopy(r.choice(value)))
    elif kind == 2:
        value.append(r.choice(EXTREMES))
    else:
        r.shuffle(value)


def spoil(tree, r):
    """One thing in a tree."""
    path = r.choice([p for p in nodes(tree) if p])
    if r.random() < 0.6:  # most of what can be said is in numbers
        path = r.choice([p for p in nodes(tree) if p and is_number(at(tree, p))] or [path])
    value, parent = at(tree, path), at(tree, path[:-1])
    if is_number(value):
        parent[path[-1]] = spoil_number(value, r)
    elif isinstance(value, dict) and value and r.random() < 0.7:
        spoil_map(value, r)
    elif isinstance(value, list) and r.random() < 0.7:
        spoil_list(value, r)
    else:
        parent[path[-1]] = r.choice(WORDS)


def place_in(tree, r, beyond=0.0):
    """A place in the domain, or somewhat outside of it."""
    lower, upper = ([float(v) for v in tree["domain"][k]] for k in ("lower", "upper"))
    return [low + r.uniform(-beyond, 1 + beyond) * (high - low) for low, high in zip(lower, upper)]


def add_plane(tree, r):
    normal = [r.gauss(0, 1) if r.random() < 0.6 else 0 for _ in range(tree["dimension"])]
    tree.setdefault("bodies", []).append({"plane": {"point": place_in(tree, r, 0.3), "normal": normal}})


def add_box(tree, r):
    corners = place_in(tree, r, 0.2), place_in(tree, r, 0.2)
    box = {"lower": list(map(min, *corners)), "upper": list(map(max, *corners))}
    tree.setdefault("bodies", []).append({"box": box})


def add_grain(tree, r):
    speed = 10.0 ** r.uniform(-2, 3)
    one = {"position": place_in(tree, r), "velocity": [speed * r.uniform(-1, 1) for _ in range(tree["dimension"])]}
    if r.random() < 0.5:
        one["radius"] = 10.0 ** r.uniform(-5, -1)
    if r.random() < 0.3:
        one["fixed"] = True
    tree["grains"].setdefault("place", []).append(one)


def change_contact(tree, r):
    law = r.choice([
        {"linear": {"stiffness": 10.0 ** r.uniform(0, 8), "restitution": r.uniform(0.01, 1), "friction": r.choice([0, 0.5, 5])}},
        {"hertz": {"young": 10.0 ** r.uniform(2, 11), "poisson": r.uniform(0, 0.49), "restitution": r.uniform(0.01, 1),
                   "friction": 0.5}}])
    tree["grains"]["contact"] = law


def change_step(tree, r):
    tree["time"]["step"] = 10.0 ** r.uniform(-7, -2)
    tree["time"]["force"] = r.random() < 0.5


def change_periodic(tree, r):
    tree["domain"]["periodic"] = [r.random() < 0.5 for _ in range(tree["dimension"])]


def change_open(tree, r):
    faces = [f"{side}_{axis}" for axis in "xyz"[:tree["dimension"]] for side in ("lower", "upper")]
    tree["domain"]["open"] = r.sample(faces, r.randint(1, len(faces)))


def change_source(tree, r):
    corners = place_in(tree, r, 0), place_in(tree, r, 0)
    source = {"region": {"box": {"lower": list(map(min, *corners)), "upper": list(map(max, *corners))}},
              "velocity": [10.0 ** r.uniform(-2, 1) * r.uniform(-1, 1) for _ in range(tree["dimension"])]}
    source.update(r.choice([{"rate": 10.0 ** r.uniform(-3, 3)}, {"keep": "full"}, {"rate": 10.0 ** r.uniform(-3, 3), "every": 1}]))
    tree[r.choice([p for p in ("grains", "continuum") if p in tree])]["source"] = source


def change_gravity(tree, r):
    size = 10.0 ** r.uniform(-2, 3)
    tree["gravity"] = [size * r.gauss(0, 1) for _ in range(tree["dimension"])]


def change_material(tree, r):
    tree["continuum"]["material"] = r.choice([
        {"drucker_prager": {"bulk_modulus": 10.0 ** r.uniform(2, 7), "friction": 0.4, "density": 10.0 ** r.uniform(1, 5)}},
        {"elastic": {"bulk_modulus": 10.0 ** r.uniform(2, 7), "poisson": 0.3, "density": 10.0 ** r.uniform(1, 5)}}])


def change_fill(tree, r):
    corners = place_in(tree, r, 0.05), place_in(tree, r, 0.05)
    region = {"box": {"lower": list(map(min, *corners)), "upper": list(map(max, *corners))}}
    part = r.choice([p for p in ("grains", "continuum") if p in tree])
    fill = {"region": region, "velocity": [10.0 ** r.uniform(-2, 1) * r.uniform(-1, 1) for _ in range(tree["dimension"])]}
    tree[part]["fill"] = fill


def change_integrator(tree, r):
    tree["grains"]["integrator"] = "velocity_verlet"
    tree["grains"]["neighbours"] = r.choice(["cells", "all_pairs"])
    tree["grains"]["skin"] = r.choice([0.001, 0.01, 0.1, 1, 2])


CHANGES = {None: [add_plane, add_box, change_step, change_periodic, change_open, change_gravity],
           "grains": [add_grain, change_contact, change_contact, change_integrator, change_fill, change_source],
           "continuum": [change_material, change_fill, change_source]}


def mistake(tree, r):
    """A scene that is sound in form, and wrong or extreme in what it says."""
    r.choice([change for part, changes in CHANGES.items() if part is None or part in tree for change in changes])(tree, r)


def spoil_size(tree, r):
    """Another size or sign of one number."""
    path = r.choice([p for p in nodes(tree) if p and p != ("quern",) and p != ("dimension",) and is_number(at(tree, p))])
    words = str(at(tree, path)).split(" ")
    size = float(words[0]) * r.choice([10.0 ** r.uniform(-3, 3), r.uniform(0.3, 3), r.uniform(0.3, 3), -1])
    words[0] = repr(round(size) if isinstance(at(tree, path), int) else size)
    at(tree, path[:-1])[path[-1]] = " ".join(words)


def spoil_bytes(text, r):
    data = bytearray(text)
    for _ in range(r.randrange(1, 4)):
        place, kind = r.randrange(len(data) + 1), r.randrange(5)
        if kind == 0:
            data[place:place + r.randrange(1, 9)] = b""
        elif kind == 1:
            data[place:place] = r.choice([b"\t", b"\0", b"\xef\xbb\xbf", b"\xff", b"{", b"]", b": ", b"\n", b"- ", b"#", b"'"])
        elif kind == 2:
            data[place:place] = r.choice(EXTREMES + WORDS).encode()
        elif kind == 3 and data:
            data[place % len(data)] ^= 1 << r.randrange(8)
        else:
            del data[place:]
    return bytes(data)


def scenes(seed, count):
    """(number, text). Half of them say what could be meant, a quarter is spoilt as a tree, and a quarter by its bytes, some
    of these of scenes that are at fault already."""
    for k in range(count):
        r = random.Random(f"{seed} {k}")
        tree = base(r.choice(list(SMALL)))
        if k % 4 == 3:
            text = written(tree).encode() if k % 8 == 3 else r.choice(CORPUS).read_bytes()
            yield k, spoil_bytes(text, r)
            continue
        for _ in range(0 if k % 4 == 2 else r.choice([1, 1, 2, 3])):
            (mistake if r.random() < 0.7 else spoil_size)(tree, r)
        for _ in range(r.choice([1, 1, 2, 3]) if k % 4 == 2 else 0):
            if not isinstance(tree, dict) or len(list(nodes(tree))) < 2:
                break
            spoil(tree, r)
        yield k, written(tree).encode(errors="replace")


# ---- a trial ----

def attempt(k, text, folder):
    """The word for how it went."""
    path, out = folder / f"{k}.yaml", folder / f"{k}"
    path.write_bytes(text)
    words = ["plan", "--json", path]
    status, printed, said = call(*words, limit=20)
    check_end(words, status, said)
    if status:
        return f"refused by {status}"
    plan = json.loads(printed)
    cost = plan["estimated_core_seconds"] + plan["estimated_settling_core_seconds"]
    plain = k % 5 == 0
    words = ["run", path, "-o", out, "--quiet", "--force", "--threads", 1 + k % 2, *([] if plain else OBSERVED)]
    status, _, said = call(*words, limit=20, stop_after=None if cost < 2 and sum(plan["entries"].values()) < 1e5 else 2)
    check_end(words, status, said, allowed=(0, 2, 3, 4, 130))
    need(status != 2 or not out.exists() or not (out / "frames").exists(), f"exit status 2, and {out} holds frames")
    need(status != 130 or cost >= 2 or sum(plan["entries"].values()) >= 1e5, "interrupted before its time")
    if status == 0:
        look(out)
    return {0: "done", 130: "too long to wait for"}.get(status, f"run ends with {status}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=20261)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--only", type=int)
    parser.add_argument("--keep", type=pathlib.Path)
    o = parser.parse_args()
    with lab.workplace() as place:
        folder = o.keep or pathlib.Path(place)
        folder.mkdir(exist_ok=True)
        cases = {k: text for k, text in scenes(o.seed, o.count) if o.only in (None, k)}
        faults = nonsense.each(lambda k: attempt(k, cases[k], folder), cases, f"{len(cases)} scenes, seed {o.seed}")
    for fault in faults:
        print(f"scene {fault}\n  again: --seed {o.seed} --only {fault.split(':')[0]} --keep FOLDER")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
