# SPDX-License-Identifier: MIT
"""A closed form as the reference of a study: a CSV file with a column for each measure that it knows."""
import csv
import math
import pathlib
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import yaml

from .measure import Measure, Reading
from .reader import Reader, nearest, number_label

BESIDE = {"time": "s", "share": "1"}  # columns that go with those of measures


def rounded(x: float) -> float:
    """Twelve digits, as labels of axes have them."""
    return float(f"{x:.12g}")


@dataclass(frozen=True)
class Closed:
    file: str
    units: dict[str, str | None]  # of each column; None: text
    follows: tuple[str, ...]
    rows: dict[tuple, list[dict]]  # by the values of the axes that it follows: cells by column, without those that are empty

    def column(self, name: str, rows: list[dict]) -> list[float]:
        return [row[name] for row in rows if name in row]

    def reading(self, measure: Measure, values: dict[str, str], like: Reading) -> Reading | None:
        """The measure for a point with these values on the axes, at the times of `like`; None if the file has no column of it. ValueError
        with a sentence if the file does not reach so far."""
        if measure.name not in self.units:
            return None
        key = tuple(values[axis] if self.units[axis] is None else rounded(number_label(values[axis])[0]) for axis in self.follows)
        rows = [row for row in self.rows.get(key, []) if measure.name in row]
        if not rows:
            raise ValueError(f"{self.file} has no {measure.name} for {', '.join(f'{axis} {values[axis]}' for axis in self.follows)}")
        numbers, unit = np.array(self.column(measure.name, rows)), self.units[measure.name]
        if measure.distribution:
            return Reading(numbers, unit, shares=np.array(self.column("share", rows)))
        if measure.at != "every":
            return Reading(numbers, unit, None, like.columns)
        times, wanted = np.array(self.column("time", rows)), like.times
        near = 1e-9 * (wanted[-1] - wanted[0])
        if wanted[0] < times[0] - near or wanted[-1] > times[-1] + near:
            raise ValueError(f"{self.file} goes from {times[0]:g} s to {times[-1]:g} s, the run from {wanted[0]:g} s to {wanted[-1]:g} s")
        return Reading(np.interp(wanted, times, numbers), unit, wanted, like.columns)


# ---- from its file ----

Tell = Callable[[str], None]


def header_of(cells: list[str], tell: Tell) -> dict[str, str | None]:
    units: dict[str, str | None] = {}
    for cell in cells:
        match = re.fullmatch(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]+)\])?\s*", cell)
        if not match or not match[1]:
            tell(f"line 1: '{cell}' is no column such as 'front [m]'")
        elif match[1] in units:
            tell(f"line 1: the column '{match[1]}' stands there twice")
        else:
            units[match[1]] = match[2]
    return units


def check_header(units: dict[str, str | None], measures: dict[str, Measure], axes: dict[str, str | None], follows: tuple[str, ...],
                 tell: Tell) -> None:
    """Every column a measure with its unit, an axis that is followed, or beside one of these."""
    for name, unit in units.items():
        if name in follows:
            if (unit or "1") != (axes[name] or "1"):
                tell(f"line 1: '{name}' is in '{unit or 1}', and the axis in '{axes[name] or 'no unit'}'")
        elif name in axes:
            tell(f"line 1: the column '{name}' is an axis; name it in 'follows'")
        elif name in measures and measures[name].source == "cost":
            tell(f"line 1: '{name}' is a cost, which is not compared with a reference")
        elif name in measures and measures[name].vector and measures[name].at == "every":
            tell(f"line 1: '{name}' is a vector over time, which a table cannot hold; give its measure another 'at'")
        elif name not in measures and name not in BESIDE:
            tell(f"line 1: '{name}' is no measure{nearest(name, measures, 'measures: ')}")
        elif unit is None or unit != BESIDE.get(name, unit):
            tell(f"line 1: the unit of '{name}' is missing; write it behind the name, as in 'front [m]'" if unit is None else
                 f"line 1: '{name}' is in '{unit}', must be in '{BESIDE[name]}'")
    for name in follows:
        if name not in units:
            tell(f"line 1: a column '{name}' is missing, since 'follows' names it")
    if all(name in BESIDE or name in axes for name in units):
        tell(f"line 1: no column is a measure; measures: {', '.join(measures) or 'none'}")
    for measure in (measures[name] for name in units if name in measures):
        beside = "share" if measure.distribution else "time" if measure.at == "every" else ""
        if beside and beside not in units:
            tell(f"line 1: a column '{beside} [{BESIDE[beside]}]' is missing, which '{measure.name}' needs")


