# SPDX-License-Identifier: MIT
"""quern chart: what is drawn is what the table and the runs say; the same table gives the same bytes; texts do not overlap, be there thirty
settings beside each other; what goes wrong is said."""
import csv
import json
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys

import h5py
import numpy as np

import lab

try:
    import matplotlib  # noqa: F401
    import yaml
except ImportError as missing:
    print(f"{missing.name} is not there")
    sys.exit(77)

sys.path.insert(0, str(lab.SOURCE / "python"))
from quern import chart_labels  # noqa: E402
from quern.chart_data import along, asked_radii, of_all, over_seeds  # noqa: E402
from quern.chart_form import Chart  # noqa: E402
from quern.runs import open as open_run  # noqa: E402

TWO = lab.scene("two_grains")
BLUE = "#0072b2"


def call(*words, status=0, cwd=None):
    done = subprocess.run([lab.QUERN, *map(str, words)], capture_output=True, text=True, timeout=300, cwd=cwd)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def write(path, **study):
    path.write_text(yaml.safe_dump({"study": 1, "base": TWO, **study}, sort_keys=False))
    return path


def rows_of(path):
    """Rows by column, names without units."""
    with open(path) as file:
        return [{key.split(" [")[0]: value for key, value in row.items()} for row in csv.DictReader(file)]


def every_kind(here):
    """A study of two colliding grains with a chart of every kind. Seeds do nothing there, so the speeds of the grains stand for chance."""
    (here / "page.md").write_text("# Bounces\n\nBefore.\n\n<!-- quern chart -->\nold words\n<!-- end -->\n\nAfter.\n")
    speeds = {"slow": {"grains.place.0.velocity.0": 1.0}, "fast": {"grains.place.0.velocity.0": 1.5}}
    path = write(here / "bounce.yaml", repeats={"seeds": 2}, page={"file": "page.md"}, jobs=2,
                 set={"time.end": "4 ms", "output.every": "0.1 ms", "observe": ["energy", {"profile": {"axis": 0, "bins": 10}}]},
                 axes={"restitution": {"key": "grains.contact.linear.restitution", "list": [0.5, 0.7, 0.9]}, "speed": {"cases": speeds}},
                 reference={"name": "half", "set": {"grains.contact.linear.restitution": 0.5}, "follows": ["speed"]},
                 measure=[{"name": "left", "series": "energy.grains"}, {"name": "dense", "series": "profile.density_*", "norm": "share"}],
                 charts=[{"name": "cost", "kind": "front", "measure": "left", "mark": {"restitution": 0.7, "speed": "slow"}, "relative_cost": "yes"},
                         {"name": "shares", "kind": "front", "measure": "dense", "title": "Of the profile"},
                         {"name": "over_number", "kind": "scalar", "measure": "left", "over": "restitution", "by": "speed"},
                         {"name": "over_words", "kind": "scalar", "measure": "left", "over": "speed", "by": ["restitution", "model"]},
                         {"name": "energy", "kind": "series", "column": "energy.grains", "where": {"speed": "slow"}},
                         {"name": "shape", "kind": "profile", "measure": "dense", "where": {"speed": "slow"}},
                         {"name": "speeds", "kind": "distribution", "field": "grain.velocity.x", "where": {"speed": "slow"}},
                         {"name": "line", "kind": "line", "field": "grain.velocity.x", "from": ["-50 mm", 0], "to": ["50 mm", 0], "width": "4 mm",
                          "bins": 50, "frame": "first", "by": "restitution", "where": {"speed": "slow"}}])
    call("sweep", path, "-o", here / "out", "--quiet")
    said = call("chart", path, "-o", here / "out")
    assert said.startswith("8 charts; ") and "warning" not in said, said
    return path


