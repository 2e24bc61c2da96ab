# SPDX-License-Identifier: MIT
"""quern film - a run as a film, every frame drawn by `quern render` with one view, one range of colours and one scale.

First each frame is measured, then the measures are joined, then each frame is drawn; so the same grain at rest stands at the same pixel in
all pictures, and the same speed has the same colour."""
import argparse
import concurrent.futures
import contextlib
import functools
import importlib.util
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from typing import NoReturn

import numpy

from .program import QuernError, call, sentence_of

STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
FORMS = (".mp4", ".webm", ".gif", ".png")
USUAL = 0.95  # of the frames have all their values within the range of colours: one that bursts must not take them all


class Parser(argparse.ArgumentParser):
    """Help and faults in the form that the other commands have."""

    def error(self, message: str) -> NoReturn:
        print(f"quern film: {message}\nusage: quern film RUN [OPTION]...; see quern film --help", file=sys.stderr)
        sys.exit(1)


def arguments(words: list[str] | None) -> argparse.Namespace:
    parser = Parser(prog="quern film", usage="quern film RUN [OPTION]...", add_help=False,
                    formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=30, width=200))
    parser.add_argument("run", metavar="RUN", help="the folder of a run")
    parser.add_argument("-o", "--output", metavar="FILE", help="where to write it: .mp4, .webm, .gif, or .png that moves; default: RUN/film.mp4")
    parser.add_argument("--frames", metavar="A..B[:STEP]", default="..", help="which, such as 10..40:2, 10.. or ..40; default: all")
    parser.add_argument("--fps", type=float, metavar="N", default=25, help="frames per second; default: 25")
    parser.add_argument("--width", type=int, metavar="N", default=1280, help="in pixels; default: 1280")
    parser.add_argument("--keep", metavar="DIR", help="leave the pictures of the frames in this folder too")
    for name, value, text in (("field", "NAME", "what to colour by"), ("view", "X0,Y0,X1,Y1", "what to show; default: what all frames show"),
                              ("range", "LOW,HIGH", "what the first and the last colour stand for; default: of 95 %% of the frames"),
                              ("vectors", "NAME", "arrows of a field: velocity")):
        parser.add_argument(f"--{name}", metavar=value, help=text)
    parser.add_argument("--chains", action="store_true", help="a line for each contact that presses, as wide as its force")
    parser.add_argument("-h", "--help", action="help", help="this text")
    found = parser.parse_args(words)
    if not 0 < found.fps <= 240:
        parser.error(f"--fps {found.fps:g}: give a number above 0, up to 240")
    if not 600 <= found.width <= 8000:
        parser.error(f"--width {found.width}: give a whole number between 600 and 8000")
    if found.output and pathlib.Path(found.output).suffix.lower() not in FORMS:
        parser.error(f"{found.output}: films are {', '.join(FORMS)}: give it one of these endings")
    return found


def pick(folder: pathlib.Path, wanted: str) -> list[int]:
    """The numbers of the frames that are meant, of those that are there."""
    there = sorted(int(path.stem) for path in (folder / "frames").glob("*.h5") if path.stem.isdigit())
    if not there:
        raise QuernError(f"{folder}/frames holds no frames: name the folder of a run", 2)
    match = re.fullmatch(r"(\d*)\.\.(\d*)(?::([1-9]\d*))?", wanted)
    if not match:
        raise QuernError(f"--frames {wanted}: give A..B or A..B:STEP, numbers of frames, such as 10..40:2")
    first, last = int(match[1] or there[0]), int(match[2] or there[-1])
    found = [k for k in there if first <= k <= last][::int(match[3] or 1)]
    if not found:
        raise QuernError(f"--frames {wanted}: the frames of {folder} are {there[0]} to {there[-1]}")
    return found


def render(folder: pathlib.Path, frame: int, options: list[str]) -> str:
    try:
        return call(["render", str(folder), "--frame", str(frame), *options]).stdout
    except QuernError as error:
        raise QuernError(str(error).split("\nusage: ")[0].removeprefix("quern render: "), error.status) from None


