# SPDX-License-Identifier: MIT
"""The scenes of configs/ do what they say, as they stand; the two columns do so in bits.py and rerun.py, made shorter."""
import math
import pathlib

import h5py

import lab


def read(folder):
    """Times, and the first entity's x, vx and, of points, the tip, by frame."""
    rows = []
    for path in lab.frames(folder):
        with h5py.File(path) as file:
            name = "grains" if "grains" in file else "points"
            x, v = file[name]["position"][:], file[name]["velocity"][:]
            rows.append((float(file.attrs["time"]), x[0, 0], v[0, 0], x[:, 0].max()))
    return rows


def near(what, found, wanted, tolerance):
    print(f"{what}: {found:.6g}, asked {wanted:.6g} within {tolerance:.0%}")
    assert abs(found / wanted - 1) < tolerance, what


def incline(place):
    """A disc that rolls has 2/3 of the acceleration of a free one; below tan(20 deg)/3 of friction it slides."""
    down, press, time = 3.3552, 9.2184, 0.5
    for friction, wanted in ((0.5, 2 / 3 * down), (0.1, down - 0.1 * press)):
        out = place / f"incline_{friction}"
        lab.run("incline", out, f"--set=grains.contact.linear.friction={friction}")
        end = read(out)[-1]
        near(f"incline, friction {friction}: speed", end[2], wanted * time, 0.01)
        near(f"incline, friction {friction}: way", end[1], 0.5 * wanted * time**2, 0.01)


def elastic_bar(place):
    """The tip's swing crosses its place of rest twice in a period of 5.2 s, and goes as far as v L/c."""
    out = place / "elastic_bar"
    lab.run("elastic_bar", out, "--set=output.every=0.1")
    rows = read(out)
    swing = [(t, tip - rows[0][3]) for t, _, _, tip in rows]
    crossings = [t - u * (s - t) / (w - u) for (t, u), (s, w) in zip(swing[1:], swing[2:]) if u * w < 0]
    assert len(crossings) >= 6, crossings
    near("elastic_bar: period", crossings[5] / 3, 5.2, 0.02)
    near("elastic_bar: swing", max(u for _, u in swing), 0.05 * 13 / 10, 0.1)


def mixture(place):
    """Sand and steel are poured by their shares of the mass, and flow; nobody is lost or becomes another."""
    out = place / "mixture"
    lab.run("mixture", out)
    kinds = []
    for path in (lab.frames(out)[0], lab.frames(out)[-1]):
        with h5py.File(path) as file:
            grains = file["grains"]
            id, kind, mass, moves = (grains[name][:] for name in ("id", "material", "mass", "fixed"))
            kinds.append({i: (k, m) for i, k, m in zip(id, kind, mass)})
            poured, speed = mass * (moves == 0), grains["velocity"][:, 0]
    assert kinds[0] == kinds[1] and set(kind) == {0, 1}
    steel = poured[kind == 1].sum() / poured.sum()
    print(f"mixture: {len(kind)} grains, {steel:.4f} of the mass is steel, asked 0.4; fastest {speed.max():.3g} m/s")
    assert abs(steel - 0.4) < mass.max() / poured.sum() and speed.max() > 0.1


def two_grains(place):
    out = place / "two_grains"
    lab.run("two_grains", out)
    near("two_grains: restitution", -read(out)[-1][2], 0.5, 0.01)


if __name__ == "__main__":
    assert math.isclose(math.hypot(3.3552, 9.2184), 9.81, rel_tol=1e-4)
    with lab.workplace() as name:
        for test in (incline, elastic_bar, mixture, two_grains):
            test(pathlib.Path(name))
