# SPDX-License-Identifier: MIT
"""quern film: one view and one range for all frames, films that players read, with ffmpeg and without; nothing half is left."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

from png import QUERN, place, read_png, run, write_frame

try:
    from PIL import Image
except ImportError:
    Image = None

N = 12


def a_run(folder):
    """A heap that slides to the right, one grain that stays where it is at 1 m/s, one that flies off; 12 frames."""
    r = np.random.default_rng(1)
    heap = r.uniform(0, 0.02, (400, 3)) * [1, 1, 0]
    for k in range(N):
        x, speed = heap + [0.002 * k, 0, 0], r.uniform(0.1, 0.2, (400, 1)) * [k + 1, 0, 0]
        x[0], speed[0] = (0.06, 0.01, 0), (1, 0, 0)
        x[1], speed[1] = (0.06 + 0.3 * k, 0.02, 0), (300, 0, 0)
        write_frame(folder, 2, "a slide", {"grains": {"position": ("m", x), "radius": ("m", np.full(400, 5e-4)),
                                                      "velocity": ("m/s", speed)}}, number=k)


def film(*words, status=0, **environment):
    done = subprocess.run([str(w) for w in (QUERN, "film", *words)], capture_output=True, text=True, timeout=200,
                          env={**os.environ, **environment})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stderr if status else done.stdout


def pictures(folder):
    """Of every frame: the resting grain at the same pixel in the same colour, in a view that the flying one does not widen."""
    film(folder, "-o", folder / "all.png", "--width", 600, "--keep", folder / "kept", PATH=str(folder))
    kept = sorted((folder / "kept").iterdir())
    assert [path.name for path in kept] == [f"{k:06d}.png" for k in range(N)], kept
    views = [json.loads(run("render", folder, "--frame", k, "--measure"))["view"] for k in range(N)]
    view = [*np.min(views, axis=0)[:2], *np.max(views, axis=0)[2:]]
    assert view[2] < 0.08, f"the stray widens the view: {view}"
    x, y = place(view, 600, (0.06, 0.01))
    colours = [tuple(read_png(path)[y, x]) for path in kept]
    assert len(set(colours)) == 1 and 100 < colours[0][1] < 200, f"the grain at pixel {x}, {y} is {colours}"
    assert len({read_png(path).shape for path in kept}) == 1
    film(folder, "-o", folder / "again.png", "--width", 600, "--keep", folder / "again", "--frames", "3..9:2", PATH=str(folder))
    print(f"{N} pictures, the same grain at pixel {x}, {y}, colour {colours[0]}")
    if Image:
        with Image.open(folder / "all.png") as moving:
            assert moving.n_frames == N and moving.info["duration"] == 40, moving.info
    return kept


def same_bytes(folder, kept):
    film(folder, "-o", folder / "twice.png", "--width", 600, "--keep", folder / "twice", PATH=str(folder))
    assert all(path.read_bytes() == (folder / "twice" / path.name).read_bytes() for path in kept), "pictures differ"
    assert (folder / "twice.png").read_bytes() == (folder / "all.png").read_bytes()
    some = sorted((folder / "again").iterdir())
    assert len(some) == 4, some


def probe(path):
    words = ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v", "-show_entries",
             "stream=width,height,pix_fmt,codec_name,nb_read_frames,r_frame_rate", "-of", "json", str(path)]
    return json.loads(subprocess.run(words, capture_output=True, text=True, check=True).stdout)["streams"][0]


def by_ffmpeg(folder):
    for form, codec in (("mp4", "h264"), ("webm", "vp9")):
        said = film(folder, "-o", folder / f"f.{form}", "--width", 601, "--fps", 10, "--frames", "2..")
        found = probe(folder / f"f.{form}")
        assert "ffmpeg" in said and f"{N - 2} frames" in said, said
        assert (found["codec_name"], found["pix_fmt"], int(found["nb_read_frames"])) == (codec, "yuv420p", N - 2), found
        assert found["width"] == 602 and found["height"] % 2 == 0 and found["r_frame_rate"] == "10/1", found
        print(f"{form}: {codec}, {found['width']} x {found['height']}, {found['nb_read_frames']} frames")


def without_ffmpeg(folder):
    """PIL makes what it can, and says so."""
    bare = {"PATH": str(folder)}
    assert "needs ffmpeg, which is not there (Debian: ffmpeg)" in film(folder, "-o", folder / "no.mp4", status=1, **bare)
    said = film(folder, "--width", 600, "--frames", "..2", **bare)
    assert said.startswith(f"{folder}/film.png: 3 frames") and "since ffmpeg is not there" in said, said
    said = film(folder, "-o", folder / "small.gif", "--width", 600, "--fps", 5, "--vectors", "velocity", **bare)
    with Image.open(folder / "small.gif") as moving:
        assert moving.n_frames == N and moving.info["duration"] == 200 and moving.size[0] == 600, (moving.n_frames, moving.info)
    print("without ffmpeg:", said.strip().rsplit(", ", 1)[1])


def interrupted(folder):
    """By a signal, at any moment from when its folder is there: status 130, no film, no folder beside it."""
    for number, after in ((signal.SIGINT, 0.0), (signal.SIGTERM, 0.5), (signal.SIGHUP, 0.2)):
        before = sorted(folder.iterdir())
        at_work = subprocess.Popen([str(QUERN), "film", str(folder), "-o", str(folder / "half.gif"), "--width", "8000"],
                                   stderr=subprocess.PIPE, text=True, start_new_session=True,
                                   preexec_fn=lambda sent=number: signal.signal(sent, signal.SIG_DFL))  # who runs the tests may ignore it, as nohup does
        end = time.monotonic() + 60
        while sorted(folder.iterdir()) == before and at_work.poll() is None and time.monotonic() < end:
            time.sleep(0.01)
        time.sleep(after)
        assert at_work.poll() is None, "it was over before"
        at_work.send_signal(number)
        said = at_work.communicate(timeout=60)[1]
        assert at_work.returncode == 130 and "nothing is left" in said and "Traceback" not in said, (at_work.returncode, said)
        assert sorted(folder.iterdir()) == before, set(folder.iterdir()) - set(before)
    print("interrupted three times, nothing left")


def refusals(folder):
    empty, made = folder / "empty", folder / "x.png"
    empty.mkdir()
    for words, status, part in (([empty], 2, "holds no frames"), ([folder, "-o", folder / "x.avi"], 1, "films are .mp4"),
                                ([folder, "--frames", "4"], 1, "give A..B"), ([folder, "--frames", "50..60"], 1, "are 0 to 11"),
                                ([folder, "--fps", "0"], 1, "above 0"), ([folder, "--width", "10"], 1, "between 600 and 8000"),
                                ([folder, "-o", folder / "no/x.png"], 4, "there is no folder"),
                                ([folder, "-o", made, "--field", "nothing"], 1, "no field 'nothing'"),
                                ([folder, "-o", made, "--chains"], 2, "contact.force"),
                                ([folder, "-o", made, "--range", "2,1"], 1, "lower end first"), ([], 1, "required")):
        said = film(*words, status=status)
        assert part in said, f"film {words}: {said}"
        assert not made.exists()
    print("every fault is refused in one sentence")


with tempfile.TemporaryDirectory() as name:
    at = pathlib.Path(name)
    a_run(at)
    if Image is None and not shutil.which("ffmpeg"):
        print("neither ffmpeg nor python3-pil is there")
        sys.exit(77)
    refusals(at)
    if shutil.which("ffmpeg") and shutil.which("ffprobe"):
        by_ffmpeg(at)
    if Image:
        same_bytes(at, pictures(at))
        without_ffmpeg(at)
        interrupted(at)