def check_numbers(here):
    """The numbers beside each picture, against the table and the runs' own files; and the lines of a picture against them."""
    path = every_kind(here)
    drawn, runs, points = here / "out/charts", rows_of(here / "out/table.csv"), rows_of(here / "out/points.csv")
    reference = {row["speed"]: float(row["cost.running"]) for row in runs if row["model"]}
    for row in rows_of(drawn / "cost.csv"):
        one = next(p for p in points if f"restitution {p['restitution'].removesuffix('0')}, {p['speed']}" == row["line"].replace("0.0,", "0,"))
        own = [float(r["cost.running"]) for r in runs if not r["model"] and (r["restitution"], r["speed"]) == (one["restitution"], one["speed"])]
        twins = [float(r["cost.running"]) for r in runs if r["model"] and r["speed"] == one["speed"]]
        assert math.isclose(float(row["processor time from the release on, over that of half"]), sum(own) / sum(twins), rel_tol=1e-12), row
        assert row["error of left against half"] == one["left.error"], row
    assert len(reference) == 2 and len(rows_of(drawn / "cost.csv")) == 6
    for row in rows_of(drawn / "over_number.csv"):
        if not row["line"].startswith("half"):
            one = next(p for p in points if float(p["restitution"]) == float(row["restitution"]) and p["speed"] == row["line"])
            assert row["left"] == one["left.mean"] and row["standard_error_y"] == one["left.standard_error"], row
    halves = {row["line"] for row in rows_of(drawn / "over_number.csv")} - {"slow", "fast"}
    assert halves == {"half, slow", "half, fast"}, halves
    for row in rows_of(drawn / "shares.csv"):
        assert any(math.isclose(float(row["error of dense against half"]), 100 * float(p["dense.error"]), abs_tol=1e-12)
                   and row["front_share"] == p["cost.dense.front_share"] for p in points), row
    run = next(r["run"] for r in runs if not r["model"] and (float(r["restitution"]), r["speed"]) == (0.7, "slow"))
    series = rows_of(here / "out/runs" / run / "series.csv")
    mine = [row for row in rows_of(drawn / "energy.csv") if row["line"] == "restitution 0.7"]
    assert [(float(a["time"]), float(a["energy.grains"])) for a in mine] == [(float(b["time"]), float(b["energy.grains"])) for b in series]
    shape = [row for row in rows_of(drawn / "shape.csv") if row["line"] == "restitution 0.7"]
    assert [float(row["profile.density"]) for row in shape] == [float(series[-1][f"profile.density_{k}"]) for k in range(10)]
    assert np.allclose([float(row["x"]) for row in shape], -0.045 + 0.01 * np.arange(10))
    first = [row for row in rows_of(drawn / "line.csv") if row["line"] == "restitution 0.5" and row["grain.velocity.x"]]
    assert [(round(float(row["distance along the line"]), 9), float(row["grain.velocity.x"])) for row in first] == [(0.045, 1), (0.055, -1)], first
    check_paths(drawn / "energy.svg", mine, "time", "energy.grains")
    print("ok  charts of every kind show the numbers of the table and of the runs")
    check_files(here, path)
    check_page(here)
    return drawn


def check_paths(svg, rows, x, y):
    """The second line of a picture, in the second colour, is the same numbers on linear axes: read back from its path."""
    found = re.findall(r'<path d="([^"]*)"[^>]*style="fill: none; stroke: #d55e00[^"]*stroke-width: 1.5', svg.read_text())
    places = np.array([[float(word) for word in pair] for pair in re.findall(r"[ML] (\S+) (\S+)", max(found, key=len))])
    assert len(places) == len(rows), f"{svg.name}: {len(places)} places of {len(rows)}"
    for column, name in enumerate((x, y)):
        data = np.array([float(row[name]) for row in rows])
        slope, offset = np.polyfit(data, places[:, column], 1)
        assert slope * (1 if column == 0 else -1) > 0 and np.abs(slope * data + offset - places[:, column]).max() < 1e-3, name


