# SPDX-License-Identifier: MIT
"""The numbers that a chart shows, from the table of a study and from runs; nothing here draws."""
import csv
import dataclasses
import io
import math
import pathlib
import re
from dataclasses import dataclass, field

import numpy as np
import yaml

from .chart_form import Chart
from .measure import Measure, taken
from .program import QuernError, sentence_of
from .runs import Frame, Run, Series, open as open_run
from .table import DAMAGE


@dataclass
class Curve:
    """One line of a chart, with standard errors of both coordinates; NaN where there is none."""
    label: str
    x: np.ndarray
    y: np.ndarray
    dx: np.ndarray | None = None
    dy: np.ndarray | None = None
    reference: bool = False
    straight: bool = False  # of distributions: a law, straight from place to place, where data rise in steps
    ended: np.ndarray | None = None  # where the program ended the run: a cross


@dataclass
class Front:
    """What a chart of cost and error knows of its points beside their places."""
    points: list[int]  # their numbers in the table, cheapest first
    labels: list[str]
    shares: np.ndarray  # of resamples in which the point is on the front; NaN for one seed
    marks: dict[int, str]  # point: what it is called
    scatter: float  # of single runs of the reference, in the unit of the error; NaN of a closed form
    reference: str
    relative: bool
    gone: list[str] = field(default_factory=list)  # points whose cost or error is not known


@dataclass
class Picture:
    """x and y: what stands at the axes, a word and a unit."""
    name: str
    kind: str
    title: str
    x: tuple[str, str]
    y: tuple[str, str]
    curves: list[Curve]
    words: list[str] = field(default_factory=list)  # at 0, 1, 2 of x, where it is no number
    front: Front | None = None
    notes: list[tuple[str, str]] = field(default_factory=list)  # who could not be shown, and why
    log: str = ""  # axes that are logarithmic: x, y, xy
    marks: list[tuple[float, str]] = field(default_factory=list)  # limits along x, and what they are
    reaches: tuple[float, float] | None = None  # the ends of y, where they are not those of the data


@dataclass
class Group:
    """Runs that differ by their seed alone: one line of a chart."""
    label: str
    folders: list[pathlib.Path]
    reference: bool = False


