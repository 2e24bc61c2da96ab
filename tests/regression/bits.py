# SPDX-License-Identifier: MIT
"""The same scene leaves the same bits: for any number of threads, batch, instruction set, C library and compiler, and
across stops by Ctrl-C and by kill -9.

`bits.py` takes small columns in 2-D and 3-D, with conversions on the way. `bits.py --main [SCENE] [--until=50ms]` takes
the scenes of configs/ as they are, settles each once (the states stay in out/bits), and lets every run go on from there.
QUERN_OTHER names a program built by another compiler.
"""
import os
import pathlib
import shutil
import signal
import sys
import time

import lab


def converts(name, folder):
    """Grains and points come and go, and the books are closed."""
    header, rows = lab.series(folder)
    grains, points = ([row[header.index(f"{set} [1]")] for row in rows] for set in ("grains", "points"))
    changes = sum(a != b for a, b in zip(grains, grains[1:]))
    s = lab.summary(folder)
    defect = abs(s["mass_defect"]), abs(s["invariant_defect"])
    assert changes > len(rows) // 2 and min(points[1:]) > 0, f"{name}: {changes} conversions in {len(rows)} frames"
    assert max(defect) < 1e-12, f"{name}: the books are open by {defect}"
    print(f"{name}: {s['steps']} steps, grains {grains[0]:.0f} to {grains[-1]:.0f}, points {points[0]:.0f} to "
          f"{points[-1]:.0f}, counts change in {changes} of {len(rows) - 1} intervals, defects {max(defect):.1e}, "
          f"{s['wall_seconds']:.1f} s", flush=True)


def run(name, out, settled, *options, **how):
    """A run to its end, from the beginning or from a settled state."""
    if settled:
        shutil.copytree(settled, out)
    lab.run(name, out, *options, resume=settled is not None, **how)


def instructions(name, base, folder, settled, options):
    """Every level that there is an object for; the loader takes lower ones where the processor lacks a level."""
    seen = {}
    for level in ("v1", "v3", "v4"):
        out = folder / level
        run(name, out, settled, *options, f"--set=run.instructions={level}")
        files = {plugin["file"] for plugin in lab.summary(out)["provenance"]["plugins"]}
        taken = {file.split(".")[-2] if file.split(".")[-2] in ("v3", "v4") else "v1" for file in files}
        assert len(taken) == 1, f"{level}: objects of several levels: {taken}"
        seen[level] = taken.pop()
        lab.same(base, out, f"run.instructions: {level} (objects of {seen[level]})")
    assert seen["v1"] == "v1"


def moments_of(base, moments):
    """Three frames of a run and, for each, how long to wait after it: up to two intervals."""
    n, s = len(lab.frames(base)), lab.summary(base)
    interval = (s["wall_seconds"] - s["settle_seconds"]) / n
    return [(frame, moments.uniform(0, 2 * interval)) for frame in (0, n // 3, 2 * n // 3 - 1)]


def stopped(name, base, folder, settled, options, moments):
    """Ctrl-C while the grains settle and at three arbitrary steps."""
    out = folder / "stopped"
    steps = []

    def settling(process, share):
        lab.wait_for(out / "log.txt", process)
        time.sleep(share * moments.uniform(0, 0.8) * lab.summary(base)["settle_seconds"])

    if settled:
        shutil.copytree(settled, out)
    else:
        lab.on_the_way(name, out, options, signal.SIGINT, settling)
    steps_before = lab.summary(out)["settle_steps"]
    for frame, delay in moments_of(base, moments):
        def later(process, share):
            lab.wait_for(out / "frames" / f"{frame:06d}.h5", process)
            time.sleep(share * delay)

        lab.on_the_way(name, out, options, signal.SIGINT, later)
        assert lab.summary(out)["status"] == "interrupted"
        steps.append(lab.summary(out)["steps"])
    lab.run(name, out, *options, resume=True)
    lab.same(base, out, f"Ctrl-C after {steps_before} steps of settling and at the steps {', '.join(map(str, steps))}")


def killed(name, base, folder, settled, options, moments):
    """kill -9 some time after a checkpoint, thrice in one run."""
    out = folder / "killed"
    checkpoint = out / "checkpoint.h5"
    often = [*options, "--set=checkpoint.every=0.02"]
    if settled:
        shutil.copytree(settled, out)
    steps = []
    for frame, delay in moments_of(base, moments):
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0

        def later(process, share):
            lab.wait_for(out / "frames" / f"{frame:06d}.h5", process)
            lab.wait_for(checkpoint, process, newer=before)
            time.sleep(share * delay)

        lab.on_the_way(name, out, often, signal.SIGKILL, later)
        steps.append(int(lab.whole(checkpoint)["@step"]))
    lab.run(name, out, *options, resume=True)
    lab.same(base, out, f"kill -9 thrice, resumed from the steps {', '.join(map(str, steps))}")


def check(name, options, folder, settled=None):
    moments = lab.seeded()
    base = folder / "base"
    run(name, base, settled, *options)
    converts(name, base)
    run(name, folder / "threads", settled, *options, threads=2)
    assert lab.summary(folder / "threads")["threads"] == 2
    lab.same(base, folder / "threads", "2 threads")
    for batch in (8, 96):
        out = folder / f"batch{batch}"
        run(name, out, settled, *options, f"--set=run.batch={batch}")
        lab.same(base, out, f"run.batch: {batch}")
    # a limit that is never met has all distances made, and not only those within an oracle's reach
    run(name, folder / "far", settled, *options, "--set=hybrid.most_changes=0.999")
    for one, two in zip(lab.frames(base), lab.frames(folder / "far"), strict=True):
        names = [name for name in lab.differences(one, two) if not name.startswith("@")]
        assert not names, f"with all distances {one.name} differs in {names[:9]}"
    instructions(name, base, folder, settled, options)
    # the names of glibc 2.33 and later, and those before; unknown ones are passed over
    without = "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable"
    run(name, folder / "libc", settled, *options, GLIBC_TUNABLES=without)
    lab.same(base, folder / "libc", "without AVX2 and FMA in the C library")
    other = os.environ.get("QUERN_OTHER")
    if other:
        run(name, folder / "other", settled, *options, program=other)
        one, two = (lab.summary(p)["provenance"]["compiler"] for p in (base, folder / "other"))
        assert one != two, f"QUERN_OTHER is built by the same {one}"
        lab.same(base, folder / "other", f"{two} and {one}")
    else:
        print("  QUERN_OTHER names no program of another compiler: not compared")
    stopped(name, base, folder, settled, options, moments)
    killed(name, base, folder, settled, options, moments)


def main():
    whole = "--main" in sys.argv
    more = [word for word in sys.argv[1:] if word.startswith("--") and word != "--main"]
    wanted = [word for word in sys.argv[1:] if not word.startswith("--")]
    for name in wanted or lab.SMALL:
        with lab.workplace() as place:
            folder, settled = pathlib.Path(place), None
            if whole:
                settled = lab.SOURCE / "out/bits" / name
                if not (settled / "checkpoint.h5").exists():
                    lab.run(name, settled, "--until=0s", threads=2)
            check(name, more if whole else lab.SMALL[name] + more, folder, settled)


if __name__ == "__main__":
    main()