def check_files(here, path):
    """The same bytes again; what made the picture is in it; lines have colours and dashes, texts are texts."""
    drawn = here / "out/charts"
    before = {file.name: file.read_bytes() for file in drawn.iterdir()}
    assert len(before) == 24 and (here / "page_cost.svg").read_bytes() == before["cost.svg"]
    shutil.rmtree(drawn)
    call("chart", path, "-o", here / "out")
    after = {file.name: file.read_bytes() for file in drawn.iterdir()}
    assert before == after, [name for name in before if before[name] != after.get(name)]
    version = call("--version").strip()
    for word in (version, "quern chart", "bounce.yaml", "sha256:"):
        assert word in before["cost.svg"].decode() and word.encode() in before["cost.png"], word
    assert "<dc:date>" not in before["cost.svg"].decode() and str(here / "out") not in before["cost.svg"].decode()
    text = before["energy.svg"].decode()
    assert ">time [ms]</text>" in text and ">energy.grains [mJ]</text>" in text and "DejaVu Sans" in text and BLUE in text
    assert "stroke-dasharray" in text and "restitution 0.9</text>" in text
    print("ok  the same bytes again; version, command, study and its hash are in the files")


def check_page(here):
    text = (here / "page.md").read_text()
    assert text.startswith("# Bounces\n\nBefore.\n\n<!-- quern chart -->\n![") and text.endswith("<!-- end -->\n\nAfter.\n") and "old words" not in text
    for part in ("](page_cost.svg)", "| 6 | ", "restitution 0.7, slow **(marked)**", "All 16 runs came to their end.", " of processor time.", "made by quern", "They ran on "):
        assert part in text, f"{part}\n{text}"
    print("ok  the page: pictures, table and words")


def check_closed(here):
    """A closed form stands beside the runs where the study compares just that with it: the energy that a restitution leaves."""
    whole = 0.5 * 2 * 2500 * math.pi * 0.005 ** 2
    lines = [f"{e},{e * e * whole if t else ''},{t},{(e * e if t else 1) * whole}" for e in (0.5, 0.8) for t in (0, 0.004)]
    (here / "theory.csv").write_text("\n".join(["restitution,left [J],time [s],course [J]", *lines, ""]))
    study = write(here / "closed.yaml", set={"time.end": "4 ms", "output.every": "0.5 ms", "observe": ["energy"]}, reference={"name": "theory", "csv": "theory.csv", "follows": ["restitution"]},
                  axes={"restitution": {"key": "grains.contact.linear.restitution", "list": [0.5, 0.8]}},
                  measure=[{"name": "left", "series": "energy.grains"}, {"name": "course", "series": "energy.grains", "at": "every"}],
                  charts=[{"name": "course", "kind": "series", "column": "energy.grains"}, {"name": "left", "kind": "scalar", "measure": "left", "over": "restitution"},
                          {"name": "front", "kind": "front", "measure": "left"}])
    call("sweep", study, "-o", here / "out", "--quiet")
    call("chart", study, "-o", here / "out")
    for row in rows_of(here / "out/charts/left.csv"):
        e = float(row["restitution"])
        assert abs(float(row["left"]) / whole - e * e) < (1e-12 if row["line"] == "theory" else 0.005), row
    course = {line: [float(row["energy.grains"]) for row in rows_of(here / "out/charts/course.csv") if row["line"] == line]
              for line in ("theory, restitution 0.5", "theory, restitution 0.8", "restitution 0.8")}
    assert all(len(values) == 9 for values in course.values()), course
    assert np.allclose(course["theory, restitution 0.8"], whole * (1 + (0.64 - 1) * np.arange(9) / 8)) and course["theory, restitution 0.5"][-1] < 0.26 * whole
    front = rows_of(here / "out/charts/front.csv")
    assert len(front) == 2 and all(float(row["processor time from the release on"]) >= 0 for row in front)
    print("ok  a closed form beside runs")


# ---- fields ----