def joined(measures: list[dict]) -> list[str]:
    """Options of one picture that is right for all."""
    views = numpy.array([one["view"] for one in measures])
    half = views.shape[1] // 2
    view = [*views[:, :half].min(axis=0), *views[:, half:].max(axis=0)]
    options = ["--view=" + ",".join(repr(float(x)) for x in view)]
    ranges = numpy.array([one["range"] for one in measures if one["range"]])
    if len(ranges):
        low = numpy.quantile(ranges[:, 0], 1 - USUAL, method="lower")
        high = numpy.quantile(ranges[:, 1], USUAL, method="higher")
        options.append(f"--range={float(low)!r},{float(high)!r}")
    for name in ("widest", "longest"):
        sizes = [one[name] for one in measures if one[name] > 0]
        if sizes:
            options.append(f"--{name}={float(numpy.quantile(sizes, USUAL, method='higher'))!r}")
    return options


def draw(folder: pathlib.Path, frames: list[int], place: pathlib.Path, given: argparse.Namespace) -> None:
    """A picture for each frame, called by its place in the film, drawn on all cores."""
    wishes = ["--chains"] * given.chains
    wishes += [f"--{name}={value}" for name in ("field", "vectors") if (value := getattr(given, name))]
    with noting_signals() as came, concurrent.futures.ThreadPoolExecutor(len(os.sched_getaffinity(0))) as workers, stopping(workers):
        measures = each(workers, came, lambda k: json.loads(render(folder, k, [*wishes, "--measure"])), frames)
        fixed = joined(measures) + [f"--{name}={value}" for name in ("view", "range") if (value := getattr(given, name))]
        fixed = [*wishes, *fixed, "--width", str(given.width)]
        names = [str(place / f"{k:06d}.png") for k in range(len(frames))]
        each(workers, came, lambda k, name: render(folder, k, [*fixed, "-o", name]), frames, names)


def each(workers: concurrent.futures.Executor, came: list[int], work: Callable, *items: list) -> list:
    """What the work gives for each, in their order; looks ten times a second whether a signal has come."""
    futures = [workers.submit(work, *one) for one in zip(*items)]
    waiting = set(futures)
    while waiting and not came:
        done, waiting = concurrent.futures.wait(waiting, timeout=0.1, return_when=concurrent.futures.FIRST_EXCEPTION)
        if any(one.exception() for one in done):
            break
    if came:
        raise KeyboardInterrupt
    return [one.result() for one in futures]


@contextlib.contextmanager
def noting_signals() -> Iterator[list[int]]:
    """Signals that would interrupt are noted: an exception amid a lock of the threads would leave it open or shut for ever."""
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in STOPS}
    before = {number: handler for number, handler in before.items() if callable(handler)}  # others are ignored, as under nohup
    for number in before:
        signal.signal(number, lambda which, _: came.append(which))
    try:
        yield came
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if came:
        raise KeyboardInterrupt


@contextlib.contextmanager
def stopping(workers: concurrent.futures.Executor) -> Iterator[None]:
    """Who interrupts does not want to wait for what has not begun."""
    try:
        yield
    except BaseException:
        workers.shutdown(cancel_futures=True)
        raise