def row_of(cells: list[str], units: dict[str, str | None], texts: set[str], line: int, tell: Tell) -> dict:
    row = {}
    for name, cell in zip(units, (cell.strip() for cell in cells)):
        if not cell:
            continue
        try:
            row[name] = cell if name in texts else float(cell)
        except ValueError:
            row[name] = math.nan
        if name not in texts and not math.isfinite(row[name]):
            tell(f"line {line}: '{cell}' in the column '{name}' is no number")
    return row


def check_group(rows: list[dict], measure: Measure, lines: list[int], tell: Tell) -> None:
    """Rows of one measure for one value of each axis: one number, or a rising course of times or shares."""
    name = measure.name
    if measure.single and len(rows) > 1:
        tell(f"line {lines[1]}: a second value of '{name}', which is one number" + " for each value of the axes that it follows")
    beside = "share" if measure.distribution else "time" if measure.at == "every" else ""
    for k, row in enumerate(rows):
        before = rows[k - 1] if k else None
        if beside and beside not in row:
            tell(f"line {lines[k]}: '{name}' is without its {beside}")
            return
        rises = not before or not beside or (row[beside] > before[beside] if beside == "time" else
                                             row[beside] >= before[beside] and row[name] >= before[name])
        if not rises:
            tell(f"line {lines[k]}: {'times' if beside == 'time' else 'values and shares'} must rise from row to row")
            return
        if beside == "share" and not 0 <= row["share"] <= 1:
            tell(f"line {lines[k]}: the share {row['share']:g} is not between 0 and 1")


def read_closed(reader: Reader, node: yaml.Node, folder: pathlib.Path, measures: list[Measure], axes: dict[str, str | None],
                follows: tuple[str, ...]) -> Closed | None:
    """The file that `node` names; its faults are faults of the study. `axes`: their units, None of those that are text."""
    file, before = reader.text(node, "reference.csv", "the path of a file"), len(reader.faults)
    if not file:
        return None

    def tell(text: str) -> None:
        reader.fault(node, f"reference.csv: {file}{', ' if text.startswith('line') else ' '}{text}")
    try:
        table = list(csv.reader((folder / file).read_text(encoding="utf-8-sig").splitlines(), skipinitialspace=True))
    except FileNotFoundError:
        tell("is not there; paths begin at the folder of the study")
        return None
    except (OSError, ValueError, csv.Error) as why:
        tell(f"cannot be read: {why.strerror if isinstance(why, OSError) else 'it is no text in UTF-8'}")
        return None
    if len(table) < 2:
        tell("has no rows; give it a header such as 'front [m]', and numbers below")
        return None
    units, known = header_of(table[0], tell), {measure.name: measure for measure in measures}
    if len(reader.faults) == before:
        check_header(units, known, axes, follows, tell)
    if len(reader.faults) > before:
        return None
    texts = {name for name in follows if axes[name] is None}
    units |= {name: axes[name] for name in follows}
    rows: dict[tuple, list] = {}
    for line, cells in enumerate(table[1:], 2):
        if len(cells) != len(units):
            if cells:
                tell(f"line {line}: {len(cells)} cells, and the header has {len(units)}")
            continue
        row = row_of(cells, units, texts, line, tell)
        missing = [name for name in follows if name not in row]
        if missing:
            tell(f"line {line}: the cell of '{missing[0]}' is empty")
        else:
            key = tuple(row[name] if name in texts else rounded(row[name]) for name in follows)
            rows.setdefault(key, []).append((line, row))
    for measure in (known[name] for name in units if name in known) if len(reader.faults) == before else ():
        for group in rows.values():
            own = [(line, row) for line, row in group if measure.name in row]
            check_group([row for _, row in own], measure, [line for line, _ in own], tell)
    if len(reader.faults) > before:
        return None
    return Closed(file, units, follows, {key: [row for _, row in group] for key, group in rows.items()})
