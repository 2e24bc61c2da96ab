# SPDX-License-Identifier: MIT
"""What leaves and what is poured, in whole runs: a hybrid's books close over both, and the bits are the same for any number of
threads, any batch, and across Ctrl-C."""
import pathlib

import bits
import lab

# a small column that runs out over an open face, while a source pours grains onto it
HYBRID = [*lab.SMALL["column"], *lab.sets(
    domain__upper="[0.052, 0.32]", domain__open="[upper_x]", time__end="100 ms", observe="[ledger, outflow, mass]",
    grains__fill__0__region__box="{lower: [0, -0.7 mm], upper: [0.052, -0.7 mm]}",
    hybrid__oracle="[{packing_fraction: {depth: 4.1 mm, half_width: 4 mm}}]", continuum__fill=[],
    grains__source="[{region: {box: {lower: [0.01, 0.06], upper: [0.03, 0.08]}}, rate: 8, velocity: [0, -0.5]}]")]
CONTINUUM = [*lab.SMALL["column"], *lab.sets(
    model="continuum", domain__upper="[0.052, 0.32]", domain__open="[upper_x]", time__end="100 ms", output__fields="[point.velocity]",
    observe="[outflow, mass]", continuum__fill="{region: {box: {lower: [0, 0], upper: [0.04, 0.044]}}}",
    continuum__source="{region: {box: {lower: [0.012, 0.06], upper: [0.028, 0.08]}}, rate: 8, velocity: [0, -0.5]}")]
HOPPER = lab.sets(
    time__end="160 ms", output__every="10 ms", grains__contact__linear__stiffness="1e5 N/m", grains__settle__energy=1e-3,
    grains__fill__region__box="{lower: [0.02, 0.051], upper: [0.1, 0.08]}", grains__overlap__most=0,
    grains__source="[{region: {box: {lower: [0.02, 0.2], upper: [0.1, 0.25]}}, rate: 40, from: 5 ms}]")


def same(name, options, folder):
    base = folder / "base"
    lab.run(name, base, *options)
    lab.same_ways(name, base, folder, *options, what=f"{name}: ", batches=(16,))
    bits.stopped(name, base, folder, None, options, lab.seeded())
    return base


def books(name, folder):
    s = lab.summary(folder)
    sums = {key: value["value"] for key, value in s["sums"].items()}
    assert abs(s["mass_defect"]) < 1e-12 and abs(s["invariant_defect"]) < 1e-12, s
    assert sums["left"] > 0.01 * s["mass_initial"] and sums["poured"] > 0.01 * s["mass_initial"], sums
    print(f"{name}: {sums['left'] / s['mass_initial']:.3f} of the mass has left, {sums['poured'] / s['mass_initial']:.3f} was poured, "
          f"defects {s['mass_defect']:.1e} and {s['invariant_defect']:.1e}")
    return s


def hybrid(folder):
    s = books("hybrid", same("column", HYBRID, folder))
    out = s["observers"]["outflow"]
    assert out["grains"]["last"] > 0 and out["points"]["last"] > 0, "grains and points leave"
    assert abs(out["mass"]["last"] - s["sums"]["left"]["value"]) < 0.2 * out["mass"]["last"], "entries that left along are few"
    print(f"hybrid: {out['grains']['last']:.4g} kg in grains, {out['points']['last']:.4g} kg in points, "
          f"{s['sums']['left']['value'] - out['mass']['last']:.3g} kg of entries; carried {s['observers']['ledger']['carried']['last']:+.3f}")


def drain(folder):
    """All of it flows out; what left beyond what there was stands in the ledger, and is little."""
    out = folder / "base"
    lab.run("column", out, *HYBRID[:-1], "--set=gravity=[30, -2]", "--set=time.end=400 ms", "--set=output.every=20 ms")
    s = lab.summary(out)
    left, owed = s["sums"]["left"]["value"], s["mass_ledger"]
    assert abs(s["mass_defect"]) < 1e-12 and abs(s["invariant_defect"]) < 1e-12, s
    print(f"drain: {left / s['mass_initial']:.6f} of the mass has left, {s['grains']} grains and {s['points']} points are there, "
          f"{owed / s['mass_initial']:.1e} is owed")
    assert s["mass_final"] == 0 and s["points"] == 0, "something has stayed"
    assert abs(left + owed - s["mass_initial"]) < 1e-12 * s["mass_initial"] and abs(owed) < 0.02 * s["mass_initial"], (left, owed)


def buried(folder):
    """A source that keeps a region full finds no room in a column, be it of grains or of points."""
    lab.run("column", folder / "base", *lab.SMALL["column"], *lab.sets(
        time__end="40 ms", hybrid__oracle="[{packing_fraction: {depth: 5 mm, half_width: 4 mm}}]",
        grains__source="{region: {box: {lower: [0.004, 0.004], upper: [0.036, 0.016]}}, keep: full, every: 1}"))
    s = lab.summary(folder / "base")
    poured = s["sums"]["poured"]["value"] / s["mass_initial"]
    print(f"buried: {poured:.4f} of the mass was poured, {s['points']} points")
    assert poured < 0.03 and s["points"] > 50 and abs(s["mass_defect"]) < 1e-12 and s["invariant_defect"] < 1e-12, s


def continuum(folder):
    books("continuum", same("column", CONTINUUM, folder))


def hopper(folder):
    s = books("hopper", same("hopper", HOPPER, folder))
    assert s["observers"]["outflow"]["rate"]["last"] > 0


if __name__ == "__main__":
    with lab.workplace() as place:
        for test in (hybrid, drain, buried, continuum, hopper):
            folder = pathlib.Path(place) / test.__name__
            folder.mkdir()
            test(folder)