def fake_run(here, fields, scene="grains: {}\n", dimension=2):
    """A run folder with one frame of given fields."""
    (here / "frames").mkdir(parents=True)
    (here / "scene.yaml").write_text(scene)
    with h5py.File(here / "frames/000000.h5", "w") as file:
        file.attrs["dimension"] = dimension
        for name, (unit, data) in fields.items():
            group, field = name.split(".")
            file.create_dataset(f"{group}s/{field}", data=np.asarray(data, float)).attrs["unit"] = np.bytes_(unit)
    return open_run(here)


def check_fields(here):
    """A field along a line: means by mass and weight, in bins; zones; a distribution beside the one that was asked for."""
    x = np.array([[0.05, 0, 0], [0.07, 0.009, 0], [0.08, 0.02, 0], [0.15, 0, 0], [0.31, 0, 0]])
    run = fake_run(here / "points", {"point.position": ("m", x), "point.pressure": ("Pa", [1, 4, 100, 7, 9]), "point.volume": ("m^3", [1, 2, 1, 1, 1]),
                                     "point.weight": ("1", [1, 0.5, 1, 0, 1])})
    chart = Chart("a", "line", field="point.pressure", ends=((0.0, 0.0), (0.4, 0.0)), width=0.02, bins=4)
    place, value, unit = along(run, chart)
    assert unit == "Pa" and np.allclose(place, [0.05, 0.15, 0.25, 0.35]) and np.allclose(value, [2.5, math.nan, math.nan, 9], equal_nan=True), value
    chart.zone = "continuum"
    assert np.allclose(along(run, chart)[1], [1, math.nan, math.nan, 9], equal_nan=True)
    chart.zone = "hybrid"
    assert np.allclose(along(run, chart)[1][0], 4)
    tilted = Chart("a", "line", field="point.pressure", ends=((0.305, -0.1), (0.305, 0.1)), width=0.02, bins=3)
    assert np.allclose(along(run, tilted)[1], [math.nan, 9, math.nan], equal_nan=True)
    scene = "grains: {material: {radius: {mean: 2.0, spread: 0.1, law: %s}}}\n"
    fields = {"grain.position": ("m", np.zeros((4, 3))), "grain.radius": ("m", [1.9, 2.0, 2.1, 5.0]), "grain.fixed": ("1", [0, 0, 0, 1])}
    run = fake_run(here / "grains", fields, scene % "normal")
    data, unit = of_all(run, Chart("a", "distribution", field="grain.radius"))
    assert sorted(data) == [1.9, 2.0, 2.1] and unit == "m"
    asked = asked_radii(run)
    inside = math.erf(2 / 2 ** 0.5)  # of a normal distribution within two deviations
    assert np.isclose(np.interp(2.2, asked.x, asked.y), (0.5 * (1 + math.erf(1 / 2 ** 0.5)) - 0.5 * (1 - inside)) / inside, atol=1e-4) and asked.x[-1] == 2.4
    even = asked_radii(fake_run(here / "even", fields, scene % "uniform"))
    assert np.isclose(np.interp(2.1, even.x, even.y), 0.75) and np.isclose(even.x[0], 1.8)
    mean, error = over_seeds([np.array([1.0, math.nan]), np.array([3.0, 5.0])])
    assert list(mean) == [2, 5] and error[0] == 1 and math.isnan(error[1])
    print("ok  a field along a line, and a distribution, in closed form")


# ---- labels ----

