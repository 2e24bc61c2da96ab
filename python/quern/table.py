# SPDX-License-Identifier: MIT
"""The tables of a study: a row for each run, a row for each point; as CSV and, beside it, HDF5.

Columns that begin with `cost.` were measured with a clock, and what follows from them; all others are results, the same to the last
digit however the study came about."""
import csv
import functools
import io
import math
import pathlib
import statistics

import h5py
import numpy as np

from . import errors, workers
from .compare import Lookup, Pairs, Ran, as_rows, lookup_of, pairs_of, unlike
from .measure import COSTS, RESULTS, UNITS, Measure, Reading, taken
from .points import Job
from .program import QuernError, sentence_of
from .reader import number_label
from .runs import Run
from .study import Study

SURE = 0.95
DAMAGE = (KeyError, IndexError, ValueError, TypeError, AttributeError, OverflowError, OSError, QuernError)  # what reading a damaged run can raise


def axis_cells(job: Job, numbers: dict[str, str]) -> dict:
    return {name: number_label(label)[0] if name in numbers else label for name, label in job.values}


def note(row: dict, text: str) -> None:
    """A further sentence in the message of a run."""
    row["message"] = f"{row['message']}; {text}" if row["message"] else text


def results_of(row: dict, summary: dict) -> dict:
    """The columns that every table has."""
    found = {name: summary.get(name) for name in RESULTS}
    for name, value in found.items():
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < 1e300:
            note(row, f"{name} of summary.json is no number")
            found[name] = ""
    provenance = summary.get("provenance")
    digest = provenance.get("scene_hash") if isinstance(provenance, dict) else None
    if not isinstance(digest, str):
        note(row, "summary.json does not say what was run")
    return found | {"scene_hash": digest or ""}


class Kept(Run):
    """A run that is over: its series are read once for all measures."""
    series = functools.cached_property(Run.series.fget)


def read_run(study: Study, job: Job, folder: pathlib.Path, numbers: dict[str, str]) -> Ran:
    """The row of a run but for errors, and its measures; damage is said in its message."""
    record = workers.recorded(folder, job.key) or {"status": "missing", "exit": "", "message": "", "cost": {}}
    row = {"run": job.key, "point": "" if job.model else job.point, "model": job.model, "seed": "" if job.seed is None else job.seed,
           "status": record["status"], "exit": record["exit"], "message": record["message"]}
    row |= axis_cells(job, numbers) | {f"cost.{name}": record["cost"].get(name, "") for name in COSTS}
    readings: dict[str, Reading] = {}
    if record["status"] != "done":
        return Ran(row, readings, job)
    run = Kept(folder / "runs" / job.key)
    summary = workers.read_json(run.folder / "summary.json")
    if not summary:
        note(row, "summary.json is missing or damaged; the next sweep makes the run again")
        return Ran(row, readings, job)
    row |= results_of(row, summary)
    for measure in study.measures:
        try:
            readings[measure.name] = taken(measure, run, summary)
        except DAMAGE as why:
            note(row, f"{measure.name}: {sentence_of(why).replace(f'{run.folder}/', '')}")
            continue
        if measure.single:
            row["cost." * (measure.source == "cost") + measure.name] = float(readings[measure.name].values[0])
    return Ran(row, readings, job)


# ---- against the reference ----

def own_error(measure: Measure, own: Reading, job: Job, lookup: Lookup) -> tuple[float, str]:
    """How far a run is from the mean of the reference, or NaN and why that cannot be told."""
    try:
        twins = list(lookup(job, measure, own).values())
    except ValueError as why:
        return math.nan, str(why)
    usable = [twin for twin in twins if not unlike(own, twin)]
    if not usable:
        return math.nan, unlike(own, twins[0]) if twins else ""
    mine, theirs = as_rows(measure, [own], usable)
    reference = np.mean(theirs, axis=0)
    off = float(errors.norm(mine[0] - reference, reference, measure.kind))
    return off, "the reference is 0, so that nothing is a share of it" if math.isnan(off) else ""


def add_errors(study: Study, runs: list[Ran], lookup: Lookup) -> None:
    for run in runs:
        for measure in compared(study) if not run.job.model else ():
            if measure.name in run.readings:
                off, why = own_error(measure, run.readings[measure.name], run.job, lookup)
                run.row[f"{measure.name}.error"] = off
                if why:
                    note(run.row, f"{measure.name}.error: {why}")


def compared(study: Study) -> list[Measure]:
    """Measures that the reference may have too."""
    return [measure for measure in study.measures if study.reference and measure.source != "cost"]


def mean_cells(name: str, single: list[float]) -> dict:
    row = {f"{name}.mean": statistics.mean(single)} if single else {}
    if len(single) > 1:
        row[f"{name}.standard_error"] = statistics.stdev(single) / math.sqrt(len(single))
    return row


