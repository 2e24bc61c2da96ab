# SPDX-License-Identifier: MIT
"""A full disk: exit status 4 and a sentence, what was written before is whole, and the run goes on when there is space.

`disk.py`: with a limit on the size of a file. `disk.py full`: on a small file system of its own, where one may be mounted
(as root on Linux); elsewhere it is skipped, with exit status 77.
"""
import os
import pathlib
import resource
import signal
import subprocess
import sys

import lab

OPTIONS = [*lab.SMALL["column"], "--set=time.end=20 ms", "--set=output.every=2 ms", "--set=grains.settle.energy=0.02"]
SIZE = 8 << 20
SKIPPED = 77


def look(folder):
    """Frames and checkpoint are whole; returns how many frames there are."""
    for frame in lab.frames(folder):
        lab.whole(frame)
    lab.whole(folder / "checkpoint.h5")
    assert not list(folder.rglob("*.part")), "a file half written is left behind"
    return len(lab.frames(folder))


def refused(folder, reason, every=0.02, **options):
    """The run, with a checkpoint every so many seconds on the clock, ends with exit status 4 and names a file; returns
    that file."""
    words = lab.command("column", folder, *OPTIONS, f"--set=checkpoint.every={every}", "--resume")
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, **options)
    assert done.returncode == 4, f"exit status {done.returncode}, not 4\n{done.stderr}"
    lines = [line for line in done.stderr.splitlines() if "error:" in line]
    assert len(lines) == 1, f"{len(lines)} sentences, not one:\n{done.stderr}"
    assert str(folder) in lines[0] and reason in lines[0], lines[0]
    return lines[0].split(str(folder) + "/")[1].split(" ")[0]


def begin(folder):
    """A run that was stopped after some frames."""
    def wait(process, _):
        lab.wait_for(folder / "frames/000002.h5", process)

    lab.on_the_way("column", folder, OPTIONS, signal.SIGINT, wait)
    return look(folder)


def fill(place, left):
    """Takes all of the file system but for about `left` bytes."""
    with open(place / "ballast", "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            pass
        file.truncate(max(0, file.tell() - left))


def on_full_disk(place, base, mount):
    """How much is left decides which file does not fit any more."""
    counts, files = {}, {}
    for left in (0, 4 << 10, 12 << 10, 32 << 10, 64 << 10, 128 << 10, 256 << 10, 512 << 10, 1 << 20):
        out = mount / "run"
        before = begin(out)
        fill(mount, left)
        file = refused(out, "No space left on device")
        counts[left], files[left] = look(out), file
        assert counts[left] >= before, "frames are lost"
        (mount / "ballast").unlink()
        lab.run("column", out, *OPTIONS, resume=True)
        look(out)
        lab.same(base, out, f"{left >> 10} KiB left, full at {file} after {counts[left]} frames, then space again")
        subprocess.run(["rm", "-r", str(out)], check=True)
    kinds = {pathlib.PurePath(file).parts[0] for file in files.values()}
    assert len(kinds) >= 2, f"full at {kinds} alone"
    print(f"full disks of {SIZE >> 20} MiB: nine, full at {', '.join(sorted(set(files.values())))}")


def mounted(place):
    """A file system of SIZE bytes at `place`, or False where that is not allowed."""
    place.mkdir()
    done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(place)], capture_output=True)
    return done.returncode == 0


def with_limit(place, base):
    """A limit on the size of a file, below that of the checkpoint, of a frame, of a page."""
    sizes = {"checkpoint.h5": (base / "checkpoint.h5").stat().st_size,
             "frames": max(frame.stat().st_size for frame in lab.frames(base))}
    # a thread sanitizer writes a file of its own where TMPDIR says, before all else; without a place it does not
    nowhere = {**os.environ, "TMPDIR": "/nowhere"}
    for name, limit in (("checkpoint.h5", (sizes["checkpoint.h5"] + sizes["frames"]) // 2),
                        ("frames", sizes["frames"] * 3 // 4), ("scene.yaml", 1024)):
        out = place / "limit"
        begin(out)
        file = refused(out, "File too large", 0.02 if name == "checkpoint.h5" else 0,
                       env=nowhere, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        assert file.startswith(name), f"with {limit} bytes {file} is refused, not {name}"
        look(out)
        lab.run("column", out, *OPTIONS, resume=True)
        lab.same(base, out, f"files of {limit} bytes at the most, refused {file}, then no limit")
        subprocess.run(["rm", "-r", str(out)], check=True)


def check(place, full):
    base, mount = place / "base", place / "disk"
    if full and not mounted(mount):
        print("no file system can be mounted here: skipped")
        return SKIPPED
    try:
        lab.run("column", base, *OPTIONS)
        if full:
            on_full_disk(place, base, mount)
        else:
            with_limit(place, base)
    finally:
        if full:
            subprocess.run(["umount", str(mount)], check=True)
    return 0


if __name__ == "__main__":
    with lab.workplace() as name:
        status = check(pathlib.Path(name), "full" in sys.argv[1:])
    sys.exit(status)
