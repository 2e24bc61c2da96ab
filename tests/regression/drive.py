# SPDX-License-Identifier: MIT
"""quern drive: a material point along a path has the stresses of closed forms, is under the stresses that were asked for, has the same
bits on every instruction set, and what it cannot do it says."""
import csv
import importlib.util
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import yaml

QUERN, SOURCE, PLUGINS = os.environ["QUERN"], pathlib.Path(os.environ["QUERN_SOURCE"]), pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
K, RHO, NU, MU = 1e8, 1500.0, 0.3, {2: 0.26, 3: 0.3819}
ELASTIC = ["elastic", f"--set=bulk_modulus={K}", f"--set=density={RHO}"]
PRAGER = ["drucker_prager", f"--set=bulk_modulus={K}", f"--set=density={RHO}"]
MU_I = ["mu_i", f"--set=bulk_modulus={K}", f"--set=critical_density={RHO}", "--set=grain_density=2500", "--set=diameter=1 mm"]
SHEAR = {2: K * (1 - NU) / (1 + NU), 3: 1.5 * K * (1 - 2 * NU) / (1 + NU)}
LAMBDA = {dim: K - 2 / dim * SHEAR[dim] for dim in (2, 3)}
UP = {2: "yy", 3: "zz"}


def call(here, *words, status=0, plugins=None):
    env = os.environ | ({"QUERN_PLUGIN_PATH": str(plugins)} if plugins else {})
    done = subprocess.run([QUERN, "drive", *map(str, words)], capture_output=True, text=True, timeout=60, cwd=here, env=env)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def drive(here, *words, **options):
    """Columns of the table that comes out."""
    call(here, *words, *[] if "--steps" in words else ["--steps", 200], "-o", "path.csv", **options)
    with open(here / "path.csv") as file:
        head, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    assert len(table) and np.isfinite(table).all()
    return {name.split(" [")[0]: table[:, k] for k, name in enumerate(head)}


def near(name, found, asked, allowed):
    off = float(np.max(np.abs(np.asarray(found) - asked) / np.max(np.abs(asked))))
    print(f"  {name:<64} {float(np.ravel(found)[-1]):<14.8g} off by {off:.1e} of {allowed:.0e}")
    assert off <= allowed, name


def check_elastic(here):
    """Hooke's law, whatever the path."""
    for dim in (2, 3):
        g, lame, two = SHEAR[dim], LAMBDA[dim], [*ELASTIC, "--dimension", dim]
        t = drive(here, *two, "--path", "oedometric", "--strain", "1%,-1%,0")
        near(f"{dim}-D oedometric: axial stress", t[f"stress_{UP[dim]}"], -(lame + 2 * g) * t["strain"], 1e-10)
        near(f"{dim}-D oedometric: lateral stress", t["stress_xx"], -lame * t["strain"], 1e-10)
        t = drive(here, *two, "--path", "isotropic", "--strain", 0.01)
        near(f"{dim}-D isotropic: pressure", t["pressure"], K * dim * t["strain"], 1e-10)
        young = 9 * K * g / (3 * K + g) if dim == 3 else 4 * K * g / (K + g)
        t = drive(here, *two, "--path", "tension")
        near(f"{dim}-D tension: axial stress over Young's modulus", t[f"stress_{UP[dim]}"], young * t["strain"], 1e-8)
        near(f"{dim}-D tension: lateral strain over Poisson's ratio", t["strain_xx"], -NU * t["strain"], 1e-8)
        t = drive(here, *two, "--path", "triaxial", "--stress", "100 kPa,200 kPa", "--pressure", "50 kPa")
        near(f"{dim}-D triaxial by stress: axial strain", t["strain"], (-t[f"stress_{UP[dim]}"] - 5e4) / young, 1e-8)
        shear = "xy" if dim == 2 else "yz"
        (here / "table.csv").write_text(f"time [s], strain_{shear} [1]\n1, 0.02\n\n2, -0.01 # back\n")
        t = drive(here, *two, "--path", "table.csv")
        near(f"{dim}-D pure shear from a table: shear stress", t["shear_stress"], 2 * g * np.abs(t[f"strain_{shear}"]), 1e-10)
        near(f"{dim}-D pure shear from a table: shear strain", t["shear_strain"], 2 * np.abs(t[f"strain_{shear}"]), 1e-12)
        (here / "table.csv").write_text(f"time,strain_{UP[dim]},pressure\n0,0,50e3\n1,-1e-3,50e3\n")
        t = drive(here, *two, "--path", "table.csv")
        near(f"{dim}-D pressed from a table: pressure", t["pressure"], 5e4, 1e-9)
        near(f"{dim}-D   shear stress, from none", t["shear_stress"], math.sqrt(dim / (2 * (dim - 1))) * 2 * g * -t[f"strain_{UP[dim]}"], 1e-6)


