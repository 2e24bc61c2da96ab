# SPDX-License-Identifier: MIT
"""python/quern: what it reads is what lies in the files, of runs that are over, at work, interrupted and killed; failures are
exceptions with the program's own sentence."""
import csv
import os
import pathlib
import signal
import sys
import time

import h5py
import numpy

import lab

sys.path.insert(0, str(lab.SOURCE / "python"))
import quern  # noqa: E402

try:
    import yaml
except ImportError:
    yaml = None
try:
    import pandas
except ImportError:
    pandas = None


def raises(kind, function, *words, **options):
    """The message of what a call raises."""
    try:
        function(*words, **options)
    except kind as error:
        return error
    raise AssertionError(f"{function.__name__} raises no {kind.__name__}")


def check_whole(here):
    """Frames, masks, series, summary and scene of a hybrid against the files themselves."""
    lab.run("column", here / "whole", *lab.SMALL["column"], "--set=time.end=20 ms")
    run = quern.open(here / "whole")
    files = lab.frames(here / "whole")
    assert run.status == "done" and len(run.frames) == len(files) == 5 and repr(run).endswith("done, 5 frames>"), run
    for frame, path in zip(run.frames, files):
        with h5py.File(path) as file:
            assert frame.time == file.attrs["time"] and frame.step == file.attrs["step"]
            assert (frame["grain.position"] == file["grains/position"][()]).all()
            assert frame.unit("point.stress") == "Pa" and frame["point.stress"].shape[1] == 6
            held = [f"{group[:-1]}.{field}" for group in file for field in file[group]]
            assert sorted(frame.fields) == sorted(held), frame.fields
    last = run.frames[-1]
    assert [frame.time for frame in run.frames[1:3]] == [run.frames[1].time, run.frames[2].time]
    assert "grain.radius" in last and "grain.colour" not in last
    told = str(raises(KeyError, last.__getitem__, "grain.colour"))
    assert "000004.h5 has no 'grain.colour'; it has " in told and "grain.radius" in told, told
    # every mask counted by hand, and by the place of each grain in the cells
    weights = {"grain": (1, 0), "point": (0, 1)}
    for kind, (alone, none) in weights.items():
        weight = last[f"{kind}.weight"]
        counts = [(weight == alone).sum(), ((weight != alone) & (weight != none)).sum(), (weight == none).sum()]
        assert [last.mask(kind, zone).sum() for zone in ("discrete", "hybrid", "continuum")] == counts, (kind, counts)
        assert counts[1] > 0, counts
    corner = {tuple(numpy.floor(x[:2] / 4e-3).astype(int)): zone for x, zone in zip(last["cell.position"], last["cell.zone"])}
    inside = numpy.floor(last["grain.position"][:, :2] / 4e-3).astype(int)
    zones = [corner.get(tuple(cell)) for cell in inside[last.mask("grain", "hybrid")]]
    # zones are as old as the last update: a grain may have left its cell by a row since
    assert numpy.mean([zone == 1 for zone in zones]) > 0.8, zones
    assert "no zone is called 'both'" in str(raises(quern.QuernError, last.mask, "grain", "both"))
    rows = list(csv.DictReader((here / "whole/series.csv").open()))
    front = [float(row["runout.front [m]"]) for row in rows]
    assert run.series["runout.front"].tolist() == front and run.series.units["runout.front"] == "m" and len(run.series) == 5
    if pandas:
        told, held = run.series.to_pandas(), pandas.read_csv(here / "whole/series.csv", float_precision="round_trip")
        assert list(told.columns) == list(held.columns) and len(told) == 5, list(told.columns)
        assert (told.to_numpy() == held[told.columns].to_numpy(float)).all() and told["runout.front [m]"].tolist() == front
        print(f"ok  a table of pandas with {len(told.columns)} columns")
    else:
        print("pandas is not here: to_pandas was not looked at")
    assert "the series have no 'runout.back'" in str(raises(KeyError, run.series.__getitem__, "runout.back"))
    assert run.summary == lab.summary(here / "whole") and "done: t = 0.02 s" in run.log
    if yaml:
        scene = run.scene
        assert scene["time"]["end"] == 0.02 and scene["gravity"] == [0, -9.81]
        numbers = [value for value in flat(scene) if isinstance(value, str) and value[:1].isdigit()]
        assert not numbers, f"numbers that were read as text: {numbers}"
    print("ok  frames, masks, series, summary and scene of a hybrid")


def flat(tree):
    if isinstance(tree, dict):
        return [leaf for item in tree.values() for leaf in flat(item)]
    return [leaf for item in tree for leaf in flat(item)] if isinstance(tree, list) else [tree]


def check_on_the_way(here):
    """A run that is at work, interrupted, killed; a row of the series that is half-written."""
    def first_frames(process, share):
        lab.wait_for(folder / "frames/000002.h5", process)
        run = quern.open(folder)
        if process.poll() is None and run.frames and (folder / "series.csv").exists():
            seen.append((run.status, len(run.frames), len(run.series), process.poll()))

    seen, status = [], {}
    for number, word in ((signal.SIGINT, "interrupted"), (signal.SIGKILL, "killed")):
        folder = here / word
        lab.on_the_way("two_grains", folder, ["--set=output.every=0.1 ms", "--set=time.end=0.2", "--set=time.step=2e-7"], number, first_frames)
        run = quern.open(folder)
        status[word] = run.status
        assert len(run.frames) >= 3 and run.frames[0].step == 0 and 3 <= len(run.series) <= len(run.frames) + 1
    assert status == {"interrupted": "interrupted", "killed": "killed"}, status
    assert any(word == "running" and gone is None for word, _, _, gone in seen), seen
    assert quern.open(here / "killed").summary == {}
    with open(here / "killed/series.csv", "a") as file:
        rows = len(quern.open(here / "killed").series)
        file.write("0.1,2")
        file.flush()
        assert len(quern.open(here / "killed").series) == rows
    print(f"ok  running with {seen[0][1]} frames, interrupted, killed, a row without its end")


