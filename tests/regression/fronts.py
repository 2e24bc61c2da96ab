# SPDX-License-Identifier: MIT
"""Charts of cost against error, and the page that tells them: shares among what is shown, costs over those of the reference, what is not
known, closed forms; sentences that are true of whatever table there is; axes with ticks and room for bars; the same in any locale."""
import csv
import json
import math
import os
import pathlib
import subprocess
import sys

import numpy as np

import lab

try:
    import matplotlib
    import yaml
except ImportError as missing:
    print(f"{missing.name} is not there")
    sys.exit(77)

sys.path.insert(0, str(lab.SOURCE / "python"))
from quern import page  # noqa: E402
from quern.chart_data import Curve, Front, Group, Picture, draw_distribution  # noqa: E402
from quern.chart_draw import STYLE, figure_of, percent, scaled  # noqa: E402
from quern.chart_form import Chart  # noqa: E402
from quern.chart_study import picture_of, read_made  # noqa: E402
from quern.program import sentence_of  # noqa: E402
from quern.study import read  # noqa: E402

TWO = lab.scene("two_grains")
E = "grains.contact.linear.restitution"
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def call(*words, status=0, **env):
    done = subprocess.run([lab.QUERN, *map(str, words)], capture_output=True, text=True, timeout=300, env={**os.environ, **env})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def write(path, **study):
    path.write_text(yaml.safe_dump({"study": 1, "base": TWO, "set": {"time.end": "4 ms", "observe": ["energy"]}, **study}, sort_keys=False))
    return path


def rows_of(path):
    """Rows by column, names without units."""
    with open(path) as file:
        return [{key.split(" [")[0]: value for key, value in row.items()} for row in csv.DictReader(file)]


def price(study, out, cost_of):
    """Costs as `cost_of` says of a row of the table, None for one that is not recorded, in place of those of the clock."""
    for row in rows_of(out / "table.csv"):
        path = out / "runs" / f"{row['run']}.json"
        record = json.loads(path.read_text())
        cost = cost_of(row)
        record["cost"] |= {"running": cost}
        if cost is None:
            del record["cost"]["running"]
        path.write_text(json.dumps(record))
    call("sweep", study, "-o", out, "--table")


