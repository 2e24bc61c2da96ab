# SPDX-License-Identifier: MIT
"""An installed Quern works wherever its folders are: libraries in a place of their own, without Cairo, moved as a whole."""
import importlib.util
import os
import pathlib
import shutil
import subprocess
import tempfile

SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])


def run(*command, status=0, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=300, **options)
    assert done.returncode == status, f"{command}: exit status {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def build(folder, *options):
    """Configured for a prefix, one instruction set, no tests run; installed below `folder`."""
    run("meson", "setup", folder / "build", SOURCE, "-Dlevels=v1", f"-Dprefix={folder}/there", "-Drender=disabled", "-Doptimization=0", *options)
    run("ninja", "-C", folder / "build", "quern", "quern-drive", "plugins")
    run("meson", "install", "-C", folder / "build", "--quiet", "--no-rebuild")


def works(program):
    assert len(run(program, "list").splitlines()) > 30, "plugins are missing"
    run(program, "plan", SOURCE / "configs/two_grains.yaml")
    run(program, "drive", "elastic", "--set=bulk_modulus=1e6", "--set=density=1000", "--path=tension", "-o", pathlib.Path(program).parent / "drive.csv")
    said = run(program, "render", "x", status=1)
    assert "unknown command 'render'" in said, said


with tempfile.TemporaryDirectory() as name:
    here = pathlib.Path(name)
    environment = {key: value for key, value in os.environ.items() if not key.startswith("QUERN")}
    os.environ.clear()
    os.environ.update(environment)
    build(here, "-Dlibdir=other/place/lib")
    place = here / "there"
    works(place / "bin/quern")
    print("ok  libraries in a place of their own, no Cairo")
    for file in ("share/man/man1/quern.1", "share/doc/quern/tutorial.md", "share/doc/quern/LICENSE", "share/quern/configs/column.yaml",
                 "share/bash-completion/completions/quern", "share/zsh/site-functions/_quern"):
        assert (place / file).exists(), f"{file} is not installed"
    print("ok  pages, scenes, manual and completions are installed")
    shutil.copytree(place, here / "moved")
    shutil.rmtree(place)
    works(here / "moved/bin/quern")
    print("ok  moved as a whole")
    (here / "moved/bin/plugins").mkdir()
    works(here / "moved/bin/quern")
    print("ok  a folder called plugins beside the program is only a folder")
    said = run("bash", "-c", f'PATH={here}/moved/bin:$PATH; source {here}/moved/share/bash-completion/completions/quern; '
               'COMP_WORDS=(quern pl); COMP_CWORD=1; _quern; echo "${COMPREPLY[@]}"; '
               'COMP_WORDS=(quern run --thr); COMP_CWORD=2; _quern; echo "${COMPREPLY[@]}"')
    assert said.split() == ["plan", "--threads"], said
    print("ok  bash completes commands and options")
    (here / "moved/bin/quern-greet").write_text("#!/bin/sh\necho hello $1\n")
    (here / "moved/bin/quern-greet").chmod(0o755)
    assert run(here / "moved/bin/quern", "greet", "you") == "hello you\n"
    assert "quern greet" in run(here / "moved/bin/quern", "--help")
    assert "did you mean 'greet'?" in run(here / "moved/bin/quern", "gret", status=1)
    print("ok  quern WORD runs quern-WORD")
    try:
        import yaml  # noqa: F401
    except ImportError:
        print("--  quern sweep is not tried: python3-yaml is not there")
    else:
        (here / "study.yaml").write_text(f"study: 1\nbase: {SOURCE}/configs/two_grains.yaml\nset: {{time.end: 1 ms}}\n")
        said = run(here / "moved/bin/quern", "sweep", here / "study.yaml", "-o", here / "study", "--quiet")
        assert said.startswith("1 runs: 1 done; "), said
        assert "holds no frames" in run(here / "moved/bin/quern", "film", here, status=2)
        assert "cannot be opened" in run(here / "moved/bin/quern", "calibrate", here / "none.yaml", status=2)
        print("ok  quern sweep, quern film and quern calibrate work where they are installed")
        if importlib.util.find_spec("matplotlib"):
            (here / "study.yaml").write_text((here / "study.yaml").read_text() + "charts:\n  - {name: n, kind: series, column: grains}\n")
            said = run(here / "moved/bin/quern", "chart", here / "study.yaml", "-o", here / "study")
            assert said.startswith("1 chart; ") and (here / "study/charts/n.svg").exists(), said
            print("ok  quern chart works where it is installed")
