# SPDX-License-Identifier: MIT
"""quern sweep: the table of a study, the same to the last digit however often it was killed; runs that fail, hang or are refused; what is
made again and what is not; sampled axes; errors against a reference; the same work by GNU parallel; what a run costs beside itself."""
import contextlib
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import sys
import time

import h5py

import lab

try:
    import yaml
except ImportError:
    print("python3-yaml is not there")
    sys.exit(77)

TWO = lab.scene("two_grains")
ENERGY = 0.5 * 2 * 2500 * 3.141592653589793 * 0.005 ** 2  # J, of two discs that meet at 1 m/s each


SOFT = {"grains.contact.linear.stiffness": 1, "time.step": "1 ms"}  # fails
ENDLESS = {"time.end": "1e6", "output.every": "1e5", "grains.place.0.velocity": [0, 0], "grains.place.1.velocity": [0, 0]}


def write(folder, name, **study):
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump({"study": 1, "base": TWO, **study}, sort_keys=False))
    return path


def words_of(path, out, *options):
    return [lab.QUERN, "sweep", str(path), "-o", str(out), *options]


def sweep(path, out, *options, status=0, **how):
    done = subprocess.run(words_of(path, out, *options), capture_output=True, text=True, timeout=300, **how)
    assert done.returncode == status, f"{path.name}: exit status {done.returncode}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stderr


def table(out, name="table"):
    """Rows by column, names without units."""
    with open(out / f"{name}.csv") as file:
        return [{key.split(" [")[0]: value for key, value in row.items()} for row in csv.DictReader(file)]


def results(out, name="table"):
    """What must be the same to the last digit: all but costs."""
    return [{key: value for key, value in row.items() if not key.startswith("cost.")} for row in table(out, name)]


def made(said):
    return said.count("] done: ")


def check_physics(here):
    """The energy that a collision leaves over its restitution, against e^2; errors against a reference follow from it."""
    path = write(here, "bounce", set={"time.end": "4 ms", "observe": ["energy"]}, jobs=2, repeats={"seeds": [3, 5]},
                 axes={"restitution": {"key": "grains.contact.linear.restitution", "grid": {"from": 0.5, "to": 1.0, "steps": 6}}},
                 reference={"name": "half", "set": {"grains.contact.linear.restitution": 0.5}},
                 measure=[{"name": "left", "series": "energy.grains"}, {"name": "all", "series": "energy.grains", "at": "every"},
                          {"name": "mass", "summary": "sums.mass"}, {"name": "most", "series": "energy.grains", "at": "max"}])
    sweep(path, here / "bounce")
    rows, points = table(here / "bounce"), table(here / "bounce", "points")
    assert len(rows) == 14 and len(points) == 6 and [row["model"] for row in rows].count("half") == 2, len(rows)
    worst = 0
    for row in rows[2:]:
        e = float(row["restitution"])
        worst = max(worst, abs((float(row["left"]) / ENERGY) ** 0.5 - e))
        assert abs(float(row["left.error"]) - abs(float(row["left"]) - float(rows[0]["left"]))) < 1e-15
        most = max(ENERGY, float(row["left"]))  # without dashpots a step leaves a little more than there was
        assert abs(float(row["most"]) / most - 1) < 1e-12 and abs(float(row["mass"]) / ENERGY - 2) < 1e-12 and row["seed"] in ("3", "5")
    assert worst < 0.005, worst  # what collisions are held to (tests/physics/collisions.c)
    assert float(points[0]["left.error"]) == 0 == float(points[0]["all.error"]) and points[0]["left.error.standard_error"] == ""
    for row in points[1:]:
        e = float(row["restitution"])
        assert abs(float(row["left.error"]) / ENERGY - (e * e - 0.25)) < 0.01 and float(row["left.error.standard_error"]) == 0
    # the whole series, by hand
    with open(here / "bounce/runs" / rows[2]["run"] / "series.csv") as file:
        assert "energy.grains [J]" in file.readline()
    own, twin = ([row[3] for row in lab.series(here / "bounce/runs" / run["run"])[1]] for run in (rows[-1], rows[0]))
    rms = (sum((a - b) ** 2 for a, b in zip(own, twin)) / len(own)) ** 0.5
    assert abs(float(rows[-1]["all.error"]) / rms - 1) < 1e-12
    with h5py.File(here / "bounce/table.h5") as file:
        assert file["runs/left"].attrs["unit"] == "J" and file["runs/left"][5] == float(rows[5]["left"])
        assert file["runs/status"].asstr()[()].tolist() == ["done"] * 14 and file["points/left.mean"].shape == (6,)
    print(f"ok  energy left over restitution: {worst:.4f} of all from e^2 at the most; errors against a reference")