def error_cells(study: Study, measure: Measure, pairs: Pairs) -> dict:
    name, mine, reference = measure.name, pairs.mine, pairs.reference
    row = {f"{name}.reference": float(np.mean(reference[:, 0]))} if measure.single else {}
    return row | {f"{name}.error": errors.error(mine, reference, measure.kind),
                  f"{name}.error.standard_error": errors.standard_error(mine, reference, measure.kind),
                  f"{name}.scatter": 0.0 if study.closed else errors.scatter(reference, measure.kind)}


def costs_of(study: Study, group: list[Ran]) -> dict:
    """By seed, of runs that came to their end."""
    costs = {run.job.seed: run.row[f"cost.{study.front}"] for run in group if run.row["status"] == "done"}
    return {seed: cost for seed, cost in costs.items() if cost != "" and math.isfinite(cost)}


def point_row(study: Study, group: list[Ran], lookup: Lookup, numbers: dict[str, str]) -> tuple[dict, dict[str, Pairs], dict]:
    """The row of a point, its pairs by measure, and what each of its seeds cost."""
    first = group[0].job
    done = [run for run in group if run.row["status"] == "done"]
    row = {"point": first.point, **axis_cells(first, numbers), "runs": len(group), "done": len(done)}
    costs = costs_of(study, group)
    row["cost.mean"] = statistics.mean(costs.values()) if costs else ""
    for measure in study.measures:
        if measure.single:
            single = [float(run.readings[measure.name].values[0]) for run in group if measure.name in run.readings]
            row |= mean_cells("cost." * (measure.source == "cost") + measure.name, single)
    pairs = {measure.name: pairs_of(measure, group, lookup) for measure in compared(study)}
    for measure in compared(study):
        if pairs[measure.name]:
            row |= error_cells(study, measure, pairs[measure.name])
    return row, {name: found for name, found in pairs.items() if found}, costs


def shares_of(measure: Measure, pairs: list[Pairs | None], costs: list[dict]) -> np.ndarray:
    """In which share of resamples each point is on the front of cost and error; NaN where that is not known."""
    there, drawn, found = [], [], np.full(len(pairs), math.nan)
    for k, own in enumerate(pairs):
        kept = [i for i, seed in enumerate(own.seeds) if seed in costs[k]] if own else []
        if kept:
            seeds = [own.seeds[i] for i in kept]
            there.append(k)
            drawn.append((seeds, np.array([costs[k][seed] for seed in seeds]), own.mine[kept], own.reference[kept]))
    if drawn:
        found[there] = errors.share_on_front(*zip(*drawn), measure.kind)
    return found


def pairs_and_costs(study: Study, measure: Measure, groups: list[list[Ran]], runs: list[Ran]) -> tuple[list[Pairs | None], list[dict]]:
    """What `shares_of` takes, of points that are groups of runs; `runs` has those of the reference as well."""
    lookup = lookup_of(study, runs)
    return [pairs_of(measure, group, lookup) for group in groups], [costs_of(study, group) for group in groups]


def add_fronts(study: Study, rows: list[dict], pairs: list[dict[str, Pairs]], costs: list[dict]) -> None:
    """Those shares, and whether they are sure."""
    for measure in compared(study):
        name = measure.name
        for row, share in zip(rows, shares_of(measure, [own.get(name) for own in pairs], costs)):
            if not math.isnan(share):
                row[f"cost.{name}.front_share"], row[f"cost.{name}.on_front"] = float(share), int(share >= SURE)


# ---- vectors ----

def vector_of(study: Study, measure: Measure, group: list[Ran], lookup: Lookup, n: int) -> dict[str, np.ndarray]:
    """Of a point: mean over its seeds and the standard error of that, mean and scatter of the reference over the same seeds."""
    found = {name: np.full(n, np.nan) for name in ("mean", "standard_error", "reference", "scatter")}
    own = [run.readings[measure.name].values for run in group if measure.name in run.readings]
    own = np.array([values for values in own if len(values) == n])
    pairs = pairs_of(measure, group, lookup)
    theirs = pairs.reference if pairs and pairs.reference.shape[1] == n else ()
    for rows, mean, spread, share in ((own, "mean", "standard_error", len(own)), (theirs, "reference", "scatter", 1)):
        if len(rows):
            found[mean] = np.mean(rows, axis=0)
        if len(rows) > 1:
            found[spread] = np.std(rows, axis=0, ddof=1) / math.sqrt(share)
    if study.closed and len(theirs):
        found["scatter"] = np.zeros(n)
    return found


