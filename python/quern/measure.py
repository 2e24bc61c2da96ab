# SPDX-License-Identifier: MIT
"""Measures of a study: what its file says of each, and how it is taken from a run."""
import math
import re
from dataclasses import dataclass

import numpy as np
import yaml

from .reader import Reader
from .runs import Run

AT = ("last", "first", "mean", "min", "max", "every")
OF = ("mean", "deviation", "min", "max", "sum", "count", "all")
NORMS = ("rms", "share", "worst")
SOURCES = {"series": "a column of series.csv", "summary": "a path in summary.json", "frame": "a field of a frame",
           "cost": "a path in summary.json that a clock gave"}
# Columns that every table has.
RESULTS = ("steps", "substeps", "settle_steps", "time_end", "grains", "points", "mass_defect", "discrete_share", "energy")
RESERVED = ("run", "point", "model", "seed", "status", "exit", "message", "scene_hash", "runs", "done", *RESULTS)
COSTS = {"wall": "s", "processor": "s", "running": "s", "memory": "B"}  # columns cost.NAME of every table
TIMES = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}
UNITS = {"time_end": "s", "time_step": "s", "energy": "J", "mass_initial": "kg", "mass_final": "kg", "mass_ledger": "kg",
         "momentum": "kg m/s", "peak_rss_bytes": "B", "state_rss_bytes": "B"}


@dataclass(frozen=True)
class Measure:
    name: str
    source: str  # one of SOURCES
    path: str
    at: str = "last"
    of: str = ""  # of a frame: what is made of all that it holds
    norm: str = "rms"
    relative: bool = False
    per: str = ""  # the path in summary.json of the number that it is divided by
    begin: float = -math.inf  # s, of a series: rows from this time on
    end: float = math.inf  # s, up to this one

    @property
    def vector(self) -> bool:
        """Several columns at a time."""
        return self.source == "series" and "*" in self.path

    @property
    def distribution(self) -> bool:
        return self.of == "all"

    @property
    def single(self) -> bool:
        """One number a run, which has a column of its own."""
        return not (self.vector or self.distribution or self.at == "every")

    @property
    def kind(self) -> str:
        """What its errors are measured by, in the words of errors.KINDS."""
        return "distance" if self.distribution else "relative" if self.relative else self.norm


@dataclass(frozen=True)
class Reading:
    """What a measure is in one run: numbers; over time a row for each time, of a vector a column for each of `columns`."""
    values: np.ndarray
    unit: str
    times: np.ndarray | None = None
    columns: tuple[str, ...] = ()
    shares: np.ndarray | None = None  # of a distribution that a closed form gives: which share is at most as large


def is_clocked(path: str) -> bool:
    """True for numbers of a summary that differ from one run of a scene to the next."""
    word = path.split(".")[0]
    return word in ("wall_seconds", "settle_seconds", "seconds_by_stage", "peak_rss_bytes", "state_rss_bytes") or word.startswith(("processor", "settle_processor"))


# ---- from the study's file ----

def read_source(reader: Reader, node: yaml.Node, found: dict) -> str:
    """Which source a measure names; empty with a fault if there is not one."""
    sources = [word for word in SOURCES if word in found]
    if len(sources) == 1:
        return sources[0]
    if reader.clean:
        *others, last = (f"{word} ({what})" for word, what in SOURCES.items())
        reader.fault(node, f"measure: give one of {', '.join(others)} and {last}")
    return ""


def check_path(reader: Reader, node: yaml.Node, source: str, path: str) -> None:
    where = f"measure.{source}"
    if source == "series" and path.count("*") > 1:
        reader.fault(node, f"{where}: '{path}' has more than one '*'; it stands for one number, as in profile.density_*")
    if source == "summary" and is_clocked(path):
        reader.fault(node, f"{where}: '{path}' was measured with a clock, so that it is no result; write 'cost: {path}'")
    if source == "cost" and path and not is_clocked(path):
        reader.fault(node, f"{where}: '{path}' is a result, which no clock has given; write 'summary: {path}'")
    if source == "frame" and path and not re.fullmatch(r"[a-z_]+\.\w+(\.(x|y|z|\d))?", path):
        reader.fault(node, f"{where}: '{path}' is no field such as grain.radius, or grain.velocity.x for one component")


