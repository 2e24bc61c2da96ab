# SPDX-License-Identifier: MIT
"""Errors of a study against closed forms: normal numbers whose means, standard errors and shares on the front are known."""
import itertools
import math
import os
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(os.environ["QUERN_SOURCE"]) / "python"))
from quern import errors  # noqa: E402
from quern.compare import as_rows  # noqa: E402
from quern.measure import Measure, Reading  # noqa: E402

draw = np.random.Generator(np.random.PCG64(7))


def near(found, wanted, relative, what):
    assert abs(found / wanted - 1) < relative, f"{what}: {found}, not {wanted}"
    print(f"ok  {what}: {found:.6g}, closed form {wanted:.6g}")


def check_by_hand():
    runs, twins = np.array([[1.0], [2.0], [6.0]]), np.array([[0.0], [0.0], [0.0]])
    near(errors.error(runs, twins), 3, 1e-15, "error of 1, 2, 6 against 0")
    near(errors.standard_error(runs, twins), math.sqrt(7 / 3), 1e-15, "its standard error")
    near(errors.standard_error(-runs, twins), math.sqrt(7 / 3), 1e-15, "the same below")
    near(errors.scatter(runs), math.sqrt(7), 1e-15, "scatter of 1, 2, 6")
    # a sine of amplitude 2 over whole periods is sqrt 2 off, whatever both began with
    time = np.arange(1000) * 2 * math.pi / 1000
    start = draw.normal(size=(4, 1))
    near(errors.error(2 * np.sin(time) + start, 0 * time + start), math.sqrt(2), 1e-12, "a sine of amplitude 2 over time")
    assert math.isnan(errors.standard_error(runs[:1], twins[:1])) and math.isnan(errors.scatter(runs[:1]))
    assert math.isnan(errors.standard_error(twins, twins)) and errors.error(twins, twins) == 0
    for _ in range(300):  # against every pair, with many that are equal
        cost, off = draw.integers(0, 6, (2, 9)).astype(float)
        beaten = [any(c <= cost[k] and o <= off[k] and (c < cost[k] or o < off[k]) for c, o in zip(cost, off)) for k in range(9)]
        assert errors.front(cost, off).tolist() == [not b for b in beaten], (cost, off)
    assert errors.front(np.array([1, 2, 3, 3, 1.0]), np.array([5, 2, 2, 1, 5.0])).tolist() == [True, True, False, True, True]
    # what is unknown is not there, and beats none
    nan = math.nan
    assert errors.front(np.array([1, nan, 0.5, 2, nan]), np.array([5, 0, nan, 2, nan])).tolist() == [True, False, False, True, False]
    assert not errors.front(np.array([nan, 1]), np.array([1, nan])).any()


def check_norms():
    """Every kind by hand: differences of 1, -2, 0 and 3 from a reference of 2, -4, 1 and 1."""
    twins = np.array([[2, -4, 1, 1.0]] * 3)
    runs = twins + [1, -2, 0, 3.0]
    for kind, wanted in (("rms", math.sqrt(14 / 4)), ("relative", math.sqrt(14 / 22)), ("share", 6 / 8), ("worst", 3 / 2), ("distance", 3)):
        near(errors.error(runs, twins, kind), wanted, 1e-15, f"{kind} of 1, -2, 0, 3 from 2, -4, 1, 1")
    spread = np.array([[1, 0, 0.0], [2, 0, 0], [3, 3, 0]])  # means 2, 1, 0; deviations 1, sqrt 3, 0
    for kind, wanted in (("rms", math.sqrt(4 / 3)), ("relative", math.sqrt(4 / 5)), ("share", (1 + math.sqrt(3)) / 3), ("worst", math.sqrt(3)),
                         ("distance", math.sqrt(3))):
        near(errors.scatter(spread, kind), wanted, 1e-15, f"scatter by {kind}")
    near(errors.error(np.array([[3.0]]), np.array([[-2.0]]), "relative"), 2.5, 1e-15, "3 from -2, relative")
    for kind in errors.SHARES:
        assert math.isnan(errors.error(runs, 0 * twins, kind)) and math.isnan(errors.standard_error(runs, 0 * twins, kind)), kind


