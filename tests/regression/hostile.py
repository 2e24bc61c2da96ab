# SPDX-License-Identifier: MIT
"""Plugins that misbehave while a scene is read or runs: one sentence with plugin and function, status 3 or 2, and what was
written before stays."""
import json
import os
import pathlib
import signal
import subprocess
import tempfile
import time

import lab
from workshop import QUERN, SANITIZED, SOURCE, compile, source

SCENE = str(SOURCE / "configs/two_grains.yaml")
LINEAR = "dem/contact.linear.c"
HEAD = ("#include <quern/contact.h>", "#include <quern/contact.h>\n#include <stdlib.h>\n#include <unistd.h>")
INIT = "(void)setup, (void)err;"
FORCE = "static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }"


def in_init(statement):
    return source(LINEAR, HEAD, (INIT, f"{INIT} {statement}"))


BED = """
quern: 1
dimension: 2
gravity: [0, -9.81]
domain: {lower: [0, 0], upper: [0.05, 0.03]}
time: {end: 5 ms}
output: {every: 0.5 ms}
checkpoint: {every: 1 ms}
bodies:
  - plane: {point: [0, 0], normal: [0, 1]}
grains:
  material: {density: 2500, radius: {mean: 1 mm}}
  contact: {linear: {stiffness: 1e5}}
  fill: {region: {box: {lower: [0.001, 0.001], upper: [0.049, 0.025]}}, packer: two_point_tangent}
"""


def in_force(statement):
    """After some calls, so that some frames have been written."""
    late = f"{{ static int calls; if (++calls == 400) {{ {statement} }} force(2, self, b); }}"
    return source(LINEAR, HEAD, (FORCE, FORCE.replace("{ force(2, self, b); }", late)))


def quern(folder, *words, status, timeout=120):
    done = subprocess.run([QUERN, *map(str, words)], capture_output=True, text=True, timeout=timeout, cwd=folder,
                          env={**os.environ, "QUERN_PLUGIN_PATH": str(folder)})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stdout}{done.stderr}"
    return done


def sentence(done, *expected):
    lines = [line for line in done.stderr.splitlines() if "error:" in line]
    assert len(lines) == 1, f"{len(lines)} sentences, not one:\n{done.stderr}"
    for part in expected:
        assert part in lines[0], f"'{part}' is not in\n{lines[0]}"


# sanitizers keep crashes and the end of the program to themselves
ENDS = ["exit(0);", "exit(130);", "quick_exit(0);"] + ([] if SANITIZED else ["_exit(0);", "_Exit(0);"])
CRASHES = [] if SANITIZED else [("*(volatile int *)0 = 1;", "SIGSEGV"), ("__builtin_trap();", "SIGILL"),
                                ("abort();", "SIGABRT"), ("raise(SIGFPE);", "SIGFPE"), ("raise(SIGBUS);", "SIGBUS")]
SIGNALS = ("#include <stdlib.h>", "#include <signal.h>\n#include <stdlib.h>")


def check_init(folder):
    """A plugin that ends the program or crashes in init."""
    cases = [(end, "contact.linear ended the program in init") for end in ENDS]
    cases += [(crash, f"contact.linear crashed ({name}) in init") for crash, name in CRASHES]
    for statement, expected in cases:
        path = compile(in_init(statement).replace(*SIGNALS), "contact.linear", folder)
        for words in (["plan", SCENE], ["run", SCENE, "-o", folder / "out", "--quiet"]):
            done = quern(folder, *words, status=3)
            sentence(done, expected)
            assert not done.stdout
    assert SANITIZED or path + "+0x" in done.stderr or "raise" in statement
    print(f"{len(cases)} ends in init are a sentence each, of plan and of run")


def check_force(folder):
    """The same in a kernel that a solver calls, on the only thread and on many."""
    with lab.workplace() as place:
        try_force(folder, pathlib.Path(place))


def try_force(folder, place):
    scene = folder / "bed.yaml"
    scene.write_text(BED)
    cases = [(end, "ended the program in ") for end in (ENDS[0], ENDS[-1])] + [(crash, f"crashed ({name}) in ") for crash, name in CRASHES]
    for k, (statement, expected) in enumerate(cases):
        path = compile(in_force(statement).replace(*SIGNALS), "contact.linear", folder)
        where = ["dem.forces"]
        if not SANITIZED and ("exit" in statement or "volatile" in statement):
            where += ["contact.linear", "force, called by dem.forces, at " + path + "+0x"]
        elif "trap" in statement:  # such code lies apart from its function
            where += ["contact.linear", "a call by dem.forces, at " + path + "+0x"]
        for threads in (1, 4):
            out = place / f"out{threads}{k}"
            done = quern(folder, "run", scene, "-o", out, "--quiet", "--threads", threads, status=3)
            frames = len(list((out / "frames").glob("*.h5")))
            assert frames > 1 and (out / "checkpoint.h5").exists()
            sentence(done, expected, *where, f"{out} keeps {frames} frames and a checkpoint of step ",
                     "from which --resume goes on")
    compile(source(LINEAR), "contact.linear", folder)
    quern(folder, "run", scene, "-o", out, "--quiet", "--resume", "--force", status=0)  # another plugin
    print(f"{len(cases)} ends in a kernel leave frames and a checkpoint, and say so")


