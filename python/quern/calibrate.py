# SPDX-License-Identifier: MIT
"""quern calibrate - constants of the continuum from the grains that a scene has: docs/calibration.md.

The grains of the scene, nothing else of it, are settled on a floor, pressed, sent down chutes, let slide on a plane and sheared in a box. The runs are those of a study: what was
made before is not made again, and a command that was killed goes on."""
import argparse
import json
import math
import pathlib
import sys
import tempfile
from dataclasses import dataclass, field
from typing import NoReturn

from . import calibrate_page, rheology, sweep
from .points import Job, jobs_of
from .program import QuernError, call, sentence_of, set_options, spelt
from .reader import StudyError
from .rheology import Grains, Rows, Shear, Slide
from .runs import Run, open as open_run, read_scene
from .study import Axis, Study, Value
from .workers import recorded, save

WIDTH, DEPTH = {2: (30, 24), 3: (12, 20)}, {2: 24, 3: 20}  # of a layer, in diameters
FLOOR = 0.7  # radii by which the centres of the floor's grains lie below it, as in the scenes of configs/
HEAVIER = 1.2  # times gravity, under which the bed is pressed: more makes it pack anew
CHUTE, EVERY, LAST = 300, 4, 1 / 3  # length and interval of output, times sqrt(d/g); share that is measured
HOLD = 6  # time for which a load is held, over sqrt(height/g)
FIRST = {2: (15.0, 19.0, 23.0), 3: (20.0, 22.0, 24.0)}  # degrees
LEANING, SLIDE = ((10.0, 13.0), (16.0, 20.0), (25.0, 30.0), (36.0, 42.0)), 80  # degrees of a smooth plane, two at a time; length over sqrt(d/g)
GENTLEST, STEEPEST, NEAREST = 3.0, 45.0, 0.8  # degrees, of chutes that are tried, and between two of them
WANTED = 3  # angles
SIDE = {2: 30, 3: 12}  # of the box that shears, in diameters
SHEARED, STRAIN, FIRST_STRAIN = (0.003, 0.01, 0.03, 0.1, 0.3), 3.0, 1.0  # inertial numbers; strain, and from where on it is measured
KEPT = ("material", "contact", "skin", "overlap", "settle", "neighbours", "integrator", "step", "settling")  # of the section grains


class Parser(argparse.ArgumentParser):
    """Help and faults in the form that the other commands have."""

    def error(self, message: str) -> NoReturn:
        print(f"quern calibrate: {message}\nusage: quern calibrate SCENE.yaml [OPTION]...; see quern calibrate --help", file=sys.stderr)
        sys.exit(1)


def arguments(words: list[str] | None) -> argparse.Namespace:
    parser = Parser(prog="quern calibrate", usage="quern calibrate SCENE.yaml [OPTION]...", add_help=False,
                    formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=30, width=200))
    parser.add_argument("scene", metavar="SCENE.yaml", help="whose grains are measured")
    parser.add_argument("--set", metavar="PATH=VALUE", action="append", default=[], help="a key of the scene; may stand several times")
    parser.add_argument("-o", "--output", metavar="DIR", help="where runs and results go; default: out/calibrate_NAME, NAME being the scene's")
    parser.add_argument("--angles", metavar="A,B,C", help="of the chutes, in degrees; default: found by trying")
    parser.add_argument("--law", choices=("shear", "chutes"), default="shear",
                        help="where friction in the block comes from: plane shear of up to three times the height, or chutes that flow for long; default: shear")
    parser.add_argument("--seeds", type=int, metavar="N", default=3, help="runs of each kind, with seeds 1 to N; default: 3")
    parser.add_argument("--jobs", type=int, metavar="N", help="runs at a time; default: one for each core")
    parser.add_argument("--size", type=float, metavar="X", default=1.0, help="width, depth and time of the layers, over the usual ones; default: 1")
    parser.add_argument("--quiet", action="store_true", help="no line for each run")
    parser.add_argument("-h", "--help", action="help", help="this text")
    found = parser.parse_args(words)
    for name, low, high in (("seeds", 1, 100), ("jobs", 1, 1000)):
        value = getattr(found, name)
        if value is not None and not low <= value <= high:
            parser.error(f"--{name} {value}: give a whole number between {low} and {high}")
    if not 0.6 <= found.size <= 10:
        parser.error(f"--size {found.size:g}: give a number between 0.6 and 10")
    found.angles = [angle_of(parser, word) for word in found.angles.split(",")] if found.angles else []
    if found.angles and len(set(found.angles)) < WANTED:
        parser.error(f"--angles: give {WANTED} of them at least, such as 15,19,23")
    return found


