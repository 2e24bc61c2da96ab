# SPDX-License-Identifier: MIT
"""The runs of a study at work: started as there is room, ended at their limit, recorded when they are over."""
import contextlib
import ctypes
import json
import math
import os
import pathlib
import select
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass

from .points import Job, digest
from .program import find, machine, sentence, set_options
from .study import Study

GRACE = 5.0  # s that a run has to end by itself once its limit is over
NO_FILES = 4  # exit status of a run that could not read or write a file
STATUS = {0: "done", 2: "refused", 130: "interrupted"}


@dataclass
class Active:
    job: Job
    process: subprocess.Popen
    began: float
    ends: float  # when the next signal is due
    place: pathlib.Path = pathlib.Path()  # its folder
    earlier: dict | None = None  # the record of the same run, which is made again for its cost alone
    asked: bool = False  # it was asked to end


def record_path(folder: pathlib.Path, key: str) -> pathlib.Path:
    return folder / "runs" / f"{key}.json"


RECORD = {"status": str, "exit": (int, str), "message": str, "cost": dict, "timings": int, "made_by": dict, "limit": (int, float, type(None))}


def recorded(folder: pathlib.Path, key: str) -> dict | None:
    """What is known of a run that is over; None if there is no record, or one that is damaged."""
    record = {"timings": 1} | read_json(record_path(folder, key))
    if not all(isinstance(record.get(name, ()), kind) for name, kind in RECORD.items()):
        return None
    whole = all(isinstance(cost, (int, float)) for cost in record["cost"].values())
    return record if whole and all(isinstance(one, str) for one in record["made_by"].values()) else None


def is_recorded(folder: pathlib.Path, job: Job, study: Study, digests: dict[str, str], retry: bool) -> bool:
    """True if the run was made already by the same program and plugins, and nothing says to try again, as a disk that was full does."""
    record = recorded(folder, job.key)
    if not record or not set(record["made_by"].values()) <= set(digests.values()):
        return False
    if record["status"] == "hung" and study.limit > (record["limit"] or 0):
        return False
    if record["status"] == "done":
        return bool(read_json(folder / "runs" / job.key / "summary.json"))
    return not retry and record["exit"] != NO_FILES


def timings_wanted(study: Study, job: Job) -> int:
    """The reference is timed as often as points only where costs are shown beside its own: it may take longer than all of them."""
    return study.timings if not job.model or any(chart.relative_cost for chart in study.charts) else 1


def is_timed(folder: pathlib.Path, job: Job, study: Study, digests: dict[str, str], retry: bool, times: int) -> bool:
    """True if the run has been made `times` times, or as often as is wanted of it. Beyond the first time none is made again that did not come to
    its end, or that another machine has made."""
    if times == 1:
        return is_recorded(folder, job, study, digests, retry)
    record = recorded(folder, job.key)
    here = record and record["status"] == "done" and record.get("machine") == machine()
    return not here or record["timings"] >= min(times, timings_wanted(study, job))