def check_locks(here):
    """A lock of another device's file of that number is another file's; where devices are named otherwise, the process tells."""
    from quern.runs import _holds
    here.mkdir()
    with open(here / "file", "w") as held:
        file = os.fstat(held.fileno())

        def words(device, process=1, kind="FLOCK"):
            return ["1:", kind, "ADVISORY", "WRITE", str(process), f"{device}:{file.st_ino}", "0", "EOF"]
        own = f"{os.major(file.st_dev):02x}:{os.minor(file.st_dev):02x}"
        assert _holds(words(own), file) and not _holds(words(own, kind="POSIX"), file) and not _holds(["1:", "->", *words(own)[1:]], file)
        assert not _holds(words("ff:ff", 999999999), file) and _holds(words("ff:ff", os.getpid()), file)
        assert not _holds([*words(own)[:5], f"{own}:1", "0", "EOF"], file) and not _holds([], file)
    path = here / "series.csv"
    for text, said in (("time [s],step\n0,1\n2,3\n", ""), ("a [m],b [m]\n1\n", "series.csv, line 2: 1 cells, and the header names 2 columns"),
                       ("a [m]\nx\n", "could not convert string to float: 'x'"), ("", ""), ("a [m],a [s]\n1,2\n", "line 2: 2 cells, and the header names 1")):
        path.write_text(text)
        if said:
            assert said in str(raises(quern.QuernError, quern.runs.Series, path)), text
        else:
            series = quern.runs.Series(path)
            assert not text or series["step"].tolist() == [1, 3] and series.units["step"] == "1" and len(series) == 2
    print("ok  locks by device and file; series of any form")


def check_run(here):
    """quern.run: sets of both forms, and what it says when a scene is refused, a run fails, a folder is taken."""
    scene = lab.SOURCE / "configs/two_grains.yaml"
    one = quern.run(scene, set={"time.end": "2 ms", "output.fields": ["grain.velocity", "grain.spin"], "gravity": numpy.array([0.0, -1.0]),
                                "output.compress": False}, out=here / "one", threads=1)
    two = quern.run(scene, set=["time.end=2 ms", "output.fields=[grain.velocity, grain.spin]", "gravity=[0,-1]", "output.compress=false"],
                    out=here / "two")
    assert one.frames[-1].path.read_bytes() == two.frames[-1].path.read_bytes()
    assert one.frames[0].mask("grain", "discrete").all() and one.frames[0].mask("grain", "discrete").shape == (2,)
    assert one.summary["threads"] == 1 and one.frames[-1].time == 0.002
    refused = raises(quern.QuernError, quern.run, scene, set={"time.end": "5 kg", "time.edn": 1}, out=here / "no")
    assert refused.status == 2 and str(refused).count("error: ") == 2 and "did you mean 'end'?" in str(refused), refused
    failed = raises(quern.QuernError, quern.run, scene, set={"grains.contact.linear.stiffness": 1, "time.step": "1 ms"}, out=here / "soft")
    assert failed.status == 3 and str(failed).startswith("dem.observe, at t = ") and "is too low" in str(failed), failed
    assert quern.open(here / "soft").status == "failed"
    taken = raises(quern.QuernError, quern.run, scene, out=here / "one")
    assert taken.status == 4 and "--force" in str(taken), taken
    assert quern.run(scene, out=here / "one", force=True, set={"time.end": 1e-3}).frames[-1].time == 0.001
    assert "there is no such folder" in str(raises(quern.QuernError, quern.open, here / "nowhere"))
    assert "no run lies there" in str(raises(quern.QuernError, quern.open, here))
    assert "not a text" in str(raises(TypeError, quern.run, scene, set="time.end=1"))
    (here / "one/frames/000001.h5").write_bytes(b"no frame")
    broken = raises(quern.QuernError, lambda: quern.open(here / "one").frames[1]["grain.position"])
    assert "000001.h5 cannot be read" in str(broken), broken
    print("ok  quern.run by mapping and list; refused, failed, taken, damaged")


def check_lazy(here):
    """Asking for a frame opens no file, and one field of a thousand frames is soon there."""
    run = quern.open(here / "killed")
    run.frames[0].path.with_name("999999.h5").write_bytes(b"not read")
    assert run.frames[-1].path.name == "999999.h5"
    began = time.perf_counter()
    for frame in run.frames[:3] * 100:
        frame["grain.position"]
    print(f"ok  lazy; {(time.perf_counter() - began) / 300 * 1e3:.2f} ms for a field of a frame")


with lab.workplace() as name:
    place = pathlib.Path(name)
    os.environ["QUERN_CACHE"] = ""
    check_whole(place)
    check_on_the_way(place)
    check_run(place)
    check_lazy(place)
    check_locks(place / "locks")
