# SPDX-License-Identifier: MIT
"""A scene that names no shape has B-splines where points send their velocity alone, and gimp where they send their affine part too; one that names a
shape has that one. The scene that a run leaves says which it was, and `quern plan` too. docs/decisions/0056"""
import pathlib

import lab
import yaml

CASES = [("bspline", []), ("bspline", ["transfer=xpic"]), ("bspline", ["rasterise=plain"]), ("gimp", ["rasterise=affine"]), ("gimp", ["transfer=apic"]),
         ("gimp", ["shape=gimp"]), ("bspline", ["shape=bspline", "transfer=apic"]), ("linear", ["shape=linear"])]


def named(place, options):
    lab.run("column", place, *lab.SMALL["column"], *options, "--set=time.end=1 ms", "--force")
    shape = yaml.safe_load((place / "scene.yaml").read_text())["continuum"]["shape"]
    name = shape if isinstance(shape, str) else next(iter(shape))
    planned = [plugin["id"] for plugin in lab.plan("column", *lab.SMALL["column"], *options)["plugins"] if plugin["id"].startswith("shape.")]
    assert planned == [f"shape.{name}"], (options, planned, name)
    return name


if __name__ == "__main__":
    with lab.workplace() as folder:
        place = pathlib.Path(folder) / "out"
        for shape, keys in CASES:
            found = named(place, ["--set=model=continuum", *(f"--set=continuum.{key}" for key in keys)])
            print(f"a continuum alone, {', '.join(keys) or 'as it stands'}: {found}")
            assert found == shape, (keys, found)
        found = named(place, [])
        print(f"a hybrid: {found}")
        assert found == "gimp", found
