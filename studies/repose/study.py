#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""repose - the angle of a poured heap over the coefficient of rolling friction.

    studies/repose/study.py [--out DIR] [--seeds 5] [--jobs 2]

Runs configs/heap.yaml on a wider floor until it rests, with five coefficients and as many seeds, and writes docs/validation/repose.md and
repose.svg. The angle of a run is the mean of both flanks, by the observer repose. Runs that are in DIR already are not repeated. Takes five
to ten minutes on two cores."""
import argparse
import concurrent.futures
import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import provenance  # noqa: E402
DOCS = ROOT / "docs/validation"
COEFFICIENTS = (0, 0.05, 0.1, 0.2, 0.3)
SPAN = 0.02, 0.07  # m from the middle: neither the blunt top, where the stream falls, nor the foot
REST = 1e-3  # m/s, of the grains' velocities the root of the mean square, at most, for the last 0.2 s
WIDER = ["domain.lower=[-0.2, 0]", "domain.upper=[0.2, 0.13]", "time.end=4 s",
         "grains.fill.region.box={lower: [-0.2, -0.5 mm], upper: [0.2, -0.5 mm]}",
         f"observe=[outflow, granular_temperature, {{repose: {{from: {SPAN[0]}, to: {SPAN[1]}, label: right}}}}, "
         f"{{repose: {{from: {-SPAN[1]}, to: {-SPAN[0]}, label: left}}}}]"]


def is_done(folder):
    summary = folder / "summary.json"
    return summary.exists() and json.loads(summary.read_text())["status"] == "done"


def run(folder, coefficient, seed):
    """One heap, unless it is there and done."""
    if not is_done(folder):
        sets = [*WIDER, f"seed={seed}", f"grains.contact.1.rolling.friction={coefficient}"]
        subprocess.run([ROOT / "build/quern", "run", ROOT / "configs/heap.yaml", "-o", folder, "--force", "--quiet", "--no-cache",
                        "--threads", "1", *(f"--set={one}" for one in sets)], check=True)
    return folder


def look(folder):
    """Slope of both flanks of a heap that rests, degrees, and the share of what was poured that has left the floor."""
    assert is_done(folder), f"{folder} has not come to its end"
    with open(folder / "series.csv") as file:
        rows = [{name.split(" ")[0]: float(x) for name, x in row.items()} for row in csv.DictReader(file)]
    last = rows[-1]
    for row in rows:
        speed = math.sqrt(2 * row["granular_temperature.temperature"])
        assert row["time"] < last["time"] - 0.2 or speed < REST, f"{folder} does not rest: {speed:.2g} m/s at {row['time']} s"
    left, right = math.degrees(last["left.angle"]), -math.degrees(last["right.angle"])
    return {"angle": (left + right) / 2, "flanks": abs(left - right), "lost": last["outflow.mass"] / last["outflow.poured"]}


def fold(runs):
    """Mean of what several seeds gave, and its standard error."""
    return {key: (statistics.mean(r[key] for r in runs), statistics.stdev(r[key] for r in runs) / math.sqrt(len(runs))) for key in runs[0]}


def table(rows):
    lines = ["| coefficient of rolling friction | angle, degrees | its standard error | least and greatest of a seed | flanks of a heap apart by |",
             "|---|---|---|---|---|"]
    for coefficient, runs in rows.items():
        r, angles = fold(runs), [one["angle"] for one in runs]
        lines.append(f"| {coefficient:g} | {r['angle'][0]:.1f} | {r['angle'][1]:.1f} | {min(angles):.1f}, {max(angles):.1f} | {r['flanks'][0]:.1f} |")
    return "\n".join(lines)


def draw(rows):
    """The angle over the coefficient: means with their standard error, and every seed as a small ring."""
    width, height, left, top, bottom, most, high = 640, 420, 70, 40, 60, 0.32, 28
    x = lambda c: left + c / most * (width - left - 30)
    y = lambda a: height - bottom - (a - 8) / (high - 8) * (height - top - bottom)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="DejaVu Sans, sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="white"/>',
           f'<text x="{left}" y="22" font-size="15" font-weight="bold">Angle of repose of discs that resist rolling</text>',
           f'<path d="M{left},{top} V{y(8)} H{width - 30}" fill="none" stroke="black"/>']
    out += [f'<path d="M{left - 5},{y(a)} h5" stroke="black"/><text x="{left - 9}" y="{y(a) + 4}" text-anchor="end">{a}</text>' for a in range(8, high + 1, 4)]
    out += [f'<path d="M{x(c):.1f},{y(8)} v5" stroke="black"/><text x="{x(c):.1f}" y="{y(8) + 19}" text-anchor="middle">{c:g}</text>'
            for c in (0, 0.1, 0.2, 0.3)]
    out += [f'<text x="{(left + width - 30) / 2}" y="{height - 16}" text-anchor="middle">coefficient of rolling friction</text>',
            f'<text transform="translate(24,{(top + height - bottom) / 2}) rotate(-90)" text-anchor="middle">angle, degrees</text>']
    means = {c: fold(runs)["angle"] for c, runs in rows.items()}
    path = " ".join(f"{'L' if i else 'M'}{x(c):.1f},{y(a):.1f}" for i, (c, (a, _)) in enumerate(means.items()))
    out.append(f'<path d="{path}" fill="none" stroke="#2c6e9b"/>')
    for c, (a, error) in means.items():
        out += [f'<circle cx="{x(c):.1f}" cy="{y(one["angle"]):.1f}" r="2.5" fill="none" stroke="#999"/>' for one in rows[c]]
        out.append(f'<path d="M{x(c):.1f},{y(a - error):.1f} V{y(a + error):.1f}" stroke="#c0392b" stroke-width="2"/>'
                   f'<circle cx="{x(c):.1f}" cy="{y(a):.1f}" r="4" fill="#c0392b"/>')
    return "\n".join([*out, "</svg>\n"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/repose_study")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time, of one thread each")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        jobs = {c: [pool.submit(run, args.out / f"{c}_{seed}", c, seed) for seed in range(1, args.seeds + 1)] for c in COEFFICIENTS}
        rows = {c: [look(job.result()) for job in some] for c, some in jobs.items()}
    print(table(rows))
    (DOCS / "repose.svg").write_text(draw(rows))
    page = DOCS / "repose.md"
    _, mark, words = page.read_text().partition("<!-- end -->")
    page.write_text(PAGE.format(table=table(rows), seeds=args.seeds, begin=1e3 * SPAN[0], end=1e3 * SPAN[1], rest=1e3 * REST,
                                lost=100 * max(r["lost"] for some in rows.values() for r in some),
                                provenance=provenance.line(provenance.of())) + mark + words)


PAGE = """<!-- written by studies/repose/study.py -->

# A heap

A source pours discs onto a rough floor, as in `configs/heap.yaml` on a wider floor, for two seconds; two seconds later the heap is looked
at. The *angle of repose* of a run is the mean slope of both flanks, each by least squares through the tops of columns between {begin:.0f} mm and
{end:.0f} mm from the middle (the observer `repose`). So neither the blunt top counts, where the stream falls, nor the foot. All runs have come to their
end, and in their last 0.2 s grains move with less than {rest:g} mm/s, root mean square. Of what was poured at most {lost:.2g} % has left the floor. Each
coefficient has {seeds} seeds; a heap's two flanks are one sample, and the standard error is that of the mean over seeds.

{table}

![the angle over the coefficient](repose.svg)

Measured on {provenance}.

"""

if __name__ == "__main__":
    main()