def check_words(reader: Reader, found: dict, measure: Measure) -> None:
    """What does not go together."""
    def refuse(key: str, text: str) -> None:
        reader.fault(found[key][0], f"measure.{key}: {text}")
    if "at" in found and measure.source in ("summary", "cost"):
        refuse("at", "a summary has one value; leave 'at' out")
    for key in ("from", "until"):
        if key in found and measure.source != "series":
            refuse(key, f"only a series has rows over time; leave '{key}' out")
    if measure.begin > measure.end:
        refuse("until", "is before 'from'")
    if "of" in found and measure.source != "frame":
        refuse("of", "only what is taken from a frame is made of many; leave 'of' out")
    if "norm" in found and (measure.single or measure.distribution):
        refuse("norm", "of a distribution it is Kolmogorov and Smirnov's distance; leave 'norm' out" if measure.distribution else
               "one number has no norm; write 'relative: yes' for a share of the reference")
    if "relative" in found and (measure.distribution or measure.norm != "rms"):
        refuse("relative", "this error is a share already; leave 'relative' out")
    if measure.source == "cost":
        for key in ("norm", "relative"):
            if key in found:
                refuse(key, f"a cost is not compared with a reference; leave '{key}' out")
    if "per" in found and measure.distribution:
        refuse("per", "all values of a frame are no number to divide; leave 'per' out")
    elif is_clocked(measure.per) and measure.source != "cost":
        refuse("per", f"'{measure.per}' was measured with a clock, and this measure is a result; leave it out")


def read_time(reader: Reader, node: yaml.Node, where: str) -> float:
    got = reader.quantity(node, where)
    if got and got[1] not in TIMES:
        reader.fault(node, f"{where} must be a time in s, ms or us, not '{node.value}'")
        return math.nan
    return got[0] * TIMES[got[1]] if got else math.nan


def read_name(reader: Reader, node: yaml.Node, source: str) -> str:
    name = reader.text(node, "measure.name", "a word")
    if name and (not re.fullmatch(r"[A-Za-z_]\w*", name) or name in RESERVED):
        reader.fault(node, f"measure.name: '{name}' must be a word that no column has already")
    elif source == "cost" and name in (*COSTS, "mean"):
        reader.fault(node, f"measure.name: a column cost.{name} is in every table already; take another name")
    return name


def read_measure(reader: Reader, node: yaml.Node) -> Measure | None:
    found = reader.mapping(node, "measure", ("name", *SOURCES, "at", "from", "until", "of", "norm", "relative", "per"))
    reader.require(node, found, "measure: ", {"name": ""})
    source = read_source(reader, node, found)
    if not source:
        return None
    if source == "frame":
        reader.require(node, found, "measure: ", {"of": f"one of {', '.join(OF)}"})

    def choice(key: str, words: tuple[str, ...], default: str) -> str:
        return reader.choice(found[key][1], f"measure.{key}", words) if key in found else default
    before = len(reader.faults)
    path = reader.text(found[source][1], f"measure.{source}", "a name such as runout.front")
    check_path(reader, found[source][1], source, path)
    name = read_name(reader, found["name"][1], source) if "name" in found else ""
    per = reader.text(found["per"][1], "measure.per", "a path in summary.json such as grains") if "per" in found else ""
    times = {key: read_time(reader, found[key][1], f"measure.{key}") for key in ("from", "until") if key in found}
    measure = Measure(name, source, path, choice("at", ("last", "first") if source == "frame" else AT, "last"), choice("of", OF, ""),
                      choice("norm", NORMS, "rms"), choice("relative", ("yes", "no", "true", "false"), "no") in ("yes", "true"), per,
                      times.get("from", -math.inf), times.get("until", math.inf))
    if len(reader.faults) == before:
        check_words(reader, found, measure)
    return measure


def read_measures(reader: Reader, node: yaml.Node, taken: list[str]) -> list[Measure]:
    measures, names = [], list(taken)
    for item in reader.items(node, "measure", "measures, {name: ..., series: ..., at: last}"):
        measure = read_measure(reader, item)
        if measure and measure.name in names:
            reader.fault(item, f"measure: the name '{measure.name}' is taken already")
        if measure:
            names.append(measure.name)
            measures.append(measure)
    return measures


# ---- from a run ----

def reach(tree, path: str, unit: str | None = None) -> tuple:
    """What stands at a dotted path of a summary, and the unit that is said beside it. Keys may hold dots: the longest that fits is tried
    first. KeyError if there is none."""
    if not path:
        return tree, unit
    words = path.split(".")
    if isinstance(tree, list) and words[0].isdecimal() and int(words[0]) < len(tree):
        return reach(tree[int(words[0])], ".".join(words[1:]), unit)
    for n in range(len(words), 0, -1) if isinstance(tree, dict) else ():
        key = ".".join(words[:n])
        if key in tree:
            try:
                return reach(tree[key], ".".join(words[n:]), tree.get("unit", unit))
            except KeyError:
                continue
    raise KeyError(f"summary.json has no '{path}'")


