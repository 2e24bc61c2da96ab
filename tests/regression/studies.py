# SPDX-License-Identifier: MIT
"""Malformed studies: every one is refused with exit status 2 and the very message that lies beside it, before anything is made.

malformed_studies/NAME.yaml goes with malformed_studies/NAME.err. `--update` rewrites the .err files; read them before they are kept."""
import contextlib
import io
import os
import pathlib
import re
import subprocess
import sys
import tempfile

try:
    import yaml  # noqa: F401
except ImportError:
    print("python3-yaml is not there")
    sys.exit(77)

sys.path.insert(0, str(pathlib.Path(os.environ["QUERN_SOURCE"]) / "python"))
from quern.sweep import main  # noqa: E402

QUERN = os.environ["QUERN"]
STUDIES = pathlib.Path(os.environ["QUERN_SOURCE"]) / "tests/regression/malformed_studies"
WITHOUT_A_PLACE = {"empty", "not_text"}
SEVERAL = {"charts_many_faults": 7, "closed_many": 5, "many_faults": 9, "set_no_path": 2}


def refuse(path, folder):
    done = subprocess.run([QUERN, "sweep", path.name, "-o", folder / "out"], cwd=path.parent, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2, f"{path.name}: exit status {done.returncode}, not 2\n{done.stdout}{done.stderr}"
    assert not done.stdout and not (folder / "out").exists(), f"{path.name}: something was made"
    return done.stderr


def refuse_here(path, folder):
    """The same without a process of its own, which takes longer than what it does."""
    out, said = io.StringIO(), io.StringIO()
    with contextlib.chdir(path.parent), contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
        status = main([path.name, "-o", str(folder / "out")])
    assert status == 2, f"{path.name}: exit status {status}, not 2\n{out.getvalue()}{said.getvalue()}"
    assert not out.getvalue() and not (folder / "out").exists(), f"{path.name}: something was made"
    return said.getvalue()


def check_form(path, text):
    found = re.findall(rf"^{path.stem}\.yaml:(\d+):(\d+): error: \S", text, re.M)
    if path.stem not in WITHOUT_A_PLACE:
        assert len(found) == SEVERAL.get(path.stem, 1), f"{path.name}: {len(found)} faults\n{text}"
    lines = path.read_text().splitlines()
    for line, column in found:
        assert int(line) <= len(lines) + 1, f"{path.name}: line {line}, column {column} is beyond the file"


def check_studies(folder, update):
    paths, wrong = sorted(STUDIES.glob("*.yaml")), []
    assert len(paths) >= 95, f"only {len(paths)} malformed studies"
    for path in paths:
        text = refuse_here(path, folder)
        check_form(path, text)
        beside = path.with_suffix(".err")
        if update:
            beside.write_text(text)
        elif not beside.exists() or beside.read_text() != text:
            wrong.append(f"{path.name} prints\n{text}")
    assert refuse(STUDIES / "many_faults.yaml", folder) == (STUDIES / "many_faults.err").read_text()
    assert {path.stem for path in STUDIES.glob("*.err")} == {path.stem for path in paths}, "messages without a study"
    assert not wrong, "\n".join(wrong) + f"\n{len(wrong)} messages differ; studies.py --update rewrites them"
    print(f"{len(paths)} malformed studies are refused with their messages")


def check_strange(folder):
    """What no text editor writes."""
    for name, data, said in (("bytes", b"\xff\xfe\x00", "not text in UTF-8"), ("deep", b"set: " + b"[" * 5000, "error: "),
                             ("itself", b"study: &a [*a]", "an alias, *a,"), ("null", b"study: 1\nbase: a\0b", "error: ")):
        path = folder / f"{name}.yaml"
        path.write_bytes(data)
        text = refuse(path, folder)
        assert said in text and "Traceback" not in text, f"{name}:\n{text}"
    for words, status, said in ((["nowhere.yaml"], 2, "cannot be read: No such file"), ([], 1, "required"), (["a", "--emit", "x"], 1, "invalid choice"), (["a", "--jobs", "0"], 1, "--jobs"), (["."], 2, "Is a directory")):
        done = subprocess.run([QUERN, "sweep", *words], cwd=folder, capture_output=True, text=True, timeout=60)
        assert done.returncode == status and said in done.stderr and "Traceback" not in done.stderr, done.stderr
    print("strange files are refused")


with tempfile.TemporaryDirectory() as name:
    check_studies(pathlib.Path(name), "--update" in sys.argv)
    check_strange(pathlib.Path(name))
