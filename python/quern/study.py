# SPDX-License-Identifier: MIT
"""A study file: read with the place of everything, and all of its faults at once. docs/studies.md says what may stand in it."""
import math
import pathlib
import random
import re
from dataclasses import dataclass, field

import yaml

from .chart_form import Chart, read_charts, read_page
from .closed import Closed, read_closed
from .measure import RESERVED, Measure, read_measures
from .reader import Reader, Sets, StudyError, compose, flow, is_path, kind, nearest, number_label, read_sets

KEYS = ("study", "name", "base", "set", "axes", "repeats", "reference", "measure", "front", "jobs", "threads", "limit", "charts", "page")
FRONTS = ("processor", "running", "wall")
SECONDS = {"": 1, "s": 1, "min": 60, "h": 3600, "d": 86400}
MOST_RUNS = 100_000


@dataclass(frozen=True)
class Value:
    """One place on an axis: what to call it, what to set."""
    label: str
    sets: Sets


@dataclass(frozen=True)
class Axis:
    name: str
    values: tuple[Value, ...]
    drawn: bool = False  # at random: together with the other axes that are

    @property
    def unit(self) -> str | None:
        """Of the values, if all are numbers in one unit; None of words."""
        found = [number_label(value.label) for value in self.values]
        return found[0][1] if found and all(found) and len({one[1] for one in found}) == 1 else None


@dataclass
class Study:
    path: pathlib.Path
    name: str = ""
    base: pathlib.Path = pathlib.Path()
    sets: Sets = ()
    axes: list[Axis] = field(default_factory=list)
    seeds: list[int] = field(default_factory=list)
    timings: int = 1  # how often each run is made, for what it costs
    reference: str = ""
    reference_sets: Sets = ()
    follows: tuple[str, ...] = ()
    closed: Closed | None = None  # the reference, if it is a closed form
    measures: list[Measure] = field(default_factory=list)
    front: str = "running"
    jobs: int = 0
    threads: int = 1
    limit: float = math.inf
    charts: list[Chart] = field(default_factory=list)
    page: pathlib.Path | None = None


def spread(first: float, last: float, law: str, share: float) -> float:
    return first * (last / first) ** share if law == "log" else first + (last - first) * share


def read_range(reader: Reader, node: yaml.Node, where: str, count: str, optional: tuple[str, ...]):
    """from, to, law and the count of a grid or a sample: (first, last, unit, law, n, others); None if something is wrong."""
    before = len(reader.faults)
    found = reader.mapping(node, where, ("from", "to", "law", count, *optional))
    reader.require(node, found, f"{where}: ", {"from": "", "to": "", count: ""})
    ends = [reader.quantity(found[key][1], f"{where}.{key}") for key in ("from", "to") if key in found]
    law = reader.choice(found["law"][1], f"{where}.law", ("even", "log")) if "law" in found else "even"
    n = reader.whole(found[count][1], f"{where}.{count}", 2 if count == "steps" else 1, MOST_RUNS) if count in found else 0
    if len(reader.faults) > before:
        return None
    (first, unit), (last, other) = ends
    if unit != other:
        reader.fault(found["to"][1], f"{where}: 'from' is in '{unit or 'no unit'}' and 'to' in '{other or 'no unit'}'; write both in one unit")
    elif not first < last:
        reader.fault(found["to"][1], f"{where}: 'to' must be above 'from'")
    if law == "log" and first <= 0:
        reader.fault(found["from"][1], f"{where}: 'from' must be above 0 where the law is log")
    return (first, last, unit, law, n, found) if len(reader.faults) == before else None


def quantity_value(key: str, x: float, unit: str) -> Value:
    label = f"{x:.12g} {unit}".strip()
    return Value(label, (f"{key}={label}",))


def read_grid(reader: Reader, node: yaml.Node, where: str, key: str) -> list[Value]:
    got = read_range(reader, node, where, "steps", ())
    if not got:
        return []
    first, last, unit, law, n, _ = got
    return [quantity_value(key, spread(first, last, law, i / (n - 1)), unit) for i in range(n)]


def read_sample(reader: Reader, node: yaml.Node, where: str, key: str) -> list[Value]:
    got = read_range(reader, node, where, "n", ("seed",))
    if not got:
        return []
    first, last, unit, law, n, found = got
    seed = reader.whole(found["seed"][1], f"{where}.seed", 0, 2**53) if "seed" in found else 1
    draw = random.Random(f"{seed} {where}")  # by name, so that a further axis changes none of the others
    return [quantity_value(key, spread(first, last, law, draw.random()), unit) for _ in range(n)]


