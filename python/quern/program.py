# SPDX-License-Identifier: MIT
"""The program quern: where it is, how it is called, what it says when it fails."""
import functools
import json
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from typing import Any

Sets = Mapping[str, Any] | Iterable[str]


class QuernError(Exception):
    """What the program, or this package, has to say; `status` is the exit status, as docs/quern.1 lists them."""

    def __init__(self, message: str, status: int = 1):
        super().__init__(message)
        self.status = status


def find() -> str:
    """The program: QUERN in the environment, the one beside the program that is running, the first in PATH."""
    here = pathlib.Path(sys.argv[0]).resolve().parent
    package = pathlib.Path(__file__).resolve().parent
    places = [os.environ.get("QUERN"), here / "quern", here / "../../bin/quern", package / "../../../../bin/quern",
              shutil.which("quern"), package / "../../build/quern"]
    for place in places:
        if place and os.access(place, os.X_OK) and os.path.isfile(place):
            return os.path.abspath(place)
    raise QuernError("the program quern is not found; name it in the environment variable QUERN, or put its folder into PATH")


@functools.cache
def machine() -> str:
    """The processor and how many of its cores this process may use: what a cost depends on."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    cores = len(os.sched_getaffinity(0))
    return f"{names[0] if names else platform.machine()}, {cores} core{'s' * (cores != 1)}"


def spelt(value: Any, within: bool = False) -> str:
    """A value as YAML that stands in one line: what --set takes; `within` a list or a mapping some texts need quotes."""
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {spelt(item, True)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(spelt(item, True) for item in value) + "]"
    if isinstance(value, str) and within and re.search(r"[,\[\]{}\n]", value):
        return json.dumps(value)
    return repr(value) if isinstance(value, float) else str(value)


def set_options(sets: Sets | None) -> list[str]:
    """--set options of a mapping from keys to values, or of a list of `key=value`."""
    if isinstance(sets, str):
        raise TypeError("set: a mapping {'key': value} or a list ['key=value'], not a text")
    words = [f"{key}={spelt(value)}" for key, value in sets.items()] if isinstance(sets, Mapping) else list(sets or [])
    return [option for word in words for option in ("--set", word)]


def sentence(said: str) -> str:
    """What a program that failed says of it: its errors, without the count of them and without warnings."""
    lines = [line for line in said.strip().splitlines() if line.strip()]
    kept = [re.sub(r"^quern: error: ", "", line) for line in lines
            if "warning: " not in line and not re.match(r"quern: \d+ faults? in ", line)]
    return "\n".join(kept or lines)


def sentence_of(why: Exception) -> str:
    """What went wrong, without the quotes that a KeyError puts around it. A system that has no room left names no file, and HDF5 no reason."""
    if isinstance(why, OSError) and why.strerror:
        return f"{why.filename}: {why.strerror}" if why.filename else why.strerror
    return str(why.args[0] if why.args else why)


def call(arguments: list[str], **options: Any) -> subprocess.CompletedProcess:
    """Runs the program to its end; raises what it says if that is not status 0."""
    done = subprocess.run([find(), *arguments], capture_output=True, encoding="utf-8", errors="replace", **options)
    if done.returncode:
        said = sentence(done.stderr) or f"the program ended with status {done.returncode}"
        raise QuernError(said, done.returncode)
    return done


def run(scene: str | os.PathLike, set: Sets | None = None, out: str | os.PathLike | None = None, threads: int | None = None,
        force: bool = False, resume: bool = False):
    """Runs a scene to its end and opens what it left; `out` as -o, `force` and `resume` as the options of these names.
    Raises QuernError with the program's sentence if the scene is refused or the run fails."""
    from .runs import open as open_run
    folder = pathlib.Path(out) if out is not None else pathlib.Path("out") / pathlib.Path(scene).stem
    options = ["--threads", str(threads)] if threads else []
    options += ["--force"] * force + ["--resume"] * resume
    call(["run", os.fspath(scene), "--quiet", "-o", str(folder), *options, *set_options(set)])
    return open_run(folder)
