# SPDX-License-Identifier: MIT
"""One plugin for another, by one option: same program, the named object mapped and the replaced one not, other results
(but for the search for neighbours, which must not matter), closed books."""
import hashlib
import pathlib

import numpy

import lab

DEEP = "depth: 8 mm, half_width: 4 mm"
# slot: options, the plugin they name, the one they replace (None: another slot keeps it)
CHANGES = [
    # grains as soft as that lie one in another, denser than solid
    ("contact law", ["grains.contact={hertz: {young: 1e7 Pa, friction: 0.4}}", "hybrid.most_density=0"], "contact.hertz",
     "contact.linear"),
    ("a contact law that yields", ["grains.contact={plastic: {stiffness: 1e6 N/m, friction: 0.4}}"], "contact.plastic", "contact.linear"),
    ("contact laws of wet grains", ["grains.contact=[{linear: {stiffness: 1e6 N/m}}, {cohesive: {surface_tension: 0.07 N/m}}]"],
     "contact.cohesive", None),
    ("contact law's friction", ["grains.contact.linear.friction=0"], "contact.linear", None),
    ("material", ["continuum.material=drucker_prager"], "material.drucker_prager", "material.mu_i"),
    ("transfer", ["continuum.transfer=mixed"], "transfer.mixed", None),
    ("transfer, of grains too", ["continuum.transfer=mixed", "hybrid.transfer=mixed"], "transfer.mixed",
     "transfer.picflip"),
    ("oracle", ["hybrid.oracle=[{strain_rate: {shear_rate: 5, %s}}]" % DEEP], "oracle.strain_rate",
     "oracle.packing_fraction"),
    ("oracle, of the top alone", ["hybrid.oracle=[{layered: {%s}}]" % DEEP], "oracle.layered", "oracle.packing_fraction"),
    ("packer", ["hybrid.packer=random"], "packer.random", None),
    ("packer, by a grid", ["hybrid.packer=grid"], "packer.grid", None),
    ("packer, by circles", ["hybrid.packer=circle_sweep"], "packer.circle_sweep", None),
    ("packer, of grains that grow", ["hybrid.packer=expand", "grains.fill.1.packer=expand"], "packer.expand", None),
    ("packer, of the first grains too", ["hybrid.packer=random", "grains.fill.0.packer=random",
                                         "grains.fill.1.packer=random"], "packer.random", "packer.two_point_tangent"),
    ("coupling", ["hybrid.coupling=lumped"], "coupling.lumped", "coupling.affine"),
    ("shape", ["continuum.shape=linear"], "shape.linear", "shape.gimp"),
    ("shape, of B-splines", ["continuum.shape=bspline"], "shape.bspline", "shape.gimp"),
    ("strain", ["continuum.strain=averaged"], "strain.averaged", "strain.plain"),
    # a force that acts in two steps has no place in the hybrid's books
    ("integrator, of grains alone", ["model=grains", "grains.integrator=velocity_verlet"], "integrator.velocity_verlet",
     "integrator.position_verlet"),
    ("integrator", ["grains.integrator=symplectic_euler"], "integrator.symplectic_euler", "integrator.position_verlet"),
    ("neighbours, of grains alone", ["model=grains", "grains.neighbours=all_pairs"], "neighbours.all_pairs",
     "neighbours.cells"),
    ("a hierarchical grid as neighbours, of grains alone", ["model=grains", "grains.neighbours=hgrid"], "neighbours.hgrid",
     "neighbours.cells"),
    ("neighbours", ["grains.neighbours=all_pairs"], "neighbours.all_pairs", "neighbours.cells")]
if (lab.PLUGINS / "coupling.exact.so").exists():
    CHANGES.append(("coupling of all at once", ["hybrid.coupling=exact"], "coupling.exact", "coupling.affine"))


def hashes():
    files = [pathlib.Path(lab.QUERN), *sorted(lab.PLUGINS.glob("*.so"))]
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def books(folder):
    s = lab.summary(folder)
    return max(abs(s["mass_defect"]), abs(s["invariant_defect"]))


