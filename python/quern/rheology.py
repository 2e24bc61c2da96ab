# SPDX-License-Identifier: MIT
"""What beds and chutes of grains tell of the continuum that stands for them: packing density, mu(I), slip, stiffness.

A chute here is a layer on a floor along x, with gravity turned by an angle; up is the last axis. Every row of it, one diameter high, is in
balance: what lies above pulls with the shear stress tau and presses with p, so that mu = tau/p is known from the angle without a contact
being looked at. docs/calibration.md has the formulas."""
import math
from dataclasses import dataclass

import numpy as np

from .runs import Frame, Run

FLOOR_ROWS, TOP_ROWS = 5, 4  # of a layer, that feel its floor or its surface
FITTED = 5  # rows over which the slope of the profile is taken
AT_REST = 1e-3  # inertial number below which a layer creeps at most
HASTE = 0.02  # acceleration over that of gravity across the layer: beyond it a flow is not steady
STEEPEST = 5.0  # I_0 beyond which the law is a straight line within any range that is measured
POISSON = 0.3  # of material.mu_i


@dataclass(frozen=True)
class Grains:
    """What the definition of I and the units of all results take: mean diameter, density of a grain, size of gravity."""
    diameter: float
    density: float
    gravity: float


@dataclass(frozen=True)
class Rows:
    """A chute over the last part of its run; an entry for each row from the floor up. `bulk` marks those that feel neither end."""
    angle: float  # radians
    y: np.ndarray
    density: np.ndarray
    velocity: np.ndarray
    pressure: np.ndarray
    friction: np.ndarray
    inertia: np.ndarray
    bulk: np.ndarray
    haste: float  # mean acceleration over g cos(angle)

    @property
    def word(self) -> str:
        if abs(self.haste) > HASTE:
            return "fast" if self.haste > 0 else "slows"
        return "steady" if np.median(self.inertia[self.bulk]) > AT_REST else "rests"


@dataclass(frozen=True)
class Shear:
    """Of a periodic box that shears under a pressure, means over the strain that is measured."""
    inertia: float
    friction: float
    density: float


@dataclass(frozen=True)
class Law:
    """mu_s + (mu_2 - mu_s)/(1 + I_0/I)."""
    mu_s: float
    mu_2: float
    i_0: float

    def __call__(self, inertia):
        return self.mu_s + (self.mu_2 - self.mu_s) * inertia / (inertia + self.i_0)


@dataclass(frozen=True)
class Looseness:
    """Density of flow with no stress on it, density (1 - dilation I)."""
    density: float
    dilation: float


@dataclass(frozen=True)
class Slip:
    """At the floor, of the bulk's profile, moved so that the layer is as fast as a whole."""
    velocity: float  # m/s
    rate: float  # 1/s
    length: float  # m


@dataclass(frozen=True)
class Slide:
    """A layer on a smooth plane that leans: friction between both from what the layer gains, and how fast its lowest row was at the end."""
    friction: float
    speed: float  # m/s
    slides: bool


@dataclass(frozen=True)
class Bed:
    """Of settled grains: density of the rows in the bulk, as they lie and with no stress on them; constrained moduli, loaded and relieved
    again."""
    settled: float
    density: float
    loaded: float
    unloaded: float
    bulk_modulus: float
    displacement: float  # m, as that of a chute


