#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""speed_accuracy - what a setting of the hybrid costs, and how far it ends from Quern's own grains.

    studies/speed_accuracy/study.py [--out DIR] [--seeds 3] [--only NAME]...

Settles the column of study.yaml once for each seed, runs pure grains from there, and every setting of study.yaml from
the first seed's grains. Cost is processor time on one thread; error is that of the final profile, the sum of |difference| over the
sum, against the mean over seeds of pure grains. Writes DIR/results.json, docs/speed_accuracy.svg and the table of
docs/speed_accuracy.md. Runs that are in DIR already are not repeated."""
import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys

import h5py
import numpy as np
import yaml

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import provenance  # noqa: E402

BIN = 0.02  # m, of the profile


def run(out, sets, threads=1, until=None):
    """Runs the column into `out` unless it is there; returns its summary, with the processor time it took."""
    summary = out / "summary.json"
    if not summary.exists() or json.loads(summary.read_text())["status"] != "done":
        command = [ROOT / "build/quern", "run", ROOT / "configs/column.yaml", "-o", out, "--force", "--quiet", "--threads",
                   str(threads)]
        for one in sets:
            command += ["--set", one]
        if until is not None:
            command += ["--until", until]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        failed = subprocess.run(command, capture_output=True, text=True)
        if failed.returncode:
            print(f"{out.name}: exit {failed.returncode}: {failed.stderr.strip()}", file=sys.stderr)
            return None
        (out / "seconds.txt").write_text(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before))
    found = json.loads(summary.read_text())
    found["core_seconds"] = float((out / "seconds.txt").read_text())
    return found


def write_grains(frame, path):
    """A frame's grains as a table that `grains.file` reads."""
    with h5py.File(frame) as file, open(path, "w") as out:
        g = file["grains"]
        print("x y radius vx vy fixed", file=out)
        for x, r, v, f in zip(g["position"][:], g["radius"][:], g["velocity"][:], g["fixed"][:]):
            print(f"{x[0]:.17g} {x[1]:.17g} {r:.17g} {v[0]:.17g} {v[1]:.17g} {f}", file=out)


def profile(out):
    """kg in each bin along the floor, at the end: of grains and points, by their shares."""
    last = sorted((out / "frames").glob("*.h5"))[-1]
    mass = np.zeros(80)
    with h5py.File(last) as file:
        for group in ("grains", "points"):
            if group not in file or not len(file[group]["position"]):
                continue
            g = file[group]
            m = np.pi * g["radius"][:] ** 2 * 2500 * (g["fixed"][:] == 0) if group == "grains" else g["mass"][:]
            if "weight" in g:
                m = m * g["weight"][:]
            np.add.at(mass, np.clip((g["position"][:, 0] / BIN).astype(int), 0, 79), m)
    return mass


def measure(out, summary):
    return {"core_seconds": summary["core_seconds"], "front": summary["observers"]["runout"]["front"]["last"],
            "height": summary["observers"]["runout"]["height"]["last"], "share": summary["discrete_share"],
            "entries": summary["observers"]["ledger"]["entries"]["mean"], "carried": summary["observers"]["ledger"]["carried"]["last"],
            "defect": summary["invariant_defect"], "profile": profile(out).tolist()}


def settle(work, seed, column):
    """The settled column of a seed as a table of grains."""
    table = work / f"settled_{seed}.txt"
    if not table.exists():
        settled = work / f"settle_{seed}"
        if run(settled, column + [f"seed={seed}", "model=grains"], until="0 s") is None:
            sys.exit("the column does not settle")
        write_grains(settled / "frames/000000.h5", table)
    return table


def from_grains(table, column):
    """The column without its fills, begun from a table of grains."""
    return [one for one in column if not one.startswith("grains.fill")] + ["grains.fill=null", f"grains.file={table}", "output.fields=[grain.velocity, point.mass]"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default=str(ROOT / "out/speed_accuracy"))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--only", action="append")
    args = parser.parse_args()
    work = pathlib.Path(args.out).resolve()
    work.mkdir(parents=True, exist_ok=True)
    study = yaml.safe_load((HERE / "study.yaml").read_text())
    column = study["column"]
    results = {"grains": [], "settings": {}, "repeats": [], "provenance": provenance.of()}
    for seed in range(1, args.seeds + 1):
        table = settle(work, seed, column)
        out = work / f"grains_{seed}"
        results["grains"].append(measure(out, run(out, from_grains(table, column) + ["model=grains"])))
        out = work / f"hybrid_{seed}"
        results["repeats"].append(measure(out, run(out, from_grains(table, column))))
        print(f"seed {seed}: done", flush=True)
    for name, sets in study["settings"].items():
        if args.only and name not in args.only:
            continue
        out = work / "".join(c if c.isalnum() else "_" for c in name)
        summary = run(out, from_grains(settle(work, 1, column), column) + sets)
        if summary:
            results["settings"][name] = measure(out, summary)
        print(f"{name}: {'done' if summary else 'FAILED'}", flush=True)
    (work / "results.json").write_text(json.dumps(results, indent=1))
    subprocess.run([sys.executable, HERE / "chart.py", work / "results.json"], check=True)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