def check_subset(here):
    """Whoever shows a part of the points, or costs over those of several references, sees the front of just that. Bounces at a speed leave an error
    that grows with it; costs are given."""
    speeds = {"slow": {"grains.place.0.velocity.0": 1.0}, "fast": {"grains.place.0.velocity.0": 1.5}}
    front = {"kind": "front", "measure": "left"}
    study = write(here / "study.yaml", repeats={"seeds": 2}, axes={"e": {"key": E, "list": [0.5, 0.7]}, "speed": {"cases": speeds}},
                  reference={"name": "hard", "set": {E: 0.4}, "follows": ["speed"]}, measure=[{"name": "left", "series": "energy.grains"}],
                  charts=[{"name": "whole", **front}, {"name": "part", "where": {"speed": "fast"}, **front},
                          {"name": "over", "relative_cost": "yes", **front}])
    call("sweep", study, "-o", here / "out", "--quiet")
    costs = {("0.5", "slow"): 4, ("0.7", "slow"): 1, ("0.5", "fast"): 8, ("0.7", "fast"): 4, ("", "slow"): 2, ("", "fast"): 80}
    price(study, here / "out", lambda row: costs[row["e"], row["speed"]] + (int(row["seed"]) - 1) * (2 if row["speed"] == "slow" else 0))
    call("chart", study, "-o", here / "out")
    shares = {name: {row["line"]: row["front_share"] for row in rows_of(here / f"out/charts/{name}.csv")} for name in ("whole", "part", "over")}
    assert shares["whole"] == {"e 0.5, slow": "1.0", "e 0.7, slow": "1.0", "e 0.5, fast": "0.0", "e 0.7, fast": "0.0"}, shares
    assert shares["part"] == {"e 0.5": "1.0", "e 0.7": "1.0"}, shares
    assert shares["over"]["e 0.7, fast"] == "1.0" == shares["over"]["e 0.5, slow"], shares
    over = {row["line"]: [float(row[name] or "nan") for name in ("processor time from the release on, over that of hard", "standard_error_x")]
            for row in rows_of(here / "out/charts/over.csv")}
    # pairs of 4 and 2, 6 and 4: 5/3, and what is left of the pairs is 4 - 10/3 and 6 - 20/3
    assert np.allclose(over["e 0.5, slow"], [5 / 3, math.sqrt(2 * (2 / 3) ** 2) / 3 / math.sqrt(2)], rtol=1e-12), over
    assert np.allclose(over["e 0.7, fast"], [4 / 80, 0]), over
    print("ok  shares on the front of what is shown; costs over the reference's, with the chance of both")
    price(study, here / "out", lambda row: None if (row["e"], row["speed"]) == ("0.5", "fast") else costs[row["e"], row["speed"]])
    (here / "page.md").write_text("# Bounces\n<!-- quern chart --><!-- end -->\n")
    tree = yaml.safe_load(study.read_text()) | {"page": {"file": "page.md"}}
    tree["charts"][0]["title"] = "Höhe, µ"
    study.write_text(yaml.safe_dump(tree, allow_unicode=True, sort_keys=False), encoding="utf-8")
    said = call("chart", study, "-o", here / "out", **ASCII)
    assert "warning: whole: e 0.5, fast: its cost or error is not known, so that it is not shown" in said, said
    text = (here / "page.md").read_text(encoding="utf-8")
    assert 'Cost or error of *e 0.5, fast* is not known.' in text and "![Höhe, µ](page_whole.svg)" in text, text
    assert "All 12 runs came to their end." in text, text
    (here / "page.md").write_bytes(b"\xff<!-- quern chart --><!-- end -->\n")
    assert "page.md is not text in UTF-8" in call("chart", study, "-o", here / "out", status=2)
    once = write(here / "once.yaml", axes={"e": {"key": E, "list": [0.5]}}, reference={"name": "hard", "set": {E: 0.4}},
                 measure=[{"name": "left", "series": "energy.grains", "relative": True}, {"name": "count", "frame": "grain.radius", "of": "count"}],
                 charts=[{"name": "over", "relative_cost": "yes", **front}])
    call("sweep", once, "-o", here / "once", "--quiet")
    price(once, here / "once", lambda row: 3 if row["model"] else 2)
    call("chart", once, "-o", here / "once")
    row, = rows_of(here / "once/charts/over.csv")
    assert float(row["processor time from the release on, over that of hard"]) == 2 / 3, row
    assert not row["standard_error_x"] and not row["front_share"], row
    text = page.points_table(read_made(read(once), here / "once"))  # errors are per cent where they are shares, not of numbers without a unit
    assert "| error of left [%] | count | of hard | error of count | runs |" in text, text
    print("ok  costs that nobody knows are told; a page in a locale of plain letters")


def check_closed(here):
    """A closed form has no scatter to compare with, and its distribution is straight from row to row."""
    (here / "theory.csv").write_text("e,left [J],speeds [m/s],share [1]\n" + "".join(f"{e},{e},,\n{e},,-1,0\n{e},,1,1\n" for e in (0.5, 0.8)))
    study = write(here / "study.yaml", axes={"e": {"key": E, "list": [0.5, 0.8]}}, page={"file": "page.md"},
                  reference={"name": "theory", "csv": "theory.csv", "follows": ["e"]},
                  measure=[{"name": "left", "series": "energy.grains"}, {"name": "speeds", "frame": "grain.velocity.x", "of": "all"}],
                  charts=[{"name": "front", "kind": "front", "measure": "left"},
                          {"name": "speeds", "kind": "distribution", "field": "grain.velocity.x", "where": {"e": 0.5}}])
    (here / "page.md").write_text("<!-- quern chart --><!-- end -->\n")
    call("sweep", study, "-o", here / "out", "--quiet")
    call("chart", study, "-o", here / "out")
    text = (here / "page.md").read_text()
    assert "scatter" not in text and "of single runs" not in (here / "out/charts/front.svg").read_text(), text
    assert "Of one seed nothing can be said about what chance does to the front" in text and "| one seed |" in text, text
    assert rows_of(here / "out/points.csv")[0]["cost.left.on_front"] == ""
    with matplotlib.rc_context(STYLE):
        made = read_made(read(study), here / "out")
        lines = {line.get_label(): line for line in figure_of(picture_of(made, made.study.charts[1])).axes[0].lines}
    assert lines["theory"].get_drawstyle() == "default" and lines["study"].get_drawstyle() == "steps-post", lines
    print("ok  a closed form: no scatter, straight from place to place")