def run(folder, options):
    """A run to its end; the plugins that were mapped while it ran."""
    # no hysteresis: cells turn back into grains at once, and the packer has work
    more = [] if "model=grains" in options else ["hybrid.hysteresis=0", "hybrid.update=100"]
    options = [*more, *options]
    options = [*lab.SMALL["column"], "--set=time.end=30 ms",
               "--set=output.fields=[grain.velocity, point.velocity, point.stress]", *(f"--set={option}" for option in options)]
    process = lab.start("column", folder, *options)
    assert lab.wait_for(folder / "log.txt", process), f"{options}: exit status {process.wait()}"
    found = lab.mapped(process)
    assert process.wait(timeout=600) == 0, f"{options}: exit status {process.returncode}"
    return found


def by_id(path, field):
    grains = {name: value for name, value in lab.contents(path).items() if name.startswith("grains/")}
    return grains[f"grains/{field}"][numpy.argsort(grains["grains/id"])]


def compare_neighbours(base, out):
    """The search decides in which order grains are stored, and nothing else; grains alone sum in the order of ids, while
    the nodes of the hybrid sum in that of storage, which changes last bits. Packers see seeds in the order of ids: so new grains
    have the same places, but for these bits, and the same radii."""
    worst = 0.0
    frames = list(zip(lab.frames(base), lab.frames(out), strict=True))
    for one, two in frames:
        a, b = ({field: by_id(frame, field) for field in ("id", "radius", "position", "velocity")} for frame in (one, two))
        assert numpy.array_equal(a["id"], b["id"]), f"{two.name}: grains are others"
        worst = max(worst, *(float(abs(a[field] - b[field]).max()) for field in a))
    assert len(frames) >= 7, f"{len(frames)} frames"
    return worst


def compare(slot, base, out):
    """Whether the results are the ones that they should be: others, or for the search for neighbours the same."""
    last = lab.frames(base)[-1].name
    if "neighbours" in slot:
        worst = compare_neighbours(base, out)
        assert worst == 0 if "alone" in slot else worst < 1e-6, f"{slot}: the results differ by {worst}"
        return f"the same but for {worst:.1e}" if worst else "the same"
    other = lab.differences(base / "frames" / last, out / "frames" / last)
    names = ["grains/position", "grains/velocity"]
    if "points/stress" in lab.contents(base / "frames" / last):
        names.append("points/stress")
    assert all(name in other for name in names), f"{slot}: the same results as before"
    return "other"


def check(folder):
    before = hashes()
    base = {"hybrid": folder / "base", "grains": folder / "grains"}
    plain = {"hybrid": run(base["hybrid"], []), "grains": run(base["grains"], ["model=grains"])}
    assert all(books(base[model]) < 1e-12 for model in base)
    for k, (slot, options, named, replaced) in enumerate(CHANGES):
        out = folder / str(k)
        model = "grains" if "model=grains" in options else "hybrid"
        found = run(out, options)
        assert named in found, f"{slot}: {named} is not mapped"
        assert not replaced or (replaced in plain[model] and replaced not in found), f"{slot}: {replaced} is mapped"
        defect = books(out)
        assert defect < 1e-12, f"{slot}: the books are open by {defect}"
        results = compare(slot, base[model], out)
        print(f"{slot}: {named}{f' for {replaced}' if replaced else ''}, results {results}, defects {defect:.1e}",
              flush=True)
    assert hashes() == before, "the program or an object has changed"
    print(f"{len(before)} files of the program unchanged")


def check_points(folder):
    """How many points a fill would have has no say in a hybrid, whose updates make two along each axis, with hats neither."""
    for shape in ("gimp", "linear"):
        series = {}
        for points in (1, 2, 4):
            run(folder / f"{shape}{points}", [f"continuum.shape={shape}", f"continuum.points={points}"])
            series[points] = (folder / f"{shape}{points}" / "series.csv").read_bytes()
        assert len(set(series.values())) == 1, f"{shape}: continuum.points changes a hybrid"
        print(f"continuum.points: 1, 2 or 4, {shape}: the same series of {len(series[2])} bytes", flush=True)


if __name__ == "__main__":
    with lab.workplace() as name:
        check(pathlib.Path(name))
        check_points(pathlib.Path(name))
