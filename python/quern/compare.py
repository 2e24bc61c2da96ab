# SPDX-License-Identifier: MIT
"""Runs of a study beside their reference: which belong together, and as numbers that can be subtracted."""
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .measure import Measure, Reading
from .points import Job
from .study import Study


class Ran(NamedTuple):
    """A run, be it of a point or of the reference: its row of the table, and what was measured, by name."""
    row: dict
    readings: dict[str, Reading]
    job: Job


# Readings of the reference by seed, for a run and one of its measures.
Lookup = Callable[[Job, Measure, Reading], dict]


def lookup_of(study: Study, runs: list[Ran]) -> Lookup:
    """Finds what a run is compared with: the runs of the reference that have its values on the axes that the reference follows, or the
    closed form there. ValueError with a sentence where the closed form does not reach."""
    if study.closed:
        def by_form(job: Job, measure: Measure, like: Reading) -> dict:
            reading = study.closed.reading(measure, dict(job.values), like)
            return {job.seed: reading} if reading else {}
        return by_form
    found: dict[tuple, list[Ran]] = {}
    for run in runs:
        if run.job.model:
            found.setdefault(run.job.values, []).append(run)

    def by_runs(job: Job, measure: Measure, like: Reading) -> dict:
        twins = found.get(tuple(pair for pair in job.values if pair[0] in study.follows), [])
        return {twin.job.seed: twin.readings[measure.name] for twin in twins if measure.name in twin.readings}
    return by_runs


def unlike(own: Reading, other: Reading) -> str:
    """Why two readings cannot be subtracted from each other; empty if they can."""
    if own.unit != other.unit:
        return f"it is in '{own.unit}', and the reference in '{other.unit}'"
    if own.shares is not None or other.shares is not None or own.times is None and other.times is None and not own.columns:
        return ""
    if own.times is not None and other.times is not None:
        span = own.times[-1] - own.times[0]
        if len(own.times) != len(other.times) or np.max(np.abs(own.times - other.times)) > 1e-9 * span:
            return f"its {len(own.times)} times until {own.times[-1]:g} s are not the {len(other.times)} until {other.times[-1]:g} s of the reference"
    if own.values.shape != other.values.shape:
        return f"it has {own.values.shape[-1]} columns, and the reference {other.values.shape[-1]}"
    return ""


def risen(reading: Reading, places: np.ndarray, side: str) -> np.ndarray:
    """The distribution function: the share that is at most as large as each place, or smaller (`left`)."""
    if reading.shares is not None and side == "left":  # read from its end, so that a step is seen from below
        below = 1 - np.interp(-places, -reading.values[::-1], 1 - reading.shares[::-1], left=0, right=1)
        return np.where(places <= reading.values[0], 0, below)
    if reading.shares is not None:
        return np.where(places >= reading.values[-1], 1, np.interp(places, reading.values, reading.shares, left=0))
    return np.searchsorted(reading.values, places, side) / len(reading.values)


def as_rows(measure: Measure, own: list[Reading], theirs: list[Reading]) -> tuple[np.ndarray, np.ndarray]:
    """A row of numbers for each reading, the same places for all. Distributions are taken at every value that there is, on both
    of its sides, so that none of their steps is missed."""
    if not measure.distribution:
        return np.array([one.values.ravel() for one in own]), np.array([one.values.ravel() for one in theirs])
    places = np.unique(np.concatenate([one.values for one in own + theirs]))
    sides = ("right",) if all(one.shares is None for one in theirs) else ("left", "right")
    mine, other = (np.array([np.concatenate([risen(one, places, side) for side in sides]) for one in part]) for part in (own, theirs))
    return mine, other


class Pairs(NamedTuple):
    """Of a point and one measure: seeds that both have, and a row of numbers for each."""
    seeds: list
    mine: np.ndarray
    reference: np.ndarray


def pairs_of(measure: Measure, group: list[Ran], lookup: Lookup) -> Pairs | None:
    """None where there is nothing to compare. What cannot be compared with the first run of the point is left out."""
    found: dict = {}
    for run in group:
        own = run.readings.get(measure.name)
        if own is None:
            continue
        try:
            twin = lookup(run.job, measure, own).get(run.job.seed)
        except ValueError:
            continue
        first = next(iter(found.values()))[0] if found else own
        if twin and not unlike(own, twin) and not unlike(first, own):
            found[run.job.seed] = own, twin
    if not found:
        return None
    own, theirs = zip(*found.values())
    return Pairs(list(found), *as_rows(measure, list(own), list(theirs)))