def slope(y: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Of a line through each row and its neighbours, as many on either side as there are up to FITTED rows."""
    half, n = FITTED // 2, len(y)
    parts = [slice(max(0, k - half), min(n, k + half + 1)) for k in range(n)]
    return np.array([np.polyfit(y[part], u[part], 1)[0] if len(y[part]) > 1 else math.nan for part in parts])


def bulk_rows(y: np.ndarray, density: np.ndarray, diameter: float) -> np.ndarray:
    """Rows that are farther than FLOOR_ROWS diameters from the floor and TOP_ROWS from the surface, which is where the mass would end
    were all of it as dense as its middle."""
    high = y[1] - y[0]
    dense = np.median(density[density > 0.5 * density.max()])
    surface = density.sum() * high / dense
    return (y > FLOOR_ROWS * diameter) & (y < surface - TOP_ROWS * diameter)


def rows_of(angle: float, y: np.ndarray, times: np.ndarray, density: np.ndarray, velocity: np.ndarray, grains: Grains) -> Rows:
    """Of density and velocity, a row of the arrays for each time. What a row's mean velocity gains in time is not borne by friction."""
    high, mean = y[1] - y[0], density.mean(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        u = np.where(mean > 0, (density * velocity).mean(axis=0) / mean, 0)
    gain = np.polyfit(times, velocity, 1)[0] if len(times) > 1 else np.zeros_like(u)

    def above(force: np.ndarray) -> np.ndarray:
        return high * (np.cumsum(force[::-1])[::-1] - force / 2)
    there = mean > 0.5 * np.median(mean[mean > 0.5 * mean.max()])
    gain = np.where(there, gain, 0)
    across = grains.gravity * math.cos(angle)
    pressure = above(mean * across)
    shear = above(mean * (grains.gravity * math.sin(angle) - gain))
    rate = np.full_like(u, math.nan)
    rate[there] = slope(y[there], u[there])
    with np.errstate(invalid="ignore", divide="ignore"):
        inertia = rate * grains.diameter * np.sqrt(grains.density / pressure)
        friction = shear / pressure
    haste = float((mean * gain)[there].sum() / (mean[there].sum() * across))
    return Rows(angle, y, mean, u, pressure, friction, inertia, there & bulk_rows(y, mean, grains.diameter), haste)


def displacement_of(one: Rows, bulk_modulus: float) -> float:
    """What the rows below the bulk lack of its mean density, both without what pressure compresses, over that density: how far above the floor a
    layer would begin that were as dense all the way down."""
    free = one.density * np.exp(-one.pressure / bulk_modulus)
    return float((one.y[1] - one.y[0]) * (1 - free[:np.flatnonzero(one.bulk)[0]] / free[one.bulk].mean()).sum())


def profiles(run: Run) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of the observer `profile` of a run, one row a diameter: heights of the rows, times, and at each time densities and velocities along x."""
    series, axis = run.series, run.scene["dimension"] - 1
    keys, = [item["profile"] for item in run.scene["observe"] if "profile" in item]
    box, n = keys["region"]["box"], keys["bins"]
    y = box["lower"][axis] + (np.arange(n) + 0.5) * (box["upper"][axis] - box["lower"][axis]) / n
    density, velocity = (np.array([series[f"profile.{name}_{k}"] for k in range(n)]).T for name in ("density", "x"))
    return y, series["time"], density, velocity


def chute(run: Run, angle: float, last: float, grains: Grains) -> Rows:
    """Over the last part of its time."""
    y, times, density, velocity = profiles(run)
    late = times > (1 - last) * times[-1]
    return rows_of(angle, y, times[late], density[late], velocity[late], grains)


def slide(run: Run, angle: float, grains: Grains) -> Slide:
    """While it moves, however it moves within: all of it is in balance with the plane. Where the lowest row hardly moves, the plane holds and
    the layer flows on it, which is friction of the grains among each other."""
    _, times, density, velocity = profiles(run)
    mean = (density * velocity).sum(axis=1) / density.sum(axis=1)
    late = np.flatnonzero(mean > math.sqrt(grains.gravity * grains.diameter) / 3)
    late = late[late >= len(times) // 5]
    if len(late) < 5 or mean[-1] < mean[late[0]]:
        return Slide(math.nan, float(velocity[-1, 0]), False)
    gain = float(np.polyfit(times[late], mean[late], 1)[0])
    holds = float(velocity[late, 0].mean()) < 0.5 * float(mean[late].mean())
    return Slide(max(0.0, math.tan(angle) - gain / (grains.gravity * math.cos(angle))), float(velocity[-1, 0]), not holds)


def fit_law(inertia: np.ndarray, friction: np.ndarray) -> Law:
    """Least squares in mu. For a given I_0 the law is a straight line over I/(I + I_0), so that only I_0 is searched for: on a grid of its
    logarithm, made finer around the best. mu_2 is not below mu_s."""
    def line(log_i0: float) -> tuple[float, Law]:
        i_0 = math.exp(log_i0)
        x = inertia / (inertia + i_0)
        rise = max(0.0, float(np.cov(x, friction, bias=True)[0, 1] / np.var(x)))
        mu_s = max(0.0, float(friction.mean() - rise * x.mean()))
        law = Law(mu_s, mu_s + rise, i_0)
        return float(np.mean((law(inertia) - friction) ** 2)), law
    low, high = math.log(1e-3), math.log(STEEPEST)
    for _ in range(6):
        grid = np.linspace(low, high, 41)
        best = min(range(len(grid)), key=lambda k: line(grid[k])[0])
        low, high = grid[max(0, best - 1)], grid[min(len(grid) - 1, best + 1)]
    return line((low + high) / 2)[1]


def sheared(run: Run, rate: float, first: float, grains: Grains) -> Shear:
    """From this share of its time on, which its strain grows with. Friction is the ratio of mean stresses, and I that of the normal stress that there was:
    both are noise from contact to contact."""
    series = run.series
    late = series["time"] > first * series["time"][-1]

    def borne(axes: str) -> float:
        return abs(float((series[f"stress.{axes}"] + series[f"stress.kinetic_{axes}"])[late].mean()))
    pressure = borne("yy")
    return Shear(rate * grains.diameter * math.sqrt(grains.density / pressure), borne("xy") / pressure, float(grains.density * series["box.packing"][late].mean()))


def law_of(chutes: list[Rows]) -> Law:
    """Of some chutes, each a point: the mean of its rows. Friction is the same in all of them and I is what scatters, so that a fit over
    rows would take its scatter for a gentler slope."""
    return fit_law(*(np.array([getattr(one, name)[one.bulk].mean() for one in chutes]) for name in ("inertia", "friction")))


def looseness_of(chutes: list[Rows], bulk_modulus: float) -> Looseness:
    """A straight line through all chutes, the mean of the bulk's I and stress-free density each."""
    inertia = np.array([one.inertia[one.bulk].mean() for one in chutes])
    free = np.array([(one.density * np.exp(-one.pressure / bulk_modulus))[one.bulk].mean() for one in chutes])
    fall, density = np.polyfit(inertia, free, 1)
    return Looseness(float(density), float(-fall / density))


def slip_of(one: Rows) -> Slip:
    """Bagnold's profile through the rows of the bulk, u = u_f + A (H^(3/2) - (H - y)^(3/2)), that is constant I; shear rate at the floor
    3/2 A H^(1/2). H is where the pressure ends. u_f is what makes the layer flow as fast as it does on the whole: the lowest rows are slower than
    the bulk's profile, continued to the floor, would have them."""
    k = int(np.flatnonzero(one.bulk)[0])
    height = one.y[k] + one.pressure[k] / ((one.pressure[0] - one.pressure[k]) / (one.y[k] - one.y[0]))
    shape = height ** 1.5 - np.clip(height - one.y, 0, None) ** 1.5
    rise, _ = np.polyfit(shape[one.bulk], one.velocity[one.bulk], 1)
    mass = np.where(one.y < height, one.density, 0)
    velocity, rate = mass @ (one.velocity - rise * shape) / mass.sum(), 1.5 * rise * math.sqrt(height)
    return Slip(float(velocity), float(rate), float(velocity / rate))


def modulus(y: np.ndarray, shift: np.ndarray, height: float, load: float) -> float:
    """Constrained modulus M of a layer of this height whose weight per volume grew by `load`: the place y sinks by load/M (H y - y^2/2)."""
    shape = height * y - y ** 2 / 2
    return float(-load * (shape @ shape) / (shape @ shift))


def bulk_over_constrained(dimension: int, poisson: float = POISSON) -> float:
    """K/M of an isotropic solid with material.mu_i's Poisson's ratio: in 2-D M = K + G, in 3-D K + 4/3 G."""
    shear = (1 - poisson) / (1 + poisson) if dimension == 2 else 1.5 * (1 - 2 * poisson) / (1 + poisson)
    return 1 / (1 + (1 if dimension == 2 else 4 / 3) * shear)


def heights(frame: Frame, axis: int) -> np.ndarray:
    """Of all grains, in the order of their numbers."""
    return frame["grain.position"][np.argsort(frame["grain.id"]), axis]


def bed(run: Run, heavier: float, grains: Grains) -> Bed:
    """Of a run whose last three outputs are settled grains, the same under `heavier` times gravity, and the same back under their own."""
    y, _, density, velocity = profiles(run)
    settled = rows_of(0.0, y, np.zeros(1), density[-3:-2], 0 * velocity[-3:-2], grains)
    dense, dimension = float(np.median(settled.density[settled.bulk])), run.scene["dimension"]
    height = settled.density.sum() * (y[1] - y[0]) / dense
    rest, pressed, relieved = (heights(frame, dimension - 1) for frame in run.frames[-3:])
    inside = (rest > FLOOR_ROWS * grains.diameter) & (rest < height - TOP_ROWS * grains.diameter)
    load = (heavier - 1) * dense * grains.gravity
    loaded, unloaded = (modulus(rest[inside], way[inside], height, more) for way, more in ((pressed - rest, load), (relieved - pressed, -load)))
    bulk = loaded * bulk_over_constrained(dimension)
    free = settled.density[settled.bulk] * np.exp(-settled.pressure[settled.bulk] / bulk)
    return Bed(float(settled.density[settled.bulk].mean()), float(free.mean()), loaded, unloaded, bulk, displacement_of(settled, bulk))
