# SPDX-License-Identifier: MIT
"""Malformed scenes: every one is refused with exit status 2 and the very message that lies beside it.

malformed/NAME.yaml goes with malformed/NAME.err, what the program prints (but for lists of installed plugins). `--update` rewrites the .err files; read
them before they are kept: a message names the place, what was found and what is allowed.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

QUERN = os.environ["QUERN"]
SCENES = pathlib.Path(os.environ["QUERN_SOURCE"]) / "tests/regression/malformed"
WITHOUT_A_PLACE = {"empty", "comment_only"}  # faults of the file as a whole
SEVERAL = {"three_errors": 3}


def refuse(name):
    done = subprocess.run([QUERN, "plan", name + ".yaml"], cwd=SCENES, capture_output=True, timeout=60)
    assert done.returncode == 2, f"{name}: exit status {done.returncode}, not 2\n{done.stderr.decode(errors='replace')}"
    assert not done.stdout, f"{name}: it printed a plan"
    return re.sub(rb"(installed|is wanted): [a-z0-9_, ]+", rb"\1: ...", done.stderr)  # whatever plugins there are


def check_form(name, text):
    place = re.compile(rb"^%b\.yaml:(\d+):(\d+): error: \S" % re.escape(name.encode()), re.M)
    found = place.findall(text)
    if name not in WITHOUT_A_PLACE:
        assert found, f"{name}: no line and column in\n{text.decode(errors='replace')}"
    if name in SEVERAL:
        assert len(found) == SEVERAL[name], f"{name}: {len(found)} faults are reported, not {SEVERAL[name]}"
    lines = (SCENES / (name + ".yaml")).read_bytes().split(b"\n")
    for line, _ in found:
        assert int(line) <= len(lines), f"{name}: line {line} is beyond the file"


def check_scenes(update):
    names = sorted(path.stem for path in SCENES.glob("*.yaml"))
    assert len(names) >= 60, f"only {len(names)} malformed scenes"
    wrong = []
    for name in names:
        text = refuse(name)
        check_form(name, text)
        path = SCENES / (name + ".err")
        if update:
            path.write_bytes(text)
        elif not path.exists() or path.read_bytes() != text:
            wrong.append(f"{name}.yaml prints\n{text.decode(errors='replace')}")
    extra = {path.stem for path in SCENES.glob("*.err")} - set(names)
    assert not extra, f"messages without a scene: {sorted(extra)}"
    assert not wrong, "\n".join(wrong) + f"\n{len(wrong)} messages differ; scenes.py --update rewrites them"
    print(f"{len(names)} malformed scenes are refused with their messages")


def refused(arguments, *expected, status=2):
    done = subprocess.run([QUERN, *arguments], cwd=SCENES.parents[2], capture_output=True, text=True, timeout=60)
    assert done.returncode == status, f"{arguments}: exit status {done.returncode}\n{done.stderr}"
    for text in expected:
        assert text in done.stderr, f"{arguments}: '{text}' is not in\n{done.stderr}"
    return done.stderr


def check_options():
    scene = "configs/two_grains.yaml"
    refused(["plan", "nowhere.yaml"], "nowhere.yaml: error: cannot be opened: No such file or directory")
    refused(["plan", "configs"], "configs: error: cannot be read: Is a directory")
    refused(["plan", scene, "--set", "time.end=5 kg"], "--set time.end=5 kg: error: scene: time.end: 'kg'")
    refused(["plan", scene, "--set", "time.edn=5 s"], "unknown key 'edn'; did you mean 'end'?")
    refused(["plan", scene, "--set", "time.end"], "is not of the form path.to.key=value")
    refused(["plan", scene, "--set", "=3"], "is not of the form path.to.key=value")
    refused(["plan", scene, "--set", "time.end.late=3"], "'late' cannot be reached: above it stands '20 ms'")
    refused(["plan", scene, "--set", "grains.place.7.radius=1 mm"], "name its items by number, from 0")
    refused(["plan", scene, "--set", "time={end: [}"], "--set time={end: [}: error: not valid YAML")
    for number in ("00", "+0", " 0", "0 ", "-0"):
        refused(["plan", scene, "--set", f"grains.place.{number}.radius=1 mm"], "name its items by number, from 0")
    refused(["plan", scene, "--set", " time.end=3"], "unknown key ' time'")
    refused(["plan", scene, "--set", "time.end =3"], "unknown key 'end '")
    refused(["plan", scene, "--set", "time.end=1e-400"], "'1e-400' is too small")
    refused(["plan", scene, "--set", "time.end='1'"], "in quotes is a text, not a number")
    refused(["plan", scene, "--set", "time.force='true'"], "must be true or false")
    # the hybrid lacks what grains with a fault do not publish, which is no fault of its own
    one = ["--set", "grains.contact.linear.stiffness=5 kg"]
    assert refused(["plan", "configs/column.yaml", *one], "stiffness: 'kg'").count("error:") == 1
    refused(["run", "configs/column.yaml", *one], "quern: 1 fault in")
    refused(["plan"], "a scene is missing", status=1)
    refused(["plan", scene, "--sett", "a=1"], "unknown option '--sett'", status=1)
    print("missing files and faulty options are refused by name")


def check_warnings():
    """What is taken with a warning: plan says it too."""
    def warns(command, scene, *sets):
        words = [QUERN, *command, f"configs/{scene}.yaml", *(word for one in sets for word in ("--set", one))]
        done = subprocess.run(words, cwd=SCENES.parents[2], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        return done.stderr

    said = warns(["plan"], "elastic_bar", "bodies=[{box: {lower: [-1, -1], upper: [1, 1]}}]")
    assert re.search(r"warning: \d+ of \d+ points of continuum.fill lie in body 0, a body.box, and are left out", said), said
    # a bed of fifty diameters whose grains bear their weight with a tenth of a millimetre, a twentieth of a diameter
    bed = ["bodies=[{plane: {point: [0, 0], normal: [0, 1]}}]", "gravity=[0, -10]", "domain.upper=[0.05, 0.15]",
           "grains.place=[]", "grains.material.radius.mean=1 mm", "grains.fill={region: {box: {lower: [0, 0], upper: [0.02, 0.1]}}}"]
    said = warns(["plan"], "two_grains", *bed, "grains.contact.linear.stiffness=4e4")
    assert re.search(r"warning: under 0.1 m of fill grains overlap by about 5(\.\d+)? % of a diameter", said), said
    assert re.search(r"contact.linear. have 4e\+04 N/m there; take 4.1e\+05 N/m", said), said
    assert "warning" not in warns(["plan"], "two_grains", *bed, "grains.contact.linear.stiffness=4e5")
    # 5e13 steps of two grains
    with tempfile.TemporaryDirectory() as folder:
        for command in (["plan"], ["run", "--quiet", "--until", "0", "-o", folder]):
            said = warns(command, "two_grains", "time.end=1e9", "output.every=1e9")
            assert re.search(r"warning: this will take long on \d+ cores?: .* and about \d+(\.\d)? days of running", said), said
    print("plan and run warn of points in bodies, of contacts too soft, and of runs too long")


def check_pipes():
    """A pipe is no scene, and nothing waits for somebody to write into it."""
    with tempfile.TemporaryDirectory() as folder:
        pipe = os.path.join(folder, "scene.yaml")
        os.mkfifo(pipe)
        refused(["plan", pipe], "scene.yaml: error: cannot be read: it is no regular file")
        refused(["plan", "/dev/zero"], "cannot be read: it is no regular file")
        scene = "tests/regression/malformed/file_missing.yaml"
        refused(["plan", scene, "--set", f"grains.file={pipe}"], "is no regular file; a file is wanted")
    print("pipes and devices are refused")


def check_booleans():
    """Switches take the same words wherever they stand."""
    plans = set()
    for yes, no in (("true", "false"), ("yes", "no"), ("On", "OFF"), ("True", "False")):
        done = subprocess.run([QUERN, "plan", "configs/column.yaml", "--json", "--set", f"domain.periodic=[{no}, {no}]",
                               "--set", f"output.compress={yes}", "--set", f"grains.fill.1.settle={no}"],
                              cwd=SCENES.parents[2], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stderr
        plans.add(done.stdout)
    assert len(plans) == 1
    print("true, yes and on are one word")


if __name__ == "__main__":
    check_scenes("--update" in sys.argv[1:])
    check_options()
    check_warnings()
    check_pipes()
    check_booleans()