def check_prager(here):
    """Elastic slopes, yield at mu p wherever it is met, no change of volume by flow, and no tension."""
    for dim in (2, 3):
        mu, g, two = MU[dim], SHEAR[dim], [*PRAGER, "--dimension", dim]
        t = drive(here, *two, "--set=friction=10", "--path", "oedometric", "--strain", 1e-5, "--steps", 10)
        near(f"{dim}-D oedometric, held by friction: slope", t[f"stress_{UP[dim]}"][-1] / -t["strain"][-1], LAMBDA[dim] + 2 * g, 2e-5)
        t = drive(here, *two, "--path", "oedometric")
        near(f"{dim}-D oedometric, at yield: shear stress over pressure", t["friction"][1:], mu, 1e-12)
        near(f"{dim}-D oedometric: pressure of the volume", t["pressure"], K / 2 * (1 / t["volume"] - t["volume"]), 1e-9)
        for hold in ("volume", "pressure"):
            t = drive(here, *two, "--path", "simple_shear", "--hold", hold, "--pressure", "100 kPa", "--steps", 1000)
            late = t["strain"] > 0.05
            near(f"{dim}-D simple shear, {hold} held: shear stress", t["shear_stress"][late], mu * 1e5, 1e-9)
            near(f"{dim}-D simple shear, {hold} held: pressure", t["pressure"], 1e5, 1e-9)
            assert abs(t["volume"][-1] - 1) < 1e-12
            near(f"{dim}-D simple shear, {hold} held: first slope, G/J", t["shear_stress"][1] / t["strain"][1], g * t["density"][0] / RHO, 1e-7)
        # the mean pressure is p_0 + q/d for a deviator q along one axis, whose shear stress is q sqrt((d - 1)/(2 d))
        share = math.sqrt((dim - 1) / (2 * dim))
        t = drive(here, *two, "--path", "triaxial", "--pressure", "100 kPa")
        near(f"{dim}-D triaxial: shear stress at yield", t["shear_stress"][-1], mu * 1e5 / (1 - mu / dim / share), 1e-8)
        near(f"{dim}-D triaxial: lateral stress", t["stress_xx"], -1e5, 2e-10)
        t = drive(here, *two, "--path", "oedometric", "--strain", "-1%,1%", "--pressure", "10 kPa")
        open_ = t["volume"] > 1.001
        assert open_.any() and not t["pressure"][open_].any() and np.max(np.abs(t["density"] * t["volume"] / t["density"][0] - 1)) < 1e-9
        j = t["volume"][-1] * RHO / t["density"][0]
        near(f"{dim}-D opened and closed: pressure of the volume", t["pressure"][-1], K / 2 * (1 / j - j), 1e-9)


def check_mu_i(here):
    """Shear stress over pressure is mu(I) at any rate."""
    limit, number = {2: 0.60, 3: 0.6435}, {2: 0.36, 3: 0.279}
    for dim in (2, 3):
        for rate in (0.1, 10, 1000):
            inertial = rate * 1e-3 * math.sqrt(2500 / 1e5)
            asked = MU[dim] + (limit[dim] - MU[dim]) / (1 + number[dim] / inertial)
            for hold in ("volume", "pressure")[:1 + (rate == 10)]:
                t = drive(here, *MU_I, "--dimension", dim, "--path", "simple_shear", "--hold", hold, "--rate", f"{rate} 1/s",
                          "--pressure", "100 kPa")
                near(f"{dim}-D mu(I), {hold} held, I = {inertial:.2g}", t["friction"][-1], asked, 1e-6)
                near(f"{dim}-D   its shear rate", t["point.shear_rate"][-1], rate, 1e-5)


