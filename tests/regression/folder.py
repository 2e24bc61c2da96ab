# SPDX-License-Identifier: MIT
"""The folder of a run: not replaced without --force, and then no more than what a run has left; never what the run was given;
held by one run at a time, and free again once that is gone, however it went."""
import os
import pathlib
import shutil
import signal
import subprocess

import lab

SCENE = pathlib.Path(lab.scene("two_grains"))
LEFT = {"progress.json", "scene.yaml", "input.yaml", "checkpoint.h5", "summary.json", "series.csv", "log.txt", "run.xdmf", "frames", "views"}


def run(scene, folder, *options, status=0, cwd=None):
    words = [lab.QUERN, "run", "--quiet", str(scene), "-o", str(folder), *map(str, options)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, cwd=cwd)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    assert done.stderr.count("error:") == (status != 0), f"not one sentence:\n{done.stderr}"
    return done.stderr


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refuses(place):
    out = place / "out"
    run(SCENE, out)
    assert {path.name for path in out.iterdir()} == LEFT, sorted(out.iterdir())
    assert (out / "input.yaml").read_bytes() == SCENE.read_bytes()
    before = contents(out)
    said = run(SCENE, out, status=4)
    for word in ("holds a run already", "--resume", "--force", "-o", *LEFT):
        assert word in said, f"'{word}' is not in\n{said}"
    assert contents(out) == before, "a refused run has changed the folder"
    # one sign of a run is enough
    for name in LEFT:
        other = place / f"only_{name}"
        other.mkdir()
        (shutil.copytree if (out / name).is_dir() else shutil.copy)(out / name, other / name)
        assert name in run(SCENE, other, status=4)
    print(f"a folder with any of {len(LEFT)} signs of a run is left as it is")


def forces(place):
    """What is stale goes, what is not the run's stays."""
    out = place / "out"
    kept = ["notes.txt", "frames/notes.txt", "frames/12.h5", "views/mine.pvsm", "views/grains_12.hdf", "files/mine.txt",
            "files/0123456789abcdef-other.txt", "frame_000003.png"]
    stale = ["frames/000077.h5", "frames/000078.h5.part", "views/grains_000077.hdf", "views/points.hdf.series",
             "checkpoint.h5.part", "files/0123456789abcdef-grains.txt.part"]
    for name in kept + stale:
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_text("x")
    run(SCENE, out, "--force", "--set=time.end=5 ms")
    now = contents(out)
    assert all(now[name] == b"x" for name in kept), sorted(now)
    assert not set(stale) & set(now), sorted(set(stale) & set(now))
    assert len(lab.frames(out)) == 6 + 1 and (out / "frames/12.h5").exists()  # and one that is nobody's
    assert len(list((out / "views").glob("grains_0*.hdf"))) == 6
    print("--force removes what a run has left, stale views too, and nothing else")


def own_scene(place):
    """A scene that lies where the run would write."""
    own = place / "own"
    own.mkdir()
    scene = own / "scene.yaml"
    text = "# my own words\n" + SCENE.read_text()
    scene.write_text(text)
    for options in ([], ["--force"], ["--resume"]):
        said = run(scene, own, *options, status=4)
        assert "own/scene.yaml" in said and "name another folder" in said, said
        assert contents(own) == {"scene.yaml": text.encode()}
    run(scene.name, ".", "--force", status=4, cwd=own)
    assert "own/scene.yaml is not what a run has left" in run(SCENE, own, "--force", status=4)
    # its files too: here a run's frame, of all things, is the list of grains
    out, grains = place / "given", place / "given/series.csv"
    run(SCENE, out)
    grains.write_text("x y radius\n0 0 0.005\n")
    said = run(SCENE, out, "--force", "--set=grains.place=null", f"--set=grains.file={grains}", status=4)
    assert "given/series.csv belongs to the scene itself" in said, said
    assert grains.read_text() == "x y radius\n0 0 0.005\n"
    # a scene.yaml that was changed by hand is somebody's again
    run(SCENE, place / "changed")
    with open(place / "changed/scene.yaml", "a") as file:
        file.write("# changed\n")
    run(SCENE, place / "changed", "--force", status=4)
    # a pipe is nobody's scene, and nobody waits for it
    (place / "pipe").mkdir()
    os.mkfifo(place / "pipe/scene.yaml")
    assert "pipe/scene.yaml is not what a run has left" in run(SCENE, place / "pipe", "--force", status=4)
    print("what a run was given is never replaced")


