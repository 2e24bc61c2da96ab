# SPDX-License-Identifier: MIT
"""Signals: the first one stops the run after its step, with a checkpoint; the second one ends it at once; what the run was started
to ignore, and a reader that has gone away, stop nothing."""
import os
import pathlib
import signal
import subprocess
import time

import lab
import workshop

OPTIONS = [*lab.SMALL["column"], "--set=time.end=60 ms", "--set=grains.settle.energy=0.02"]
HANGS = [('.id = "contact.linear"', '.id = "contact.mine"'),
         ("static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }",
          "#include <stdio.h>\n#include <stdlib.h>\n"
          "static void force_2d(const void *self, const quern_contact_batch *b)\n"
          "{ force(2, self, b); fclose(fopen(getenv(\"HANGS\"), \"w\")); for (volatile int i = 0; ; i = !i) {} }")]


def start(folder, *options, **how):
    words = [word for word in lab.command("column", folder, *OPTIONS, *options) if word != "--quiet"]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, text=True, **how)


def heard():
    """Whoever started the tests may have had signals ignored, as nohup does."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def stops(place):
    base = place / "base"
    lab.run("column", base, *OPTIONS)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        out = place / number.name
        process = start(out, stderr=subprocess.PIPE, preexec_fn=heard)
        assert lab.wait_for(out / "frames/000001.h5", process)
        process.send_signal(number)
        said = process.communicate(timeout=60)[1]
        assert process.returncode == 130, f"{number.name}: exit status {process.returncode}"
        assert "interrupted: t = " in said and "--resume" in said, said
        assert lab.summary(out)["status"] == "interrupted"
        lab.run("column", out, *OPTIONS, resume=True)
        lab.same(base, out, number.name)


def twice(place):
    """A plugin that never comes back: who asks again gets an end."""
    plugins, out = place / "plugins", place / "twice"
    plugins.mkdir()
    workshop.compile(workshop.source("dem/contact.linear.c", *HANGS), "contact.mine", plugins)
    words = [lab.QUERN, "run", "--threads", "1", lab.scene("two_grains"), "-o", str(out),
             "--set=grains.contact={mine: {stiffness: 1e6}}", "--set=grains.place.0.position=[-5.001 mm, 0]",
             "--set=grains.place.1.position=[5.001 mm, 0]"]
    process = subprocess.Popen(words, stderr=subprocess.DEVNULL, preexec_fn=heard,
                               env={**os.environ, "QUERN_PLUGIN_PATH": str(plugins), "HANGS": str(place / "hangs")})
    try:
        assert lab.wait_for(place / "hangs", process)
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        assert process.poll() is None, "a plugin that does not come back was left after one signal"
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=10) == -signal.SIGTERM
    finally:
        process.kill()


def ignored(place):
    out = place / "nohup"
    process = start(out, stderr=subprocess.DEVNULL, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    assert lab.wait_for(out / "frames/000001.h5", process)
    process.send_signal(signal.SIGHUP)
    assert process.wait(timeout=60) == 0 and lab.summary(out)["status"] == "done"


def nobody_reads(place):
    out = place / "pipe"
    process = start(out, stderr=subprocess.PIPE)
    assert lab.wait_for(out / "log.txt", process)
    process.stderr.close()
    assert process.wait(timeout=60) == 0, f"exit status {process.returncode}"
    assert lab.summary(out)["status"] == "done"
    print("the second signal ends a run at once; an ignored one and a closed pipe do not stop it")


if __name__ == "__main__":
    with lab.workplace() as name:
        for test in (stops, twice, ignored, nobody_reads):
            test(pathlib.Path(name))
