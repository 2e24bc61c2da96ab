# SPDX-License-Identifier: MIT
"""From the table of a study to the lines of its charts: which runs belong together, what the reference is, where points lie."""
import dataclasses
import math
import pathlib
from dataclasses import dataclass

import h5py
import numpy as np

from .chart_data import FROM_RUNS, Curve, Front, Group, Picture, over_seeds, slabs
from .chart_form import Chart
from .errors import SHARES
from .measure import Measure, Reading, taken
from .points import combinations, jobs_of
from .program import QuernError, sentence_of
from .reader import number_label
from .runs import open as open_run
from .study import Study
from .table import DAMAGE, pairs_and_costs, read_run, shares_of


@dataclass
class Table:
    """One of the tables in table.h5: columns, numbers or text, and units of those that are numbers."""
    columns: dict[str, np.ndarray]
    units: dict[str, str]

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise QuernError(f"the table has no column '{name}'; it was written for another form of the study; quern sweep writes it anew", 2)
        return self.columns[name]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))


@dataclass
class Made:
    """A study that was made: its runs, its points, and where they lie."""
    study: Study
    folder: pathlib.Path
    runs: Table
    points: Table
    labels: list[dict[str, str]]  # of each point, by axis
    numbers: dict[str, str]  # units of axes that are numbers


def read_table(group: h5py.Group) -> Table:
    columns, units = {}, {}
    for name, data in group.items():
        if "unit" in data.attrs:
            unit = data.attrs["unit"]
            columns[name], units[name] = data[()], unit.decode() if isinstance(unit, bytes) else unit
        else:
            columns[name] = data.asstr()[()]
    return Table(columns, units)


def read_made(study: Study, folder: pathlib.Path) -> Made:
    """The tables of a study; QuernError where there are none or they are of another study."""
    path = folder / "table.h5"
    if not path.exists():
        raise QuernError(f"{folder}: no table lies there; quern sweep {study.path} makes it, -o names another folder", 2)
    try:
        with h5py.File(path, "r") as file:
            runs, points = read_table(file["runs"]), read_table(file["points"])
    except (*DAMAGE, RuntimeError) as why:
        raise QuernError(f"{path} cannot be read: {why}; quern sweep {study.path} writes it anew", 2) from None
    labels = [{name: value.label for name, value in point.items()} for point in combinations(study)]
    made = Made(study, folder, runs, points, labels, {axis.name: axis.unit for axis in study.axes if axis.unit})
    if not is_of(made):
        raise QuernError(f"{path} is of another form of the study, with other points; quern sweep {study.path} writes it anew", 2)
    return made


def is_of(made: Made) -> bool:
    """True if the table has the points that the study asks for, in their order."""
    if len(made.points) != len(made.labels):
        return False
    for axis in made.study.axes:
        labels = [values[axis.name] for values in made.labels]
        wanted = [number_label(label)[0] for label in labels] if axis.unit else labels
        if axis.name not in made.points.columns or list(made.points[axis.name]) != wanted:
            return False
    return True


def label_of(made: Made, values: dict[str, str], names) -> str:
    """What a line is called: words as they are, numbers with their axis."""
    return ", ".join(f"{name} {values[name]}" if name in made.numbers else values[name] for name in names if name in values)


def picked(made: Made, chart: Chart) -> list[int]:
    """Points that have the values of `where`."""
    return [k for k, values in enumerate(made.labels) if all(values[name] == label for name, label in chart.where.items())]


def done(made: Made, rows) -> list[int]:
    return [int(k) for k in rows if made.runs["status"][k] == "done"]


def rows_of_point(made: Made, point: int) -> list[int]:
    runs = made.runs
    return done(made, np.flatnonzero((runs["model"] == "") & (runs["point"] == point)))


def reference_rows(made: Made, point: int) -> list[int]:
    """Runs of the reference that a point is compared with."""
    if not made.study.reference:
        return []
    runs = made.runs
    same = runs["model"] != ""
    for name in made.study.follows:
        same &= runs[name] == made.points[name][point]
    return done(made, np.flatnonzero(same))


def references(made: Made, chart: Chart, names) -> list[tuple[str, list[int]]]:
    """Label and rows of each reference that the chart's points have."""
    found: dict[tuple, tuple[str, list[int]]] = {}
    for point in picked(made, chart):
        rows = reference_rows(made, point)
        values = {name: made.labels[point][name] for name in made.study.follows if name in names}
        if rows:
            found.setdefault(tuple(rows), (", ".join(filter(None, [made.study.reference, label_of(made, values, names)])), rows))
    return list(found.values())


def groups_of(made: Made, chart: Chart) -> list[Group]:
    """A group for each point, then the references."""
    def folders(rows):
        return [made.folder / "runs" / made.runs["run"][k] for k in rows]
    groups = [Group(label_of(made, made.labels[k], chart.by) or made.study.name, folders(rows_of_point(made, k))) for k in picked(made, chart)]
    groups = [group for group in groups if group.folders]
    return groups + [Group(label, folders(rows), True) for label, rows in references(made, chart, chart.by)]