def angle_of(parser: Parser, word: str) -> float:
    try:
        angle = float(word)
    except ValueError:
        angle = math.nan
    if not GENTLEST <= angle <= STEEPEST:
        parser.error(f"--angles: '{word}' is no number of degrees between {GENTLEST:g} and {STEEPEST:g}")
    return angle


# ---- the scene whose grains they are ----

@dataclass(frozen=True)
class Given:
    """What is taken from the scene: of its section `grains` what makes a grain, with every default."""
    name: str
    dimension: int
    grains: dict
    of: Grains


def alone(scene: str, sets: list[str], upper: list[float]) -> dict:
    """The scene with every default, by the program: it begins a run of one grain under the scene's own laws, and writes them down."""
    one = {"model": "grains", "domain": {"lower": [0.0] * len(upper), "upper": upper}, "bodies": [], "observe": [], "stages": None, "output": None,
           "time": {"end": 1.0}, **{f"grains.{key}": None for key in ("file", "from", "source", "pairs", "fill")},
           "grains.place": [{"position": [x / 2 for x in upper]}]}
    with tempfile.TemporaryDirectory(prefix="quern-calibrate-") as place:
        out = pathlib.Path(place) / "run"
        call(["run", scene, "--quiet", "--no-cache", "--until", "0", "-o", str(out), *set_options(sets), *set_options(one)])
        return read_scene((out / "scene.yaml").read_text(encoding="utf-8"))


def radius_of(scene: str, grains: dict) -> float:
    if grains.get("materials"):
        raise QuernError(f"{scene} has several materials of grains, and a calibration is of one: name it by --set grains.materials=null and "
                         "--set grains.material={density: ..., radius: ...}", 2)
    return grains["material"]["radius"]["mean"]


def resolved(scene: str, sets: list[str]) -> Given:
    plan = json.loads(call(["plan", "--json", scene, *set_options(sets)]).stdout)
    if not any(one["name"] == "grain" for one in plan["sets"]):
        raise QuernError(f"{scene} has no grains to measure: give it a section grains with a material and a contact law, or --set model=all", 2)
    found = alone(scene, sets, [1e3] * plan["dimension"])
    layer = DEPTH[plan["dimension"]] * 2 * radius_of(scene, found["grains"])
    found = alone(scene, sets, [layer] * plan["dimension"])  # some defaults follow from how deep a fall can be
    grains = found["grains"]
    gravity = math.sqrt(math.fsum(g * g for g in found["gravity"]))
    if gravity == 0:
        raise QuernError(f"{scene} has no gravity, without which grains neither settle nor flow down; give it by --set gravity=...", 2)
    return Given(found["name"], plan["dimension"], {key: grains[key] for key in KEPT if key in grains},
                 Grains(2 * grains["material"]["radius"]["mean"], grains["material"]["density"], gravity))


# ---- scenes of its own ----

