# SPDX-License-Identifier: MIT
"""How far a setting ends from its reference, how sure that is, and which settings are worth their cost.

A measure is one number a run or a row of numbers, over time or over places; below, `runs` and `twins` have a row for each seed, the same
seeds, and a column for each number. What is judged is the mean over seeds, since single runs of grains differ by chance.

By `kind`, the size of a difference d from a reference R is
- rms: the root of the mean square of d, of one number its amount;
- relative: that over the same of R;
- share: the sum of |d| over the sum of |R|;
- worst: the largest |d| over the mean of |R|;
- distance: the largest |d|, which between distribution functions is Kolmogorov and Smirnov's."""
import numpy as np

KINDS = ("rms", "relative", "share", "worst", "distance")
SHARES = ("relative", "share", "worst")  # of the reference
RESAMPLES = 1000
AT_ONCE = 200_000  # numbers of resamples that are held together, few enough to stay in a processor's cache


def size(x: np.ndarray, kind: str) -> np.ndarray:
    """Of each row."""
    if kind == "share":
        return np.sum(np.abs(x), axis=-1)
    return np.maximum(np.max(x, axis=-1), -np.min(x, axis=-1)) if kind in ("worst", "distance") else np.sqrt(np.mean(x ** 2, axis=-1))


def slope(x: np.ndarray, kind: str) -> np.ndarray:
    """How fast the size of a row grows with each of its numbers."""
    if kind == "share":
        return np.sign(x)
    if kind in ("worst", "distance"):
        return np.where(np.arange(len(x)) == np.argmax(np.abs(x)), np.sign(x), 0)
    return x / (len(x) * size(x, kind))


def whole_of(reference: np.ndarray, kind: str) -> np.ndarray:
    """What the size of a difference is a share of, of each row."""
    return np.mean(np.abs(reference), axis=-1) if kind == "worst" else size(reference, kind)


def whole_slope(reference: np.ndarray, kind: str) -> np.ndarray:
    """How fast that grows with each of a row's numbers."""
    return np.sign(reference) / len(reference) if kind == "worst" else slope(reference, kind)


def norm(difference: np.ndarray, reference: np.ndarray, kind: str) -> np.ndarray:
    """Of each row; NaN for a share of a reference that is 0."""
    if kind not in SHARES:
        return size(difference, kind)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = size(difference, kind) / whole_of(reference, kind)
    return np.where(np.isfinite(found), found, np.nan)


def error(runs: np.ndarray, twins: np.ndarray, kind: str = "rms") -> float:
    """Norm of the difference of the means."""
    return float(norm(np.mean(runs - twins, axis=0), np.mean(twins, axis=0), kind))


def standard_error(runs: np.ndarray, twins: np.ndarray, kind: str = "rms") -> float:
    """Of that error, to first order: each seed moves it by its own deviation from the mean difference, along the slope of the norm; and
    where the error is a share, by its twin's deviation from the reference's mean as well. Pairs of one seed began alike, so that what
    they have in common falls out. NaN for one seed, or with no difference at all."""
    pairs = runs - twins
    n, mean = len(pairs), np.mean(pairs, axis=0)
    if n < 2 or size(mean, kind) == 0:
        return float("nan")
    moved = np.sum((pairs - mean) * slope(mean, kind), axis=-1)
    if kind in SHARES:
        reference = np.mean(twins, axis=0)
        whole = whole_of(reference, kind)
        if whole == 0:
            return float("nan")
        moved = (moved - size(mean, kind) / whole * np.sum((twins - reference) * whole_slope(reference, kind), axis=-1)) / whole
    return float(np.std(moved, ddof=1) / np.sqrt(n))


def scatter(twins: np.ndarray, kind: str = "rms") -> float:
    """How much runs of the reference differ among themselves: their standard deviation over seeds, its norm."""
    return float(norm(np.std(twins, axis=0, ddof=1), np.mean(twins, axis=0), kind)) if len(twins) > 1 else float("nan")


def front(cost: np.ndarray, off: np.ndarray) -> np.ndarray:
    """True for points that no other one beats: none is at most as costly and at most as wrong, and better in one of them. What is NaN is
    unknown: such a point is not there, and beats none."""
    on = np.zeros(len(cost), bool)
    known = np.flatnonzero(~(np.isnan(cost) | np.isnan(off)))
    order = known[np.lexsort((off[known], cost[known]))]
    c, o = cost[order], off[order]
    first = np.searchsorted(c, c, "left")  # of those that cost as much
    before = np.where(first > 0, np.minimum.accumulate(o)[first - 1], np.inf)
    on[order] = (o == o[first]) & (o[first] < before)
    return on


def share_on_front(seeds: list[list], costs: list[np.ndarray], runs: list[np.ndarray], twins: list[np.ndarray], kind: str = "rms",
                   resamples: int = RESAMPLES, seed: int = 1) -> np.ndarray:
    """For each point, in which share of resamples of the seeds it is on the front. `seeds`: those of each point, in the order of its
    rows. All points share the draws, so that a reference which is off for one is off for all; a point that lacks a seed goes without it, and is not
    there in a resample that has none of its seeds."""
    every = list(dict.fromkeys(one for own in seeds for one in own))
    draws = np.random.Generator(np.random.PCG64(seed)).integers(0, len(every), (resamples, len(every)))
    often = np.array([np.bincount(pick, minlength=len(every)) for pick in draws], dtype=float)
    mean_cost, off = np.full((2, resamples, len(costs)), np.nan)
    for k, (own, cost, run, twin) in enumerate(zip(seeds, costs, runs, twins)):
        weight = often[:, [every.index(one) for one in own]]
        there = np.flatnonzero(weight.sum(axis=1))
        weight = weight[there] / weight[there].sum(axis=1, keepdims=True)
        mean_cost[there, k] = weight @ cost
        step, pairs = max(1, AT_ONCE // run.shape[1]), run - twin
        for a in range(0, len(there), step):
            some = weight[a:a + step]
            reference = some @ twin if kind in SHARES else pairs  # which is not looked at
            off[there[a:a + step], k] = norm(some @ pairs, reference, kind)
    on = np.array([front(c, o) for c, o in zip(mean_cost, off)])
    known = ~np.isnan(mean_cost)
    share = on.sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return np.where(known.any(axis=0) & [len(cost) > 1 for cost in costs], share, np.nan)  # of one seed there is nothing to resample
