# SPDX-License-Identifier: MIT
"""What a run left, or leaves just now: frames, series, summary, scene. docs/run_folder.md says what lies where."""
import contextlib
import csv
import functools
import json
import os
import pathlib
import re
from collections.abc import Iterator, Sequence
from typing import Any

import h5py
import numpy as np

from .program import QuernError

ZONES = ("discrete", "hybrid", "continuum")  # cell.zone 0, 1, 2
PLURALS = {"body": "bodies"}


class Frame:
    """The state at one time. `frame["grain.position"]` reads an array from the file whenever it is asked for."""

    def __init__(self, path: pathlib.Path):
        self.path = path

    def __repr__(self) -> str:
        return f"<quern.Frame {self.path.name}, t = {self.time:g} s>"

    def _file(self) -> h5py.File:
        try:
            return h5py.File(self.path, "r")
        except OSError as why:
            raise QuernError(f"{self.path} cannot be read: {why}", 4) from None

    @functools.cached_property
    def attributes(self) -> dict[str, Any]:
        """What the file says of itself: time, step, dimension, name, seed, scene_hash and others."""
        with self._file() as file:
            return {key: value.decode() if isinstance(value, bytes) else value for key, value in file.attrs.items()}

    @property
    def time(self) -> float:
        """s since the release."""
        return float(self.attributes["time"])

    @property
    def step(self) -> int:
        return int(self.attributes["step"])

    def _find(self, file: h5py.File, name: str) -> h5py.Dataset:
        kind, _, field = name.partition(".")
        place = f"{PLURALS.get(kind, kind + 's')}/{field}"
        if field and place in file and isinstance(file[place], h5py.Dataset):
            return file[place]
        raise KeyError(f"{self.path.name} has no '{name}'; it has {', '.join(self.fields)} (output.fields adds others)")

    def __getitem__(self, name: str) -> np.ndarray:
        with self._file() as file:
            data = self._find(file, name)
            try:
                return data[()]
            except OSError as why:
                raise QuernError(f"{name} of {self.path} cannot be read: {why}", 4) from None

    def __contains__(self, name: str) -> bool:
        return name in self.fields

    @functools.cached_property
    def fields(self) -> list[str]:
        """Names of all that the frame holds, such as grain.position."""
        singular = {plural: kind for kind, plural in PLURALS.items()}
        with self._file() as file:
            return [f"{singular.get(group, group.removesuffix('s'))}.{field}" for group in file
                    if isinstance(file[group], h5py.Group) for field in file[group]]

    def unit(self, name: str) -> str:
        with self._file() as file:
            return self._find(file, name).attrs["unit"].decode()

    def zone(self, kind: str) -> np.ndarray:
        """0, 1 or 2 for each grain, point or cell: it is in the zone of grains, of both, or of the continuum. Of grains and
        points the share that they carry tells it: all, some or none."""
        if kind == "cell":
            return self["cell.zone"]
        if f"{kind}.weight" not in self:  # no hybrid: all of one kind
            return np.full(len(self[f"{kind}.position"]), 0 if kind == "grain" else 2)
        weight = self[f"{kind}.weight"]
        carried = weight if kind == "grain" else 1 - weight
        return np.where(carried == 1, 0, np.where(carried == 0, 2, 1))

    def mask(self, kind: str, zone: str) -> np.ndarray:
        """True for grains, points or cells of a zone: 'discrete', 'hybrid' or 'continuum'."""
        if zone not in ZONES:
            raise QuernError(f"no zone is called '{zone}'; there are {', '.join(ZONES)}")
        return self.zone(kind) == ZONES.index(zone)


class Frames(Sequence):
    """The frames of a run in order of time, as they are now; a file is opened when something is read from it."""

    def __init__(self, folder: pathlib.Path):
        self._folder = folder

    def _paths(self) -> list[pathlib.Path]:
        return sorted(path for path in self._folder.glob("*.h5") if path.stem.isdigit())

    def __len__(self) -> int:
        return len(self._paths())

    def __getitem__(self, which):
        paths = self._paths()
        return [Frame(path) for path in paths[which]] if isinstance(which, slice) else Frame(paths[which])

    def __iter__(self) -> Iterator[Frame]:
        return (Frame(path) for path in self._paths())