def check_norms_of_many():
    """Over 4000 studies of 8 seeds the error of every kind scatters as each study says of itself; the reference scatters too, and points
    have a part in common with it. Two numbers beside the closed form of the first order."""
    reference, off = np.array([6.0, -3.0, 2.0, 5.0]), np.array([1.0, 0.6, -0.8, 2.0])
    for kind in errors.KINDS:
        found, said = [], []
        for _ in range(4000):
            common = draw.normal(scale=0.4, size=(8, 4))
            twins = reference + common + draw.normal(scale=0.2, size=(8, 4))
            runs = reference + off + 0.5 * common + draw.normal(scale=0.3, size=(8, 4))
            found.append(errors.error(runs, twins, kind))
            said.append(errors.standard_error(runs, twins, kind))
        slope, whole = {"rms": (off / (4 * errors.size(off, "rms")), 1), "share": (np.sign(off), 16), "distance": (np.array([0, 0, 0, 1]), 1),
                        "worst": (np.array([0, 0, 0, 1]), 4),
                        "relative": (off / (4 * errors.size(off, "rms")), errors.size(reference, "rms"))}[kind]
        back = {"share": np.sign(reference), "worst": np.sign(reference) / 4,
                "relative": reference / (4 * errors.size(reference, "rms"))}.get(kind, np.zeros(4))
        back = back * errors.size(off, kind) / whole
        # runs less twins hold -0.5 of what is common, the reference all of it; each number has its own chance
        by_hand = math.sqrt(np.sum((0.4 * (-0.5 * slope - back)) ** 2 + (0.2 * (slope + back)) ** 2 + (0.3 * slope) ** 2) / 8) / whole
        near(np.std(found), by_hand, 0.04, f"{kind}: spread of the error over 4000 studies")
        near(math.sqrt(np.mean(np.square(said))), by_hand, 0.04, f"{kind}: what they say themselves")


def check_distance():
    """Kolmogorov and Smirnov's distance: of numbers against the even law it is, times sqrt n, spread by Kolmogorov's law."""
    measure = Measure("radii", "frame", "grain.radius", of="all")
    even = Reading(np.array([0, 1.0]), "m", shares=np.array([0, 1.0]))

    def distance(x, reference=even):
        mine, theirs = as_rows(measure, [Reading(np.sort(x), "m")], [reference])
        return errors.error(mine, theirs, measure.kind)
    near(distance(np.array([0.3, 0.4])), 0.6, 1e-15, "distance of 0.3 and 0.4 from the even law")  # above the larger one
    near(distance(np.array([0.7, 0.8])), 0.7, 1e-15, "of 0.7 and 0.8")  # below the smaller one
    near(distance(np.array([1, 1, 2, 3.0]), Reading(np.array([1, 2, 2, 3.0]), "m")), 0.25, 1e-15, "of 1, 1, 2, 3 from 1, 2, 2, 3")
    steps = Reading(np.array([1, 1, 2, 2.0]), "m", shares=np.array([0, 0.5, 0.5, 1]))
    assert distance(np.array([1, 2.0]), steps) == 0 and distance(np.array([2, 2.0]), steps) == 0.5 == distance(np.array([1, 1.0]), steps)
    near(distance(np.array([1, 2.0]), Reading(np.array([1, 2.0]), "m", shares=np.array([0.25, 1]))), 0.5, 1e-15, "a step, and a slope beneath a step")
    found = np.array([distance(draw.random(400)) for _ in range(4000)]) * math.sqrt(400)
    near(np.mean(found), math.sqrt(math.pi / 2) * math.log(2), 0.03, "mean of sqrt(n) times the distance")
    above = 2 * sum((-1) ** (k - 1) * math.exp(-2 * (k * 1.2) ** 2) for k in range(1, 9))
    near(np.mean(found > 1.2), above, 0.25, "share above 1.2")