def read_list(reader: Reader, node: yaml.Node, where: str, key: str) -> list[Value]:
    values = [Value(flow(item), (f"{key}={flow(item)}",)) for item in reader.items(node, where, "values")]
    return distinct(reader, node, where, values)


def read_cases(reader: Reader, node: yaml.Node, where: str) -> list[Value]:
    found = reader.mapping(node, where)
    if isinstance(node, yaml.MappingNode) and not node.value:
        reader.fault(node, f"{where} must have a case at least, NAME: {{KEY: VALUE}}")
    return [Value(name, read_sets(reader, value, f"{where}.{name}")) for name, (_, value) in found.items()]


def distinct(reader: Reader, node: yaml.Node, where: str, values: list[Value]) -> list[Value]:
    seen = set()
    for item, value in zip(node.value, values):
        if value.label in seen:
            reader.fault(item, f"{where}: '{value.label}' stands here twice")
        seen.add(value.label)
    return values


WAYS = {"list": read_list, "grid": read_grid, "random": read_sample}


def read_axis(reader: Reader, at: yaml.Node, node: yaml.Node, name: str) -> Axis:
    where = f"axes.{name}"
    if not re.fullmatch(r"[A-Za-z_]\w*", name) or name in RESERVED:
        reader.fault(at, f"{where}: the name of an axis must be a word that no column has already")
    found = reader.mapping(node, where, ("key", *WAYS, "cases"))
    ways = [word for word in found if word != "key"]
    if not ways and not reader.clean:
        return Axis(name, ())
    if len(ways) != 1:
        reader.fault(node, f"{where}: give one of list, grid, random or cases" + (f", not {' and '.join(ways)}" if ways else ""))
        return Axis(name, ())
    way, value = ways[0], found[ways[0]][1]
    if way == "cases":
        if "key" in found:
            reader.fault(found["key"][0], f"{where}: cases have keys of their own; leave 'key' out")
        return Axis(name, tuple(read_cases(reader, value, f"{where}.cases")))
    reader.require(node, found, f"{where}: ", {"key": "the key of the scene that the axis sets"})
    key = reader.text(found["key"][1], f"{where}.key", "the path of a key such as continuum.cell") if "key" in found else ""
    if key == "seed":
        reader.fault(found["key"][1], f"{where}.key: seeds are set by 'repeats: {{seeds: ...}}'")
    elif not is_path(key):
        reader.fault(found["key"][1], f"{where}.key: '{key}' is no path of a key such as continuum.cell")
    return Axis(name, tuple(WAYS[way](reader, value, f"{where}.{way}", key)), way == "random")


def read_axes(reader: Reader, node: yaml.Node) -> list[Axis]:
    found = reader.mapping(node, "axes")
    axes = [read_axis(reader, at, value, name) for name, (at, value) in found.items()]
    drawn = [axis for axis in axes if axis.drawn and axis.values]
    for axis in drawn[1:]:
        if len(axis.values) != len(drawn[0].values):
            reader.fault(found[axis.name][1], f"axes.{axis.name}: random axes are drawn together: n must be {len(drawn[0].values)}, as of {drawn[0].name}")
    return axes


def read_repeats(reader: Reader, node: yaml.Node, study: Study) -> None:
    found = reader.mapping(node, "repeats", ("seeds", "timings"))
    if "timings" in found:
        study.timings = reader.whole(found["timings"][1], "repeats.timings", 1, 100)
    else:
        reader.require(node, found, "repeats: ", {"seeds": "how many or which: 3 or [1, 2, 3]"})
    study.seeds = read_seeds(reader, found["seeds"][1]) if "seeds" in found else []


def read_seeds(reader: Reader, value: yaml.Node) -> list[int]:
    if not isinstance(value, yaml.SequenceNode):
        return list(range(1, reader.whole(value, "repeats.seeds", 1, 10_000) + 1))
    seeds = [reader.whole(item, "repeats.seeds", 0, 2**53) for item in reader.items(value, "repeats.seeds", "whole numbers")]
    if len(set(seeds)) < len(seeds):
        reader.fault(value, "repeats.seeds: a seed stands here twice")
    return seeds


