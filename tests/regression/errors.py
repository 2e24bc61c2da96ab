# SPDX-License-Identifier: MIT
"""Errors of a study against closed forms: normal numbers whose means, standard errors and shares on the front are known."""
import math
import os
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(os.environ["QUERN_SOURCE"]) / "python"))
from quern import errors  # noqa: E402

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
    share = errors.share_on_front([cost, cost, cost], runs, [zero] * 3, resamples=4000)
    rho = np.corrcoef(one, other)[0, 1]
    chance = 0.5 * (1 + math.erf(1 / math.sqrt(2 * (1 - rho)) / math.sqrt(2)))
    near(share[0], chance, 0.03, "share of resamples in which a setting leads by its standard error")
    near(share[1], 1 - chance, 0.12, "share of the other one")
    assert share[2] == 0 and (share == errors.share_on_front([cost, cost, cost], runs, [zero] * 3, resamples=4000)).all()
    # dearer and better: both are on it, always
    share = errors.share_on_front([cost, 2 * cost], [10 + one[:, None], 5 + other[:, None]], [zero] * 2, resamples=100)
    assert share.tolist() == [1, 1]


check_by_hand()
check_standard_error()
check_front()