def scene_of(given: Given, size: float) -> dict:
    """A layer on a rough floor, periodic sideways, under the scene's gravity."""
    n, d = given.dimension, given.of.diameter
    wide, deep = WIDTH[n][0] * size * d, DEPTH[n] * size * d
    rows = math.ceil(1.5 * deep / d)
    aside, high = [0.0] * (n - 1), rows * d
    over = [wide] * (n - 1)
    box = {"lower": [*aside, 0.0], "upper": [*over, high]}
    fill = [{"region": {"box": {"lower": [*aside, -FLOOR * d / 2], "upper": [*over, -FLOOR * d / 2]}}, "fixed": True},
            {"region": {"box": {"lower": [*aside, d / 2], "upper": [*over, deep]}}, "settle": True}]
    tick = math.sqrt(d / given.of.gravity)
    return {"quern": 1, "name": f"calibration of {given.name}", "dimension": n, "seed": 1, "gravity": turned(given, 0.0),
            "domain": {**box, "periodic": [True] * (n - 1) + [False]}, "time": {"end": CHUTE * size * tick},
            "grains": {**given.grains, "overlap": {**given.grains.get("overlap", {}), "most": 0.0}, "fill": fill},
            "bodies": [{"plane": {"point": [*aside, 0.0], "normal": [*aside, 1.0]}}],
            "output": {"every": EVERY * tick}, "observe": [{"profile": {"axis": n - 1, "bins": rows, "region": {"box": box}}}]}


def turned(given: Given, angle: float) -> list[float]:
    """Gravity as a chute of this angle, in degrees, feels it."""
    g, turn = given.of.gravity, math.radians(angle)
    return [g * math.sin(turn), *[0.0] * (given.dimension - 2), -g * math.cos(turn)]


def case_of(given: Given, angle: float) -> Value:
    return Value(f"{angle:g} degrees", (f"stages={spelt([{'set': {'gravity': turned(given, angle)}}])}",))


def pressed(given: Given, size: float) -> Value:
    """Settled grains, the same under more weight, and again under their own."""
    hold = HOLD * math.sqrt(DEPTH[given.dimension] * size * given.of.diameter / given.of.gravity)
    heavy = [HEAVIER * g for g in turned(given, 0.0)]
    stages = [{"for": hold}, {"for": hold, "set": {"gravity": heavy}}, {"set": {"gravity": turned(given, 0.0)}}]
    return Value("bed", (f"time.end={3 * hold!r}", f"output.every={hold!r}", f"stages={spelt(stages)}"))


def leaning(given: Given, size: float, angle: float) -> Value:
    """Grains settled on a smooth plane, which then leans."""
    tick = math.sqrt(given.of.diameter / given.of.gravity)
    return Value(f"plane at {angle:g} degrees", (f"grains.fill={spelt(scene_of(given, size)['grains']['fill'][1:])}", f"time.end={SLIDE * size * tick!r}",
                                                 f"stages={spelt([{'set': {'gravity': turned(given, angle)}}])}"))


def shear_of(given: Given, size: float, inertia: float) -> tuple[float, float]:
    """Pressure, about that in the middle of the layer, and rate of shear."""
    n, d = given.dimension, given.of.diameter
    pressure = (0.4 if n == 2 else 0.3) * given.of.density * given.of.gravity * DEPTH[n] * size * d
    return pressure, inertia / d * math.sqrt(pressure / given.of.density)


def box_of(given: Given, size: float, inertia: float) -> Value:
    """The same grains in a box without walls that shears, under the pressure in the middle of the layer."""
    n, side = given.dimension, SIDE[given.dimension] * size * given.of.diameter
    pressure, rate = shear_of(given, size, inertia)
    domain = {"lower": [0.0] * n, "upper": [side] * n, "periodic": [True] * n}
    fill = [{"region": {"box": {"lower": [0.0] * n, "upper": [side] * n}}}]
    return Value(f"shear at {inertia:g}", (
        f"gravity={spelt([0.0] * n)}", f"domain={spelt(domain)}", "bodies=[]", f"grains.fill={spelt(fill)}", f"time.end={STRAIN / rate!r}",
        f"grains.box={spelt({'shear': rate, 'pressure': pressure, 'along': 'y'})}", f"output.every={STRAIN / rate / 300!r}", "observe=[stress, box]"))


# ---- runs ----