class Series:
    """series.csv: a column for each number over time. `series["runout.front"]` is an array, `series.units["runout.front"]`
    its unit."""

    def __init__(self, path: pathlib.Path):
        try:
            text = path.read_text(encoding="utf-8")
            text = text[:text.rfind("\n") + 1]  # of a run at work the last row may not be whole
            header, *rows = csv.reader(text.splitlines()) if text else [[]]
        except (OSError, UnicodeDecodeError, csv.Error) as why:
            raise QuernError(f"{path} cannot be read: {getattr(why, 'strerror', None) or 'it is no table of text'}", 4) from None
        found = [re.fullmatch(r"(.*?)(?: \[(.*)\])?", word) for word in header]
        self.units = {match[1]: match[2] or "1" for match in found}
        for line, row in enumerate(rows, 2):
            if len(row) != len(self.units):
                raise QuernError(f"{path}, line {line}: {len(row)} cells, and the header names {len(self.units)} columns", 4)
        try:
            numbers = np.array(rows, dtype=float).reshape(len(rows), len(self.units))
        except ValueError as why:
            raise QuernError(f"{path}: {why}", 4) from None
        self._columns = dict(zip(self.units, numbers.T))

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._columns:
            raise KeyError(f"the series have no '{name}'; they have {', '.join(self._columns)}")
        return self._columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        """Rows."""
        return len(next(iter(self._columns.values()), []))

    def to_pandas(self):
        """A table of pandas, with units in the names of its columns."""
        import pandas
        return pandas.DataFrame({f"{name} [{self.units[name]}]": column for name, column in self._columns.items()})


class Run:
    """A folder that a run has left, or is at work in; what is read is what lies there at that moment."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        self.frames = Frames(folder / "frames")

    def __repr__(self) -> str:
        return f"<quern.Run {self.folder}: {self.status}, {len(self.frames)} frames>"

    @property
    def status(self) -> str:
        """'running' while a process holds the folder; else what the summary says, 'done', 'stopped', 'interrupted' or 'failed';
        'killed' if there is none."""
        if _is_held(self.folder / ".quern.lock"):
            return "running"
        return self.summary.get("status", "killed")

    @property
    def series(self) -> Series:
        return Series(self.folder / "series.csv")

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json; empty where the run has not come to its end."""
        try:
            return json.loads((self.folder / "summary.json").read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}

    @property
    def scene(self) -> dict[str, Any]:
        """The scene with every default, numbers in SI units."""
        return read_scene((self.folder / "scene.yaml").read_text(encoding="utf-8"))

    @property
    def log(self) -> str:
        return (self.folder / "log.txt").read_text(encoding="utf-8", errors="replace")


def _is_held(lock: pathlib.Path) -> bool:
    """True if a run holds its folder. Asked of the kernel's list: to try the lock could refuse a run that begins just then."""
    try:
        file, locks = lock.stat(), pathlib.Path("/proc/locks").read_text()
    except OSError:
        return False
    return any(_holds(line.split(), file) for line in locks.splitlines())


def _holds(words: list[str], file: os.stat_result) -> bool:
    """Whether a line of /proc/locks is of this file. It names device and inode; where the device is another one than `stat` tells, as on
    btrfs, it counts if the process has the file open."""
    if len(words) < 6 or words[1] != "FLOCK":
        return False
    major, minor, inode = words[5].split(":")
    if int(inode) != file.st_ino:
        return False
    if (int(major, 16), int(minor, 16)) == (os.major(file.st_dev), os.minor(file.st_dev)):
        return True
    for link in pathlib.Path(f"/proc/{words[4]}/fd").glob("*"):
        with contextlib.suppress(OSError):
            if os.path.samestat(link.stat(), file):
                return True
    return False


def read_scene(text: str) -> dict[str, Any]:
    """A scene as Python's own lists and dictionaries; 1e5 is a number, though YAML 1.1 asks for 1.0e+5."""
    import yaml
    loader = type("Loader", (yaml.SafeLoader,), {})
    number = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$")
    loader.add_implicit_resolver("tag:yaml.org,2002:float", number, list("-+.0123456789"))
    return yaml.load(text, Loader=loader)


def open(folder: str | os.PathLike) -> Run:
    """A run by its folder: one that is over, at work, interrupted or killed."""
    path = pathlib.Path(folder)
    if not path.is_dir():
        raise QuernError(f"{path}: there is no such folder")
    if not (path / "scene.yaml").exists():
        raise QuernError(f"{path}: no run lies there, since there is no scene.yaml; -o of quern run names the folder")
    return Run(path)
