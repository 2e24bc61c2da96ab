# SPDX-License-Identifier: MIT
"""From a study to its runs: what each sets, and the key by which a run that was made before is known again."""
import contextlib
import hashlib
import itertools
import json
import pathlib
from dataclasses import dataclass

import yaml

from .program import call, find
from .reader import Sets
from .study import Study, Value


@dataclass(frozen=True)
class Job:
    """One run: of point `point`, or of the reference if `model` names one."""
    point: int
    model: str
    seed: int | None
    values: tuple[tuple[str, str], ...]  # axis and label
    sets: Sets
    key: str

    def __str__(self) -> str:
        words = [self.model] * bool(self.model) + [f"{axis} {label}" for axis, label in self.values]
        words += [f"seed {self.seed}"] * (self.seed is not None)
        return ", ".join(words) or "the scene as it is"


def combinations(study: Study, names: list[str] | None = None) -> list[dict[str, Value]]:
    """Every value of every axis with every one of the others; random axes go together. `names`: of these axes alone."""
    axes = [axis for axis in study.axes if names is None or axis.name in names]
    drawn = [axis for axis in axes if axis.drawn]
    columns = [[{axis.name: value} for value in axis.values] for axis in axes if not axis.drawn]
    if drawn:
        columns.append([dict(zip((axis.name for axis in drawn), values)) for values in zip(*(axis.values for axis in drawn))])
    merged = [{name: value for part in parts for name, value in part.items()} for parts in itertools.product(*columns)]
    return [{axis.name: point[axis.name] for axis in axes} for point in merged]


def jobs_of(study: Study) -> list[Job]:
    """The runs of the reference, then those of the points, seeds innermost."""
    scene = scene_digest(study.base)
    found = []
    parts = [(study.reference, combinations(study, list(study.follows)))] if study.reference and not study.closed else []
    for model, points in [*parts, ("", combinations(study))]:
        for number, point in enumerate(points):
            for seed in study.seeds or [None]:
                sets = list(study.sets) + [one for value in point.values() for one in value.sets]
                sets += list(study.reference_sets) * bool(model) + [f"seed={seed}"] * (seed is not None)
                values = tuple((name, value.label) for name, value in point.items())
                found.append(Job(number, model, seed, values, tuple(sets), key_of(study, scene, sets)))
    return found


def in_turn(jobs: list[Job]) -> list[int]:
    """The places of jobs in the order in which they are begun: all with one seed, all with the next, the reference before the points, since it
    may settle for them. What the machine does for a minute then does not fall on all seeds of one point."""
    seeds = {seed: turn for turn, seed in enumerate(dict.fromkeys(job.seed for job in jobs))}
    return sorted(range(len(jobs)), key=lambda k: (seeds[jobs[k].seed], not jobs[k].model))


# ---- keys ----

def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def words_of(text: str) -> list[str]:
    """What YAML says, comments and blanks aside, word by word; text that is none stands for itself. Read as events, since aliases can
    make a tree larger than any memory."""
    try:
        events = yaml.parse(text, Loader=getattr(yaml, "CBaseLoader", yaml.BaseLoader))
        return [f"{type(one).__name__} {getattr(one, 'anchor', None)} {getattr(one, 'style', None)} {getattr(one, 'value', '')}" for one in events]
    except (yaml.YAMLError, RecursionError):
        return [text]


def file_meant(path: pathlib.Path) -> pathlib.Path:
    """The file itself; of a run, RUN or RUN:FRAME, its checkpoint or that frame."""
    run, _, frame = str(path).rpartition(":")
    if run and frame.isdecimal() and not path.exists():
        return pathlib.Path(run) / "frames" / f"{int(frame):06d}.h5"
    return path / "checkpoint.h5" if path.is_dir() else path


def files_named(words: list[str], folder: pathlib.Path) -> dict[str, str]:
    """Every word that is the path of a file or of a run, with the hash of what is in it."""
    found = {}
    for word in words:
        path = word.split(" ", 3)[-1]
        with contextlib.suppress(OSError, ValueError):
            if 0 < len(path) < 4096 and file_meant(folder / path).is_file():
                found[path] = digest(file_meant(folder / path).read_bytes())
    return found


def scene_digest(base: pathlib.Path) -> str:
    """Of what a scene says, not of how: comments do not count."""
    words = words_of(base.read_text(encoding="utf-8", errors="replace"))
    return digest(json.dumps([words, files_named(words, base.parent)]).encode())


def key_of(study: Study, scene: str, sets: list[str]) -> str:
    files = [files_named(words_of(one.partition("=")[2]), study.path.parent) for one in sets]
    return digest(json.dumps([scene, sets, files, study.threads]).encode())[:16]


def program_digests() -> dict[str, str]:
    """The program and every plugin that it finds, by path, each with the hash of the file."""
    paths = [find()] + [plugin["file"] for plugin in json.loads(call(["list", "--json"]).stdout)]
    return {path: digest(pathlib.Path(path).read_bytes()) for path in paths}