def check_ends(here):
    """Runs that are done, refused, fail, crash, hang, and hang deaf: each a row with its sentence."""
    cases = {"good": {}, "refused": {"time.end": -1}, "fails": SOFT,
             "hangs": ENDLESS}
    measure = [{"name": "front", "series": "runout.front"}]
    path = write(here, "ends", set={"time.end": "4 ms"}, axes={"case": {"cases": cases}}, jobs=1, limit="1 s", measure=measure)
    sweep(path, here / "ends")
    rows = {row["case"]: row for row in table(here / "ends")}
    ends = {case: (row["status"], row["exit"]) for case, row in rows.items()}
    assert ends == {"good": ("done", "0"), "refused": ("refused", "2"), "fails": ("failed", "3"), "hangs": ("hung", "")}, ends
    assert rows["good"]["message"].startswith("front: the series have no 'runout.front'; they have time, "), rows["good"]
    assert rows["refused"]["message"] == "--set time.end=-1: error: scene: time.end is -1, must be between 0 and 1e12 s", rows["refused"]
    assert rows["fails"]["message"].startswith("dem.observe, at t = ") and "too low" in rows["fails"]["message"]
    assert rows["hangs"]["message"] == "not over within its limit of 1 s" and rows["hangs"]["steps"] == ""
    assert 1 <= float(rows["hangs"]["cost.wall"]) < 4, rows["hangs"]["cost.wall"]
    assert "4 of 4 runs are there already" in sweep(path, here / "ends")
    assert "] failed: " in sweep(path, here / "ends", "--retry")
    path.write_text(path.read_text().replace("limit: 1 s", "limit: 1.5 s"))
    assert sweep(path, here / "ends").count("] hung: ") == 1  # more time is a reason to try again
    deaf = write(here, "deaf", axes={"case": {"cases": {"hangs": cases["hangs"]}}}, limit="1 s")
    subprocess.run(["sh", "-c", 'trap "" TERM; exec "$@"', "sh", *words_of(deaf, here / "deaf")], capture_output=True, check=True, timeout=100)
    row = table(here / "deaf")[0]
    assert row["status"] == "hung" and 5 < float(row["cost.wall"]) < 12, row
    print("ok  done, refused, failed, hung, hung and deaf: each a row")


