# SPDX-License-Identifier: MIT
"""quern sweep - the runs of a study, a number of them at a time, and the table of what came out.

A run that is recorded is not made again. A record is written once a run is over, whole or not at all, so that a sweep that is killed
goes on where it was; runs that it had begun are begun anew, since what they cost is measured as a whole."""
import argparse
import contextlib
import fcntl
import math
import os
import pathlib
import re
import shlex
import signal
import sys
from typing import NoReturn

from . import workers
from .points import Job, in_turn, jobs_of, program_digests
from .program import QuernError, sentence_of
from .reader import StudyError
from .study import Study, read
from .table import write_tables


HUNG = 124  # exit status of --only if the run was not over within its limit


class Parser(argparse.ArgumentParser):
    """Help and faults in the form that the other commands have."""

    def error(self, message: str) -> NoReturn:
        print(f"quern sweep: {message}\nusage: quern sweep STUDY.yaml [OPTION]...; see quern sweep --help", file=sys.stderr)
        sys.exit(1)


def arguments(words: list[str] | None) -> argparse.Namespace:
    parser = Parser(prog="quern sweep", usage="quern sweep STUDY.yaml [OPTION]...", add_help=False,
                    formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=30, width=200))
    parser.add_argument("study", metavar="STUDY.yaml", help="what to run; docs/studies.md")
    parser.add_argument("-o", "--output", metavar="DIR", help="the folder of the study; default: out/NAME")
    parser.add_argument("--jobs", type=int, metavar="N", help="runs at a time, instead of what the study says")
    parser.add_argument("--retry", action="store_true", help="make runs again that were refused, failed or hung")
    parser.add_argument("--table", action="store_true", help="make no run; write the tables of those that are there")
    parser.add_argument("--only", type=int, metavar="K", help="make run K alone, counted from 1, and write no table")
    parser.add_argument("--emit", metavar="FORM", choices=["parallel", "slurm"], help="make no run; print the same work for GNU parallel or a slurm array")
    parser.add_argument("--quiet", action="store_true", help="no line for each run")
    parser.add_argument("-h", "--help", action="help", help="this text")
    found = parser.parse_args(words)
    if found.jobs is not None and found.jobs < 1:
        parser.error(f"--jobs {found.jobs}: give a whole number above 0")
    return found


def program() -> list[str]:
    return [os.path.abspath(sys.argv[0])]


def emit(study: Study, folder: pathlib.Path, jobs: list[Job], form: str) -> str:
    """The study as work for another program: a command for each run, then `--table` gathers."""
    paths = [*program(), str(study.path.resolve()), str(folder.resolve())]
    for path in paths:
        if re.search(r"[\0-\x1f\x7f]", path):
            raise QuernError(f"--emit: the path {path!r} has a character that a line of commands cannot hold; give files and folder other names")
    command = shlex.join(program() + [str(study.path.resolve()), "-o", str(folder.resolve())])
    if form == "parallel":
        return "".join(f"{command} --quiet --only {k + 1}\n" for k in in_turn(jobs))
    minutes = [f"#SBATCH --time={math.ceil(study.limit * study.timings / 60) + 1}"] if math.isfinite(study.limit) else []
    most = f"%{study.jobs}" if study.jobs else ""
    return "\n".join(["#!/bin/sh", f"#SBATCH --job-name={shlex.quote(study.name)}", f"#SBATCH --array=1-{len(jobs)}{most}",
                      f"#SBATCH --cpus-per-task={study.threads}", *minutes, f"# when all are done: {command} --table",
                      f'exec {command} --quiet --only "$SLURM_ARRAY_TASK_ID"', ""])