def end_with_parent() -> None:
    """In the child, before the program takes its place: a sweep that is killed leaves no runs behind that hold their folders."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def start(study: Study, job: Job, folder: pathlib.Path, again: bool) -> Active:
    earlier = recorded(folder, job.key) if again else None
    place = folder / "runs" / (job.key + ".again" * bool(earlier))
    if not earlier:
        record_path(folder, job.key).unlink(missing_ok=True)  # what it says will not be true of what stands there
    command = [find(), "run", str(study.base.resolve()), "--quiet", "--force", "--threads", str(study.threads),
               "-o", str(place), *set_options(job.sets)]
    with open(f"{place}.err", "wb") as said:
        process = subprocess.Popen(command, cwd=study.path.parent.resolve(), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=said, preexec_fn=end_with_parent)
    now = time.monotonic()
    return Active(job, process, now, now + study.limit, place, earlier)


def remind(fd: int, active: Active) -> None:
    """At its limit a run is asked to end, then made to; by its descriptor, since it may just have ended by itself."""
    with contextlib.suppress(ProcessLookupError):
        signal.pidfd_send_signal(fd, signal.SIGKILL if active.asked else signal.SIGTERM)
    active.asked, active.ends = True, time.monotonic() + GRACE


def read_json(path: pathlib.Path) -> dict:
    """Empty where there is no such file, or no mapping in it."""
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return tree if isinstance(tree, dict) else {}


def message_of(active: Active, code: int, said: str, study: Study) -> tuple[str, str]:
    """Status and sentence of a run that is over."""
    if active.asked:
        return "hung", f"not over within its limit of {study.limit:g} s"
    words = sentence(said) if code else ""
    if code < 0:
        words = words or f"ended by signal {-code}, {signal.Signals(-code).name}"
    return STATUS.get(code, "failed"), words or ("" if code == 0 else f"exit status {code}")


def running_of(summary: dict, processor: float) -> float:
    """Processor time from the release on: it does not matter who has settled. Of a run that does not tell it, by the share of the clock."""
    if "processor_seconds" in summary and "settle_processor_seconds" in summary:
        return summary["processor_seconds"] - summary["settle_processor_seconds"]
    whole = summary.get("wall_seconds")
    return processor * (1 - summary.get("settle_seconds", 0) / whole) if whole else processor


def used_by(summary: dict, digests: dict[str, str]) -> set[str]:
    """The program and the plugins that a run has used; all that there are if it does not tell."""
    plugins = summary.get("provenance", {}).get("plugins")
    return {plugin["file"] for plugin in plugins} | {find()} if plugins is not None else set(digests)


def finish(study: Study, active: Active, folder: pathlib.Path, digests: dict[str, str]) -> dict:
    """Waits for a run that has ended and records it; one that somebody has interrupted is not recorded."""
    _, status, usage = os.wait4(active.process.pid, 0)
    code = active.process.returncode = os.waitstatus_to_exitcode(status)
    wall, note = time.monotonic() - active.began, pathlib.Path(f"{active.place}.err")
    word, message = message_of(active, code, note.read_text(encoding="utf-8", errors="replace"), study)
    note.unlink()
    summary = read_json(active.place / "summary.json") if word == "done" else {}
    processor = usage.ru_utime + usage.ru_stime
    record = {"status": word, "exit": "" if active.asked else code if code >= 0 else 128 - code, "message": message,
              "limit": None if math.isinf(study.limit) else study.limit, "job": str(active.job), "sets": active.job.sets,
              "cost": {"wall": wall, "processor": processor, "running": running_of(summary, processor), "memory": usage.ru_maxrss * 1024},
              "timings": 1, "machine": machine(),
              "made_by": {path: digests.get(path) or digest(pathlib.Path(path).read_bytes()) for path in sorted(used_by(summary, digests))}}
    if active.earlier:
        shutil.rmtree(active.place, ignore_errors=True)
    if word != "interrupted":
        save(record_path(folder, active.job.key), json.dumps(timed(active.earlier, record) if active.earlier else record, indent=1))
    return record


def timed(earlier: dict, again: dict) -> dict:
    """The earlier record, once the same run was made again: other programs make it take longer, and push it out of memory. One that does not come
    to its end this time says nothing."""
    found = earlier | {"timings": earlier["timings"] + 1}
    if again["status"] == "done":
        found["cost"] = {name: (max if name == "memory" else min)(cost, again["cost"].get(name, cost)) for name, cost in earlier["cost"].items()}
    return found


def save(path: pathlib.Path, text: str) -> None:
    """Written aside and renamed: there is the old file or the new one, whole."""
    aside = path.with_name(f"{path.name}.{os.getpid()}.part")
    aside.write_text(text, encoding="utf-8")
    os.replace(aside, path)


def proc_bytes(path: str, word: str) -> float:
    """A line of a file of /proc, in bytes; NaN where the system does not tell."""
    try:
        lines = pathlib.Path(path).read_text().splitlines()
        return next(float(line.split()[1]) * 1024 for line in lines if line.startswith(word))
    except (OSError, StopIteration):
        return math.nan


def has_room(active: dict[int, Active], largest: float) -> bool:
    """True if another run as large as any has memory, once those at work have grown as large too. What they hold already is no longer
    available. Where the system does not tell, there is room."""
    held = [proc_bytes(f"/proc/{one.process.pid}/status", "VmRSS:") for one in active.values()]
    largest = max(largest, *(own for own in held if not math.isnan(own)), 0)
    to_come = sum(max(0, largest - own) for own in held if not math.isnan(own))
    return not proc_bytes("/proc/meminfo", "MemAvailable:") < to_come + largest


def largest_known(jobs: list[Job], folder: pathlib.Path) -> float:
    """The most memory that a run of the study has taken, as far as that is recorded."""
    records = (recorded(folder, job.key) for job in jobs)
    return max((record["cost"].get("memory", 0) for record in records if record), default=0)


def wait(active: dict[int, Active], stop: int) -> list[int]:
    """File descriptors of runs that are over, or `stop`, once there is one or a limit has come."""
    timeout = max(0.0, min(one.ends for one in active.values()) - time.monotonic())
    poll = select.poll()
    for fd in (stop, *active):
        poll.register(fd, select.POLLIN)
    return [fd for fd, _ in poll.poll(None if math.isinf(timeout) else math.ceil(min(timeout, 1e6) * 1000))]


def run_all(study: Study, jobs: list[Job], folder: pathlib.Path, at_a_time: int, digests: dict[str, str],
            say: Callable[[Job, dict], None], stop: int, largest: float = 0, again: bool = False) -> bool:
    """Makes the runs; False if they were interrupted, as they are once `stop` can be read. Another one is started while cores are free,
    and while memory is left for the largest that there was, `largest` bytes in earlier ones. `again`: for their costs alone."""
    (folder / "runs").mkdir(exist_ok=True)
    waiting, active, whole = list(reversed(jobs)), {}, True
    try:
        while waiting or active:
            while waiting and len(active) < at_a_time and (not active or has_room(active, largest)):
                one = start(study, waiting.pop(), folder, again)
                active[os.pidfd_open(one.process.pid)] = one
            over = wait(active, stop)
            if stop in over:
                return False
            for fd in over:
                one = active.pop(fd)
                os.close(fd)
                record = finish(study, one, folder, digests)
                largest = max(largest, record["cost"]["memory"])
                whole &= record["status"] != "interrupted"
                say(one.job, record)
            for fd, one in active.items():
                if time.monotonic() >= one.ends:
                    remind(fd, one)
    finally:
        for fd, one in active.items():
            one.process.kill()
            one.process.wait()
            os.close(fd)
    return whole