def resumed(place):
    """From the run's own scene, on which it stands."""
    out = place / "resumed"
    run(SCENE, out, "--until", "5 ms")
    run(out / "scene.yaml", out, status=4)
    run(out / "scene.yaml", out, "--force", status=4)
    run(out / "scene.yaml", out, "--resume")
    assert lab.summary(out)["status"] == "done" and len(lab.frames(out)) == 21
    run(out / "scene.yaml", out, "--resume", "--set=time.end=22 ms")
    assert "end: 0.022" in (out / "scene.yaml").read_text()
    assert (out / "input.yaml").read_bytes() == SCENE.read_bytes()
    # what does not fit the checkpoint is refused before anything is touched
    series = (out / "series.csv").read_text()
    (out / "series.csv").write_text(series[:100])
    before = contents(out)
    assert "does not hold the 23 rows" in run(out / "scene.yaml", out, "--resume", status=2)
    assert contents(out) == before
    (out / "series.csv").write_text(series)
    # frames whose checkpoint is gone are not lost by a run that begins anew
    (out / "checkpoint.h5").unlink()
    before = contents(out)
    assert "no checkpoint.h5" in run(SCENE, out, "--resume", status=4)
    assert contents(out) == before
    # one that was stopped before its first checkpoint begins anew, and still has the text that somebody wrote
    begun = place / "begun"
    run(SCENE, begun, "--until", "0")
    (begun / "checkpoint.h5").unlink()
    run(begun / "scene.yaml", begun, "--resume", "--until", "1 ms")
    assert (begun / "input.yaml").read_bytes() == SCENE.read_bytes()
    print("a run goes on from its own scene.yaml")


def fault_found_late(place):
    """What only the set-up finds is found before anything is touched."""
    out = place / "late"
    bad = "--set=grains.place.0.position=[9, 9]"
    run(SCENE, out, bad, status=2)
    assert not out.exists(), "a scene at fault leaves a folder"
    run(SCENE, out)
    before = contents(out)
    run(SCENE, out, bad, "--force", status=2)
    assert contents(out) == before, "a scene at fault has replaced a run"


def one_at_a_time(place):
    out = place / "shared"
    options = [*lab.SMALL["column"], "--set=time.end=80 ms"]
    process = lab.start("column", out, *options)
    assert lab.wait_for(out / "log.txt", process)
    for more in (["--force"], ["--resume"], []):
        said = run(SCENE, out, *more, status=4)
        assert f"in use by another run, process {process.pid}" in said, said
    assert lab.stop(process, signal.SIGKILL) == -signal.SIGKILL
    assert (out / ".quern.lock").exists(), "it was not killed in the middle"
    run(SCENE, out, "--force")  # no stale lock
    assert not (out / ".quern.lock").exists()
    # two at the same moment: one of them runs
    both = [subprocess.Popen([lab.QUERN, "run", "--quiet", str(SCENE), "-o", str(place / "race")],
                             stderr=subprocess.DEVNULL) for _ in range(4)]
    assert sorted(process.wait(timeout=60) for process in both) == [0, 4, 4, 4]
    assert len(lab.frames(place / "race")) == 21 and lab.summary(place / "race")["status"] == "done"
    print("a folder is held by one run at a time, and by none that is gone")


def log(place):
    """What cannot be written to the log is an error like any other; the command that was given stands in it."""
    out = place / "log"
    run(SCENE, out, "--until", "5 ms", "--set", "name=two words")
    assert "quern run --quiet" in (out / "log.txt").read_text() and "'name=two words'" in (out / "log.txt").read_text()
    (out / "log.txt").unlink()
    (out / "log.txt").symlink_to("/dev/full")
    said = run(SCENE, out, "--resume", "--set", "name=two words", status=4)
    assert "log.txt cannot be written: No space left on device" in said, said


def where_it_is_called(place):
    """A run reads nothing there but what its scene names: not the file by whose name another is built in memory, either."""
    here = place / "here"
    here.mkdir()
    with open(here / "memory", "wb") as file:
        file.truncate(2 << 30)  # who reads all of it, once for each frame, takes more than the minute that a run has
    run(SCENE, "out", "--until", "5 ms", cwd=here)
    assert sorted(path.name for path in here.iterdir()) == ["memory", "out"]


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (refuses, forces, own_scene, resumed, fault_found_late, one_at_a_time, log, where_it_is_called):
            test(pathlib.Path(name))