def check_standard_error():
    """Over many studies of 8 seeds the spread of the error is what a study says of itself; what pairs have in common falls out."""
    found, said = [], []
    for _ in range(4000):
        common = draw.normal(scale=10, size=(8, 1))
        pair = 5 + common + draw.normal(scale=0.3, size=(8, 1)), common + draw.normal(scale=0.4, size=(8, 1))
        found.append(errors.error(*pair))
        said.append(errors.standard_error(*pair))
    near(np.mean(found), 5, 1e-3, "error of means 5 apart")
    near(np.std(found), 0.5 / math.sqrt(8), 0.04, "its spread over 4000 studies")
    near(math.sqrt(np.mean(np.square(said))), 0.5 / math.sqrt(8), 0.04, "what they say themselves")
    # over time: errors of 3 and 4 at two times, spreads a and b: e = 5/sqrt 2, de = (3 da + 4 db) / (5 sqrt 2)
    said = []
    for _ in range(4000):
        runs = np.array([3.0, 4.0]) + draw.normal(size=(8, 2)) * [0.2, 0.1]
        said.append(errors.standard_error(runs, np.zeros((8, 2))))
    near(math.sqrt(np.mean(np.square(said))), math.hypot(3 * 0.2, 4 * 0.1) / (5 * math.sqrt(2) * math.sqrt(8)), 0.03, "over two times")


def check_front():
    """Two settings whose means over 8 seeds are as good: each beats the other in half of the resamples; one that is clearly worse never does.
    The chance that a resample of n seeds has its mean below that of the other follows the normal law."""
    n = 4000
    spread = np.linspace(-1, 1, n)
    spread = (spread - spread.mean()) / spread.std()
    one, other = draw.permutation(spread), draw.permutation(spread)
    zero, cost = np.zeros((n, 1)), np.ones(n)
    step = 1.0 / math.sqrt(n)  # the standard error of a resampled mean
    runs = [10 + one[:, None], 10 + step + other[:, None], 20 + one[:, None]]
    seeds = [list(range(n))] * 3
    share = errors.share_on_front(seeds, [cost, cost, cost], runs, [zero] * 3, resamples=4000)
    rho = np.corrcoef(one, other)[0, 1]
    chance = 0.5 * (1 + math.erf(1 / math.sqrt(2 * (1 - rho)) / math.sqrt(2)))
    near(share[0], chance, 0.03, "share of resamples in which a setting leads by its standard error")
    near(share[1], 1 - chance, 0.12, "share of the other one")
    assert share[2] == 0 and (share == errors.share_on_front(seeds, [cost, cost, cost], runs, [zero] * 3, resamples=4000)).all()
    # dearer and better: both are on it, always
    share = errors.share_on_front(seeds[:2], [cost, 2 * cost], [10 + one[:, None], 5 + other[:, None]], [zero] * 2, resamples=100)
    assert share.tolist() == [1, 1]


def check_lost_seeds():
    """A point that lost runs draws the same seeds as the others. Here all points are off by what their seed is off and cost the same, so that
    the first, which is better by a hair in every seed, leads in every resample; drawn by position, it would not."""
    off = draw.normal(scale=3, size=(8, 1)) + 50
    zero, one = np.zeros((8, 1)), np.ones(8)
    last = list(range(1, 8))
    share = errors.share_on_front([list(range(8)), list(range(8))], [one, one], [off, off + 0.1], [zero] * 2)
    assert share.tolist() == [1, 0]
    # one that has seeds 1 to 7 alone is compared by those: it changes nothing for the first two, whatever it is itself
    worse = errors.share_on_front([list(range(8)), last, list(range(8))], [one, 2 * one[1:], one], [off, off[1:] + 90, off + 0.1], [zero, zero[1:], zero])
    assert worse.tolist() == [1, 0, 0], worse
    # two points of two seeds each out of three, which cost the same: every one of the 27 draws by hand
    off, there, leads = ({1: 1.0, 2: 5.0}, {2: 4.0, 3: 2.0}), [0, 0], [0, 0]
    for draws in itertools.product((1, 2, 3), repeat=3):
        found = [[own[one] for one in draws if one in own] for own in off]
        means = [sum(one) / len(one) if one else math.inf for one in found]
        for k in range(2):
            there[k] += bool(found[k])
            leads[k] += means[k] == min(means) and bool(found[k])
    share = errors.share_on_front([list(own) for own in off], [one[:2]] * 2, [np.array(list(own.values()))[:, None] for own in off], [zero[:2]] * 2,
                                  resamples=20000)
    for k in range(2):
        near(share[k], leads[k] / there[k], 0.03, f"share of point {k + 1}, which lacks a seed")


check_by_hand()
check_norms()
check_standard_error()
check_norms_of_many()
check_distance()
check_front()
check_lost_seeds()
