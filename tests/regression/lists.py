# SPDX-License-Identifier: MIT
"""Lists of near grains are remade when grains have come nearer, not when they have come far, and in time all the same: a gas that drifts
goes the same way to the bit with any skin, and grains that go together keep their list for ever."""
import pathlib

import numpy

import lab

GAS = """
quern: 1
dimension: {dim}
gravity: {gravity}
domain: {{lower: {lower}, upper: {upper}}}
time: {{end: 0.3, step: 1e-4}}
grains:
  material: {{density: 1000, radius: {{mean: 5 mm}}}}
  contact: {{linear: {{stiffness: 1e4, friction: 0.5, restitution: 0.8}}}}
  file: {table}
  skin: {skin}
output: {{every: 0.05, fields: [grain.velocity, grain.spin]}}
"""
RADIUS, DRIFT = 5e-3, 6.0


def table(path, dim, heat, shear):
    """Grains on a lattice, with a drift that grows upwards by `shear` and velocities of random directions besides."""
    draw = numpy.random.default_rng(7)
    sites = numpy.stack(numpy.meshgrid(*[numpy.arange(8 if dim == 3 else 16)] * dim), -1).reshape(-1, dim) * 2.3 * RADIUS
    velocity = heat * draw.standard_normal(sites.shape)
    velocity[:, 0] += DRIFT + shear * sites[:, -1]
    names = " ".join([*"xyz"[:dim], *(f"v{a}" for a in "xyz"[:dim]), "radius"])
    rows = numpy.column_stack([sites, velocity, numpy.full(len(sites), RADIUS)])
    path.write_text("\n".join([names, *(" ".join(f"{x:.17g}" for x in row) for row in rows), ""]))


def run(place, name, dim, skin):
    scene = place / f"{name}_{skin}.yaml"
    scene.write_text(GAS.format(dim=dim, gravity=[0] * dim, lower=[-2.0] * dim, upper=[6.0] * dim, skin=skin, table=place / f"{name}.txt"))
    lab.run(scene, place / f"{name}_{skin}")
    return place / f"{name}_{skin}"


def grains(frame):
    names = ("id", "position", "velocity", "spin")
    found = lab.contents(frame)
    order = found["grains/id"].argsort()
    return {name: found[f"grains/{name}"][order] for name in names}


def same_with_any_skin(place, dim):
    table(place / f"gas{dim}.txt", dim, heat=0.4, shear=20)
    first, *others = [run(place, f"gas{dim}", dim, skin) for skin in (0.5, 0.1, 0.02)]
    met = 0
    for other in others:
        for one, two in zip(lab.frames(first), lab.frames(other), strict=True):
            a, b = grains(one), grains(two)
            for name in a:
                assert numpy.array_equal(a[name], b[name]), f"{dim}-D, {other.name}, {one.name}: {name}"
            met += numpy.count_nonzero(a["spin"])
    assert met > 1000, f"{dim}-D: {met} spins: the gas hardly meets itself"
    print(f"{dim}-D: the same with three skins")


def kept_by_a_drift(place):
    table(place / "drift.txt", 2, heat=0, shear=0)
    used = lab.contents(run(place, "drift", 2, 0.1) / "checkpoint.h5")["total/displacement.0"]
    way = DRIFT * 0.3
    assert used < 1e-9 * way, f"grains that went {way} m together have used up {used} m"
    print(f"{way} m together use up {float(used[0]):.3g} m of the skin")


def round_and_round(place):
    """Grains that drift together through a periodic domain are brought back before anybody sees them outside."""
    (place / "round.txt").write_text("x y vx vy radius\n0.1 0.5 1 0 0.005\n0.5 0.5 1 0 0.005\n")
    scene = place / "round.yaml"
    scene.write_text(GAS.format(dim=2, gravity=[0, 0], lower=[0, 0], upper=[1, 1], skin=0.1, table=place / "round.txt")
                     .replace("[1, 1]}", "[1, 1], periodic: [true, true]}").replace("end: 0.3, step: 1e-4", "end: 4, step: 1e-3")
                     .replace("every: 0.05", "every: 0.5") + "observe: [{packing_fraction: {region: {box: {lower: [0, 0], upper: [1, 1]}}}}]\n")
    lab.run(scene, place / "round")
    farthest = max(abs(grains(frame)["position"] - 0.5).max() for frame in lab.frames(place / "round"))
    assert farthest < 0.5 + 4 * 0.1 * 2 * RADIUS, farthest
    header, rows = lab.series(place / "round")
    fraction = [row[next(k for k, name in enumerate(header) if name.startswith("packing_fraction"))] for row in rows]
    assert max(fraction) - min(fraction) < 1e-12 and fraction[0] > 1e-4, fraction
    print("four times round a periodic domain, and never far out of it")


with lab.workplace() as folder:
    kept_by_a_drift(pathlib.Path(folder))
    round_and_round(pathlib.Path(folder))
    for dim in (2, 3):
        same_with_any_skin(pathlib.Path(folder), dim)
