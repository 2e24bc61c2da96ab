#!/usr/bin/python3 -I
# SPDX-License-Identifier: MIT
"""provenance - what a measured figure depends on: processor, compiler and commit, as one line: tools/provenance.py [BUILD]

Scripts that measure import `of` and `line`. BUILD is the build folder, by default build.
"""
import os
import pathlib
import platform
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def output(*command):
    """What a command prints, or nothing if there is no such command or it fails."""
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, cwd=ROOT)
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def compiler(build):
    """As the build's own configuration names it."""
    try:
        text = (pathlib.Path(build) / "config.h").read_text()
    except OSError:
        return "no build"
    return re.search(r'QUERN_COMPILER "(.*)"', text)[1]


def commit():
    """The commit that is checked out; `-dirty` if other files than pages differ from it."""
    name = output("git", "rev-parse", "--short=12", "HEAD")
    changed = output("git", "status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs")
    return (name + ("-dirty" if changed else "")) or "no commit"


def of(build=ROOT / "build"):
    return {"processor": processor(), "cores": len(os.sched_getaffinity(0)), "compiler": compiler(build),
            "commit": commit()}


def line(found):
    count = found["cores"]
    return f"{found['processor']}, {count} core{'s' if count != 1 else ''}; {found['compiler']}; commit {found['commit']}"


if __name__ == "__main__":
    print(line(of(pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build")))