@dataclass
class Work:
    """Runs that are made, by case and seed."""
    options: argparse.Namespace
    given: Given
    folder: pathlib.Path
    stop: int
    runs: dict[tuple[str, int], Run | str] = field(default_factory=dict)  # or what a run that failed has said

    def make(self, cases: list[Value], seeds: list[int]) -> None:
        study = Study(self.folder / "scene.yaml", self.given.name, self.folder / "scene.yaml", axes=[Axis("case", tuple(cases))], seeds=seeds)
        jobs = jobs_of(study)
        if not sweep.make(study, jobs, self.folder, self.options, self.stop):
            raise Interrupted
        for job in jobs:
            self.runs[job.values[0][1], job.seed] = self.left(job)

    def left(self, job: Job) -> Run | str:
        record = recorded(self.folder, job.key) or {"status": "missing", "message": "no record was left"}
        return open_run(self.folder / "runs" / job.key) if record["status"] == "done" else record["message"]

    def chute(self, angle: float, seed: int) -> Rows | str:
        run = self.runs[case_of(self.given, angle).label, seed]
        return run if isinstance(run, str) else rheology.chute(run, math.radians(angle), LAST, self.given.of)


def find_sheared(work: Work, seeds: list[int]) -> list[list[Shear]]:
    """For each seed one of each inertial number with which every seed has come to its end; none at all where these are too few."""
    given, size = work.given, work.options.size
    cases = {inertia: box_of(given, size, inertia).label for inertia in SHEARED}
    work.make([box_of(given, size, inertia) for inertia in SHEARED], seeds)
    for inertia, case in list(cases.items()):
        said = [run for seed in seeds if isinstance(run := work.runs[case, seed], str)]
        if said:
            print(f"quern calibrate: warning: {case} is left out: {said[0]}", file=sys.stderr)
            del cases[inertia]
    if len(cases) < WANTED:
        print("quern calibrate: warning: too few boxes that shear are left, and the law is that of the chutes", file=sys.stderr)
        return []
    return [[rheology.sheared(work.runs[case, seed], shear_of(given, size, inertia)[1], FIRST_STRAIN / STRAIN, given.of) for inertia, case in cases.items()]
            for seed in seeds]


def find_slides(work: Work, seeds: list[int]) -> list[Slide] | None:
    """Of the gentlest angle at which the layer slides with every seed; none where it never does; None where a run failed."""
    def slides(angle: float, some: list[int]) -> list[Slide] | None:
        runs = [work.runs[leaning(work.given, work.options.size, angle).label, seed] for seed in some]
        for run in runs:
            if isinstance(run, str):
                print(f"quern calibrate: warning: friction of a smooth wall is left out: the plane at {angle:g} degrees: {run}", file=sys.stderr)
                return None
        return [rheology.slide(run, math.radians(angle), work.given.of) for run in runs]

    for angles in LEANING:
        work.make([leaning(work.given, work.options.size, angle) for angle in angles], seeds[:1])
        for angle in angles:
            found = slides(angle, seeds[:1])
            if found and found[0].slides and seeds[1:]:
                work.make([leaning(work.given, work.options.size, angle)], seeds[1:])
                found = slides(angle, seeds)
            if found is None or all(one.slides for one in found):
                return found
    return []


class Interrupted(Exception):
    """Somebody has asked for an end."""


def word_of(chute: Rows | str) -> str:
    return "failed" if isinstance(chute, str) else chute.word


def next_angles(known: dict[float, str]) -> list[float]:
    """Where to look for flows that are steady: beside those that are, between what rests and what runs away, or farther on; none if there
    are enough, or nothing is left to try."""
    steady = sorted(angle for angle, word in known.items() if word == "steady")
    low = max((angle for angle, word in known.items() if word == "rests"), default=None)
    high = min((angle for angle, word in known.items() if word in ("fast", "failed")), default=None)
    if len(steady) >= WANTED:
        return []
    below = min(steady, default=high if high is not None else max(known))
    above = max(steady, default=low if low is not None else min(known))
    wanted = [below - 3 if low is None or low > below else (low + below) / 2, above + 3 if high is None or high < above else (high + above) / 2]
    wanted += [(a + b) / 2 for a, b in zip(steady, steady[1:])]
    fresh = [angle for angle in dict.fromkeys(round(angle, 1) for angle in wanted) if GENTLEST <= angle <= STEEPEST]
    return [angle for angle in fresh if min(abs(angle - other) for other in known) >= NEAREST]