def check_observer(folder):
    """In an observer whose outputs repeat: how often they do is asked apart from the call."""
    begin = "\tconst observer *o = self;\n\tconst quern_column *u"
    for statement, expected in [("exit(0);", "observer.profile ended the program in whole")] + [
            (crash, f"observer.profile crashed ({name}) in whole") for crash, name in CRASHES]:
        text = source("observers/observer.profile.c", (begin, statement + begin), ("#include <math.h>", "#include <math.h>\n#include <signal.h>\n#include <stdlib.h>"))
        compile(text, "observer.profile", folder, beside="observers")
        sentence(quern(folder, "run", SCENE, "--set=observe=[{profile: {axis: 0, bins: 3}}]", "-o", folder / "out", "--quiet", "--force", status=3),
                 expected)
    os.remove(folder / "observer.profile.so")
    print("so do ends in an observer whose outputs repeat")


def check_stage(folder):
    """And in a stage of a solver: the template's own, which moves grains."""
    scene = folder / "flight.yaml"
    scene.write_text("quern: 1\ndimension: 2\ngravity: [0, -9.81]\ndomain: {lower: [0, 0], upper: [1, 1]}\n"
                     "time: {end: 1 s}\ngrains: {solver: mine, count: 10, radius: 1 mm}\n")
    for statement, expected in [("exit(0);", "solver.mine ended the program in mine.move")] + [
            (crash, f"solver.mine crashed ({name}) in mine.move") for crash, name in CRASHES]:
        text = source("solver", ("moving m = {", statement + " moving m = {")).replace(
            "#include <stdio.h>", "#include <signal.h>\n#include <stdio.h>\n#include <stdlib.h>")
        compile(text, "solver.mine", folder)
        sentence(quern(folder, "run", scene, "-o", folder / "flight", "--quiet", "--force", status=3), expected, "keeps 1 frame and ")
    os.remove(folder / "solver.mine.so")
    print("so do ends in a stage")


def check_environment(folder):
    """What belongs to the whole program is put back, and the plugin that has changed it is named."""
    for statement, what in [("__builtin_ia32_ldmxcsr(0x3f80);", "the rounding or another mode of arithmetic"),
                            ("__builtin_ia32_ldmxcsr(0x9fc0);", "the rounding or another mode of arithmetic"),
                            ("__builtin_ia32_ldmxcsr(0x1d80);", "the rounding or another mode of arithmetic"),
                            ("unsigned short word = 0x27f; __asm__ volatile(\"fldcw %0\" : : \"m\"(word));",
                             "the rounding or another mode of arithmetic"),
                            ('if (chdir("/")) abort();', "the working folder"),
                            ("close(0);", "what is open for reading and printing")]:
        compile(in_init(statement), "contact.linear", folder)
        for words in (["plan", SCENE], ["run", SCENE, "-o", "out", "--quiet", "--force"]):
            sentence(quern(folder, *words, status=2), "two_grains.yaml:", f"contact.linear: init changes {what}")
    assert not (folder / "out/frames").exists() and not os.path.exists("/out")
    print("arithmetic, folder and streams are watched")


def check_forks(folder):
    """Copies that init makes of the program end there; the program itself goes on."""
    compile(in_init("fork(); fork();"), "contact.linear", folder)
    environment = {**os.environ, "QUERN_PLUGIN_PATH": str(folder)}
    process = subprocess.Popen([QUERN, "plan", "--json", SCENE], stdout=subprocess.PIPE, text=True, env=environment,
                               start_new_session=True)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    json.loads(out)  # once
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            break
        time.sleep(0.01)
    else:
        os.killpg(process.pid, signal.SIGKILL)
        raise AssertionError("copies of the program go on")
    print("copies end where they were made")


if __name__ == "__main__":
    for test in (check_init, check_force, check_observer, check_stage, check_environment, check_forks):
        with tempfile.TemporaryDirectory() as name:
            test(pathlib.Path(name))
