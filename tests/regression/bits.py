"""The same scene leaves the same bits: for any number of threads, batch, instruction set, C library and compiler, and
across stops by Ctrl-C and by kill -9.

`bits.py` takes small columns in 2-D and 3-D, with conversions on the way; `bits.py --main [--set=...]` takes the scenes
of configs/ as they are. QUERN_OTHER names a program built by another compiler.
"""
import os
import pathlib
import signal
import sys
import tempfile
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


def instructions(name, base, folder, options):
    """Every level that there is an object for; the loader takes lower ones where the processor lacks a level."""
    seen = {}
    for level in ("v1", "v3", "v4"):
        out = folder / level
        lab.run(name, out, *options, f"--set=run.instructions={level}")
        files = {plugin["file"] for plugin in lab.summary(out)["provenance"]["plugins"]}
        taken = {level if f".{level}.so" in file else "lower" for level in ("v4", "v3") for file in files
                 if f".{level}.so" in file} or {"v1"}
        assert len(taken) == 1, f"{level}: objects of several levels: {taken}"
        seen[level] = taken.pop()
        lab.same(base, out, f"run.instructions: {level} (objects of {seen[level]})")
    assert seen["v1"] == "v1"


def stopped(name, base, folder, options, moments):
    """Ctrl-C at three arbitrary steps of one run, the first within the first interval."""
    out = folder / "stopped"
    steps = []
    for moment in (0, len(lab.frames(base)) // 3, 2 * len(lab.frames(base)) // 3):
        for attempt in range(20):
            process = lab.start(name, out, *options, resume=bool(steps))
            if lab.wait_for(out / "frames" / f"{moment:06d}.h5", process):
                time.sleep(moments.uniform(0, 0.05))
            status = lab.stop(process, signal.SIGINT)
            assert status == 130, f"{name}: exit status {status} after Ctrl-C"
            assert lab.summary(out)["status"] == "interrupted"
            break
        steps.append(lab.summary(out)["steps"])
    lab.run(name, out, *options, resume=True)
    lab.same(base, out, f"Ctrl-C at the steps {', '.join(map(str, steps))}, resumed")


def stopped_settling(name, base, folder, options, moments):
    out = folder / "settling"
    process = lab.start(name, out, *options)
    assert lab.wait_for(out / "log.txt", process)
    time.sleep(moments.uniform(0, 0.1))
    assert lab.stop(process, signal.SIGINT) == 130
    before = lab.summary(out)
    lab.run(name, out, *options, resume=True)
    lab.same(base, out, f"Ctrl-C at step {before['settle_steps']} of settling, resumed")


def killed(name, base, folder, options, moments):
    """kill -9 some time after a checkpoint, thrice in one run."""
    out = folder / "killed"
    checkpoint = out / "checkpoint.h5"
    lost = []
    for moment in (0, len(lab.frames(base)) // 3, 2 * len(lab.frames(base)) // 3):
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        process = lab.start(name, out, *options, "--set=checkpoint.every=0.02", resume=before > 0)
        lab.wait_for(out / "frames" / f"{moment:06d}.h5", process)
        lab.wait_for(checkpoint, process, newer=before)
        time.sleep(moments.uniform(0, 0.05))
        assert lab.stop(process) == -signal.SIGKILL, f"{name}: ended before it was killed"
        lost.append(int(lab.whole(checkpoint)["@step"]))
    lab.run(name, out, *options, resume=True)
    lab.same(base, out, f"kill -9, resumed from the steps {', '.join(map(str, lost))}")


def check(name, options, folder):
    moments = lab.seeded()
    base = folder / "base"
    lab.run(name, base, *options)
    converts(name, base)
    for threads in (2,):
        out = folder / "threads"
        lab.run(name, out, *options, threads=threads)
        assert lab.summary(out)["threads"] == threads
        lab.same(base, out, f"{threads} threads")
    for batch in (8, 96):
        out = folder / f"batch{batch}"
        lab.run(name, out, *options, f"--set=run.batch={batch}")
        lab.same(base, out, f"run.batch: {batch}")
    instructions(name, base, folder, options)
    # the names of glibc 2.33 and later, and those before; unknown ones are passed over
    without = "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable"
    lab.run(name, folder / "libc", *options, GLIBC_TUNABLES=without)
    lab.same(base, folder / "libc", "without AVX2 and FMA in the C library")
    other = os.environ.get("QUERN_OTHER")
    if other:
        lab.run(name, folder / "other", *options, program=other)
        one, two = (lab.summary(p)["provenance"]["compiler"] for p in (base, folder / "other"))
        assert one != two, f"QUERN_OTHER is built by the same {one}"
        lab.same(base, folder / "other", f"{two} and {one}")
    else:
        print("  QUERN_OTHER names no program of another compiler: not compared")
    stopped(name, base, folder, options, moments)
    stopped_settling(name, base, folder, options, moments)
    killed(name, base, folder, options, moments)


if __name__ == "__main__":
    more = [word for word in sys.argv[1:] if word != "--main"]
    for name, small in lab.SMALL.items():
        with tempfile.TemporaryDirectory() as place:
            check(name, ([] if "--main" in sys.argv else small) + more, pathlib.Path(place))
