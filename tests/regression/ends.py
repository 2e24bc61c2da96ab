# SPDX-License-Identifier: MIT
"""Ends that change on resume, and --until: frames are due at whole multiples of output.every and at time.end, none is missing
and none comes twice, and where nothing is asked for otherwise the bits are those of a run in one go."""
import contextlib
import math
import os
import pathlib
import pty
import re
import subprocess

import lab

MS = 1e-3


def run(folder, *options, status=0, resume=False):
    """What the run says."""
    words = [lab.QUERN, "run", lab.scene("two_grains"), "-o", str(folder), "--threads", "1", *options]
    done = subprocess.run(words + ["--resume"] * resume, capture_output=True, text=True, timeout=60)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stderr


def times(folder):
    """Of the frames, after a look at whether they, the series and the summary agree."""
    header, rows = lab.series(folder)
    contents = [lab.contents(frame) for frame in lab.frames(folder)]
    found = [float(frame["@time"]) for frame in contents]
    assert found == [row[header.index("time [s]")] for row in rows], "frames and series.csv differ"
    assert [int(frame["@step"]) for frame in contents] == [row[header.index("step [1]")] for row in rows]
    assert found == sorted(set(found)), f"frames at {found}"
    return found


def expect(folder, *wanted):
    found = [time / MS for time in times(folder)]
    assert len(found) == len(wanted) and all(math.isclose(a, b, abs_tol=1e-12) for a, b in zip(found, wanted)), \
        f"frames at {found} ms, not at {wanted}"


def bytes_of(folder):
    return {path: path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def sets(end, every=None):
    return lab.sets(time__end=f"{end}e-3", **({"output__every": f"{every}e-3"} if every else {}))


def later(place):
    """10 ms in steps of 3, and then to 20: as many steps as in one go, or one more, since 10 ms is where a step ends."""
    out, once = place / "later", place / "once"
    run(out, *sets(10, 3))
    expect(out, 0, 3, 6, 9, 10)
    run(out, *sets(20, 3), resume=True)
    expect(out, 0, 3, 6, 9, 10, 12, 15, 18, 20)
    run(once, *sets(20, 3))
    one, two = lab.summary(out), lab.summary(once)
    assert one["status"] == two["status"] == "done", (one["status"], two["status"])
    assert 0 <= one["steps"] - two["steps"] <= 1, (one["steps"], two["steps"])
    assert math.isclose(one["time_end"], 0.02, rel_tol=1e-12), one["time_end"]
    print(f"a later end: 10 ms and 10 more, {one['steps']} steps, {two['steps']} in one go")


def later_on_the_way(place):
    """A later end while an interval runs that leads to the same frame: nothing is different."""
    out = place / "way"
    run(out, *sets(10, 3), "--until", "4 ms")
    run(out, *sets(20, 3), resume=True)
    lab.same(place / "once", out, "a later end, asked for within an interval")


def earlier(place):
    out = place / "earlier"
    run(out, *sets(20, 3), "--until", "4 ms")
    before = bytes_of(out)
    now = lab.summary(out)["time_end"]
    assert 0.004 <= now < 0.00405, now  # a step is 0.049 ms
    said = run(out, *sets(3.5, 3), resume=True, status=2)
    assert "time.end is 0.0035 s" in said and f"come to {now:.9g} s" in said, said
    assert bytes_of(out) == before, "a refused run has changed its folder"
    run(out, *sets(5, 3), resume=True)  # within the running interval
    expect(out, 0, 3, 5)
    assert lab.summary(out)["time_end"] == 0.005 and lab.summary(out)["status"] == "done"
    print("an earlier end: refused where it is over, kept to the bit where it is not")


def other_every(place):
    out = place / "every"
    run(out, *sets(10, 3), "--until", "4 ms")
    said = run(out, *sets(10, 2), resume=True)
    assert "output.every was '0.003' and is '0.002'" in said, said
    expect(out, 0, 3, 6, 8, 10)
    assert not [view for view in (out / "views").glob("*_0000*.hdf") if int(view.stem[-6:]) > 4]


def default_every(place):
    """Where the scene leaves output.every open it is end/50 of the first end, also later on."""
    out, scene = place / "default", place / "default.yaml"
    text = pathlib.Path(lab.scene("two_grains")).read_text()
    scene.write_text("\n".join(line for line in text.splitlines() if not line.startswith("output")))
    words = [lab.QUERN, "run", "--quiet", str(scene), "-o", str(out)]
    subprocess.run([*words, "--until", "5 ms"], check=True)
    subprocess.run([*words, "--resume", "--set=time.end=24 ms"], check=True)
    expect(out, *[0.4 * k for k in range(61)])
    print("a later end of a scene without output.every: frames as before")


def until(place):
    """Stops at the first step that is there, and says how to go on; what is over already is left alone."""
    out, base = place / "until", place / "base"
    run(base, *sets(10, 3))
    said = run(out, *sets(10, 3), "--until", "4.2 ms")
    s = lab.summary(out)
    assert s["status"] == "stopped" and 0 <= s["time_end"] - 0.0042 < s["time_step"], s["time_end"]
    assert "stopped: t = 0.0042" in said and "--resume" in said.splitlines()[-1], said
    expect(out, 0, 3)
    before = bytes_of(out)
    said = run(out, *sets(10, 3), "--until", "2 ms", resume=True)
    assert f"t = {s['time_end']:.9g} s already" in said, said
    assert bytes_of(out) == before, "a run that had nothing to do has changed its folder"
    run(out, *sets(10, 3), "--until", "9 ms", resume=True)
    assert lab.summary(out)["time_end"] == 0.009000000000000001
    run(out, *sets(10, 3), "--until", "9.5 ms", resume=True)
    run(out, *sets(10, 3), resume=True)
    lab.same(base, out, "stopped by --until and gone on")
    assert lab.summary(out)["step_limited_by"] == lab.summary(base)["step_limited_by"] != ""
    # the command that it recommends
    run(out.with_name("said"), *sets(10, 3), "--until", "4 ms")
    line = (out.with_name("said") / "log.txt").read_text().splitlines()[-1]
    subprocess.run([lab.QUERN, *line.split("quern ")[1].split(), "--quiet"], check=True)
    lab.same(base, out.with_name("said"), "gone on as the log says")


def left(place):
    """On a terminal, how long it will take from here: settling is over by then, also after a checkpoint and a resume."""
    try:
        master, slave = pty.openpty()
    except OSError:
        print("no terminal can be had here: what is left of a run was not looked at")
        return
    words = [word for word in lab.command("column", place / "left", *lab.SMALL["column"], "--set=time.end=300 ms", "--threads=1",
                                          "--set=grains.settle.step=0.002") if word != "--quiet"]
    process, said = subprocess.Popen(words, stderr=slave), b""
    os.close(slave)
    with contextlib.suppress(OSError):  # that is how a terminal says that nobody is there any more
        while part := os.read(master, 4096):
            said += part
    assert process.wait() == 0
    seconds = [float(number) for number in re.findall(rb"step \d+, (-?\d+) s left", said)]
    assert seconds and min(seconds) >= 0, seconds
    print(f"{lab.summary(place / 'left')['settle_seconds']:.1f} s of settling, then {seconds} s left")


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (later, later_on_the_way, earlier, other_every, default_every, until, left):
            test(pathlib.Path(name))
