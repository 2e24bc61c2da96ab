# SPDX-License-Identifier: MIT
"""coupling.exact: small columns in 2-D and 3-D fall with it, convert, and keep their books; the same bits for threads, batches, instruction sets,
compilers, the numbers of blocks, and across a stop. Skipped where Quern was built without it.
"""
import os
import pathlib
import sys

import lab
import permuted
from bits import converts

EXACT = "--set=hybrid.coupling=exact"
SCENES = {
    "column": [*lab.SMALL["column"], "--set=observe=[mass, ledger, energy, {runout: {axis: 0}}]", EXACT],
    "column_3d": [*lab.SMALL["column_3d"], *lab.sets(time__end="40 ms"), EXACT],  # it has begun to fall by then
}


def front(folder):
    header, rows = lab.series(folder)
    return rows[-1][header.index("runout.front [m]")]


def main():
    if not (lab.PLUGINS / "coupling.exact.so").exists():
        print("built without coupling.exact")
        sys.exit(77)
    for name, options in SCENES.items():
        with lab.workplace() as place:
            folder = pathlib.Path(place)
            lab.run(name, folder / "base", *options)
            converts(name, folder / "base")
            lab.same_ways(name, folder / "base", folder, *options, levels=("v1",) if name == "column" else ())
            half = "40 ms" if name == "column" else "10 ms"
            lab.run(name, folder / "stopped", *options, f"--until={half}")
            lab.run(name, folder / "stopped", *options, resume=True)
            lab.same(folder / "base", folder / "stopped", f"stopped at {half}")
            if name == "column":
                lab.run(name, folder / "affine", *options, "--set=hybrid.coupling=affine")
                exact, affine = front(folder / "base"), front(folder / "affine")
                print(f"  front at {1e3 * exact:.1f} mm, with coupling.affine at {1e3 * affine:.1f} mm")
                assert exact != affine and abs(exact / affine - 1) < 0.1
    other = os.environ.get("QUERN_PERMUTED")
    if not other:
        print("QUERN_PERMUTED names no program: not compared")
        return
    with lab.workplace() as place:
        here, there = pathlib.Path(place) / "here", pathlib.Path(place) / "there"
        lab.run("column", here, *permuted.WIDE, EXACT)
        lab.run("column", there, *permuted.WIDE, EXACT, program=other, threads=2)
        lab.same(here, there, "blocks with other numbers", checkpoint=False)
        assert permuted.is_permuted(there) and not permuted.is_permuted(here)


if __name__ == "__main__":
    main()