def at_a_time(study: Study, wanted: int | None) -> int:
    """Runs at a time: as many as the cores have room for."""
    room = max(1, len(os.sched_getaffinity(0)) // study.threads)
    asked = wanted or study.jobs or room
    if asked > room:
        print(f"quern sweep: {room} runs at a time instead of {asked}: each takes {study.threads} of {len(os.sched_getaffinity(0))} cores", file=sys.stderr)
    return min(asked, room)


@contextlib.contextmanager
def held(folder: pathlib.Path, key: str = ""):
    """One sweep at a time works in a folder, or several that make single runs, each run by one of them: whoever wants the same waits. The
    lock is the kernel's and goes with the process."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".sweep.lock", "w") as file, contextlib.ExitStack() as more:
        try:
            fcntl.flock(file, (fcntl.LOCK_SH if key else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except OSError:
            raise QuernError(f"another sweep is at work in {folder}; wait for it, or give another folder by -o", 4) from None
        if key:
            (folder / "runs").mkdir(exist_ok=True)
            fcntl.flock(more.enter_context(open(folder / "runs" / f"{key}.lock", "w")), fcntl.LOCK_EX)
        yield


def make(study: Study, jobs: list[Job], folder: pathlib.Path, options: argparse.Namespace, stop: int) -> bool:
    """Makes what is not recorded, then all again until each has been timed as often as is asked; False if somebody interrupted it."""
    digests, at_once = program_digests(), at_a_time(study, options.jobs)
    return all(make_round(study, jobs, folder, options, stop, digests, at_once, times) for times in range(1, study.timings + 1))


def make_round(study: Study, jobs: list[Job], folder: pathlib.Path, options: argparse.Namespace, stop: int, digests: dict[str, str],
               at_once: int, times: int) -> bool:
    """Makes each run that has not been made so many times."""
    order = [jobs[k] for k in in_turn(jobs)]
    left = {job.key: job for job in order if not workers.is_timed(folder, job, study, digests, options.retry and times == 1, times)}
    if not options.quiet and len(left) < len(jobs) and times == 1:
        print(f"{len(jobs) - len(left)} of {len(jobs)} runs are there already", file=sys.stderr)

    def say(job: Job, record: dict) -> None:
        say.done += 1
        if not options.quiet:
            word = record["message"].splitlines()[0] if record["message"] else f"{record['cost']['wall']:.1f} s"
            word += f", timing {times} of {study.timings}" * (times > 1)
            print(f"[{say.done}/{len(left)}] {record['status']}: {job}: {word}", file=sys.stderr, flush=True)
    say.done = 0
    return workers.run_all(study, list(left.values()), folder, at_once, digests, say, stop, workers.largest_known(jobs, folder), times > 1)


def sweep(study: Study, options: argparse.Namespace, stop: int) -> int:
    jobs = jobs_of(study)
    folder = pathlib.Path(options.output or pathlib.Path("out") / study.name).resolve()
    if options.emit:
        print(emit(study, folder, jobs, options.emit), end="")
        return 0
    if options.only is not None:
        if not 1 <= options.only <= len(jobs):
            raise QuernError(f"--only {options.only}: the study has runs 1 to {len(jobs)}")
        job = jobs[options.only - 1]
        with held(folder, job.key):
            return status_of(workers.recorded(folder, job.key)) if make(study, [job], folder, options, stop) else 130
    if options.table:  # while others make the runs
        return conclude(tables(study, jobs, folder), folder, True)
    with held(folder):
        whole = make(study, jobs, folder, options, stop)
        rows = tables(study, jobs, folder)
    return conclude(rows, folder, whole)


def tables(study: Study, jobs: list[Job], folder: pathlib.Path) -> list[dict]:
    """One at a time reads what is there and writes it, so that the last tables have all that earlier ones had."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / ".table.lock", "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        return write_tables(study, jobs, folder)


def status_of(record: dict | None) -> int:
    """The exit status of a single run, for the program that asked for it: that of the run itself, or as `timeout` has it."""
    if not record or record["status"] == "done":
        return 0 if record else 4
    return HUNG if record["status"] == "hung" else int(record["exit"] or 1)


def conclude(rows: list[dict], folder: pathlib.Path, whole: bool) -> int:
    """The last lines: how the runs ended, and where the table is."""
    counts = {}
    for row in rows:
        counts[row["status"]] = counts.get(row["status"], 0) + 1
    print(f"{len(rows)} runs: {', '.join(f'{n} {word}' for word, n in sorted(counts.items()))}; {folder / 'table.csv'}")
    if not whole:
        print("quern sweep: interrupted; the same command goes on", file=sys.stderr)
    return 0 if whole else 130


def listen() -> int:
    """From now on signals that end a program can be read here, a byte each. As exceptions they could come anywhere, and get lost."""
    stop, note = os.pipe()
    os.set_blocking(note, False)
    signal.set_wakeup_fd(note)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:  # as under nohup
            signal.signal(number, lambda *_: None)
    return stop


def main(words: list[str] | None = None) -> int:
    options = arguments(words)
    try:
        study = read(pathlib.Path(options.study), options.study)
        return sweep(study, options, listen())
    except StudyError as faults:
        count = len(str(faults).splitlines())
        print(f"{faults}\nquern sweep: {count} fault{'s' * (count != 1)} in {options.study}", file=sys.stderr)
        return 2
    except QuernError as error:
        print(f"quern sweep: error: {error}", file=sys.stderr)
        return error.status
    except OSError as error:
        print(f"quern sweep: error: {sentence_of(error)}", file=sys.stderr)
        return 4
