# SPDX-License-Identifier: MIT
"""A bed at rest stays where it is, with 10 and with 30 substeps, half shares and a ramp: its centre of mass does not sink, grains and points
do not move, its mass is all there and no cell changes zone. `bed.py RUN...` says the same of runs of configs/bed.yaml that are there; docs/validation/bed.md."""
import pathlib
import sys

import lab

NARROW = ["--set=domain.upper=[40 mm, 120 mm]", "--set=grains.fill.0.region.box.upper=[40 mm, -0.7 mm]",
          "--set=grains.fill.1.region.box.upper=[40 mm, 73 mm]", "--set=continuum.fill.region.box.upper=[40 mm, 72 mm]",
          "--set=time.end=0.6 s", "--set=output={every: 20 ms, fields: []}"]
RAMP = ["--set=hybrid.weights=ramp", "--set=hybrid.oracle.0.packing_fraction.half_width=8 mm"]
DIAMETER = 2e-3


def slope(x, y):
    """Of the line by least squares."""
    a, b = sum(x) / len(x), sum(y) / len(y)
    return sum((u - a) * (v - b) for u, v in zip(x, y)) / sum((u - a) ** 2 for u in x)


def look(out, what):
    """How far the centre of mass has sunk, in diameters, between the first and the last tenth of the outputs, each a mean since the bed swings as a
    whole; how fast in the second half, in diameters a grain step; the kinetic energy of a grain over mgD in the second half; the changes of the share of grains."""
    header, lines = lab.series(out)
    rows = [dict(zip((name.split(" ")[0] for name in header), line)) for line in lines][1:]
    summary = lab.summary(out)
    lift = 9.81 * summary["mass_initial"] * DIAMETER     # J, of all by a diameter
    tenth, half = max(len(rows) // 10, 1), rows[len(rows) // 2:]
    place = [row["energy.potential"] / lift for row in rows]
    sunk = (sum(place[:tenth]) - sum(place[-tenth:])) / tenth
    steps = summary["substeps"] / summary["time_end"]
    rate = -slope([row["time"] * steps for row in half], place[len(rows) // 2:])
    kinetic = [sum(row[f"energy.{name}"] for row in half) / len(half) / lift for name in ("grains", "points")]
    share = [row["discrete_share.share"] for row in rows]
    carried = [row["ledger.carried"] for row in rows] if "ledger.carried" in rows[0] else [0]
    top = [row["top.height"] / DIAMETER for row in rows]
    print(f"{what}: {summary['substeps']} grain steps; sinks by {sunk:+.4f} D, its top by {(sum(top[:tenth]) - sum(top[-tenth:])) / tenth:+.4f} D, at last by "
          f"{rate:+.1e} D a step; kinetic energy over mgD {kinetic[0]:.1e} of grains and {kinetic[1]:.1e} of points; share of grains from {min(share):.4f} to "
          f"{max(share):.4f}; carried mass less one up to {max(map(abs, carried)):.1e}", flush=True)
    return sunk, sum(kinetic), max(map(abs, carried))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        for out in sys.argv[1:]:
            look(pathlib.Path(out), out)
        sys.exit()
    with lab.workplace() as name:
        for substeps in (10, 30):
            for shares, options in (("half", []), ("ramp", RAMP)):
                out = pathlib.Path(name) / f"{shares}_{substeps}"
                lab.run("bed", out, *NARROW, f"--set=hybrid.substeps={substeps}", *options)
                sunk, kinetic, carried = look(out, f"{shares}, n = {substeps}")
                assert abs(sunk) < 0.05 and kinetic < 3e-4 and carried < 2e-3
