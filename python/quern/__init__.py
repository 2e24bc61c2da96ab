# SPDX-License-Identifier: MIT
"""Quern from Python: runs as arrays, and runs of one's own.

    run = quern.open("out/column")
    run.frames[-1]["grain.position"]

docs/python.md is the page about it. Needs h5py and numpy; YAML (python3-yaml) where scenes and studies are read."""
from .program import QuernError, run
from .runs import Frame, Run, Series, open

__all__ = ["Frame", "QuernError", "Run", "Series", "open", "run"]