def over_seeds(rows: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and its standard error at each place, over those that have a number there."""
    data = np.array(rows)
    there = np.isfinite(data)
    n = there.sum(axis=0)
    clean = np.where(there, data, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = clean.sum(axis=0) / n
        deviation = np.sqrt(np.where(there, (data - mean) ** 2, 0).sum(axis=0) / (n - 1))
        return np.where(n > 0, mean, math.nan), np.where(n > 1, deviation / np.sqrt(n), math.nan)


def told(notes: list[tuple[str, str]]) -> list[str]:
    """Notes as sentences; what is said of many is said once."""
    by_why: dict[str, list[str]] = {}
    for who, why in dict.fromkeys(notes):
        by_why.setdefault(why, []).append(who)
    return [f"{who[0]}{f' and {len(who) - 1} more' if len(who) > 1 else ''}: {why}" for why, who in by_why.items()]


# ---- one run ----

def series_of(run: Run, chart: Chart) -> tuple[np.ndarray, np.ndarray, str, str]:
    """Times, values, units."""
    series = run.series
    return series["time"], series[chart.column], series.units["time"], series.units[chart.column]


def slabs(run: Run, pattern: str, n: int) -> tuple[np.ndarray, str, str]:
    """Middles of the slabs of an observer.profile, the axis and its unit; else numbers."""
    label, scene = pattern.split(".")[0], run.scene
    for item in scene.get("observe") or []:
        (name, keys), = item.items()
        if name == "profile" and keys.get("label") == label and keys["bins"] == n:
            axis = keys["axis"]
            box = (keys.get("region") or {}).get("box") or scene["domain"]
            low, high = box["lower"][axis], box["upper"][axis]
            return low + (np.arange(n) + 0.5) * (high - low) / n, "xyz"[axis], "m"
    return np.arange(n, dtype=float), "slab", "1"


def profile_of(run: Run, pattern: str, which: Measure | int) -> tuple[np.ndarray, np.ndarray, str, str, str]:
    """Places, values, word and unit of the places, unit of the values; of a measure of the study, or of a row of the series."""
    measure = Measure("profile", "series", pattern, "every") if isinstance(which, int) else which
    reading = taken(measure, run, run.summary)
    values = reading.values
    if isinstance(which, int):
        if not -len(values) <= which < len(values):
            raise KeyError(f"there is no frame {which}; the series have {len(values)} rows")
        values = values[which]
    places, word, unit = slabs(run, pattern, len(values))
    return places, values, word, unit, reading.unit


def frame_of(run: Run, number: int) -> Frame:
    try:
        return run.frames[number]
    except IndexError:
        raise KeyError(f"there is no frame {number}; the run has {len(run.frames)}") from None


def values_of(frame: Frame, name: str) -> tuple[np.ndarray, str]:
    """A field, or a component of one by `.x`, and its unit."""
    words = name.split(".")
    whole = ".".join(words[:2])
    data = frame[whole]
    if len(words) == 3:
        if data.ndim != 2 or data.shape[1] != 3:
            raise KeyError(f"{whole} has no component '{words[2]}'")
        data = data[:, "xyz".index(words[2])]
    if data.ndim != 1:
        raise KeyError(f"{whole} is a vector; name its component, {whole}.x")
    return data, frame.unit(whole)


def of_all(run: Run, chart: Chart) -> tuple[np.ndarray, str]:
    """The field of all grains or points that move and are there."""
    frame = frame_of(run, chart.frame)
    data, unit = values_of(frame, chart.field)
    entity = chart.field.split(".")[0]
    for name, gone in ((f"{entity}.fixed", lambda x: x != 0), (f"{entity}.weight", lambda x: x == 0)):
        if name in frame:
            data = data if not gone(frame[name]).any() else np.where(gone(frame[name]), math.nan, data)
    return data[np.isfinite(data)], unit


def shares_of_mass(frame: Frame, entity: str) -> np.ndarray:
    """By which each grain or point counts in a mean: its size, times its weight in a hybrid."""
    if entity == "cell":
        return np.ones(len(frame["cell.position"]))
    size = frame["grain.radius"] ** int(frame.attributes["dimension"]) if entity == "grain" else frame["point.volume"]
    return size * frame[f"{entity}.weight"] if f"{entity}.weight" in frame else size


def along(run: Run, chart: Chart) -> tuple[np.ndarray, np.ndarray, str]:
    """Middles of the bins along the line, the mean in each and its unit; NaN where nothing is."""
    frame = frame_of(run, chart.frame)
    data, unit = values_of(frame, chart.field)
    entity = chart.field.split(".")[0]
    begin, end = (np.array([*place, 0.0][:3]) for place in chart.ends)
    length = float(np.linalg.norm(end - begin))
    off = frame[f"{entity}.position"] - begin
    s = off @ (end - begin) / length
    beside = np.linalg.norm(off - np.outer(s, (end - begin) / length), axis=1)
    mass = shares_of_mass(frame, entity)
    counts = (beside <= chart.width / 2) & (s >= 0) & (s < length) & (mass > 0) & np.isfinite(data)
    if chart.zone:
        counts &= frame.mask(entity, chart.zone)
    bins = (s[counts] / length * chart.bins).astype(int)
    mass = mass[counts]
    sums, whole = (np.bincount(bins, weights, chart.bins)[:chart.bins] for weights in (mass * data[counts], mass))
    with np.errstate(invalid="ignore"):
        return (np.arange(chart.bins) + 0.5) * length / chart.bins, np.where(whole > 0, sums / whole, math.nan), unit


def asked_radii(run: Run) -> Curve | None:
    """The distribution that the scene asks for, where it is one: a normal one, cut at two deviations, or an even one."""
    grains = run.scene.get("grains") or {}
    radius = (grains.get("material") or {}).get("radius") or {}
    if grains.get("materials") or grains.get("file") or grains.get("from") or not radius.get("spread"):
        return None
    mean, spread = radius["mean"], radius["spread"]
    even = radius["law"] == "uniform"
    z = np.linspace(-1, 1, 101) if even else np.linspace(-2, 2, 101)
    below = (z + 1) / 2 if even else np.array([0.5 * (1 + math.erf(one / math.sqrt(2))) for one in z])
    return Curve("asked", mean * (1 + spread * z), (below - below[0]) / (below[-1] - below[0]), reference=True, straight=True)


# ---- lines of a chart: one for each group ----

def each_run(group: Group, take, notes: list[tuple[str, str]]) -> list:
    """What `take` takes from the runs of a group; those that do not have it are noted."""
    found = []
    for folder in group.folders:
        try:
            found.append(take(open_run(folder)))
        except (*DAMAGE, yaml.YAMLError) as why:
            notes.append((group.label if group.label == folder.name else f"{group.label}, {folder.name}", sentence_of(why)))
    return found


def curve(group: Group, x: np.ndarray, rows: list[np.ndarray]) -> Curve:
    mean, deviation = over_seeds(rows)
    return Curve(group.label, x, mean, dy=deviation, reference=group.reference)


def draw_series(chart: Chart, groups: list[Group], _which=-1) -> Picture:
    picture = Picture(chart.name, chart.kind, chart.title, ("time", "s"), (chart.column, "1"), [])
    for group in groups:
        found = each_run(group, lambda run: series_of(run, chart), picture.notes)
        found = [one for one in found if len(one[0])]
        if not found:
            continue
        times = found[0][0][found[0][0] <= min(one[0][-1] for one in found)]
        picture.curves.append(curve(group, times, [np.interp(times, one[0], one[1]) for one in found]))
        picture.x, picture.y = ("time", found[0][2]), (chart.column, found[0][3])
    return picture


def draw_profile(chart: Chart, groups: list[Group], which: Measure | int = -1) -> Picture:
    picture = Picture(chart.name, chart.kind, chart.title, ("slab", "1"), (chart.column, "1"), [])
    word = re.sub(r"[._]?\*", "", chart.column)
    for group in groups:
        found = each_run(group, lambda run: profile_of(run, chart.column, which), picture.notes)
        found = [one for one in found if len(one[0]) == len(found[0][0])]
        if found:
            picture.curves.append(curve(group, found[0][0], [one[1] for one in found]))
            picture.x, picture.y = (found[0][2], found[0][3]), (word, found[0][4])
    return picture


def draw_line(chart: Chart, groups: list[Group], _which=-1) -> Picture:
    picture = Picture(chart.name, chart.kind, chart.title, ("distance along the line", "m"), (chart.field, "1"), [])
    for group in groups:
        found = each_run(group, lambda run: along(run, chart), picture.notes)
        if found and np.isfinite([one[1] for one in found]).any():
            picture.curves.append(curve(group, found[0][0], [one[1] for one in found]))
            picture.y = chart.field, found[0][2]
        elif found:
            picture.notes.append((group.label, f"nothing with {chart.field} lies within {chart.width / 2:g} m of the line"))
    return picture


def draw_distribution(chart: Chart, groups: list[Group], _which=-1) -> Picture:
    """All seeds together; at most a thousand and one steps are drawn."""
    picture = Picture(chart.name, chart.kind, chart.title, (chart.field, "1"), ("share at or below", "1"), [])
    asked = {}
    for group in groups:
        found = each_run(group, lambda run: (of_all(run, chart), asked_radii(run) if chart.field == "grain.radius" else None), picture.notes)
        data = np.sort(np.concatenate([one[0][0] for one in found])) if found else np.array([])
        if not len(data):
            continue
        x, counts = np.unique(data, return_counts=True)
        share = np.cumsum(counts) / len(data)
        if len(x) > 1001:
            keep = np.unique(np.linspace(0, len(x) - 1, 1001).round().astype(int))
            x, share = x[keep], share[keep]
        picture.curves.append(Curve(group.label, np.concatenate([x[:1], x]), np.concatenate([[0.0], share]), reference=group.reference))
        picture.x = chart.field, found[0][0][1]
        for _, one in found:
            if one:
                asked.setdefault(one.x.tobytes(), (one, group.label))
    for one, label in asked.values():
        picture.curves.append(dataclasses.replace(one, label=f"{one.label}, {label}") if len(asked) > 1 else one)
    return picture


FROM_RUNS = {"series": draw_series, "profile": draw_profile, "line": draw_line, "distribution": draw_distribution}


# ---- tables that belong to no run ----

def of_tables(tables: dict[str, pathlib.Path], columns: list[str], title: str) -> Picture:
    """The first column across, the others up; they share one unit. A line for each column of each table."""
    across, *up = columns
    picture = Picture("table", "table", title, (across, "1"), (", ".join(up), "1"), [])
    units = set()
    for label, path in tables.items():
        table = Series(path)
        for name in columns:
            if name not in table:
                raise QuernError(f"{path} has no column '{name}'; it has {', '.join(table)}", 2)
        units |= {(table.units[across], table.units[name]) for name in up}
        for name in up:
            words = [label] * (len(tables) > 1) + [name.replace("_", " ")] * (len(up) > 1)
            picture.curves.append(Curve(", ".join(words) or label, table[across], table[name]))
    if len(units) > 1:
        raise QuernError("columns of one chart share one unit: " + ", ".join(sorted(f"'{y}' over '{x}'" for x, y in units)), 2)
    if not any(len(one.x) for one in picture.curves):
        raise QuernError("there is nothing to draw: no row", 2)
    (unit_x, unit_y), = units
    picture.x = across.replace("_", " "), unit_x
    picture.y = ", ".join(up).replace("_", " "), unit_y
    return picture


# ---- the numbers as a file ----

def as_csv(picture: Picture) -> str:
    """What is drawn, a row for each point of each line, in the units of the table."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    (x, x_unit), (y, y_unit) = picture.x, picture.y
    head = ["line", f"{x} [{x_unit}]" if not picture.words else x, f"{y} [{y_unit}]", f"standard_error_x [{x_unit}]", f"standard_error_y [{y_unit}]"]
    writer.writerow(head + ["front_share [1]"] * bool(picture.front))
    for one in picture.curves:
        for k in range(len(one.x)):
            errors = [data[k] if data is not None else math.nan for data in (one.dx, one.dy)]
            numbers = ["" if math.isnan(value) else repr(float(value)) for value in (one.x[k], one.y[k], *errors)]
            label = one.label
            if picture.words:
                numbers[0] = picture.words[round(one.x[k])]
            if picture.front:
                label = picture.front.labels[k]
                share = picture.front.shares[k]
                numbers.append("" if math.isnan(share) else repr(float(share)))
            writer.writerow([label, *numbers])
    return out.getvalue()