# ---- from the table alone ----

def scalar_lines(made: Made, chart: Chart) -> dict[str, list[int]]:
    lines: dict[str, list[int]] = {}
    for point in picked(made, chart):
        lines.setdefault(label_of(made, made.labels[point], chart.by), []).append(point)
    return lines


def reference_of(made: Made, chart: Chart, column: str, label: str, points: list[int], x: np.ndarray) -> Curve | None:
    """Mean of the reference beside each point of a line, and its standard error; the closed form as it is."""
    if made.study.closed:
        y = made.points.columns.get(f"{column}.reference", np.full(len(made.points), math.nan))[points]
        dy = np.full(len(points), math.nan)
    else:
        values, rows = made.runs[column], [reference_rows(made, point) for point in points]
        stats = [over_seeds([values[k] for k in row]) if row else (math.nan, math.nan) for row in rows]
        y, dy = (np.array([float(one[part]) for one in stats]) for part in (0, 1))
    if not np.isfinite(y).any():
        return None
    name = f"{made.study.reference}, {label}" if label and set(made.study.follows) & set(chart.by) else made.study.reference
    return Curve(name, x, y, dy=dy, reference=True)


def draw_scalar(made: Made, chart: Chart) -> Picture:
    points, axis = made.points, next(axis for axis in made.study.axes if axis.name == chart.over)
    words = [] if chart.over in made.numbers else [value.label for value in axis.values]
    column = "cost." * (measure_of(made, chart).source == "cost") + chart.measure
    mean, deviation = points[f"{column}.mean"], points[f"{column}.standard_error"]
    picture = Picture(chart.name, "scalar", chart.title, (chart.over, made.numbers.get(chart.over, "1")),
                      (chart.measure, points.units[f"{column}.mean"]), [], words)
    seen = set()
    for label, which in scalar_lines(made, chart).items():
        x = np.array([float(words.index(made.labels[k][chart.over])) if words else made.points[chart.over][k] for k in which])
        order = np.argsort(x, kind="stable")
        which, x = [which[k] for k in order], x[order]
        there = np.isfinite(mean[which])
        if there.any():
            picture.curves.append(Curve(label or made.study.name, x[there], mean[which][there], dy=deviation[which][there]))
        one = reference_of(made, chart, column, label, which, x)
        if one and one.label not in seen:
            picture.curves.append(one)
            seen.add(one.label)
    picture.curves.sort(key=lambda one: one.reference)
    return picture


def cost_of(made: Made, point: int, relative: bool) -> tuple[float, float]:
    """Mean of the study's cost and its standard error; or over the mean of the reference, whose own chance counts likewise: seeds that
    both have are pairs. NaN where that is not known."""
    column, seeds = made.runs[f"cost.{made.study.front}"], np.nan_to_num(made.runs["seed"])  # of a study without seeds all are 0
    sides = rows_of_point(made, point), reference_rows(made, point)
    own, twins = ({seeds[k]: column[k] for k in rows if math.isfinite(column[k])} for rows in sides)
    if not relative:
        mean, deviation = over_seeds(list(own.values())) if own else (math.nan, math.nan)
        return float(mean), float(deviation)
    both = [seed for seed in own if seed in twins]
    x, y = np.array([own[seed] for seed in both]), np.array([twins[seed] for seed in both])
    if not both or not y.mean() > 0:
        return math.nan, math.nan
    ratio = float(x.mean() / y.mean())
    return ratio, float(np.std(x - ratio * y, ddof=1) / y.mean() / math.sqrt(len(both))) if len(both) > 1 else math.nan


def front_shares(made: Made, chart: Chart, shown: list[int]) -> np.ndarray:
    """In which share of resamples each of these points is on the front of just these, by cost as the chart shows it; as in the table,
    where that has been asked of the same points and costs."""
    name, study = chart.measure, made.study
    known = made.points.columns.get(f"cost.{name}.front_share", np.full(len(made.points), math.nan))
    by_reference = chart.relative_cost and study.follows
    if len(shown) == np.isfinite(made.points[f"{name}.error"]).sum() and not by_reference:
        return known[shown]
    measure = measure_of(made, chart)
    study, numbers = dataclasses.replace(study, measures=[measure]), made.numbers
    there = set(made.runs["run"])
    runs = [read_run(study, job, made.folder, numbers) for job in jobs_of(study) if job.key in there and (job.model or job.point in shown)]
    if not {run.job.point for run in runs if not run.job.model} >= set(shown):
        raise QuernError(f"{made.folder / 'table.h5'} is of another form of the study or of its scene; quern sweep {study.path} writes it anew", 2)
    groups = [[run for run in runs if not run.job.model and run.job.point == k] for k in shown]
    pairs, costs = pairs_and_costs(study, measure, groups, runs)
    if by_reference:
        wholes = [np.nanmean([made.runs[f"cost.{study.front}"][row] for row in reference_rows(made, k)]) for k in shown]
        costs = [{seed: cost / whole for seed, cost in own.items()} for own, whole in zip(costs, wholes)]
    return shares_of(measure, pairs, costs)