def processes(out):
    """Processes whose command names the folder."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().split(b"\0")
        except OSError:
            continue
        found += [int(path.parent.name)] * any(word.startswith(f"{out}/runs".encode()) for word in words)
    return found


def check_kills(here):
    """Killed at moments drawn from a seed, a sweep leaves no run behind and comes to the table of one that was not."""
    path = write(here, "kills", set={"time.end": "10 ms", "observe": ["energy"]}, jobs=2, repeats={"seeds": 2},
                 axes={"speed": {"key": "grains.place.0.velocity.0", "random": {"from": "1 m/s", "to": "5 m/s", "law": "log", "n": 6}},
                       "step": {"key": "time.step", "list": ["5e-6", "4e-6"]}},
                 reference={"name": "fine", "set": {"time.step": "1e-6"}, "follows": ["speed"]},
                 measure=[{"name": "left", "series": "energy.grains"}])
    sweep(path, here / "whole", "--jobs", "1")
    draw, runs = lab.seeded(), here / "killed/runs"
    for number, kind in enumerate([signal.SIGKILL, signal.SIGINT, signal.SIGTERM]):
        process = subprocess.Popen(words_of(path, here / "killed"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while len(list(runs.glob("*.json"))) < 10 * number and process.poll() is None:
            time.sleep(0.002)
        time.sleep(draw.uniform(0, 0.1))
        assert process.poll() is None, "the sweep was over before it was killed"
        lab.stop(process, kind)
        deadline = time.monotonic() + 5
        while processes(here / "killed") and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not processes(here / "killed"), "a run goes on without its sweep"
    there = len(list((here / "killed/runs").glob("*.json")))
    said = sweep(path, here / "killed")
    assert made(said) + there == 36, (there, said)
    assert results(here / "whole") == results(here / "killed"), "the table differs"
    # standard errors of two seeds of grains that know no chance are 0, and fronts stand on clocks: the rest is the same too
    assert results(here / "whole", "points") == results(here / "killed", "points")
    assert not list((here / "killed").rglob("*.part")) and not list((here / "killed/runs").glob("*.err"))
    assert all(row["speed"] and row["left.error"] if not row["model"] else True for row in table(here / "whole"))
    print(f"ok  killed three times with {there} of 36 runs made: the same table")


def check_again(here):
    """What makes a run be made again: what the scene says, a file that it names, another program; not a comment."""
    shutil.copy(TWO, here / "base.yaml")
    text = (here / "base.yaml").read_text().split("  place:")
    (here / "base.yaml").write_text(f"{text[0]}  file: grains.txt\n" + text[1][text[1].index("output:"):])
    (here / "grains.txt").write_text("x y radius vx vy\n-0.0055 0 0.005 1 0\n0.0055 0 0.005 -1 0\n")
    path = write(here, "again", base="base.yaml", set={"time.end": "1 ms"}, repeats={"seeds": 2})
    out = here / "again"
    assert made(sweep(path, out)) == 2 and made(sweep(path, out)) == 0
    (here / "base.yaml").write_text("# a word\n" + (here / "base.yaml").read_text())
    assert made(sweep(path, out)) == 0
    (here / "base.yaml").write_text((here / "base.yaml").read_text().replace("restitution: 0.5", "restitution: 0.6"))
    assert made(sweep(path, out)) == 2
    (here / "grains.txt").write_text((here / "grains.txt").read_text().replace("-1 0", "-2 0"))
    assert made(sweep(path, out)) == 2
    other = here / "other"
    other.mkdir()
    shutil.copy(lab.QUERN, other / "quern")
    shutil.copy(pathlib.Path(lab.QUERN).parent / "quern.built", other)
    (other / "plugins").symlink_to(lab.PLUGINS)
    moved = {"env": {**os.environ, "QUERN": str(other / "quern")}}
    assert made(sweep(path, out, **moved)) == 0  # the same program elsewhere
    with open(other / "quern", "ab") as file:
        file.write(b"\0")
    assert made(sweep(path, out, **moved)) == 2
    shutil.rmtree(out / "runs" / table(out)[0]["run"])
    assert made(sweep(path, out, **moved)) == 1
    print("ok  made again for another scene, file, program or a lost folder alone")


def check_samples(here):
    """A sample: the same with a further axis beside it, even in its logarithm, drawn together with another."""
    wide = {"key": "grains.contact.linear.stiffness", "random": {"from": "1e4 N/m", "to": "1e8 N/m", "law": "log", "n": 400}}
    one = write(here, "one", axes={"stiffness": wide})
    two = write(here, "two", axes={"end": {"key": "time.end", "random": {"from": "1 ms", "to": "2 ms", "n": 400, "seed": 9}}, "stiffness": wide})
    sys.path.insert(0, str(lab.SOURCE / "python"))
    from quern.points import jobs_of
    from quern.study import read
    first, second = ([dict(job.values) for job in jobs_of(read(path))] for path in (one, two))
    assert [point["stiffness"] for point in first] == [point["stiffness"] for point in second] and len(second) == 400
    import numpy
    logs = numpy.log10([float(point["stiffness"].split()[0]) for point in first])
    # mean and spread of even numbers between 4 and 8, of 400 draws; four standard errors
    assert abs(logs.mean() - 6) < 4 * (4 / 12 ** 0.5) / 20 and abs(logs.std() / (4 / 12 ** 0.5) - 1) < 0.15, (logs.mean(), logs.std())
    ends = numpy.array([float(point["end"].split()[0]) for point in second])
    assert abs(numpy.corrcoef(ends, logs)[0, 1]) < 0.2
    print(f"ok  samples: mean of the logarithm {logs.mean():.3f} of 6, spread {logs.std():.3f} of {4 / 12 ** 0.5:.3f}")


def disk_of(here):
    """The environment of a sweep whose runs find the disk full while there is a file `full`."""
    (here / "wrapped").write_text(f'#!/bin/sh\n[ "$1" = run ] && [ -e {here}/full ] && echo "quern: error: no space left" >&2 && exit 4\nexec {lab.QUERN} "$@"\n')
    (here / "wrapped").chmod(0o755)
    return {**os.environ, "QUERN": str(here / "wrapped")}


def check_order(here):
    """No point has its costs measured in one stretch of time: all points are made with one seed, then all with the next, for GNU parallel too."""
    path = write(here, "order", set={"time.end": "1 ms"}, repeats={"seeds": [7, 4]}, jobs=1, reference={"name": "hard", "set": {}},
                 axes={"restitution": {"key": "grains.contact.linear.restitution", "list": [0.5, 0.7, 0.9]}},
                 measure=[{"name": "mass", "summary": "sums.mass"}])
    lines = subprocess.run(words_of(path, here / "order", "--emit", "parallel"), capture_output=True, text=True, check=True).stdout.splitlines()
    begun = [line.split(": ")[1] for line in sweep(path, here / "order").splitlines() if "] done: " in line]
    assert begun == [f"{one}, seed {seed}" for seed in (7, 4) for one in ("hard", *(f"restitution {e}" for e in (0.5, 0.7, 0.9)))], begun
    assert [int(line.split()[-1]) for line in lines] == [1, 3, 5, 7, 2, 4, 6, 8], lines
    print("ok  all points are made with one seed, then with the next, the reference before them")


def check_timings(here):
    """A run is made as often as costs are timed, all of them in turn, and costs the least that it took; it may be timed once more later. What a
    timing meets takes no result away."""
    study = {"set": {"time.end": "1 ms"}, "repeats": {"seeds": 2, "timings": 3}, "axes": {"restitution": {"key": "grains.contact.linear.restitution", "list": [0, 0.5]}},
             "reference": {"name": "as it is", "set": {"grains.contact.linear.restitution": 0.3}}, "measure": [{"name": "mass", "summary": "sums.mass"}], "jobs": 2}
    out, env = here / "timings", disk_of(here)
    said = sweep(write(here, "timings", **study), out, env=env)
    # a restitution of 0 is refused: two references once, two points three times, two points once
    assert made(said) == 2 + 2 * 3 and said.count("] refused: ") == 2 and said.count("timing 3 of 3") == 2, said
    turns = [line[-6] for line in said.splitlines() if line.endswith(" of 3")]
    assert turns == ["2", "2", "3", "3"], said
    rows = [row for row in table(out) if row["status"] == "done"]
    records = {row["run"]: json.loads((out / "runs" / f"{row['run']}.json").read_text()) for row in rows}
    assert [records[row["run"]]["timings"] for row in rows] == [1, 1, 3, 3], records
    points = [row["run"] for row in rows if not row["model"]]
    for run, seconds in zip(points, (1e-9, 1e9)):
        (out / "runs" / f"{run}.json").write_text(json.dumps(records[run] | {"cost": {name: seconds for name in records[run]["cost"]}}))
    del records[rows[0]["run"]]["timings"]  # as records of before have none
    (out / "runs" / f"{rows[0]['run']}.json").write_text(json.dumps(records[rows[0]["run"]]))
    before = results(out)
    assert made(sweep(write(here, "timings", **study | {"repeats": {"seeds": 2, "timings": 4}}), out, env=env)) == 2
    cheap, dear = ([float(row[f"cost.{name}"]) for name in ("processor", "memory")] for row in table(out) if row["run"] in points)
    assert cheap[0] == 1e-9 and cheap[1] > 1e6 and 0 < dear[0] < 60 and dear[1] == 1e9 and results(out) == before, (cheap, dear)
    (here / "full").touch()
    chart = {"charts": [{"name": "front", "kind": "front", "measure": "mass", "relative_cost": True}]}
    said = sweep(write(here, "timings", **study | {"repeats": {"seeds": 2, "timings": 5}}, **chart), out, env=env)
    assert said.count("] failed: ") == 2 * 4 + 2 and results(out) == before, said  # the reference counts now, and is timed four times
    (here / "full").unlink()
    single = sweep(write(here, "single", **study | {"axes": {}, "repeats": {"timings": 2}}), here / "single", "--only", "2", env=env)
    assert made(single) == 2 and "timing 2 of 2" in single, single
    assert not list(out.rglob("*.again")) and not list(out.rglob("*.err"))
    print("ok  runs are timed as often as is asked, all in turn, and cost the least that they took")


def check_emit(here):
    path = write(here, "emit", set={"time.end": "1 ms"}, repeats={"seeds": 3}, limit="10 min", jobs=2)
    sweep(path, here / "own")
    lines = subprocess.run(words_of(path, here / "theirs", "--emit", "parallel"), capture_output=True, text=True, check=True).stdout
    assert len(lines.splitlines()) == 3 and not (here / "theirs").exists()
    script = subprocess.run(words_of(path, here / "theirs", "--emit", "slurm"), capture_output=True, text=True, check=True).stdout
    assert "#SBATCH --array=1-3%2\n" in script and "#SBATCH --time=11\n" in script and "#SBATCH --cpus-per-task=1\n" in script
    ways = [["sh", "-c", f"for SLURM_ARRAY_TASK_ID in 1 2 3; do export SLURM_ARRAY_TASK_ID; sh {here}/job.sh || exit; done"]]
    (here / "job.sh").write_text(script)
    if shutil.which("parallel"):
        ways.append(["parallel", "--jobs", "2"])
    for way in ways:
        shutil.rmtree(here / "theirs", ignore_errors=True)
        subprocess.run(way, input=lines, text=True, check=True, timeout=120, env={**os.environ, "HOME": str(here)})
        assert made(sweep(path, here / "theirs", "--table")) == 0
        assert results(here / "own") == results(here / "theirs"), way
    print(f"ok  the same table by {'GNU parallel' if len(ways) > 1 else 'no GNU parallel, which is not there,'} and as a slurm array would")


def check_lock(here):
    path = write(here, "long", set=ENDLESS, limit="20 s")
    first = subprocess.Popen(words_of(path, here / "long"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    lab.wait_for(here / "long/.sweep.lock", first)
    while not processes(here / "long"):
        time.sleep(0.01)
    assert "another sweep is at work" in sweep(path, here / "long", status=4)
    sweep(path, here / "long", "--table")
    assert table(here / "long")[0]["status"] == "missing"
    first.send_signal(signal.SIGINT)
    assert first.wait(timeout=20) == 130 and table(here / "long")[0]["status"] == "missing"
    print("ok  one sweep in a folder, tables of what is there meanwhile; an interrupted one ends with 130 and its table")


def check_settled(here):
    """Points that settle alike settle once: the cache has one state for each seed."""
    small = dict(one.removeprefix("--set=").split("=", 1) for one in lab.SMALL["column"] if "oracle" not in one)
    small |= {"grains.fill.1.region.box.upper": "[0.039, 0.08]", "grains.settle.step": "0.05"}  # long enough to be kept
    path = write(here, "settled", base=lab.scene("column"), set={**{key: yaml.safe_load(value) for key, value in small.items()}, "time.end": "1 ms"},
                 axes={"depth": {"key": "hybrid.oracle.0.packing_fraction.depth", "list": ["12 mm", "16 mm", "20 mm"]}}, repeats={"seeds": 2}, jobs=1)
    sweep(path, here / "settled", env={**os.environ, "QUERN_CACHE": str(here / "cache")})
    rows = table(here / "settled")
    logs = [(here / "settled/runs" / row["run"] / "log.txt").read_text() for row in rows]
    assert [row["status"] for row in rows] == ["done"] * 6 and sum("settled already" in log for log in logs) == 4, rows
    print("ok  six runs of two seeds settle twice")


def check_overhead(here):
    path = write(here, "many", set={"time.end": "1 ms"}, repeats={"seeds": 200}, jobs=1)
    began = time.monotonic()
    sweep(path, here / "many", "--quiet")
    whole = time.monotonic() - began
    rows = table(here / "many")
    assert len(rows) == 200 and {row["status"] for row in rows} == {"done"}
    beside = (whole - sum(float(row["cost.wall"]) for row in rows)) / 200
    alone = []
    for number in range(20):
        began = time.monotonic()
        lab.run("two_grains", here / f"alone{number}", "--set=time.end=1 ms", f"--set=seed={number}")
        alone.append(time.monotonic() - began)
    bare = sum(alone) / len(alone)
    print(f"ok  200 runs: {1e3 * whole / 200:.1f} ms each, {1e3 * beside:.1f} ms of it beside the run; started by hand a run takes {1e3 * bare:.1f} ms")
    assert beside < 0.05 and whole / 200 - bare < 0.05, (beside, whole / 200, bare)


SLURM = """ClusterName=quern
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
SlurmctldPort={controller}
SlurmdPort={node}
StateSaveLocation={here}/state
SlurmdSpoolDir={here}/spool
SlurmctldPidFile={here}/slurmctld.pid
SlurmdPidFile={here}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores}
PartitionName=all Nodes=ALL Default=YES State=UP
"""


@contextlib.contextmanager
def slurm(here):
    """A cluster of this machine alone, as long as the block lasts; gives its environment, or None if it does not come up."""
    with socket.socket() as one, socket.socket() as other:
        one.bind(("127.0.0.1", 0))
        other.bind(("127.0.0.1", 0))
        ports = {"controller": one.getsockname()[1], "node": other.getsockname()[1]}
    names = {"host": socket.gethostname().split(".")[0], "user": pwd.getpwuid(os.getuid()).pw_name, "cores": os.cpu_count()}
    for name in ("state", "spool"):
        (here / name).mkdir()
    (here / "slurm.conf").write_text(SLURM.format(here=here, **names, **ports))
    env = {**os.environ, "SLURM_CONF": str(here / "slurm.conf")}
    with open(here / "said", "w") as said:
        parts = [subprocess.Popen([program, "-D"], env=env, stdout=said, stderr=said) for program in ("slurmctld", "slurmd")]
    try:
        deadline = time.monotonic() + 10
        while "idle" not in subprocess.run(["sinfo", "-h", "-o", "%T"], env=env, capture_output=True, text=True).stdout:
            time.sleep(0.1)
            if time.monotonic() > deadline or any(part.poll() is not None for part in parts):
                break
        else:
            deadline = math.inf
        yield env if deadline == math.inf else None
    finally:
        for part in reversed(parts):
            part.terminate()
            part.wait(timeout=20)


def check_slurm(here):
    """Six runs, one of which fails, as an array of jobs of a slurm that runs on this machine alone."""
    if not all(shutil.which(program) for program in ("slurmctld", "slurmd", "sbatch", "sinfo", "scontrol")):
        print("    slurm is not there, and not tried")
        return
    cases = {"soft": {**SOFT, "time.end": "4 ms"}, "short": {}, "long": {"time.end": "2 ms"}}
    path = write(here, "array", set={"time.end": "1 ms"}, axes={"case": {"cases": cases}}, repeats={"seeds": 2}, limit="1 min")
    sweep(path, here / "own")
    with slurm(here) as env:
        if not env:
            print(f"    slurm is there, but does not come up:\n{(here / 'said').read_text()[-2000:]}")
            return
        script = subprocess.run(words_of(path, here / "theirs", "--emit", "slurm"), capture_output=True, text=True, check=True).stdout
        subprocess.run(["sbatch"], input=script, text=True, check=True, cwd=here, env=env, capture_output=True)
        began, runs = time.monotonic(), here / "theirs/runs"
        while len(list(runs.glob("*.json"))) < 6 or subprocess.run(["squeue", "-h"], env=env, capture_output=True, text=True).stdout:
            time.sleep(0.2)
            assert time.monotonic() < began + 60, f"{list(runs.glob('*.json'))}\n{(here / 'said').read_text()}"
        told = subprocess.run(["scontrol", "show", "job", "-o"], env=env, capture_output=True, text=True, check=True).stdout
    ends = {int(line.split("ArrayTaskId=")[1].split()[0]): line.split("ExitCode=")[1].split()[0] for line in told.splitlines()}
    assert ends == {1: "3:0", 2: "3:0", 3: "0:0", 4: "0:0", 5: "0:0", 6: "0:0"}, told
    assert "6 of 6 runs are there already" in sweep(path, here / "theirs") and results(here / "own") == results(here / "theirs")
    print(f"ok  the same table by slurm in {time.monotonic() - began:.1f} s; it sees which runs failed")


def check_only(here):
    """A single run ends with the status of the run, so that a cluster sees what failed."""
    cases = {"good": {}, "refused": {"time.end": -1}, "fails": SOFT, "hangs": ENDLESS}
    path = write(here, "single", set={"time.end": "4 ms"}, axes={"case": {"cases": cases}}, limit="1 s")
    for k, status in enumerate((0, 2, 3, 124)):
        for _ in range(2):  # made, and there already
            sweep(path, here / "single", "--only", str(k + 1), "--quiet", status=status)
    sweep(path, here / "single", "--only", "5", status=1)
    print("ok  --only ends with the status of its run")


def check_full(here):
    """A run that a full disk ended is made again by the next sweep."""
    (here / "full").touch()
    path, env = write(here, "disk", set={"time.end": "1 ms"}, repeats={"seeds": 2}), disk_of(here)
    sweep(path, here / "disk", env=env)
    assert [(row["status"], row["exit"], row["message"]) for row in table(here / "disk")] == [("failed", "4", "no space left")] * 2
    (here / "full").unlink()
    assert made(sweep(path, here / "disk", env=env)) == 2
    print("ok  a run that found the disk full is tried again")


def check_memory(here):
    """Runs that have begun and not yet grown count as large as the largest."""
    sys.path.insert(0, str(lab.SOURCE / "python"))
    from quern import workers
    from quern.points import jobs_of
    from quern.study import read
    sleepers = [subprocess.Popen(["sleep", "20"]) for _ in range(2)]
    active = {one.pid: workers.Active(None, one, 0, 0) for one in sleepers}
    resident, available = 0, workers.proc_bytes("/proc/meminfo", "MemAvailable:")
    while resident < 1e5 and sleepers[0].poll() is None:  # until the program has taken its place
        resident = workers.proc_bytes(f"/proc/{sleepers[0].pid}/status", "VmRSS:")
    assert 1e5 < resident < 1e7 < available, (resident, available)
    assert workers.has_room(active, 0) and workers.has_room(active, available / 4)
    assert not workers.has_room(active, available / 2.5)  # two that have yet to grow, and a third
    assert workers.has_room({}, available / 2.5)
    for one in sleepers:
        one.kill()
        one.wait()
    path = write(here, "memory", set={"time.end": "1 ms"}, repeats={"seeds": 2})
    sweep(path, here / "memory")
    most = max(float(row["cost.memory"]) for row in table(here / "memory"))
    assert workers.largest_known(jobs_of(read(path)), here / "memory") == most > 1e6
    # processor time from the release on, exactly where a run tells it
    assert workers.running_of({"processor_seconds": 9.0, "settle_processor_seconds": 4.0, "wall_seconds": 1, "settle_seconds": 1}, 99.0) == 5
    assert workers.running_of({"wall_seconds": 8.0, "settle_seconds": 2.0}, 4.0) == 3 and workers.running_of({}, 4.0) == 4
    print("ok  memory of runs that have just begun is kept free")


def check_names(here):
    """Blanks in paths and names; a line break cannot stand in a list of commands; 2D is a word, 2 mm a number."""
    folder = here / "a folder, with 'blanks'"
    folder.mkdir()
    axes = {"dimension": {"cases": {"2D": {}, "3D": {"time.end": "2 ms"}}}, "end": {"key": "time.step", "list": ["1e-6 s", "2e-6 s"]}}
    path = write(folder, "my study", set={"time.end": "1 ms"}, axes=axes)
    subprocess.run([lab.QUERN, "sweep", path.name, "--jobs", "1"], cwd=folder, check=True, capture_output=True, timeout=100)
    text = (folder / "out/my_study/table.csv").read_text()
    assert "dimension,end [s],seed" in text and ",2D,1e-06," in text, text
    for form in ("parallel", "slurm"):
        lines = subprocess.run(words_of(path, folder / "o u t", "--emit", form), capture_output=True, text=True, check=True).stdout
        last = lines.splitlines()[-1] if form == "parallel" else lines
        subprocess.run(["sh", "-c", last], check=True, env={**os.environ, "SLURM_ARRAY_TASK_ID": "4"}, timeout=100)
        assert len(list((folder / "o u t/runs").glob("*.json"))) == 1
    broken = folder / "two\nlines"
    assert "a character that a line of commands cannot hold" in sweep(path, broken, "--emit", "slurm", status=1)
    (folder / "...yaml").write_text(path.read_text())
    said = subprocess.run([lab.QUERN, "sweep", "...yaml", "--table"], cwd=folder, capture_output=True, text=True, timeout=100)
    assert said.returncode == 0 and (folder / "out/study/table.csv").exists(), said
    print("ok  blanks and line breaks in names, words that begin with a number")


# those that mostly wait go on beside the others; what a sweep costs is measured alone
WAITING = (check_ends, check_slurm, check_lock)
OTHERS = (check_physics, check_kills, check_again, check_samples, check_order, check_timings, check_emit, check_only, check_full, check_memory, check_names, check_settled)


def check_all(place, checks):
    for check in checks:
        (place / check.__name__).mkdir()
        check(place / check.__name__)


with lab.workplace() as name, concurrent.futures.ThreadPoolExecutor(1) as pool:
    waiting = pool.submit(check_all, pathlib.Path(name), WAITING)
    check_all(pathlib.Path(name), OTHERS)
    waiting.result()
    check_all(pathlib.Path(name), (check_overhead,))
