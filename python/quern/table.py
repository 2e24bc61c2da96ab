# SPDX-License-Identifier: MIT
"""The tables of a study: a row for each run, a row for each point; as CSV and, beside it, HDF5.

Columns that begin with `cost.` were measured with a clock, and what follows from them; all others are results, the same to the last
digit however the study came about."""
import csv
import io
import math
import pathlib
import statistics
from collections.abc import Callable

import h5py
import numpy as np

from . import errors, workers
from .points import Job
from .reader import QUANTITY
from .runs import Series
from .study import RESULTS, Measure, Study

UNITS = {"time_end": "s", "energy": "J"}
COSTS = {"wall": "s", "processor": "s", "running": "s", "memory": "B"}
SURE = 0.95


def axis_numbers(study: Study) -> dict[str, str]:
    """The unit of each axis whose values are all numbers in one unit; the others are columns of text."""
    units = {}
    for axis in study.axes:
        found = [QUANTITY.fullmatch(value.label) for value in axis.values]
        if all(found) and len({match[2] for match in found}) == 1:
            units[axis.name] = found[0][2] or "1"
    return units


def axis_cells(job: Job, numbers: dict[str, str]) -> dict:
    return {name: float(QUANTITY.fullmatch(label)[1]) if name in numbers else label for name, label in job.values}


def reach(tree: dict, path: str):
    """What stands at a dotted path of a summary."""
    for word in path.split("."):
        tree = tree[int(word)] if isinstance(tree, list) and word.isdigit() else tree[word]
    return tree


def measured(measure: Measure, series: Series | None, summary: dict) -> tuple[np.ndarray, str]:
    """The numbers of a measure, one or one for each time, and their unit; KeyError, IndexError or ValueError if there are none."""
    if measure.source == "summary":
        value = reach(summary, measure.path)
        if isinstance(value, dict) and "value" in value:
            return np.array([float(value["value"])]), value["unit"]
        if isinstance(value, (bool, dict, list, str)) or value is None:
            raise ValueError(f"{measure.path} of the summary is no number")
        return np.array([float(value)]), UNITS.get(measure.path, "1")
    column = series[measure.path]
    pick = {"last": lambda x: x[-1:], "first": lambda x: x[:1], "every": lambda x: x, "mean": lambda x: np.array([np.mean(x)]),
            "min": lambda x: np.array([np.min(x)]), "max": lambda x: np.array([np.max(x)])}[measure.at]
    return pick(column), series.units[measure.path]


def read_run(study: Study, job: Job, folder: pathlib.Path, numbers: dict[str, str], units: dict[str, str]) -> tuple[dict, dict[str, np.ndarray]]:
    """The row of a run but for errors, and its measures."""
    record = workers.recorded(folder, job.key) or {"status": "missing", "exit": "", "message": "", "cost": {}}
    row = {"run": job.key, "point": "" if job.model else job.point, "model": job.model, "seed": "" if job.seed is None else job.seed,
           "status": record["status"], "exit": record["exit"], "message": record["message"]}
    row |= axis_cells(job, numbers) | {f"cost.{name}": record["cost"].get(name, "") for name in COSTS}
    where, values = folder / "runs" / job.key, {}
    summary = workers.read_json(where / "summary.json")
    if record["status"] != "done" or not summary:
        return row, {}
    series = Series(where / "series.csv") if any(measure.source == "series" for measure in study.measures) else None
    row |= {name: summary.get(name, "") for name in RESULTS} | {"scene_hash": summary["provenance"]["scene_hash"]}
    for measure in study.measures:
        try:
            values[measure.name], units[measure.name] = measured(measure, series, summary)
        except (KeyError, IndexError, ValueError, TypeError) as why:
            row["message"] = f"{measure.name}: {why.args[0] if why.args else why}"
            continue
        if measure.at != "every":
            row[measure.name] = float(values[measure.name][0])
    return row, values


# ---- against the reference ----

def twins_of(study: Study, runs: list) -> Callable[[Job], list]:
    """Finds runs of the reference that a point is compared with: those that have its values on the axes that the reference follows."""
    found: dict[tuple, list] = {}
    for run in runs:
        if run[2].model:
            found.setdefault(run[2].values, []).append(run)
    return lambda job: found.get(tuple(pair for pair in job.values if pair[0] in study.follows), [])


def of_measure(runs: list, name: str) -> dict:
    """Values by seed, of runs that have them."""
    return {job.seed: values[name] for _, values, job in runs if name in values}


def add_errors(runs: list, twins_of_job: Callable[[Job], list]) -> None:
    """How far each run is from the mean of the reference."""
    for row, values, job in runs:
        if job.model:
            continue
        twins = twins_of_job(job)
        for name, own in values.items():
            theirs = [value for value in of_measure(twins, name).values() if len(value) == len(own)]
            if theirs:
                row[f"{name}.error"] = errors.norm(own - np.mean(theirs, axis=0))


def pairs_of(own: dict, theirs: dict) -> tuple[list, np.ndarray, np.ndarray]:
    """Seeds that both have, with as many times, and their values."""
    seeds = [seed for seed in own if seed in theirs and len(own[seed]) == len(theirs[seed])]
    lengths = {len(own[seed]) for seed in seeds}
    seeds = seeds if len(lengths) == 1 else []
    return seeds, np.array([own[seed] for seed in seeds]), np.array([theirs[seed] for seed in seeds])


