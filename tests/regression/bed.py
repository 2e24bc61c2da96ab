# SPDX-License-Identifier: MIT
"""A bed at rest stays where it is, with 10 and with 30 substeps, half shares and a ramp: its centre of mass does not sink, grains and
points do not move, its mass is all there, the floor bears its weight and every row of cells what lies above it. `bed.py RUN...` says the same of runs of configs/bed.yaml that
are there; docs/validation/bed.md."""
import pathlib
import sys

import h5py
import lab
import numpy

NARROW = ["--set=domain.upper=[40 mm, 120 mm]", "--set=grains.fill.0.region.box.upper=[40 mm, -0.7 mm]",
          "--set=grains.fill.1.region.box.upper=[40 mm, 73 mm]", "--set=continuum.fill.region.box.upper=[40 mm, 72 mm]",
          "--set=time.end=0.6 s", "--set=output={every: 20 ms, fields: [contact.force, grain.weight, point.weight, point.stress, point.volume, point.mass]}"]
RAMP = ["--set=hybrid.weights=ramp", "--set=hybrid.oracle.0.packing_fraction.half_width=8 mm"]
DIAMETER = 2e-3


def slope(x, y):
    """Of the line by least squares."""
    a, b = sum(x) / len(x), sum(y) / len(y)
    return sum((u - a) * (v - b) for u, v in zip(x, y)) / sum((u - a) ** 2 for u in x)


def look(out, what):
    """How far the centre of mass has sunk, in diameters, as the first zones were made and from then on, to the last tenth of the outputs: means
    over a tenth each, since the bed swings as a whole; the kinetic energy of a grain over mgD in the second half; the most that carried mass
    is off; the share of the weight on the floor. Prints also how fast it sinks in the second half, in diameters a grain step."""
    header, lines = lab.series(out)
    first, *rows = [dict(zip((name.split(" ")[0] for name in header), line)) for line in lines]
    summary = lab.summary(out)
    weight = 9.81 * summary["mass_initial"]
    tenth, half = max(len(rows) // 10, 1), rows[len(rows) // 2:]
    place = [row["energy.potential"] / (weight * (1 + row["ledger.carried"]) * DIAMETER) for row in rows]
    early, late = sum(place[:tenth]) / tenth, sum(place[-tenth:]) / tenth
    made = first["energy.potential"] / (weight * DIAMETER) - early
    steps = summary["substeps"] / summary["time_end"]
    rate = -slope([row["time"] * steps for row in half], place[len(rows) // 2:])
    kinetic = [sum(row[f"energy.{name}"] for row in some) / len(some) / (weight * DIAMETER) for name in ("grains", "points")
               for some in (half, rows[-tenth:])]
    share, carried = ([row[name] for row in rows] for name in ("discrete_share.share", "ledger.carried"))
    floor = -sum(row["wall_force.y"] for row in rows) / len(rows) / weight
    print(f"{what}: {summary['substeps']} grain steps; sinks by {made:+.4f} D as zones are made and {early - late:+.4f} D later, in the "
          f"second half by {rate:+.1e} D a step; kinetic energy over mgD {kinetic[0] + kinetic[2]:.1e} in the second half, "
          f"{kinetic[1] + kinetic[3]:.1e} at last; "
          f"share of grains from {min(share):.4f} to {max(share):.4f}; carried mass off by {max(map(abs, carried)):.1e}; "
          f"on the floor {floor:.4f} of the weight", flush=True)
    return made, early - late, kinetic[1] + kinetic[3], max(map(abs, carried)), floor


def rows(frame, cell=4e-3):
    """Of the rows of cells below the top three: what grains and points bear in their shares, over the weight above, halfway up the row."""
    with h5py.File(frame) as file:
        grains, points, contacts = ({key: value[:] for key, value in file[name].items()} for name in ("grains", "points", "contacts"))
    height = numpy.where(grains["fixed"] == 0, grains["position"][:, 1], numpy.nan)
    mass = numpy.pi * grains["radius"] ** 2 * 2500 * grains["weight"]
    first, second = contacts["first"], contacts["second"]
    branch = grains["position"][first] - grains["position"][second]
    low = numpy.minimum(grains["position"][first, 1], grains["position"][second, 1])
    share = numpy.minimum(grains["weight"][first], grains["weight"][second])
    pressed = share * contacts["force"][:, 1] * branch[:, 1]  # N m; of a contact, positive where it presses
    length = numpy.abs(branch[:, 1])
    out = []
    for row in range(int(numpy.nanmax(height) / cell) - 2):
        begin, end = row * cell, (row + 1) * cell
        part = numpy.clip(numpy.minimum(low + length, end) - numpy.maximum(low, begin), 0, None) / numpy.where(length > 0, length, 1)
        here = (points["position"][:, 1] >= begin) & (points["position"][:, 1] < end)
        borne = (pressed * part).sum() - (points["weight"] * points["volume"] * points["stress"][:, 1])[here].sum()
        weigh = points["weight"] * points["mass"]
        above = sum((m * numpy.clip((numpy.nan_to_num(y, nan=-1) - begin) / cell, 0, 1)).sum()
                    for m, y in ((mass, height), (weigh, points["position"][:, 1])))
        out.append(borne / (9.81 * above * cell))
    return out


def mean_rows(out):
    """The mean over the last quarter of the frames: the bed still swings a little from the making of zones."""
    frames = lab.frames(out)
    mean = numpy.mean([rows(frame) for frame in frames[-(len(frames) // 4):]], 0)
    print("    rows bear " + ", ".join(f"{row:.3f}" for row in mean))
    return mean


if __name__ == "__main__":
    if len(sys.argv) > 1:
        for out in map(pathlib.Path, sys.argv[1:]):
            look(out, out.name)
            with h5py.File(lab.frames(out)[-1]) as file:
                split = "points" in file and "contacts" in file
            if split:
                mean_rows(out)
        sys.exit()
    with lab.workplace() as name:
        for substeps in (10, 30):
            for shares, options in (("half", []), ("ramp", RAMP)):
                out = pathlib.Path(name) / f"{shares}_{substeps}"
                lab.run("bed", out, *NARROW, f"--set=hybrid.substeps={substeps}", *options)
                # docs/validation/bed.md has what is left after a million steps
                made, sunk, kinetic, carried, floor = look(out, f"{shares}, n = {substeps}")
                borne = mean_rows(out)
                assert abs(made) < 0.05 and abs(sunk) < 0.01 and kinetic < 1e-4 and carried < 2e-3 and abs(floor - 1) < 0.01
                # two rows lie at the zone's upper edge, where grains also get impulses of the exchange, which are in neither stress
                assert all(abs(row - 1) < 0.01 for row in borne[:-2]) and all(abs(row - 1) < 0.15 for row in borne[-2:]), borne
