# SPDX-License-Identifier: MIT
"""quern calibrate: a law, a slip and a modulus that chutes and a bed were made up from are found again; where steady chutes are looked for;
the whole command on a small layer, whose block a scene takes, and which goes on where it was; what it refuses; the warning of a hybrid whose
continuum is not as dense as its grains have settled."""
import csv
import math
import pathlib
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np

import lab

sys.path.insert(0, str(lab.SOURCE / "python"))
try:
    from quern import calibrate, rheology
except ImportError as missing:
    print(f"{missing.name} is not there")
    sys.exit(77)

SAND = rheology.Grains(2e-3, 2500.0, 9.81)
LAW = rheology.Law(0.25, 0.62, 0.33)
ROWS, SLIP = 24, 6.0  # diameters


def made_up(angle, gain=0.0, noise=0.0, seed=1):
    """A chute whose rows flow by the law at every depth, with a slip length at the floor, and whose velocities all gain `gain` a second:
    du/dy = I sqrt(p/rho_s)/d, I from tan(angle) less what the gain takes."""
    rng, d, times = np.random.default_rng(seed), SAND.diameter, np.linspace(1, 2, 40)
    density = np.zeros(36)
    density[:ROWS] = 2000.0
    y = (np.arange(36) + 0.5) * d
    across = SAND.gravity * math.cos(angle)
    mu = math.tan(angle) - gain / across
    inertia = LAW.i_0 * (mu - LAW.mu_s) / (LAW.mu_2 - mu)
    height = ROWS * d
    factor = inertia / d * math.sqrt(2000.0 * across / SAND.density)
    u = 2 / 3 * factor * (height ** 1.5 - np.maximum(height - y, 0) ** 1.5) + SLIP * d * factor * math.sqrt(height)
    velocity = u + gain * (times - times.mean())[:, None] + noise * u.max() * rng.normal(size=(40, 36))
    return rheology.rows_of(angle, y, times, np.tile(density, (40, 1)), velocity, SAND), inertia


def check_fit():
    chutes = []
    for degrees, gain in ((16, 0.0), (19, 0.05), (22, -0.03)):
        rows, inertia = made_up(math.radians(degrees), gain)
        apart = np.max(np.abs(rows.inertia[rows.bulk] / inertia - 1))
        slip = rheology.slip_of(rows).length / SAND.diameter
        assert rows.bulk.sum() >= 14 and apart < 0.01, (degrees, apart)  # of the slope over five rows, four and a half from the surface
        assert abs(slip / SLIP - 1) < 5e-3 and rows.word == "steady", (degrees, slip, rows.word)
        chutes.append(rows)
    found = rheology.law_of(chutes)
    off = max(abs(a / b - 1) for a, b in zip((found.mu_s, found.mu_2, found.i_0), (LAW.mu_s, LAW.mu_2, LAW.i_0)))
    assert off < 0.01, found
    print(f"ok  a law is found again from made-up chutes within {off:.1e}, slip within 5e-3")
    noisy = [made_up(math.radians(degrees), noise=0.02, seed=degrees)[0] for degrees in (16, 18, 20, 22)]
    law = rheology.law_of(noisy)
    worst = max(abs(law(x) - LAW(x)) for x in (0.02, 0.05, 0.1, 0.2))
    assert worst < 0.01, law
    print(f"ok  with velocities that scatter by 2 %, mu(I) is found within {worst:.4f}")
    assert made_up(math.radians(22), 0.5)[0].word == "fast" and made_up(math.radians(16), -0.4)[0].word == "slows"
    line = rheology.fit_law(np.array([0.02, 0.1, 0.2]), 0.3 + 0.8 * np.array([0.02, 0.1, 0.2]))
    assert abs(line(0.15) - 0.42) < 2e-3 and line.i_0 > 4, line
    loose = [replace(one, density=np.where(one.density > 0, 2040 * (1 - 0.4 * one.inertia) * np.exp(one.pressure / 1e5), 0)) for one in chutes]
    slow = rheology.looseness_of(loose, 1e5)
    assert abs(slow.density / 2040 - 1) < 1e-9 and abs(slow.dilation / 0.4 - 1) < 1e-9, slow
    looser = replace(loose[0], density=loose[0].density * np.where(np.arange(36) < 2, 0.9, 1))
    assert abs(rheology.displacement_of(looser, 1e5) / (0.2 * SAND.diameter) - 1) < 0.02 and abs(rheology.displacement_of(loose[0], 1e5)) < 0.02 * SAND.diameter
    y = np.linspace(0, 0.04, 50)
    assert abs(rheology.modulus(y, -3000 / 1e5 * (0.05 * y - y ** 2 / 2), 0.05, 3000) / 1e5 - 1) < 1e-12
    print("ok  flows that are not steady are told, a straight law is a straight law, a modulus is found again")


