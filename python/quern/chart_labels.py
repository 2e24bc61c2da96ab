# SPDX-License-Identifier: MIT
"""Places for labels beside points, so that no two texts overlap and as few points as can be are covered."""
import math

import numpy as np

GAP = 2.0  # points (1/72 inch) that stay free around each text
ANGLES = 24
ROUNDS = 3


def boxes(centres: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """left, bottom, right, top of each."""
    return np.hstack([centres - sizes / 2, centres + sizes / 2])


def hits(some: np.ndarray, others: np.ndarray) -> np.ndarray:
    """How many of the others each box overlaps."""
    low = np.maximum(some[:, None, :2], others[None, :, :2])
    high = np.minimum(some[:, None, 2:], others[None, :, 2:])
    return np.all(low < high, axis=2).sum(axis=1)


def candidates(anchor: np.ndarray, size: np.ndarray, bounds: np.ndarray, clear: float) -> np.ndarray:
    """Centres around a point, nearest first: on ellipses on which the text just clears the point, then further away."""
    angles = np.arange(ANGLES) * 2 * math.pi / ANGLES + math.pi / 4
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    reach = size / 2 + clear
    touch = np.min(reach / np.maximum(np.abs(around), 1e-9), axis=1)  # to the edge of the box in that direction
    most = float(np.hypot(*(bounds[2:] - bounds[:2])))
    found = np.concatenate([anchor + around * (touch + more)[:, None] for more in np.append(0.0, np.geomspace(4, most, 30))])
    half = size / 2
    inside = np.all((found - half >= bounds[:2]) & (found + half <= bounds[2:]), axis=1)
    return found[inside]


def crosses(start: np.ndarray, ends: np.ndarray, others: np.ndarray) -> np.ndarray:
    """How many of the boxes each leader from a point to its text goes through, looked at in nine places."""
    if not len(others):
        return np.zeros(len(ends))
    steps = np.linspace(0.1, 0.9, 9)
    places = start + (ends - start)[:, None, :] * steps[None, :, None]
    inside = (places[:, :, None, 0] > others[:, 0]) & (places[:, :, None, 0] < others[:, 2]) \
        & (places[:, :, None, 1] > others[:, 1]) & (places[:, :, None, 1] < others[:, 3])
    return inside.any(axis=1).sum(axis=1)


def best(anchor: np.ndarray, size: np.ndarray, placed: np.ndarray, points: np.ndarray, bounds: np.ndarray, clear: float) -> np.ndarray:
    """The cheapest place: text on text counts most, then text on points, leaders through texts, distance."""
    options = candidates(anchor, size, bounds, clear)
    if not len(options):
        return np.clip(anchor + size, bounds[:2] + size / 2, bounds[2:] - size / 2)
    found = boxes(options, size)
    costs = np.hypot(*(options - anchor).T) + 20 * crosses(anchor, options, placed) + 1e4 * hits(found, placed) + 60 * hits(found, points)
    return options[int(np.argmin(costs))]


def place(anchors: np.ndarray, sizes: np.ndarray, points: np.ndarray, bounds: np.ndarray, clear: float = 5.0) -> np.ndarray:
    """Centres of texts of these sizes, one for each anchor; `points` are boxes that texts should not cover, `bounds` a box that they
    stay in; all in points. Each in turn takes its best place, the most crowded first, then again with all others in theirs."""
    sizes = sizes + GAP
    distance = np.hypot(*(anchors[:, None] - anchors[None]).transpose(2, 0, 1))
    order = np.argsort(np.sort(distance, axis=1)[:, 1:4].sum(axis=1), kind="stable")
    centres, there = anchors.astype(float).copy(), np.zeros(len(anchors), bool)
    for _ in range(ROUNDS):
        for k in order:
            there[k] = False
            centres[k] = best(anchors[k], sizes[k], boxes(centres[there], sizes[there]), points, bounds, clear)
            there[k] = True
    return centres