def number_of(summary: dict, path: str) -> tuple[float, str]:
    try:
        value, unit = reach(summary, path)
    except KeyError:
        raise KeyError(f"summary.json has no '{path}'") from None
    if isinstance(value, dict) and "value" in value:
        value, unit = value["value"], value.get("unit", "1")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{path} of summary.json is no number")
    word = path.split(".")[0]
    return float(value), str(unit or UNITS.get(word) or ("s" if is_clocked(path) else "1"))


PICKS = {"last": lambda x: x[-1], "first": lambda x: x[0], "mean": np.mean, "min": np.min, "max": np.max}


def of_series(measure: Measure, run: Run) -> Reading:
    series = run.series
    names = [measure.path]
    if measure.vector:
        form = re.compile(re.escape(measure.path).replace(r"\*", r"(\d+)"))
        found = sorted((int(match[1]), match[0]) for match in map(form.fullmatch, series) if match)
        names = [name for _, name in found] or names
    columns, unit = [series[name] for name in names], series.units[names[0]]
    within = (series["time"] >= measure.begin) & (series["time"] <= measure.end)
    columns = [column[within] for column in columns]
    if not within.any():
        raise ValueError("series.csv has no row" + (" between 'from' and 'until'" if len(series) else ""))
    if measure.at != "every":
        return Reading(np.array([float(PICKS[measure.at](column)) for column in columns]), unit, None, tuple(names))
    return Reading(np.column_stack(columns) if measure.vector else columns[0], unit, series["time"][within], tuple(names))


def made_of(x: np.ndarray, of: str) -> float:
    """Sums are rounded once, so that neither the order of grains nor the processor matters."""
    if of == "count":
        return float(len(x))
    if of == "sum":
        return math.fsum(x)
    if not len(x):
        raise ValueError("the frame has none")
    if of in ("min", "max"):
        return float(PICKS[of](x))
    mean = math.fsum(x) / len(x)
    return mean if of == "mean" else math.sqrt(math.fsum((x - mean) ** 2) / len(x))


def of_frame(measure: Measure, run: Run) -> Reading:
    kind, field, *component = measure.path.split(".")
    if not len(run.frames):
        raise ValueError("the run has no frame")
    frame = run.frames[PICKS[measure.at](range(len(run.frames)))]
    name = f"{kind}.{field}"
    values = np.asarray(frame[name], dtype=float)
    if values.ndim > 1 and not component:
        raise ValueError(f"{name} is a vector; name a component, such as {name}.x")
    if component:
        column = "xyz".find(component[0]) if component[0] in "xyz" else int(component[0])
        if values.ndim < 2 or column >= values.shape[1]:
            raise ValueError(f"{name} has no component '{component[0]}'")
        values = values[:, column]
    if f"{kind}.fixed" in frame:
        values = values[np.asarray(frame[f"{kind}.fixed"]) == 0]
    unit = "1" if measure.of == "count" else frame.unit(name)
    if measure.distribution:
        if not len(values):
            raise ValueError("the frame has none")
        return Reading(np.sort(values), unit)
    return Reading(np.array([made_of(values, measure.of)]), unit)


def unit_over(unit: str, other: str) -> str:
    if other == "1":
        return unit
    return f"{unit}/({other})" if re.search(r"[ /]", other) else f"{unit}/{other}"


def taken(measure: Measure, run: Run, summary: dict) -> Reading:
    """A measure of a run; KeyError, ValueError, OSError or QuernError with a sentence if it cannot be taken."""
    if measure.source in ("summary", "cost"):
        value, unit = number_of(summary, measure.path)
        reading = Reading(np.array([value]), unit)
    else:
        reading = of_series(measure, run) if measure.source == "series" else of_frame(measure, run)
    if measure.per:
        share, unit = number_of(summary, measure.per)
        if share == 0:
            raise ValueError(f"'{measure.per}' is 0: nothing can be divided by it")
        reading = Reading(reading.values / share, unit_over(reading.unit, unit), reading.times, reading.columns)
    if not np.isfinite(reading.values).all():
        raise ValueError(f"{measure.path} is not finite")
    return reading