def check_slide():
    """A layer that gains what a friction of 0.2 leaves, from some time on, with a lowest row at two thirds of its speed; and one that flows on a plane
    that holds."""
    class Made:
        def __init__(self, lowest, starts):
            n, t = 36, np.linspace(0, 1, 41)
            u = np.maximum(t - starts, 0) * SAND.gravity * (math.sin(0.25) - 0.2 * math.cos(0.25))
            share = np.where(np.arange(n) == 0, lowest, 1 + (1 - lowest) / (ROWS - 1))
            self.scene = {"dimension": 2, "observe": [{"profile": {"region": {"box": {"lower": [0, 0], "upper": [1, n * 2e-3]}}, "bins": n}}]}
            self.series = {"time": t, **{f"profile.density_{k}": np.full(41, 2000.0 * (k < ROWS)) for k in range(n)},
                           **{f"profile.x_{k}": u * share[k] * (k < ROWS) for k in range(n)}}
    for starts in (0, 0.3):
        found = rheology.slide(Made(0.67, starts), 0.25, SAND)
        assert found.slides and abs(found.friction - 0.2) < 1e-9, found
    assert not rheology.slide(Made(0.2, 0), 0.25, SAND).slides and not rheology.slide(Made(0.67, 0.99), 0.25, SAND).slides
    print("ok  friction of a plane is found again, from when the layer slides on; a plane that holds is told")


def check_search():
    """The search ends for any grains, with three angles wherever a window of three degrees or more is steady."""
    for low, high in ((16, 25), (10, 14), (27, 33), (4, 7.5), (21.5, 24.6), (35, 44)):
        known, wanted, rounds = {}, list(calibrate.FIRST[2]), 0
        while wanted:
            known |= {angle: "rests" if angle < low else "fast" if angle > high else "steady" for angle in wanted}
            wanted, rounds = calibrate.next_angles(known), rounds + 1
        steady = sorted(angle for angle, word in known.items() if word == "steady")
        assert len(steady) >= 3 and rounds < 12, (low, high, known)
        assert len(calibrate.spread_out(steady)) == 3
    for word in ("rests", "fast", "failed", "slows"):
        known, wanted = {}, list(calibrate.FIRST[2])
        while wanted:
            known |= dict.fromkeys(wanted, word)
            wanted = calibrate.next_angles(known)
        assert 3 <= len(known) < 40, (word, known)
    print("ok  steady chutes are found wherever they are, and the search ends where there are none")


def command(*words, status=0):
    done = subprocess.run([lab.QUERN, "calibrate", *map(str, words)], capture_output=True, text=True, timeout=280)
    assert done.returncode == status, f"exit status {done.returncode}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


SOFT = ["--set", "grains.contact.linear.stiffness=2e4", "--set", "grains.settle.energy=1e-3"]


