# SPDX-License-Identifier: MIT
"""Ten thousand frames cost five times as much as two thousand, in time and in bytes written, and the lists of them that
ParaView reads are well formed."""
import json
import pathlib
import resource
import shutil
import xml.etree.ElementTree

import lab


def written():
    """Bytes that this process and those that it has waited for have written so far."""
    text = pathlib.Path("/proc/self/io").read_text()
    return int(text.split("wchar:")[1].split()[0])


def seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(folder, frames, resume=False):
    """One frame every two steps; returns what it took."""
    before = written(), seconds()
    lab.run("two_grains", folder, f"--set=time.end={frames} us", "--set=output.every=1 us", "--set=time.step=0.5 us",
            resume=resume)
    return written() - before[0], seconds() - before[1]


def well_formed(folder, frames):
    xdmf = xml.etree.ElementTree.parse(folder / "run.xdmf").getroot()
    times = [float(time.get("Value")) for time in xdmf.iter("Time")]
    assert len(times) == frames + 1 and times == sorted(times), f"run.xdmf names {len(times)} frames"
    series = json.loads((folder / "views/grains.hdf.series").read_text())
    assert [entry["name"] for entry in series["files"]] == [f"grains_{k:06d}.hdf" for k in range(frames + 1)]
    assert [entry["time"] for entry in series["files"]] == times
    assert len(list((folder / "frames").glob("*.h5"))) == frames + 1


def check(place):
    few, many = place / "few", place / "many"
    one = run(few, 2000)
    shutil.rmtree(few)
    all = run(many, 10000)
    well_formed(many, 10000)
    print(f"2000 and 10000 frames: {one[0] / 1e6:.1f} and {all[0] / 1e6:.1f} MB, {one[1]:.1f} and {all[1]:.1f} s")
    assert all[0] < 1.1 * 5 * one[0], f"{all[0] / one[0]:.2f} times the bytes for 5 times the frames"
    assert all[1] < 1.6 * 5 * one[1], f"{all[1] / one[1]:.2f} times the time for 5 times the frames"


def any_number_of_fields(place):
    """More sets and fields than anybody has thought of."""
    out = place / "fields"
    lab.run("column", out, *lab.SMALL["column"], "--set=time.end=5 ms", "--set=grains.settle.energy=0.02",
            "--set=observe=[energy, ledger, momentum]")
    named = {item.text.split(":")[1] for item in xml.etree.ElementTree.parse(out / "run.xdmf").iter("DataItem")
             if item.text.startswith("frames/")}
    there = {f"/{name}" for name in lab.contents(lab.frames(out)[-1]) if "@" not in name}
    sets = {name.split("/")[1] for name in there if name.endswith("/position")}
    assert named == {name for name in there if name.split("/")[1] in sets}, there ^ named


def gone_on(place):
    """Killed or stopped, a run takes the lists up where its checkpoint stands."""
    base, out = place / "base", place / "gone_on"
    options = ["--set=output.every=0.1 ms"]
    lab.run("two_grains", base, *options)
    lab.run("two_grains", out, *options, "--until=5 ms")
    with open(out / "run.xdmf", "r+") as file:  # as if killed while it wrote
        file.truncate((out / "run.xdmf").stat().st_size - 40)
    lab.run("two_grains", out, *options, resume=True)
    for name in ("run.xdmf", "views/grains.hdf.series"):
        assert (out / name).read_bytes() == (base / name).read_bytes(), name
    well_formed(out, 200)


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (gone_on, any_number_of_fields, check):
            test(pathlib.Path(name))
