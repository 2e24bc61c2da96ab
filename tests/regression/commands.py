# SPDX-License-Identifier: MIT
"""The command line: every command reads its options alike, says how it is used, and says so when it could not print."""
import json
import os
import pathlib
import stat
import subprocess
import tempfile

QUERN, SOURCE = os.environ["QUERN"], pathlib.Path(os.environ["QUERN_SOURCE"])
SCENE = str(SOURCE / "configs/two_grains.yaml")
HYBRID = str(SOURCE / "configs/column.yaml")
COMMANDS = {"run": [SCENE], "plan": [SCENE], "list": [], "describe": ["contact.linear"], "schema": [],
            "new": ["oracle", "mine"], "check": ["x.so"], "drive": ["elastic", "--path=tension"], "render": ["x"]}


def quern(*words, status=0, **options):
    done = subprocess.run([QUERN, *map(str, words)], capture_output=True, text=True, timeout=60, **options)
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done


def said(*words, status=1):
    """The one sentence of a refusal."""
    done = quern(*words, status=status)
    assert not done.stdout, f"{words} prints {done.stdout}"
    return done.stderr.splitlines()[0]


def check_help():
    for command in COMMANDS:
        for option in ("-h", "--help"):
            done = quern(command, option)
            assert done.stdout.startswith(f"usage: quern {command} ") and not done.stderr, done
        assert "--help" in done.stdout
        assert quern(command, *COMMANDS[command], "--help").stdout == done.stdout
    for option in ("-h", "--help", "help"):
        assert all(f"quern {command} " in quern(option).stdout for command in COMMANDS)
    print("every command says how it is used")


def check_unknown():
    for command, words in COMMANDS.items():
        assert said(command, *words, "--helo") == f"quern {command}: unknown option '--helo'; did you mean '--help'?"
        assert said(command, *words, "-q") == f"quern {command}: unknown option '-q'"
    assert "did you mean '--threads'?" in said("run", SCENE, "--thread5=3")
    assert "unknown option '-x'" in said("plan", SCENE, "--json", "-xy")
    assert "--json takes no value" in said("list", "--json=yes")
    assert "--set needs PATH=VALUE" in said("plan", SCENE, "--set")
    assert "--output needs DIR" in said("run", SCENE, "-o")
    assert said("plna", SCENE) == "quern: unknown command 'plna'; did you mean 'plan'?; see quern --help"
    print("unknown options are refused with the nearest known one")


def check_words():
    for command in ("run", "plan", "describe", "check", "drive", "render"):
        assert said(command, "a", "b") == f"quern {command}: 'b' is one word too many"
        assert "is missing" in said(command)
    for command in ("list", "schema"):
        assert "takes no word" in said(command, "a")
    assert "a kind and a name are missing" in said("new", "oracle")
    for command in ("run", "new", "schema", "drive", "render"):
        assert "needs " in said(command, *COMMANDS[command], "-o", "")
    print("too many words, too few and empty ones are refused")


def check_forms():
    """--name value and --name=value are the same, before and behind the words, and so is what follows --."""
    plans = [quern("plan", *words).stdout for words in (
        [SCENE, "--set", "time.end=30 ms"], [SCENE, "--set=time.end=30 ms"], ["--set=time.end=30 ms", SCENE],
        ["--set", "time.end=30 ms", "--", SCENE])]
    assert len(set(plans)) == 1 and plans[0] != quern("plan", SCENE).stdout
    assert "-o.yaml: error: cannot be opened" in said("plan", "--", "-o.yaml", status=2)
    print("options have one meaning in every form")


def check_substeps():
    """As many substeps as the plan has room for leave the step to the grains; with one more the continuum sets it."""
    def plan(n):
        return json.loads(quern("plan", "--json", HYBRID, "--set", f"hybrid.substeps={n}").stdout)
    most = plan(10)["most_substeps"]
    assert 10 < most < 100 and plan(most)["most_substeps"] == most
    assert plan(most)["step_set_by"].startswith(f"{most} times contact.linear"), plan(most)["step_set_by"]
    assert "stress waves of material.mu_i" in plan(most + 1)["step_set_by"]
    said = {n: quern("plan", HYBRID, "--set", f"hybrid.substeps={n}").stdout for n in (10, most, most + 1)}
    assert f"\n{most} substeps would fit into a step\n" in said[10] and " fit into a step" not in said[most]
    assert f"\nno more than {most} substeps fit into a step, so that these are shorter" in said[most + 1]
    assert not any("most_substeps" in quern("plan", "--json", HYBRID, f"--set=model={m}").stdout for m in ("grains", "continuum"))
    print(f"of a column: {most} substeps fit into a step")


def check_numbers():
    wrong = [" 2", "2 ", "+2", "-2", "-0", "02", "2.0", "2e0", "0x2", "two", "", "0", "257", "99999999999999999999"]
    for text in wrong:
        assert said("run", SCENE, "--threads", text) == \
            f"quern run: --threads must be a whole number between 1 and 256, not '{text}'"
    for text in (" 1", "+1", "-1", "-0", "00", "1.", "9" * 30):
        assert "--frame must be a whole number of at least 0" in said("render", "x", f"--frame={text}")
    for text in ("599", "8001"):
        assert "--width must be a whole number between 600 and 8000" in said("render", "x", "--width", text)
    assert "--seconds must be a whole number between 1 and 86400" in said("check", "x.so", "--seconds", "99999999999")
    print("numbers are digits within their range, and nothing else")


def check_full():
    """What cannot be printed is not done."""
    for words in (["--help"], ["--version"], ["list"], ["list", "--json"], ["describe", "contact.linear"], ["schema"],
                  ["plan", SCENE], ["plan", "--help"]):
        with open("/dev/full", "w") as full:
            done = subprocess.run([QUERN, *words], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        assert done.returncode == 4 and "cannot be written: No space left" in done.stderr, f"{words}: {done}"
    assert "/dev/full cannot be written: No space left" in said("schema", "-o", "/dev/full", status=4)
    assert stat.S_ISCHR(os.stat("/dev/full").st_mode), "a device was replaced by a file"
    print("a full disk behind the output is exit status 4")


def check_files(folder):
    quern("run", SCENE, "-o", folder / "deep/down/run", "--quiet")
    for name in ("x.jpg", "x.ps", "x.PNG.gif"):
        assert "PNG, SVG and PDF can be written" in said("render", folder / "deep/down/run", "-o", folder / name)
        assert not (folder / name).exists()
    quern("render", folder / "deep/down/run", "-o", folder / "x.PNG")
    assert "cannot be written" in quern("render", folder / "deep/down/run", "-o", "/dev/full", status=4).stderr
    quern("new", "oracle", "mine", "-o", folder / "no/such/folder")
    assert (folder / "no/such/folder/oracle.mine.c").exists()
    print("folders are made with those above them; a picture is what its name says")


if __name__ == "__main__":
    for test in (check_help, check_unknown, check_words, check_forms, check_substeps, check_numbers, check_full):
        test()
    with tempfile.TemporaryDirectory() as name:
        check_files(pathlib.Path(name))