def check_labels(_here):
    """Crowds of points: no label on another one, none outside."""
    for seed in range(12):
        draw = np.random.default_rng(seed)
        anchors = np.array([150.0, 120.0]) + draw.normal(0, 10 + 5 * seed, (30, 2))
        sizes = np.column_stack([draw.uniform(5, 60 if seed % 2 else 14, 30), np.full(30, 10.0)])
        bounds = np.array([0.0, 0.0, 374.0, 260.0])
        anchors = np.clip(anchors, 5, bounds[2:] - 5)
        centres = chart_labels.place(anchors, sizes, chart_labels.boxes(anchors, np.full((30, 2), 9.0)), bounds)
        found = chart_labels.boxes(centres, sizes)
        assert (found[:, :2] >= 0).all() and (found[:, 2:] <= bounds[2:]).all(), seed
        assert (chart_labels.hits(found, found) == 1).all(), seed  # itself
        near = np.median(np.hypot(*(centres - anchors).T))
        assert near < np.sqrt((sizes + chart_labels.GAP).prod(axis=1).sum() / np.pi), (seed, near)  # radius of a disc of all texts
    print("ok  thirty labels in a crowd, twelve times: none on another one")


SCRIPT = """<script>
const found = [...document.querySelectorAll("svg")].map(svg => [...svg.querySelectorAll("text")].map(text => {
  const box = text.getBoundingClientRect(); return [text.textContent, box.left, box.top, box.right, box.bottom]; }));
document.body.innerHTML = ""; const out = document.createElement("pre"); out.id = "found"; out.textContent = JSON.stringify(found);
document.body.append(out);
</script>"""


TWO_TEXTS = """<svg width="99" height="50" style="font: 10px monospace"><text x="5" y="20" textLength="20">one</text>
<text x="5" y="20" textLength="20">two</text></svg>"""


def overlapping(texts):
    """Pairs of texts whose boxes share more than half a pixel in both directions."""
    wrong = []
    for k, (word, *box) in enumerate(texts):
        for other, *beside in texts[k + 1:]:
            across, along = (min(box[side + 2], beside[side + 2]) - max(box[side], beside[side]) for side in (0, 1))
            if across > 0.5 and along > 0.5:
                wrong.append(f"'{word}' and '{other}' overlap by {across:.1f} x {along:.1f}")
    return wrong


def dump(browser, page, here):
    """A page as a browser without a window has it once its scripts are through."""
    words = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", f"--user-data-dir={here / 'profile'}", "--dump-dom", page]
    return subprocess.run(words, capture_output=True, text=True, timeout=120, env={**os.environ, "HOME": str(here)})


