#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""chart - draws docs/speed_accuracy.svg and writes the table of docs/speed_accuracy.md: chart.py results.json"""
import json
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "tools"))
import provenance  # noqa: E402

DOCS = pathlib.Path(__file__).resolve().parent.parent.parent / "docs"
BEGIN, END = "<!-- written by chart.py -->", "<!-- end -->"
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 900, 560, 80, 190, 40, 60


def errors(results):
    """Mean profile of the grains, their own scatter, and by setting: cost over grains, error of profile, run-out, height."""
    grains = results["grains"]
    mean = np.mean([g["profile"] for g in grains], axis=0)
    off = lambda p: float(np.abs(np.array(p) - mean).sum() / mean.sum())
    cost = np.mean([g["core_seconds"] for g in grains])
    front, height = np.mean([g["front"] for g in grains]), np.mean([g["height"] for g in grains])
    rows = {n: (s["core_seconds"] / cost, off(s["profile"]), s["front"] / front - 1, s["height"] / height - 1)
            for n, s in results["settings"].items()}
    # a seed against the mean of the others, which it must not be part of
    scatter = []
    for k, g in enumerate(grains):
        others = np.mean([o["profile"] for j, o in enumerate(grains) if j != k], axis=0)
        scatter.append(float(np.abs(np.array(g["profile"]) - others).sum() / others.sum()))
    return rows, float(np.mean(scatter)), cost


def front_of(rows):
    return sorted((r[0], r[1], n) for n, r in rows.items()
                  if not any(o[0] <= r[0] and o[1] <= r[1] and o != r for o in rows.values()))


def draw(rows, scatter):
    log = np.log10
    costs, worst = [r[0] for r in rows.values()] + [1.0], max(r[1] for r in rows.values()) * 1.08
    low, high = log(min(costs)) - 0.1, max(log(max(costs)), 0) + 0.1
    x = lambda c: LEFT + (log(c) - low) / (high - low) * (WIDTH - LEFT - RIGHT)
    y = lambda e: HEIGHT - BOTTOM - e / worst * (HEIGHT - TOP - BOTTOM)
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" font-family="DejaVu Sans, sans-serif" font-size="12">',
           '<rect width="100%" height="100%" fill="white"/>',
           f'<text x="{LEFT}" y="22" font-size="15" font-weight="bold">Column collapse: cost against error to grains alone</text>']
    text = lambda px, py, s, anchor="start", more="": out.append(f'<text x="{px:.1f}" y="{py:.1f}" text-anchor="{anchor}" {more}>{s}</text>')
    line = lambda x1, y1, x2, y2, style: out.append(f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>')
    out.append(f'<rect x="{LEFT}" y="{y(scatter):.1f}" width="{WIDTH - LEFT - RIGHT}" height="{y(0) - y(scatter):.1f}" fill="#e8eef5"/>')
    text(LEFT + 6, y(scatter) + 15, "grains differ by this much from seed to seed", more='fill="#4a6785"')
    for c in (0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0):
        if low <= log(c) <= high:
            line(x(c), y(0), x(c), y(0) + 5, 'stroke="black"')
            text(x(c), y(0) + 19, f"{c:g}", "middle")
    step = 0.05 if worst > 0.12 else 0.02
    for e in np.arange(0, worst, step):
        line(LEFT - 5, y(e), LEFT, y(e), 'stroke="black"')
        text(LEFT - 9, y(e) + 4, f"{100 * e:.0f} %", "end")
    line(LEFT, y(0), WIDTH - RIGHT, y(0), 'stroke="black"')
    line(LEFT, y(0), LEFT, TOP, 'stroke="black"')
    text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 16, "processor time, grains alone = 1", "middle")
    text(0, 0, "error of the final profile", "middle", f'transform="translate(22,{(TOP + HEIGHT - BOTTOM) / 2}) rotate(-90)"')
    best = front_of(rows)
    path = " ".join(f"{'M' if i == 0 else 'L'}{x(c):.1f},{y(e):.1f}" for i, (c, e, _) in enumerate(best))
    out.append(f'<path d="{path}" fill="none" stroke="#c0392b" stroke-width="1.5" stroke-dasharray="5 3"/>')
    names = {n for _, _, n in best}
    taken = []
    text(WIDTH - RIGHT + 24, TOP + 14, "by error of the profile", more='fill="#666"')
    for k, (n, r) in enumerate(sorted(rows.items(), key=lambda i: i[1][1]), 1):
        px, py, bold = x(r[0]), y(r[1]), 'font-weight="bold"' if n == "column.yaml" else ""
        out.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4.5" fill="{"#c0392b" if n in names else "#2c6e9b"}"/>')
        places = [(px + a, py + b) for a, b in ((8, 4), (-16, 4), (-4, -8), (-4, 18), (8, -8), (8, 16), (-18, -8), (-18, 16))]
        lx, ly = next((q for q in places if all(abs(q[0] - t[0]) > 13 or abs(q[1] - t[1]) > 11 for t in taken)), places[0])
        taken += [(lx, ly), (px - 4, py + 4)]
        text(lx, ly, k, more=f'font-size="10" {bold}')
        text(WIDTH - RIGHT + 24, TOP + 16 + 17 * k, f"{k}  {n}", more=bold)
    out.append('<circle cx="%g" cy="%g" r="5" fill="#c0392b"/><text x="%g" y="%g">Pareto front</text></svg>' % (LEFT + 20, TOP + 6, LEFT + 31, TOP + 10))
    return "\n".join(out)


def table(results, rows, scatter, cost):
    grains, repeats = results["grains"], results["repeats"]
    best = {n for _, _, n in front_of(rows)}
    lines = [f"Measured on {provenance.line(results['provenance'])}.", ""] if "provenance" in results else []
    lines += ["| setting | cost | profile | run-out | height | share of grains | entries | carried mass | |", "|---|---|---|---|---|---|---|---|---|"]
    for n, r in sorted(rows.items(), key=lambda i: i[1][1]):
        s = results["settings"][n]
        lines.append(f"| {n} | {r[0]:.2f} | {100 * r[1]:.1f} % | {100 * r[2]:+.1f} % | {100 * r[3]:+.1f} % | {s['share']:.2f} | {s['entries']:.4f} | {s['carried']:+.4f} | {'front' if n in best else ''} |")
    lines += ["", f"Grains alone: {cost:.0f} s of processor time; the profile of a seed is {100 * scatter:.1f} % from the mean of the others.", ""]
    for key, unit in (("front", "run-out"), ("height", "height")):
        a, b = np.array([g[key] for g in grains]), np.array([g[key] for g in repeats])
        if len(a) > 1:
            error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
            lines.append(f"Over {len(a)} seeds the {unit} of `column.yaml` is {b.mean():.4f} m against {a.mean():.4f} m of grains: {100 * (b.mean() / a.mean() - 1):+.1f} %, twice the standard error of the difference {200 * error / a.mean():.1f} %.")
    return "\n".join(lines) + "\n"


def main():
    results = json.loads(pathlib.Path(sys.argv[1]).read_text())
    rows, scatter, cost = errors(results)
    (DOCS / "speed_accuracy.svg").write_text(draw(rows, scatter))
    page = (DOCS / "speed_accuracy.md").read_text()
    before, after = page[:page.index(BEGIN)], page[page.index(END):]
    (DOCS / "speed_accuracy.md").write_text(f"{before}{BEGIN}\n{table(results, rows, scatter, cost)}\n{after}")
    print(table(results, rows, scatter, cost))


main()