def spread_out(steady: list[float]) -> list[float]:
    """The gentlest, the steepest, and the one that is nearest to their middle."""
    middle = min(steady[1:-1], key=lambda angle: abs(angle - (steady[0] + steady[-1]) / 2))
    return [steady[0], middle, steady[-1]]


def find_angles(work: Work) -> list[float]:
    """Three angles, by runs of the first seed."""
    known: dict[float, str] = {}
    wanted = list(FIRST[work.given.dimension])
    while wanted:
        work.make([case_of(work.given, angle) for angle in wanted], [1])
        for angle in wanted:
            known[angle] = word_of(work.chute(angle, 1))
        wanted = next_angles(known)
    steady = sorted(angle for angle, word in known.items() if word == "steady")
    if len(steady) < WANTED:
        found = ", ".join(f"{angle:g} degrees {word}" for angle, word in sorted(known.items()))
        raise QuernError(f"these grains flow steadily down {len(steady)} of the chutes that were tried ({found}), and mu(I) takes {WANTED}; "
                         "give others by --angles, or a longer and deeper one by --size 2", 3)
    return spread_out(steady)


def measure(work: Work) -> calibrate_page.Found:
    """All of it: the bed, the angles, the chutes of every seed, a smooth plane."""
    seeds, given = list(range(1, work.options.seeds + 1)), work.given
    press = pressed(given, work.options.size)
    work.make([press], seeds)
    angles = sorted(set(work.options.angles)) or find_angles(work)
    work.make([case_of(given, angle) for angle in angles], seeds)
    bad = {f"{case}, seed {seed}": run for (case, seed), run in work.runs.items() if isinstance(run, str) and float_of(case) in (None, *angles)}
    if bad:
        raise QuernError("\n".join(f"{what}: {said}" for what, said in bad.items()), 3)
    beds = [rheology.bed(work.runs[press.label, seed], HEAVIER, given.of) for seed in seeds]
    chutes = {angle: [work.chute(angle, seed) for seed in seeds] for angle in angles}
    moving = [angle for angle, rows in chutes.items() if all(one.word == "steady" for one in rows)]
    for angle in sorted(set(angles) - set(moving)):
        words = ", ".join(dict.fromkeys(one.word for one in chutes[angle] if one.word != "steady"))
        print(f"quern calibrate: warning: the flow at {angle:g} degrees is left out: {words}", file=sys.stderr)
    if len(moving) < WANTED:
        raise QuernError(f"{len(moving)} of the chutes flow steadily with every seed, and mu(I) takes {WANTED}; give others by --angles", 3)
    return calibrate_page.Found(given.name, given.dimension, given.of, beds, {angle: chutes[angle] for angle in moving}, find_slides(work, seeds),
                                find_sheared(work, seeds), work.options.law == "shear")


def float_of(case: str) -> float | None:
    return float(case.split(" ")[0]) if case[0].isdigit() else None


def calibrate(options: argparse.Namespace, stop: int) -> int:
    given = resolved(options.scene, options.set)
    folder = pathlib.Path(options.output or f"out/calibrate_{pathlib.Path(options.scene).stem}").resolve()
    options.retry = False
    with sweep.held(folder):
        (folder / "runs").mkdir(exist_ok=True)
        save(folder / "scene.yaml", calibrate_page.as_yaml(scene_of(given, options.size)))
        found = measure(Work(options, given, folder, stop))
        said = calibrate_page.write(found, folder, options)
    print(said)
    return 0


def main(words: list[str] | None = None) -> int:
    options = arguments(words)
    try:
        return calibrate(options, sweep.listen())
    except Interrupted:
        print("quern calibrate: interrupted; the same command goes on", file=sys.stderr)
        return 130
    except (QuernError, StudyError) as error:
        print(f"quern calibrate: error: {error}", file=sys.stderr)
        return getattr(error, "status", 2)
    except OSError as error:
        print(f"quern calibrate: error: {sentence_of(error)}", file=sys.stderr)
        return 4