def check_asked(here):
    """Runs that ask for several distributions have several lines, each by its name."""
    groups = []
    for spread in (0.1, 0.2):
        run = here / f"{spread}"
        (run / "frames").mkdir(parents=True)
        (run / "scene.yaml").write_text(f"grains: {{material: {{radius: {{mean: 2.0, spread: {spread}, law: uniform}}}}}}\n")
        with lab.h5py.File(run / "frames/000000.h5", "w") as file:
            file.create_dataset("grains/radius", data=np.array([1.9, 2.0])).attrs["unit"] = np.bytes_("m")
        groups += [Group(f"spread {spread}", [run])] * 2
    found = draw_distribution(Chart("a", "distribution", field="grain.radius"), groups).curves
    assert [one.label for one in found if one.reference] == ["asked, spread 0.1", "asked, spread 0.2"] and found[-1].straight, found
    one = draw_distribution(Chart("a", "distribution", field="grain.radius"), groups[:2]).curves
    assert [one.label for one in one if one.reference] == ["asked"], one
    print("ok  distributions that were asked for")


# ---- sentences and axes ----

def picture(x, y, shares, marks, scatter, relative=True, dx=None, gone=()):
    labels = [f"s{k}" for k in range(len(x))]
    front = Front(list(range(len(x))), labels, np.array(shares), marks, scatter, "grains", relative, list(gone))
    nothing = np.full(len(x), math.nan)
    line = Curve("settings", np.array(x), np.array(y), nothing if dx is None else np.array(dx), nothing)
    return Picture("a", "front", "", ("cost", "1" if relative else "s"), ("error", "%"), [line], front=front)


def check_sentences(_here):
    one = picture([0.2, 0.5, 0.8, 0.9], [5.0, 2.0, 3.0, 1.0], [1.0, 0.97, 0.2, 0.0], {2: "as it stands"}, 2.5)
    assert page.about_front(one.front) == [
        "Surely on the front of cost and error, in at least 95 % of the resamples of the seeds, are *s0* and *s1*.",
        'Chance decides about *s2* (20 %).']
    assert page.about_mark(one, 2) == 'The marked *s2* costs 0.8 times as much as grains and is off by 3 %; in the means it is beaten by ' \
        '*s1*, which costs 38 % less and is off by 2 %.'
    assert page.about_mark(one, 1).endswith("; it is itself surely on the front.")
    assert page.about_mark(one, 3).endswith("; no point that is surely on the front is at most as dear and at most as wrong.")
    assert page.about_scatter(one) == ['Single runs of grains scatter by 2.5 %; 2 of 4 points are off by no more: *s1* and *s3*.',
                                       'The cheapest of those costs 0.5 times as much as grains: *s1*.']
    none = picture([0.2, 0.5], [5.0, 2.0], [0.5, math.nan], {}, 1.0, gone=["a, b", "c|d"])
    assert page.about_front(none.front) == ["No point is surely on the front of cost and error: none is there in 95 % of the resamples of the seeds.",
                                            'Chance decides about *s0* (50 %).', 'Nothing can be said of *s1*, of one seed.',
                                            'Cost or error of *a, b* and *c\\|d* is not known.']
    assert page.about_scatter(none) == ["Single runs of grains scatter by 1 %; every point is off by more."]
    # what is not sure is not told as 95 %
    assert page.about_front(picture([1.0], [1.0], [0.949], {}, 1.0).front)[1] == 'Chance decides about *s0* (94.9 %).'
    assert [percent(share) for share in (0.949, 0.946, 0.95, 0.054, 0.05, 0.126, 1.0)] \
        == ["94.9 %", "94.6 %", "95 %", "5.4 %", "5 %", "13 %", "100 %"]
    # as dear, much cheaper, for nothing
    for cost, words in ((3.0, "costs as much"), (2.99, "costs as much"), (0.006, "costs 99.8 % less"), (0.0, "costs 100 % less")):
        beaten = picture([cost, 3.0], [1.0, 2.0], [1.0, 0.0], {}, 1.0, relative=False)
        assert page.about_mark(beaten, 1) == 'The marked *s1* costs 3 s and is off by 2 %; in the means it is beaten by *s0*, ' \
            f'which {words} and is off by 1 %.'
    assert page.about_mark(picture([0.5], [1.0], [math.nan], {}, 1.0), 0) == "The marked *s0* costs 0.5 times as much as grains and is off by 1 %."
    assert "costs as much" in page.about_mark(picture([0.0, 0.0], [1.0, 2.0], [1.0, 0.0], {}, 1.0), 1)
    print("ok  sentences follow from their numbers")