def read_reference(reader: Reader, node: yaml.Node, study: Study, sound: bool) -> None:
    """`sound`: axes and measures have no fault, so that a closed form can be held against them."""
    before = len(reader.faults)
    found = reader.mapping(node, "reference", ("name", "set", "csv", "follows"))
    way = {"set": "what it sets beside the study's own, or csv, the file of a closed form"} if "csv" not in found else {}
    reader.require(node, found, "reference: ", {"name": "", **way})
    if "set" in found and "csv" in found:
        reader.fault(found["csv"][0], "reference: a closed form makes no runs; leave out 'set' or 'csv'")
        return
    if "name" in found:
        study.reference = reader.text(found["name"][1], "reference.name", "a word")
    if "set" in found:
        study.reference_sets = read_sets(reader, found["set"][1], "reference.set")
    if "follows" in found:
        nodes = reader.items(found["follows"][1], "reference.follows", "axes")
        names = [axis.name for axis in study.axes]
        for item in nodes:
            word = reader.text(item, "reference.follows", "the name of an axis")
            if word and word not in names:
                reader.fault(item, f"reference.follows: no axis is called '{word}'{nearest(word, names, 'axes: ')}")
        study.follows = tuple(item.value for item in nodes)
    if "csv" in found and sound and len(reader.faults) == before:
        units = {axis.name: axis.unit for axis in study.axes}
        study.closed = read_closed(reader, found["csv"][1], study.path.parent, study.measures, units, study.follows)


def read_limit(reader: Reader, node: yaml.Node) -> float:
    got = reader.quantity(node, "limit")
    if got and (got[1] not in SECONDS or got[0] <= 0):
        reader.fault(node, f"limit must be a time above 0 in s, min, h or d, not '{node.value}'")
        return math.inf
    return got[0] * SECONDS[got[1]] if got else math.inf


def read_base(reader: Reader, node: yaml.Node, folder: pathlib.Path) -> pathlib.Path:
    text = reader.text(node, "base", "the path of a scene")
    if text and not (folder / text).is_file():
        reader.fault(node, f"base: there is no scene {text}; paths begin at the folder of the study")
    return folder / text


def read_tree(reader: Reader, root: yaml.Node, path: pathlib.Path) -> Study:
    study = Study(path)
    found = reader.mapping(root, "the study", KEYS)
    parts = {key: value for key, (_, value) in found.items()}
    reader.require(root, found, "", {"study": "write 'study: 1'", "base": "the scene that all runs begin with"})
    if "study" in parts and flow(parts["study"]) != "1":
        reader.fault(parts["study"], f"study must be 1, the only form there is, not {kind(parts['study'])}")
    study.base = read_base(reader, parts["base"], path.parent) if "base" in parts else path
    study.name = reader.text(parts["name"], "name") if "name" in parts else re.sub(r"[^\w.-]+", "_", path.stem).strip(".-") or "study"
    if "name" in parts and study.name and not re.fullmatch(r"\w[\w.-]*", study.name):
        reader.fault(parts["name"], f"name: '{study.name}' must be a word of letters, digits, '.', '-' and '_': a folder is called so")
    study.sets = read_sets(reader, parts["set"], "set") if "set" in parts else ()
    before = len(reader.faults)
    study.axes = read_axes(reader, parts["axes"]) if "axes" in parts else []
    study.measures = read_measures(reader, parts["measure"], [axis.name for axis in study.axes]) if "measure" in parts else []
    if "reference" in parts:
        read_reference(reader, parts["reference"], study, len(reader.faults) == before)
    if "repeats" in parts:
        read_repeats(reader, parts["repeats"], study)
    if "front" in parts:
        study.front = reader.choice(parts["front"], "front", FRONTS)
    study.jobs = reader.whole(parts["jobs"], "jobs", 1, 10_000) if "jobs" in parts else 0
    study.threads = reader.whole(parts["threads"], "threads", 1, 1024) if "threads" in parts else 1
    study.limit = read_limit(reader, parts["limit"]) if "limit" in parts else math.inf
    study.charts = read_charts(reader, parts["charts"], study) if "charts" in parts else []
    study.page = read_page(reader, parts["page"], path.parent) if "page" in parts else None
    count = math.prod(len(axis.values) for axis in study.axes if not axis.drawn) * max(1, len(study.seeds))
    count *= max((len(axis.values) for axis in study.axes if axis.drawn), default=1)
    if count > MOST_RUNS:
        reader.fault(parts["axes"], f"axes: these are {count} runs; at most {MOST_RUNS} are a study")
    return study


def read(path: pathlib.Path, name: str | None = None) -> Study:
    """The study in a file; StudyError with all faults, each with its place. `name`: what messages call the file."""
    reader = Reader(name or str(path))
    root = compose(path, reader.name)
    study = read_tree(reader, root, path)
    if reader.faults:
        raise StudyError("\n".join(text for _, _, text in sorted(reader.faults, key=lambda fault: fault[:2])))
    return study
