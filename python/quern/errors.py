# SPDX-License-Identifier: MIT
"""How far a setting ends from its reference, how sure that is, and which settings are worth their cost.

A measure is one number a run or a row of numbers over time; below, `runs` and `twins` have a row for each seed, the same seeds, and
a column for each time. What is judged is the mean over seeds, since single runs of grains differ by chance."""
import numpy as np


def norm(difference: np.ndarray) -> float:
    """Root of the mean square over time; of one number its amount."""
    return float(np.sqrt(np.mean(difference ** 2, axis=-1)))


def error(runs: np.ndarray, twins: np.ndarray) -> float:
    """Norm of the difference of the means."""
    return norm(np.mean(runs - twins, axis=0))


def standard_error(runs: np.ndarray, twins: np.ndarray) -> float:
    """Of that error, to first order: each seed moves it by the mean over time of (mean difference)(its own deviation) over the
    error. Pairs of one seed began alike, so that what they have in common falls out. NaN for one seed, or with no difference at all."""
    pairs = runs - twins
    n, mean = len(pairs), np.mean(pairs, axis=0)
    size = norm(mean)
    if n < 2 or size == 0:
        return float("nan")
    moved = np.mean((pairs - mean) * mean, axis=-1) / size
    return float(np.std(moved, ddof=1) / np.sqrt(n))


def scatter(twins: np.ndarray) -> float:
    """How much runs of the reference differ among themselves: their standard deviation over seeds, its norm over time."""
    return norm(np.std(twins, axis=0, ddof=1)) if len(twins) > 1 else float("nan")


def front(cost: np.ndarray, off: np.ndarray) -> np.ndarray:
    """True for points that no other one beats: none is at most as costly and at most as wrong, and better in one of them."""
    order = np.lexsort((off, cost))
    c, o = cost[order], off[order]
    first = np.searchsorted(c, c, "left")  # of those that cost as much
    before = np.where(first > 0, np.minimum.accumulate(o)[first - 1], np.inf)
    on = np.empty(len(cost), bool)
    on[order] = (o == o[first]) & (o[first] < before)
    return on


def share_on_front(costs: list[np.ndarray], runs: list[np.ndarray], twins: list[np.ndarray], resamples: int = 1000, seed: int = 1) -> np.ndarray:
    """For each point, in which share of resamples of its seeds it is on the front. Points of equally many seeds share their draws, so
    that a reference which is off for one is off for all."""
    draws = np.random.Generator(np.random.PCG64(seed)).random((resamples, max(len(cost) for cost in costs)))
    mean_cost, off = np.empty((2, resamples, len(costs)))
    for k, (cost, run, twin) in enumerate(zip(costs, runs, twins)):
        n = len(cost)
        picks = (draws[:, :n] * n).astype(int)
        mean_cost[:, k] = np.mean(cost[picks], axis=1)
        often = np.array([np.bincount(pick, minlength=n) for pick in picks]) / n
        off[:, k] = np.sqrt(np.mean((often @ (run - twin)) ** 2, axis=1))
    share = np.mean([front(c, o) for c, o in zip(mean_cost, off)], axis=0)
    return np.where([len(cost) > 1 for cost in costs], share, np.nan)  # of one seed there is nothing to resample
