#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""report - the key numbers of a run's summary, and where its files are: tools/report.py DIR..."""
import json
import sys

ROWS = [
    ("grains", "moving and fixed, at the end", lambda s: f"{s['grains']}"),
    ("points", "at the end", lambda s: f"{s['points']}"),
    ("wall time", "settling apart", lambda s: f"{s['wall_seconds'] - s['settle_seconds']:.1f} s, settling {s['settle_seconds']:.1f} s, {s['threads']} threads"),
    ("run-out", "99 % of the connected mass", lambda s: f"{s['observers']['runout']['front']['last']:.4f} m"),
    ("height", "99 % of the connected mass", lambda s: f"{s['observers']['runout']['height']['last']:.4f} m"),
    ("discrete share", "of the mass, mean over time", lambda s: f"{s['discrete_share']:.3f}"),
    ("ledger", "sum of |entries| over the mass, mean over time", lambda s: f"{s['observers']['ledger']['entries']['mean']:.4f}"),
    ("carried mass", "over that at the start, minus 1, last and worst", lambda s: f"{s['observers']['ledger']['carried']['last']:+.4f}, {max((s['observers']['ledger']['carried'][k] for k in ('min', 'max')), key=abs):+.4f}"),
    ("invariants", "mass and momentum, relative, worst step", lambda s: f"{s['invariant_defect']:.1e}"),
]


def main():
    for folder in sys.argv[1:]:
        with open(f"{folder}/summary.json") as file:
            summary = json.load(file)
        print(f"\n{summary['name']}: {summary['status']}, t = {summary['time_end']:g} s")
        for name, meaning, show in ROWS:
            try:
                print(f"  {name:15s} {show(summary):38s} {meaning}")
            except KeyError:
                pass
        print(f"  numbers: {folder}/summary.json, {folder}/series.csv\n  picture: {folder}/column.png")


main()