def check_limits(here):
    """What a material does not bear is said, and how far it came is kept."""
    said = call(here, *PRAGER, "--path", "triaxial", "--stress", "1 MPa", "--pressure", "100 kPa", "-o", "path.csv", status=3)
    assert "no strain gives the stress that is asked for" in said, said
    with open(here / "path.csv") as file:
        last = list(csv.DictReader(file))[-1]
    axial = -float(last["stress_zz [Pa]"])
    most = 1e5 * (1 + 2 * 0.3819 / math.sqrt(3) * 1.5 / (1 - 0.3819 / math.sqrt(3)))
    q = (most - 1e5)
    assert 0 < (most - axial) < 1e3 and abs(q * math.sqrt(1 / 3) - 0.3819 * (1e5 + q / 3)) < 1, (most, axial)
    said = call(here, *PRAGER, "--path", "table.csv", "-o", "path.csv", status=2) if (here / "table.csv").write_text(
        "time,stress_xx,stress_yy,stress_zz\n0,1e3,1e3,1e3\n1,0,0,0\n") else ""
    assert "cannot begin with stress_xx = 1000 Pa" in said, said
    said = call(here, *ELASTIC, "--path", "isotropic", "--strain", "500%", "--steps", "2", "-o", "path.csv", status=3)
    assert "give more --steps" in said, said


def check_scene(here):
    """A scene's material is that of the same numbers given by hand."""
    scene = SOURCE / "configs/elastic_bar.yaml"
    t = drive(here, "--scene", scene, "--path", "tension")
    other = drive(here, "--scene", scene, "--set=continuum.material.elastic.bulk_modulus=2 MPa", "--path", "tension")
    assert not np.array_equal(t["pressure"], other["pressure"]), "--set of a scene does nothing"
    column = drive(here, "--scene", SOURCE / "configs/column.yaml", "--path", "simple_shear")
    number = column["point.shear_rate"][-1] * 2e-3 * np.sqrt(2500 / column["pressure"][-1])
    assert "point.shear_rate" in column and "stress_zz" not in column
    law = yaml.safe_load((SOURCE / "configs/column.yaml").read_text())["continuum"]["material"]["mu_i"]
    asked = law["static_friction"] + (law["limit_friction"] - law["static_friction"]) / (1 + law["inertial_number"] / number)
    assert abs(column["friction"][-1] - asked) < 1e-6, (column["friction"][-1], asked, number)
    assert "has no continuum.material" in call(here, "--scene", SOURCE / "configs/two_grains.yaml", "--path", "tension", status=2)


def check_bits(here):
    """The same table on every instruction set that there is."""
    tables = {}
    for level in ("", ".v3", ".v4"):
        folder = here / f"plugins{level}"
        folder.mkdir()
        for path in PLUGINS.glob("material.*.so"):
            name = path.name.split(".")
            if ".".join(name[2:-1]) == level[1:]:
                (folder / path.name).symlink_to(path)
                (folder / f"{'.'.join(name[:2])}.so").unlink(missing_ok=True)
                (folder / f"{'.'.join(name[:2])}.so").symlink_to(path)
        if level and f" avx{'2' if level == '.v3' else '512f'} " not in pathlib.Path("/proc/cpuinfo").read_text():
            continue
        if any(folder.iterdir()):
            call(here, *PRAGER, "--path", "triaxial", "-o", "prager.csv", plugins=folder)
            call(here, *MU_I, "--path", "simple_shear", "--hold", "pressure", "-o", "mu_i.csv", plugins=folder)
            tables[level] = (here / "prager.csv").read_bytes() + (here / "mu_i.csv").read_bytes()
    assert len(tables) >= 1 and len(set(tables.values())) == 1, sorted(tables)
    print(f"  the same bits: {', '.join(level[1:] or 'v1' for level in tables)}")