def by_ffmpeg(place: pathlib.Path, fps: float, film: pathlib.Path) -> None:
    """Players want even sizes and this form of colours."""
    form = film.suffix.lower()
    coder = {".mp4": ["-c:v", "libx264", "-crf", "18", "-preset", "medium", "-movflags", "+faststart"],
             ".webm": ["-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "4", "-row-mt", "1"]}[form]
    words = ["ffmpeg", "-nostdin", "-loglevel", "error", "-y", "-framerate", f"{fps:g}", "-i", str(place / "%06d.png"),
             "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p", *coder, "-f", form[1:], str(film)]
    done = subprocess.run(words, capture_output=True, encoding="utf-8", errors="replace")
    if done.returncode:
        raise QuernError(f"ffmpeg did not make the film: {done.stderr.strip() or f'it ended with status {done.returncode}'}", 4)


def by_pil(place: pathlib.Path, fps: float, film: pathlib.Path) -> None:
    """For GIF one palette for all, of the last picture, where most has happened, so that still parts do not flicker."""
    from PIL import Image
    paths = sorted(place.glob("*.png"))
    form = film.suffix.lower()
    shape = {"duration": max(1, round(1000 / fps)), "loop": 0, "save_all": True}
    if form == ".gif":
        shape["duration"] = max(20, shape["duration"] // 10 * 10)  # in hundredths; what is faster is shown slowly
        with Image.open(paths[-1]) as last:
            palette = last.convert("RGB").quantize(255, method=Image.Quantize.MEDIANCUT)
        one = functools.partial(still, palette=palette)
    else:
        one = still
    first, *others = (one(path) for path in paths)
    first.save(film, format=form[1:].upper(), append_images=others, **shape, **({"disposal": 1} if form == ".gif" else {}))


def still(path: pathlib.Path, palette=None):
    from PIL import Image
    with Image.open(path) as image:
        image.load()
        return image.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) if palette else image


def choose(given: argparse.Namespace) -> tuple[pathlib.Path, str]:
    """The file, and what makes it: ffmpeg, PIL, or nothing but the pictures."""
    film = pathlib.Path(given.output) if given.output else pathlib.Path(given.run) / "film.mp4"
    has_pil = importlib.util.find_spec("PIL") is not None
    if film.suffix.lower() in (".mp4", ".webm"):
        if shutil.which("ffmpeg"):
            return film, "ffmpeg"
        if not given.output and has_pil:
            return film.with_suffix(".png"), "PIL of Python, since ffmpeg is not there"
        raise QuernError(f"{film.suffix} needs ffmpeg, which is not there (Debian: ffmpeg); .gif and .png do without")
    if has_pil:
        return film, "PIL of Python"
    raise QuernError(f"{film.suffix} needs PIL of Python, which is not there (Debian: python3-pil); .mp4 and .webm need ffmpeg")


def make(given: argparse.Namespace) -> None:
    folder = pathlib.Path(given.run)
    film, maker = choose(given)
    if not film.parent.is_dir():
        raise QuernError(f"{film} cannot be written: there is no folder {film.parent}", 4)
    frames = pick(folder, given.frames)
    with tempfile.TemporaryDirectory(prefix=".quern-film-", dir=film.parent) as name:
        place = pathlib.Path(name)
        draw(folder, frames, place, given)
        whole = place / f"film{film.suffix}"
        (by_ffmpeg if maker == "ffmpeg" else by_pil)(place, given.fps, whole)
        if given.keep:
            keep(place, pathlib.Path(given.keep))
        os.replace(whole, film)
    print(f"{film}: {len(frames)} frames, {len(frames) / given.fps:.3g} s, made by {maker}")


def keep(place: pathlib.Path, folder: pathlib.Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for path in sorted(place.glob("[0-9]*.png")):
        shutil.copyfile(path, folder / f"{path.name}.part")
        os.replace(folder / f"{path.name}.part", folder / path.name)


def interrupt(*_) -> NoReturn:
    raise KeyboardInterrupt


def main(words: list[str] | None = None) -> int:
    given = arguments(words)
    for number in STOPS[1:]:
        if signal.getsignal(number) != signal.SIG_IGN:  # as under nohup
            signal.signal(number, interrupt)
    try:
        make(given)
    except KeyboardInterrupt:
        print("quern film: interrupted; nothing is left", file=sys.stderr)
        return 130
    except QuernError as error:
        print(f"quern film: error: {error}", file=sys.stderr)
        return error.status
    except OSError as error:
        print(f"quern film: error: {sentence_of(error)}", file=sys.stderr)
        return 4
    return 0