def check_browser(here):
    """Bounding boxes of all texts as a browser draws them: those of thirty crowded settings too."""
    draw, words = lab.seeded(), ("depth", "cell", "half width", "update every", "substeps")
    cases = {f"{words[k % 5]} {k + 2} mm": {"grains.contact.linear.restitution": round(0.5 + 0.003 * draw.random() * k, 6)} for k in range(30)}
    study = write(here / "crowd.yaml", set={"time.end": "2.5 ms", "observe": ["energy"]}, axes={"setting": {"cases": cases}}, repeats={"seeds": 2},
                  reference={"name": "grains", "set": {"grains.contact.linear.restitution": 0.5}}, jobs=2, measure=[{"name": "left", "series": "energy.grains"}],
                  charts=[{"name": "front", "kind": "front", "measure": "left", "title": "Thirty settings", "relative_cost": "yes", "mark": {"setting": "cell 3 mm"}},
                          {"name": "all", "kind": "scalar", "measure": "left", "over": "setting"}])
    call("sweep", study, "-o", here / "crowd", "--quiet")
    call("chart", study, "-o", here / "crowd")
    text = (here / "crowd/charts/front.svg").read_text()
    assert all(f">{k + 1}</text>" in text for k in range(30)) and len(rows_of(here / "crowd/charts/front.csv")) == 30
    browser = shutil.which("chromium")
    if not browser:
        print("--  chromium is not there: texts are not measured")
        return
    pictures = sorted([*(here / "crowd/charts").glob("*.svg"), *(here.parent / "check_numbers/out/charts").glob("*.svg")])
    parts = [path.read_text() for path in pictures]
    html = "".join(f"<div>{part[part.index('<svg'):]}</div>" for part in parts)
    (here / "all.html").write_text(f'<!DOCTYPE html><html><head><meta charset="utf-8"></head><body>{html}{TWO_TEXTS}{SCRIPT}</body></html>')
    done = dump(browser, here / "all.html", here)
    match = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    if not match and "<body>" not in dump(browser, "about:blank", here).stdout:
        print(f"--  chromium is there, but does not come up: texts are not measured\n{done.stderr[-1000:]}")
        return
    assert match, done.stderr[-2000:]
    found = json.loads(match[1].replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
    seen = overlapping(found.pop())
    assert len(seen) == 1 and seen[0].startswith("'one' and 'two' overlap by "), f"the test would not see an overlap: {seen}"
    wrong = [f"{path.name}: {line}" for path, texts in zip(pictures, found, strict=True) for line in overlapping(texts)]
    assert not wrong, "\n".join(wrong)
    count = sum(map(len, found))
    print(f"ok  {count} texts in {len(pictures)} pictures, in a browser: none on another one")


# ---- what goes wrong ----

def check_faults(here):
    out = here.parent / "check_numbers/out"
    study = here.parent / "check_numbers/bounce.yaml"
    run = next(path for path in (out / "runs").iterdir() if path.is_dir())
    for words, status, said in (
            ([study, "-o", here / "none"], 2, "no table lies there; quern sweep"), ([study, "-o", out, "--only", "x"], 1, "no chart is called so; charts: cost, shares,"),
            ([run], 1, "is a folder; say what of the run to draw"), ([run, "--series", "a.b", "-o", here / "a.svg"], 2, "the series have no 'a.b'"),
            ([run, "--series", "energy.grains", "-o", "a.gif"], 1, "must end with .svg, .png or .pdf"), ([run, "--line", "grain.radius"], 1, "--line needs --from"),
            ([run, "--line", "grain.radius", "--from", "0,0", "--to", "0,0"], 1, "must be two places"), ([], 1, "required"), ([here / "no.yaml"], 2, "cannot be read"),
            ([run, "--line", "grain.radius", "--from", "-1 kg,0", "--to", "0,0"], 1, "is no length"), ([here / "nowhere", "--series", "a"], 2, "there is no such folder"),
            ([run, "--series", "energy.grains,time", "-o", here / "a.svg"], 1, "draw a chart for each"), ([run, "--profile", "p", "--distribution", "q"], 1, "give one of"),
            ([run, "--profile", "profile.density", "--frame", "99", "-o", here / "a.svg"], 2, "there is no frame 99")):
        text = call("chart", *words, status=status)
        assert said in text, f"{words}\n{text}"
    for words in (["--series", "energy.grains,energy.stored"], ["--profile", "profile.x", "--frame", "3"], ["--distribution", "grain.radius"],
                  ["--line", "grain.velocity.x", "--from", "-50mm,0", "--to", "50 mm,0"]):
        kind = "pdf" if "--profile" in words else "svg"
        call("chart", run, *words, "-o", here / f"run.{kind}")
        assert (here / f"run.{kind}").stat().st_size > 3000
    other = study.read_text()
    study.write_text(other.replace("- 0.7", "- 0.71", 1).replace("restitution: 0.7", "restitution: 0.71"))
    assert "is of another form of the study" in call("chart", study, "-o", out, status=2)
    study.write_text(other)
    shutil.copytree(out, here / "lost")
    record = next((here / "lost/runs").glob("*.json"))
    record.unlink()
    call("sweep", study, "-o", here / "lost", "--table")
    (here.parent / "check_numbers/page.md").write_text("no marks\n")
    text = call("chart", study, "-o", here / "lost", status=2)
    assert "of 16 runs are missing; quern sweep" in text and "must have one line '<!-- quern chart -->'" in text, text
    print("ok  what goes wrong is said; charts of runs alone")


with lab.workplace() as name:
    for check in (check_numbers, check_closed, check_fields, check_labels, check_browser, check_faults):
        place = pathlib.Path(name) / check.__name__
        place.mkdir()
        check(place)