def check_command(here):
    """A layer that is smaller by a fifth, one seed: its numbers are rough, but they are those of sand. (Of half the depth, chutes of some seeds are not steady.)"""
    words = [lab.scene("column"), *SOFT, "-o", here / "sand", "--size", "0.8", "--seeds", "1", "--angles", "15,18,21"]
    said = command(*words)
    assert 10 <= said.count("] done: ") <= 17, said  # a bed, three chutes, planes, and five boxes
    options = dict(line.split("=")[1:] for line in (here / "sand/options.txt").read_text().splitlines())
    value = {key.rsplit(".", 1)[1]: float(text) for key, text in options.items()}
    print("    " + ", ".join(f"{key} {text:g}" for key, text in value.items()))
    assert 1900 < value["critical_density"] < 2080 and value["diameter"] == 2e-3 and value["grain_density"] == 2500
    assert 1900 < value["flow_density"] < 2150 and 0.1 < value["dilation"] < 1, value
    law = rheology.Law(value["static_friction"], value["limit_friction"], value["inertial_number"])
    assert 0.28 < law(0.1) < 0.41, law
    assert 0.1 < value["bulk_modulus"] / 2e4 < 0.6, value
    with open(here / "sand/rows.csv") as file:
        rows = [row for row in csv.DictReader(file) if row["bulk"] == "1"]
    assert {row["angle [degree]"] for row in rows} == {"15", "18", "21"}
    for row in rows:  # in balance
        assert abs(float(row["friction"]) - math.tan(math.radians(float(row["angle [degree]"])))) < 0.03, row
    page = (here / "sand/calibration.md").read_text()
    assert "critical_density" in page and "smooth walls" in page and "nan" not in page, page
    block = (here / "sand/calibration.yaml").read_text()
    laws = {kind: [float(x) for x in re.findall(r"([0-9.]+) at I", line)] for kind, line in re.findall(r"# friction of ([a-z ]+): (.*)", block)}
    print("    friction at I = 0.01, 0.03, 0.1, 0.3: " + "; ".join(f"{kind} {one}" for kind, one in laws.items()))
    assert list(laws) == ["plane shear", "chutes"] and abs(law(0.1) / laws["plane shear"][2] - 1) < 0.01, laws
    assert all(0.2 < one[0] < one[1] < one[2] < 0.7 for one in laws.values()) and len(laws["plane shear"]) == 4, laws
    again = command(*words, "--law", "chutes")
    assert "] done: " not in again, again
    assert re.findall(r"# friction of ([a-z ]+): ", again) == ["chutes", "plane shear"], again
    command(*words)
    print("ok  a small layer is measured, and not made again")
    block = (here / "sand/calibration.yaml").read_text()
    floor = re.search(r"shear rate: (boundary: {rough: .*, inertial_number: .*})", block)[1]
    scene = "quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [0.08, 0.08]}\ntime: {end: 1 ms}\n" \
        f"bodies: [{{plane: {{point: [0, 0], normal: [0, 1], {floor}}}}}]\n" + block + \
        "  cell: 4 mm\n  fill: {region: {box: {lower: [0, 0], upper: [0.04, 0.04]}}, stress: at_rest}\n"
    (here / "taken.yaml").write_text(scene)
    lab.run(here / "taken.yaml", here / "taken")
    words = (here / "sand/options.txt").read_text().splitlines()
    lab.run("column", here / "by_options", "--set=model=continuum", "--set=time.end=0.1 ms", *words)
    print("ok  a scene takes the block, and the command line the options")


def check_refusals(here):
    column = lab.scene("column")
    assert "--angles: give 3 of them at least" in command(column, "--angles", "20,22", status=1)
    assert "--angles: '90' is no number of degrees between 3 and 45" in command(column, "--angles", "20,22,90", status=1)
    assert "--seeds 0: give a whole number" in command(column, "--seeds", "0", status=1)
    assert "has no gravity" in command(lab.scene("two_grains"), "--set", "gravity=[0, 0]", "-o", here / "no", status=2)
    assert "has several materials of grains" in command(lab.scene("mixture"), "-o", here / "no", status=2)
    assert "has no grains to measure" in command(lab.scene("elastic_bar"), "-o", here / "no", status=2)
    assert "there.yaml" in command(here / "not_there.yaml", "-o", here / "no", status=2)
    assert not (here / "no").exists()
    print("ok  what cannot be measured is refused in a sentence")


def check_warning(here):
    """A settled bed of 50 x 50 diameters knows how dense it lies; the continuum says something else, or the same. It must move well less
    than what counts as rest there, 1e-3 of m g d."""
    bed = lab.sets(domain__upper="[0.1, 0.16]", domain__periodic="[true, false]",
                   bodies="[{plane: {point: [0, 0], normal: [0, 1], boundary: sticky}}]",
                   grains__contact__linear__stiffness="1e5", grains__settle__energy="2e-4", time__end="0.3 ms", output__every="0.3 ms",
                   observe="[]", continuum__fill="null", grains__fill__0__region__box="{lower: [0, -0.7 mm], upper: [0.1, -0.7 mm]}",
                   grains__fill__1__region__box="{lower: [0, 0.001], upper: [0.1, 0.1]}")
    said = lab.run("column", here / "thin", *bed, "--set=continuum.material.mu_i.critical_density=1900")
    found = re.search(r"these grains have settled at (\d+), .* too little; quern calibrate measures it", said)
    assert found, said
    assert 1960 < float(found[1]) < 2060, said
    said = lab.run("column", here / "right", *bed, f"--set=continuum.material.mu_i.critical_density={found[1]}")
    assert "settled at" not in said, said
    print(f"ok  grains that have settled at {found[1]} kg/m^3 tell a continuum of 1900, and one of as much nothing")


if __name__ == "__main__":
    check_fit()
    check_slide()
    check_search()
    with lab.workplace() as name:
        check_refusals(pathlib.Path(name))
        check_warning(pathlib.Path(name))
        check_command(pathlib.Path(name))