def point_row(study: Study, group: list, twins: list, numbers: dict[str, str]) -> tuple[dict, dict]:
    """The row of a point, and what its place on the fronts is drawn from."""
    first = group[0][2]
    done = [row for row, _, _ in group if row["status"] == "done"]
    row = {"point": first.point, **axis_cells(first, numbers), "runs": len(group), "done": len(done)}
    costs = {job.seed: r[f"cost.{study.front}"] for r, _, job in group if r["status"] == "done"}
    row["cost.mean"] = statistics.mean(costs.values()) if costs else ""
    draws = {}
    for measure in study.measures:
        own, theirs = of_measure(group, measure.name), of_measure(twins, measure.name)
        single = [float(value[0]) for value in own.values()] if measure.at != "every" else []
        if single:
            row[f"{measure.name}.mean"] = statistics.mean(single)
        if len(single) > 1:
            row[f"{measure.name}.standard_error"] = statistics.stdev(single) / math.sqrt(len(single))
        seeds, mine, reference = pairs_of(own, theirs)
        if seeds:
            row |= {f"{measure.name}.error": errors.error(mine, reference), f"{measure.name}.error.standard_error": errors.standard_error(mine, reference),
                    f"{measure.name}.scatter": errors.scatter(reference)}
            draws[measure.name] = np.array([costs[seed] for seed in seeds]), mine, reference
    return row, draws


def add_fronts(study: Study, rows: list[dict], draws: list[dict]) -> None:
    """In which share of resamples each point is on the front of cost and error, and whether that is sure."""
    for measure in study.measures:
        there = [k for k, own in enumerate(draws) if measure.name in own]
        if not there:
            continue
        costs, runs, twins = zip(*(draws[k][measure.name] for k in there))
        for k, share in zip(there, errors.share_on_front(list(costs), list(runs), list(twins))):
            rows[k][f"cost.{measure.name}.front_share"] = float(share)
            rows[k][f"cost.{measure.name}.on_front"] = int(share >= SURE)


# ---- files ----

def text_of(value) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return str(value)


def write_csv(path: pathlib.Path, columns: dict[str, str | None], rows: list[dict]) -> None:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([name if unit is None else f"{name} [{unit}]" for name, unit in columns.items()])
    writer.writerows([text_of(row.get(name, "")) for name in columns] for row in rows)
    workers.save(path, out.getvalue())


def write_h5(path: pathlib.Path, tables: dict[str, tuple[dict, list[dict]]]) -> None:
    """A group for each table, in it a dataset for each column; empty cells are NaN, or empty text."""
    aside = path.with_name(path.name + ".part")
    with h5py.File(aside, "w") as file:
        for table, (columns, rows) in tables.items():
            group = file.create_group(table)
            for name, unit in columns.items():
                cells = [row.get(name, "") for row in rows]
                if unit is None:
                    group.create_dataset(name, data=[str(cell) for cell in cells], dtype=h5py.string_dtype())
                else:
                    data = np.array([math.nan if cell == "" else float(cell) for cell in cells])
                    group.create_dataset(name, data=data).attrs["unit"] = unit
    aside.replace(path)


def columns_of(study: Study, numbers: dict[str, str], units: dict[str, str]) -> tuple[dict, dict]:
    """Columns of both tables with their units; None: text."""
    axes = {axis.name: numbers.get(axis.name) for axis in study.axes}
    runs = {"run": None, "point": "1", "model": None, **axes, "seed": "1", "status": None, "exit": "1", "message": None, "scene_hash": None}
    runs |= {name: UNITS.get(name, "1") for name in RESULTS}
    points = {"point": "1", **axes, "runs": "1", "done": "1"}
    costs = {"cost.mean": "s"}
    for measure in study.measures:
        unit, name = units.get(measure.name, "1"), measure.name
        runs |= {name: unit} if measure.at != "every" else {}
        points |= {f"{name}.mean": unit, f"{name}.standard_error": unit} if measure.at != "every" else {}
        if study.reference:
            runs |= {f"{name}.error": unit}
            points |= {f"{name}.error": unit, f"{name}.error.standard_error": unit, f"{name}.scatter": unit}
            costs |= {f"cost.{name}.front_share": "1", f"cost.{name}.on_front": "1"}
    return runs | {f"cost.{name}": unit for name, unit in COSTS.items()}, points | costs


def write_tables(study: Study, jobs: list[Job], folder: pathlib.Path) -> list[dict]:
    """table.csv, points.csv and table.h5 in the folder of the study; returns the rows of the first."""
    units: dict[str, str] = {}
    numbers = axis_numbers(study)
    runs = [(*read_run(study, job, folder, numbers, units), job) for job in jobs]
    twins = twins_of(study, runs)
    add_errors(runs, twins)
    groups: dict[int, list] = {}
    for run in runs:
        if not run[2].model:
            groups.setdefault(run[2].point, []).append(run)
    points = [point_row(study, group, twins(group[0][2]), numbers) for group in groups.values()]
    point_rows, draws = [row for row, _ in points], [own for _, own in points]
    add_fronts(study, point_rows, draws)
    run_columns, point_columns = columns_of(study, numbers, units)
    rows = [row for row, _, _ in runs]
    write_csv(folder / "table.csv", run_columns, rows)
    write_csv(folder / "points.csv", point_columns, point_rows)
    write_h5(folder / "table.h5", {"runs": (run_columns, rows), "points": (point_columns, point_rows)})
    return rows
