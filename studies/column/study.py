#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""column - the main scene as hybrid, as pure grains and as pure continuum, over seeds: how far apart they end.

    studies/column/study.py [--out DIR] [--threads 2] [--only column]

Runs configs/column.yaml (three seeds) and configs/column_3d.yaml (two) as they stand, their twins by `model`, that of the
continuum with plain points and with points that send their gradient as those of the hybrid do, and writes
docs/validation/column.md but for the words at its end: run-out and height of every run, their means, and the difference to pure grains beside twice its
standard error. The continuum has no seed. Runs that are in DIR already are not repeated. Takes about half an hour on two
cores."""
import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import provenance  # noqa: E402
MODELS = {"hybrid": [], "grains": ["model=grains"], "continuum": ["model=continuum"],
          "continuum, affine": ["model=continuum", "continuum.rasterise=affine"]}
SCENES = {"column": 3, "column_3d": 2}  # seeds of each
FIGURES = (("run-out", "front"), ("height", "height"))


def seeds_of(scene, model):
    """The seeds that a model is run with."""
    return range(1, 2 if model.startswith("continuum") else SCENES[scene] + 1)


def run(out, scene, model, seed, threads):
    """Runs a scene into `out` unless it is there; returns its summary."""
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "done":
        sets = [f"seed={seed}"] + MODELS[model]
        subprocess.run([ROOT / "build/quern", "run", ROOT / f"configs/{scene}.yaml", "-o", out, "--force", "--quiet", "--no-cache"]
                       + ["--threads", str(threads)] + [word for one in sets for word in ("--set", one)], check=True)
    return json.loads(summary.read_text())


def row(model, seed, s):
    """One run as a row of the table."""
    ledger = s["observers"].get("ledger", {})
    share = f"{s['discrete_share']:.3f}" if model == "hybrid" else ""
    entries = f"{ledger['entries']['mean']:.4f}" if model == "hybrid" else ""
    carried = f"{ledger['carried']['mean']:+.4f}, {max((ledger['carried'][k] for k in ('min', 'max')), key=abs):+.4f}" if model == "hybrid" else ""
    return (f"| {model} | {seed} | {s['observers']['runout']['front']['last']:.4f} | {s['observers']['runout']['height']['last']:.4f} | {s['settle_seconds']:.0f} "
            f"| {s['wall_seconds'] - s['settle_seconds']:.0f} | {share} | {entries} | {carried} | {s['invariant_defect']:.0e} |")


def difference(ours, grains):
    """Mean of `ours` over that of `grains` less one, and twice the standard error of the difference, both relative."""
    base = statistics.mean(grains)
    error = math.sqrt(sum(statistics.variance(side) / len(side) for side in (ours, grains) if len(side) > 1))
    return statistics.mean(ours) / base - 1, 2 * error / base


def report(scene, runs, threads):
    """The tables of one scene, as lines."""
    lines = [f"**configs/{scene}.yaml and its twins, {threads} threads; entries and carried mass relative to the mass, mean over time**",
             "", "| model | seed | run-out, m | height, m | settling, s | from release on, s | discrete share | entries "
             "| carried mass, mean and worst | invariants, worst step |", "|---|---|---|---|---|---|---|---|---|---|"]
    lines += [row(model, seed, s) for model in MODELS for seed, s in enumerate(runs[model], 1)]
    lines += ["", "**Difference to pure grains, of means over seeds**", "",
              "| model | figure | difference | twice its standard error |", "|---|---|---|---|"]
    for model in (model for model in MODELS if model != "grains"):
        for figure, key in FIGURES:
            off, error = difference(*([s["observers"]["runout"][key]["last"] for s in runs[m]] for m in (model, "grains")))
            lines.append(f"| {model} | {figure} | {100 * off:+.1f} % | {100 * error:.1f} % |")
    return lines + [""]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default=str(ROOT / "out/column_study"))
    parser.add_argument("--only", choices=SCENES, help="run one scene, write no page")
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    out = pathlib.Path(args.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    lines = ["<!-- written by studies/column/study.py -->", "", f"Measured on {provenance.line(provenance.of())}.", ""]
    for scene in [args.only] if args.only else SCENES:
        runs = {model: [] for model in MODELS}
        for model in MODELS:
            for seed in seeds_of(scene, model):
                folder = out / f"{scene}_{model.replace(', ', '_')}_{seed}"
                runs[model].append(run(folder, scene, model, seed, args.threads))
                print(scene, row(model, seed, runs[model][-1]), flush=True)
        lines += report(scene, runs, args.threads)
    page = ROOT / "docs/validation/column.md"
    if not args.only:
        _, mark, words = page.read_text().partition("<!-- end -->")
        page.write_text("\n".join(lines) + mark + words)
    print("\n".join(lines))


if __name__ == "__main__":
    main()
