"""One plugin for another, by one option: same program, the named object mapped and the replaced one not, other results
(but for the search for neighbours, which must not matter), closed books."""
import hashlib
import pathlib
import tempfile

import lab

DEEP = "depth: 8 mm, half_width: 4 mm"
# slot: options, the plugin they name, the one they replace (None: another slot keeps it)
CHANGES = [
    ("contact law", ["grains.contact={hertz: {young: 4e5 Pa, friction: 0.4, impact_speed: 0.5}}"], "contact.hertz",
     "contact.linear"),
    ("contact law's friction", ["grains.contact.linear.friction=0"], "contact.linear", None),
    ("material", ["continuum.material=drucker_prager"], "material.drucker_prager", "material.mu_i"),
    ("material in rates", ["continuum.material={elastic: {density: 1975, bulk_modulus: 3e5 Pa}}"], "material.elastic",
     "material.mu_i"),
    ("transfer", ["continuum.transfer=mixed"], "transfer.mixed", None),
    ("transfer, of grains too", ["continuum.transfer=mixed", "hybrid.transfer=mixed"], "transfer.mixed",
     "transfer.picflip"),
    ("oracle", ["hybrid.oracle=[{strain_rate: {shear_rate: 5, %s}}]" % DEEP], "oracle.strain_rate",
     "oracle.packing_fraction"),
    ("packer", ["hybrid.packer=random"], "packer.random", None),
    ("packer, of the first grains too", ["hybrid.packer=random", "grains.fill.0.packer=random",
                                         "grains.fill.1.packer=random"], "packer.random", "packer.two_point_tangent"),
    ("coupling", ["hybrid.coupling=lumped"], "coupling.lumped", "coupling.affine"),
    ("shape", ["continuum.shape=linear"], "shape.linear", "shape.gimp"),
    ("integrator", ["grains.integrator=velocity_verlet"], "integrator.velocity_verlet", "integrator.symplectic_euler"),
    ("neighbours", ["grains.neighbours=all_pairs"], "neighbours.all_pairs", "neighbours.cells")]


def hashes():
    files = [pathlib.Path(lab.QUERN), *sorted(lab.PLUGINS.glob("*.so"))]
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def books(folder):
    s = lab.summary(folder)
    return max(abs(s["mass_defect"]), abs(s["invariant_defect"]))


def run(folder, options):
    """A run to its end; the plugins that were mapped while it ran."""
    options = [*lab.SMALL["column"], "--set=time.end=20 ms",
               "--set=output.fields=[grain.velocity, point.velocity, point.stress]", *(f"--set={option}" for option in options)]
    process = lab.start("column", folder, *options)
    assert lab.wait_for(folder / "log.txt", process), f"{options}: exit status {process.wait()}"
    found = lab.mapped(process)
    assert process.wait(timeout=600) == 0, f"{options}: exit status {process.returncode}"
    return found


def check(folder):
    before = hashes()
    base = folder / "base"
    plain = run(base, [])
    assert books(base) < 1e-12
    names = [f"{set}/{field}" for set, field in (("grains", "position"), ("grains", "velocity"), ("points", "stress"))]
    for k, (slot, options, named, replaced) in enumerate(CHANGES):
        out = folder / str(k)
        found = run(out, options)
        assert named in found, f"{slot}: {named} is not mapped"
        assert not replaced or (replaced in plain and replaced not in found), f"{slot}: {replaced} is mapped still"
        defect = books(out)
        assert defect < 1e-12, f"{slot}: the books are open by {defect}"
        last = f"{len(lab.frames(base)) - 1:06d}.h5"
        other = lab.differences(base / "frames" / last, out / "frames" / last)
        if slot == "neighbours":
            assert not other, f"{slot}: the results differ in {', '.join(other)}"
            lab.same(base, out, slot, checkpoint=False)
        else:
            assert all(name in other for name in names), f"{slot}: the same results as before"
        print(f"{slot}: {named}{f' for {replaced}' if replaced else ''}, {'other' if other else 'the same'} results, "
              f"defects {defect:.1e}", flush=True)
    assert hashes() == before, "the program or an object has changed"
    print(f"{len(before)} files of the program unchanged")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        check(pathlib.Path(name))