def check_words(here):
    """Bad input is one sentence: usage is status 1, a material, a file or a number that cannot be used 2."""
    for words, said in {("elastic",): "--path is missing", ("elastic", "--path", "triaxal"): "did you mean 'triaxial'?",
                        ("--path", "tension"): "a material is missing", ("elastic", "--path", "tension", "-o", "x.txt"): "must end with .svg",
                        ("elastic", "--path", "tension", "--scene", "x"): "not both",
                        ("elastic", "--path", "x.csv", "--rate", "1"): "--rate does not go with a table"}.items():
        assert said in call(here, *words, status=1), words
    for words, said in {("--path", "tension", "--strain", "1", "--stress", "1"): "not both", ("--path", "tension", "--strain", "5 m"): "--strain 5 m: ",
                        ("--path", "tension", "--rate", "0"): "must be above 0", ("--path", "tension", "--pressure=-1"): "must be at least 0",
                        ("--path", "tension", "--hold", "volume"): "simple_shear alone", ("--path", "tension", "--strain", "nan"): "nan",
                        ("--path", "tension", "--time", "1"): "--time is of paths by stress", ("--path", "tension", "--strain", "1%,1%"): "two ways",
                        ("--path", "none.csv"): "none.csv: No such file", ("--path", "tension", "--set=poison=0.1"): "poisson"}.items():
        assert said in call(here, *ELASTIC, *words, status=2), words
    assert "unknown material 'elastik'; did you mean 'elastic'?" in call(here, "elastik", "--path", "tension", status=2)
    assert "is no material" in call(here, PLUGINS / "contact.linear.so", "--path", "tension", status=2)
    tables = {"": "there is nothing in it", "time\n1": "no column beside 'time'", "strain_xx\n1": "no column 'time'",
              "time,strain_xz,foo\n1,2,3": "line 1: unknown column 'foo'", "time,shear_xx\n1,2": "unknown column 'shear_xx'",
              "time,strain_xx\n1,nan": "line 2: column 'strain_xx': 'nan' is no finite number", "time,strain_xx\n\n1,0.1\n2,x": "line 4: ",
              "time,strain_xx\n1,1e999": "no finite number", "time,strain_xx\n1,2,3": "more words than the 2 columns",
              "time,strain_xx\n1": "there are 1 words, and 2 columns", f"time,strain_xx\n1,{'0' * 62}1e-3": "'000", "time,strain_xx\n1,1\n1,2": "line 3: time 1 s does not come after 1 s",
              "time,strain_xx\n-1,1": "does not come after 0 s", "time,strain_xx,stress_xx\n1,1,1": "both give component xx",
              "time,time,strain_xx\n1,1,1": "stands twice", "time,strain_xx [%]\n1,1": "is in 1, not in [%]", "time,strain_xx\n0,1\n1,2": "must be 0 at time 0",
              "time,strain_xx\n0,0\n": "no row comes after time 0", "time,pressure,strain_xx,strain_yy,strain_zz\n1,1,0,0,0": "beside 'pressure'"}
    for text, said in tables.items():
        (here / "table.csv").write_text(text)
        found = call(here, *ELASTIC, "--path", "table.csv", status=2)
        assert said in found and "quern drive: error: table.csv: " in found and len(found.splitlines()) == 1, (text, found)
    print("  bad input is one sentence")


def check_pictures(here):
    if not importlib.util.find_spec("matplotlib"):
        return
    said = call(here, *ELASTIC, "--path", "tension", "--steps", "20", "-o", "a.svg")
    assert said.splitlines()[-1] == "a.svg" and (here / "a.csv").exists()
    assert ">shear stress<" in (here / "a.svg").read_text() and "material.elastic, tension, 3-D" in (here / "a.svg").read_text()
    assert "has no column 'foo'" in call(here, *ELASTIC, "--path", "tension", "--steps", "20", "--curve", "strain,foo", "-o", "a.png", status=2)
    sys.path.insert(0, str(SOURCE / "python"))
    from quern.chart_data import of_tables
    from quern.program import QuernError
    try:
        of_tables({"a": here / "a.csv"}, ["strain", "density", "pressure"], "")
        raise SystemExit("two units on one axis")
    except QuernError as why:
        assert "share one unit" in str(why), why
    picture = of_tables({"a": here / "a.csv"}, ["strain", "pressure"], "")
    assert picture.y == ("pressure", "Pa") and len(picture.curves) == 1 and len(picture.curves[0].x) == 21


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        for test in (check_elastic, check_prager, check_mu_i, check_limits, check_scene, check_bits, check_words, check_pictures):
            print(test.__name__)
            test(pathlib.Path(folder))
