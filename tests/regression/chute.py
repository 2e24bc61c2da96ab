# SPDX-License-Identifier: MIT
"""A layer that flows down a rough slope, 20 grains long and for a second: the hybrid keeps its mass at every output, and its height, its
density and its speed are near those of grains alone that began as the same settled bed. docs/validation/chute.md has the whole of it."""
import pathlib

import h5py

import lab

NARROW = ["--set=domain.upper=[40 mm, 120 mm]", "--set=grains.fill.0.region.box.upper=[40 mm, -0.7 mm]",
          "--set=grains.fill.1.region.box.upper=[40 mm, 73 mm]", "--set=observe.5.profile.region.box.upper=[40 mm, 64 mm]",
          "--set=continuum.fill.region.box.upper=[40 mm, 72 mm]", "--set=time.end=1 s",
          "--set=output={every: 0.1 s, fields: [grain.mass, point.mass]}"]


def rows(out, *options):
    lab.run("chute", out, *NARROW, *options)
    header, lines = lab.series(out)
    return [dict(zip((name.split(" ")[0] for name in header), line)) for line in lines]


def mean(found, column):
    """Over the second half of the run."""
    last = found[len(found) // 2:]
    return sum(row[column] for row in last) / len(last)


def centre(out):
    """Height of the centre of mass, m, mean over the second half of the frames."""
    found = []
    for path in lab.frames(out)[5:]:
        mass = moment = 0.0
        with h5py.File(path) as file:
            for kind in ("grains", "points"):
                if kind in file:
                    own = file[f"{kind}/mass"][:] * (file[f"{kind}/weight"][:] if f"{kind}/weight" in file else 1)
                    if kind == "grains":
                        own = own * (file["grains/fixed"][:] == 0)
                    mass, moment = mass + own.sum(), moment + (own * file[f"{kind}/position"][:, 1]).sum()
        found.append(moment / mass)
    return sum(found) / len(found)


def near(what, found, wanted, tolerance):
    print(f"{what}: {found:.5g}, of grains {wanted:.5g}: {found / wanted - 1:+.1%}, asked {tolerance:.0%}")
    assert abs(found / wanted - 1) < tolerance, what


if __name__ == "__main__":
    with lab.workplace() as name:
        both, grains = rows(pathlib.Path(name) / "both"), rows(pathlib.Path(name) / "grains", "--set=model=grains")
        centres = [centre(pathlib.Path(name) / which) for which in ("both", "grains")]
    carried = [row["ledger.carried"] for row in both]
    share = mean(both, "discrete_share.share")
    print(f"carried mass, over that at first, less one: from {min(carried):.2e} to {max(carried):.2e}; share of grains {share:.3f}")
    assert max(map(abs, carried)) < 0.01 and share < 0.4
    near("centre of mass, m", *centres, 0.03)
    near("height of the top, m", mean(both, "top.height"), mean(grains, "top.height"), 0.03)
    near("speed at the end, m/s", both[-1]["layer.x_0"], grains[-1]["layer.x_0"], 0.2)
    for k in range(8):
        near(f"density from {8 * k} to {8 * k + 8} mm, kg/m^3", mean(both, f"row.density_{k}"), mean(grains, f"row.density_{k}"), 0.12)