def check_digits(_here):
    """As many as are known: neither all that a file has, nor those of a spread that rounding made."""
    for value, spread, wanted in ((0.12345, 0.0123, "0.123 ± 0.012"), (12345.6, 250, "12350 ± 250"), (3.0, math.nan, "3"), (12345.6, 0, "12300"),
                                  (0.1234, 1.4e-17, "0.123"), (2.5e8, 1.2e7, "2.50e+08 ± 1.2e+07"), (3.14e-8, 2e-10, "3.140e-08 ± 2.0e-10"),
                                  (0.0, 0.2, "0.00 ± 0.20"), (0.0, 0.0, "0"), (math.nan, 1.0, "?"), (5.0, math.inf, "5"), (-1.0, 30.0, "-1 ± 30")):
        assert page.number(value, spread) == wanted, (value, spread, page.number(value, spread))
    assert scaled("m", [np.array([0.002, math.inf, math.nan])]) == (1e-3, "mm") and scaled("J", [np.array([math.inf])]) == (1.0, "J")
    # a full disk names no file, HDF5 neither file nor reason
    faults = OSError(28, "No space left on device"), OSError("Can't read data"), OSError(2, "No such file", "a"), KeyError("b")
    assert [sentence_of(why) for why in faults] == ["No space left on device", "Can't read data", "a: No such file", "b"]
    print("ok  digits and units")


def check_axes(_here):
    """Every axis has ticks within it, and every bar lies within the axes; to its right it is a whole standard error."""
    with matplotlib.rc_context(STYLE):
        for x, dx in (([3.3], [0.0]), ([3.3, 4.1], [0.1, 2.0]), ([0.8, 0.9], [0.5, 1.5]), ([1.0, 700.0], [0.3, 500.0]), ([6.2, 9.9], [5.9, 0.1]),
                      ([0.0, 1.0], [0.0, 0.1])):
            for relative in (True, False):
                axes = figure_of(picture(x, np.arange(len(x)) + 1.0, [1.0] * len(x), {}, 0.5, relative, dx)).axes[0]
                low, high = axes.get_xlim()
                ticks = [tick for tick in axes.xaxis.get_majorticklocs() if low <= tick <= high]
                assert len(ticks) >= 2, (x, low, high, ticks)
                ends = max(a + b for a, b in zip(x, dx))
                assert high >= ends, (x, dx, high)
                bars = [line for lines in axes.collections if hasattr(lines, "get_segments") for line in lines.get_segments()]
                assert math.isclose(max(float(bar[:, 0].max()) for bar in bars), ends), (x, dx, bars)
                assert low == 0 or axes.get_xscale() == "linear" or low <= min(max(a - b, 0.1 * a) for a, b in zip(x, dx)), (x, dx, low)
    print("ok  ticks and bars within the axes")


with lab.workplace() as name:
    for check in (check_sentences, check_digits, check_axes, check_asked, check_subset, check_closed):
        place = pathlib.Path(name) / check.__name__
        place.mkdir()
        check(place)