def vectors_of(study: Study, groups: list[list[Ran]], lookup: Lookup) -> dict[str, tuple[dict, dict]]:
    """Of each measure that is a vector: an array for each of the names above, a row for each point; and what to say of them. Runs with
    another number of columns than the first are left out."""
    found = {}
    for measure in (one for one in study.measures if one.vector and one.at != "every"):
        readings = [(run, run.readings[measure.name]) for group in groups for run in group if measure.name in run.readings]
        if not readings:
            continue
        first = readings[0][1]
        for run, reading in readings:
            if len(reading.values) != len(first.values):
                note(run.row, f"{measure.name}: {len(reading.values)} columns, where the first run has {len(first.values)}; left out of /vectors")
        rows = [vector_of(study, measure, group, lookup, len(first.values)) for group in groups]
        arrays = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        found[measure.name] = arrays, {"unit": first.unit, "columns": list(first.columns)}
    return found


# ---- files ----

def text_of(value) -> str:
    """A cell; what no file of text can hold is left out of it."""
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return str(value).replace("\0", "").encode(errors="replace").decode()


def write_csv(path: pathlib.Path, columns: dict[str, str | None], rows: list[dict]) -> None:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([name if unit is None else f"{name} [{unit}]" for name, unit in columns.items()])
    writer.writerows([text_of(row.get(name, "")) for name in columns] for row in rows)
    workers.save(path, out.getvalue())


def write_h5(path: pathlib.Path, tables: dict[str, tuple[dict, list[dict]]], vectors: dict[str, tuple[dict, dict]]) -> None:
    """A group for each table, in it a dataset for each column; empty cells are NaN, or empty text. Vectors have a group each."""
    aside = path.with_name(path.name + ".part")
    with h5py.File(aside, "w") as file:
        for table, (columns, rows) in tables.items():
            group = file.create_group(table)
            for name, unit in columns.items():
                cells = [row.get(name, "") for row in rows]
                if unit is None:
                    group.create_dataset(name, data=[text_of(cell) for cell in cells], dtype=h5py.string_dtype())
                else:
                    data = np.array([math.nan if cell == "" else float(cell) for cell in cells])
                    group.create_dataset(name, data=data).attrs["unit"] = unit
        for name, (arrays, notes) in vectors.items():
            group = file.create_group(f"vectors/{name}")
            group.attrs["unit"], group.attrs["columns"] = notes["unit"], notes["columns"]
            for word, data in arrays.items():
                group.create_dataset(word, data=data).attrs["unit"] = notes["unit"]
    aside.replace(path)


def columns_of(study: Study, numbers: dict[str, str], units: dict[str, str]) -> tuple[dict, dict]:
    """Columns of both tables with their units; None: text."""
    axes = {axis.name: numbers.get(axis.name) for axis in study.axes}
    runs = {"run": None, "point": "1", "model": None, **axes, "seed": "1", "status": None, "exit": "1", "message": None, "scene_hash": None}
    runs |= {name: UNITS.get(name, "1") for name in RESULTS}
    points = {"point": "1", **axes, "runs": "1", "done": "1"}
    own_costs, costs = {f"cost.{name}": unit for name, unit in COSTS.items()}, {"cost.mean": "s"}
    for measure in study.measures:
        unit, name = units.get(measure.name, "1"), measure.name
        off = unit if measure.kind == "rms" else "1"
        if measure.source == "cost":
            own_costs |= {f"cost.{name}": unit}
            costs |= {f"cost.{name}.mean": unit, f"cost.{name}.standard_error": unit}
            continue
        if measure.single:
            runs |= {name: unit}
            points |= {f"{name}.mean": unit, f"{name}.standard_error": unit}
        if study.reference:
            runs |= {f"{name}.error": off}
            points |= {f"{name}.reference": unit} if measure.single else {}
            points |= {f"{name}.error": off, f"{name}.error.standard_error": off, f"{name}.scatter": off}
            costs |= {f"cost.{name}.front_share": "1", f"cost.{name}.on_front": "1"}
    return runs | own_costs, points | costs


def write_tables(study: Study, jobs: list[Job], folder: pathlib.Path) -> list[dict]:
    """table.csv, points.csv and table.h5 in the folder of the study; returns the rows of the first."""
    numbers = {axis.name: axis.unit for axis in study.axes if axis.unit}
    runs = [read_run(study, job, folder, numbers) for job in jobs]
    units = {name: reading.unit for run in runs for name, reading in run.readings.items()}
    lookup = lookup_of(study, runs)
    add_errors(study, runs, lookup)
    groups: dict[int, list] = {}
    for run in runs:
        if not run.job.model:
            groups.setdefault(run.job.point, []).append(run)
    points = [point_row(study, group, lookup, numbers) for group in groups.values()]
    point_rows, pairs, costs = ([point[k] for point in points] for k in range(3))
    add_fronts(study, point_rows, pairs, costs)
    vectors = vectors_of(study, list(groups.values()), lookup)
    run_columns, point_columns = columns_of(study, numbers, units)
    rows = [run.row for run in runs]
    write_csv(folder / "table.csv", run_columns, rows)
    write_csv(folder / "points.csv", point_columns, point_rows)
    write_h5(folder / "table.h5", {"runs": (run_columns, rows), "points": (point_columns, point_rows)}, vectors)
    return rows