def draw_front(made: Made, chart: Chart) -> Picture:
    """Cost and error of each point, cheapest first."""
    name, points = chart.measure, made.points
    error, deviation = points[f"{name}.error"], points[f"{name}.error.standard_error"]
    costs = {k: cost_of(made, k, chart.relative_cost) for k in picked(made, chart)}
    rows = sorted((k for k in costs if math.isfinite(error[k]) and math.isfinite(costs[k][0])), key=lambda k: (costs[k][0], k))
    axes = [axis.name for axis in made.study.axes if len(axis.values) > 1 and axis.name not in chart.where]
    names = {k: label_of(made, made.labels[k], axes) or made.study.name for k in costs}
    labels, gone = [names[k] for k in rows], [names[k] for k in costs if k not in rows]
    marks = {i: ", ".join(f"{axis} {label}" for axis, label in chart.mark.items()) for i, k in enumerate(rows)
             if chart.mark and all(made.labels[k][axis] == label for axis, label in chart.mark.items())}
    scatters = np.full(1, math.nan) if made.study.closed else points[f"{name}.scatter"][rows]
    scatter = float(np.median(scatters[np.isfinite(scatters)])) if np.isfinite(scatters).any() else math.nan
    what = {"running": "processor time from the release on", "processor": "processor time", "wall": "time by the clock"}[made.study.front]
    x = (f"{what}, over that of {made.study.reference}", "1") if chart.relative_cost else (what, "s")
    relative = measure_of(made, chart).kind in SHARES
    place = [np.array([costs[k][part] for k in rows]) for part in (0, 1)]
    line = Curve("settings", place[0], error[rows], place[1], deviation[rows])
    share = front_shares(made, chart, rows)
    y = (f"error of {name} against {made.study.reference}", "%" if relative else points.units[f"{name}.error"])
    if relative:
        line.y, line.dy, scatter = 100 * line.y, 100 * line.dy, 100 * scatter
    return Picture(chart.name, "front", chart.title, x, y, [line] if rows else [],
                   front=Front(rows, labels, share, marks, scatter, made.study.reference, chart.relative_cost, gone),
                   notes=[(label, "its cost or error is not known, so that it is not shown; table.csv says how its runs ended") for label in gone])


# ---- a closed form beside runs ----

def form_of(made: Made, chart: Chart) -> Measure | None:
    """The measure by which the study compares with its closed form what the chart shows."""
    for one in made.study.measures:
        if chart.kind == "profile" and one.name == chart.measure:
            return one
        if chart.kind == "series" and (one.source, one.path, one.at, one.per) == ("series", chart.column, "every", ""):
            return one
        if chart.kind == "distribution" and one.distribution and one.path == chart.field:
            return one
    return None


def form_curve(made: Made, chart: Chart, measure: Measure, point: int, folder: pathlib.Path) -> Curve | None:
    run = open_run(folder)
    reading: Reading | None = made.study.closed.reading(measure, made.labels[point], taken(measure, run, run.summary))
    if not reading:
        return None
    followed = label_of(made, made.labels[point], [name for name in made.study.follows if name in chart.by])
    label = ", ".join(filter(None, [made.study.reference, followed]))
    if chart.kind == "distribution":
        return Curve(label, reading.values, reading.shares, reference=True, straight=True)
    return Curve(label, reading.times if chart.kind == "series" else slabs(run, measure.path, len(reading.values))[0], reading.values, reference=True)


def add_forms(made: Made, chart: Chart, picture: Picture) -> None:
    """The closed form for each point, once where it is the same for several."""
    measure, seen = form_of(made, chart), set()
    for point in picked(made, chart) if measure and made.study.closed else ():
        rows = rows_of_point(made, point)
        try:
            one = form_curve(made, chart, measure, point, made.folder / "runs" / made.runs["run"][rows[0]]) if rows else None
        except DAMAGE as why:
            picture.notes.append((made.study.reference, sentence_of(why)))
            continue
        if one and one.label not in seen:
            seen.add(one.label)
            picture.curves.append(one)


def measure_of(made: Made, chart: Chart) -> Measure:
    return next(one for one in made.study.measures if one.name == chart.measure)


def picture_of(made: Made, chart: Chart) -> Picture:
    if chart.kind in ("scalar", "front"):
        return {"scalar": draw_scalar, "front": draw_front}[chart.kind](made, chart)
    which = measure_of(made, chart) if chart.kind == "profile" else -1
    if chart.kind == "profile":
        chart.column = which.path
    picture = FROM_RUNS[chart.kind](chart, groups_of(made, chart), which)
    add_forms(made, chart, picture)
    return picture
