# SPDX-License-Identifier: MIT
"""Every loop that is marked QUERN_SIMD is vectorised by gcc, for both instruction sets that plugins are built for: a law that
falls back to one number at a time gives the same bits and takes five times as long."""
import os
import concurrent.futures
import pathlib
import re
import subprocess
import sys

from workshop import SOURCE

FLAGS = ["-std=c17", "-O3", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math",
         "-fopenmp-simd", "-fopt-info-vec-all"]
LEVELS = {"v3": ["-march=x86-64-v3"], "v4": ["-march=x86-64-v4", "-mprefer-vector-width=512"]}
SCATTERS = {("v3", "contacts.c")}  # AVX2 has no instruction for it
REPORT = re.compile(r"(\S+?):(\d+):\d+: (optimized: +loop vectorized|missed: +couldn.t vectorize loop)")


def marked():
    """{file: lines of its marked loops}: gcc names that of the loop or of the first line in it."""
    found = {}
    for path in [*(SOURCE / "plugins").rglob("*.[ch]"), *(SOURCE / "include").rglob("*.h")]:
        lines = path.read_text().splitlines()
        numbers = {k + 2 for k, line in enumerate(lines) if line.strip() == "QUERN_SIMD"}
        numbers |= {k + 1 for k in numbers if k < len(lines) and not lines[k].strip().startswith("for")}
        if numbers:
            found[path.resolve()] = numbers
    return found


def reads(path, loops):
    """Whether a source has one of these loops, in itself or in what it includes."""
    words = ["gcc", "-std=c17", "-I", SOURCE / "include", "-MM", path]
    said = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout
    return any(pathlib.Path(word).resolve() in loops for word in said.replace("\\\n", " ").split()[1:])


def report(level, path):
    words = ["gcc", *FLAGS, *LEVELS[level], "-I", SOURCE / "include", "-c", path, "-o", "/dev/null"]
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stderr


def check(level, loops):
    good, bad = set(), set()
    paths = [path for path in sorted((SOURCE / "plugins").rglob("*.c")) if reads(path, loops)]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        said = list(pool.map(lambda path: report(level, path), paths))
    for path, text in zip(paths, said):
        for file, line, what in REPORT.findall(text):
            file, line = pathlib.Path(file).resolve(), int(line)
            if line in loops.get(file, ()):
                (good if what.startswith("optimized") else bad).add((file.name, line, path.name))
    bad = {(name, line, source) for name, line, source in bad if (level, name) not in SCATTERS}
    assert not bad, f"{level}: not vectorised: " + ", ".join(f"{name}:{line} in {source}" for name, line, source in sorted(bad))
    assert len(good) > 15, good
    print(f"{level}: {len(good)} loops in {len({name for name, _, _ in good})} files")


if __name__ == "__main__":
    if not subprocess.run(["gcc", "-dM", "-E", "-"], input="", capture_output=True, text=True).stdout.count("__x86_64__"):
        sys.exit(77)
    for name in LEVELS:
        check(name, marked())
