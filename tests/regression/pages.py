# SPDX-License-Identifier: MIT
"""What the pages show works as it stands there: commands, scenes, Python, and the words that the program is said to print.

In a page, an indented line `build/quern ...` is run, with the status that `# status N` behind it says; a block of yaml whose first
line is `# FILE` is saved, others are planned; a block of python is run; every line of a block of text is found in what the last
command printed. All of a page happens in one folder, in order. Every link of every page leads somewhere."""
import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

SOURCE, QUERN = pathlib.Path(os.environ["QUERN_SOURCE"]), pathlib.Path(os.environ["QUERN"])
PAGES = {"README.md": 10, "docs/tutorial.md": 13, "docs/run_folder.md": 4, "docs/python.md": 5, "docs/film.md": 8, "docs/studies.md": 3, "docs/observers.md": 1}
if importlib.util.find_spec("matplotlib"):
    PAGES |= {"docs/charts.md": 3, "docs/drive.md": 2}
PIECE = re.compile(r"^```(yaml|python|text)\n(.*?)^```|^    (build/quern [^\n]*)$", re.M | re.S)


class Page:
    """One page, played in a folder."""

    def __init__(self, name, here):
        self.name, self.here, self.printed, self.done = name, here, "", 0

    def run(self, command, status=0):
        done = subprocess.run(command, cwd=self.here, capture_output=True, text=True, shell=isinstance(command, str),
                              env=os.environ | {"QUERN_CACHE": str(self.here / "cache"), "PYTHONPATH": str(SOURCE / "python")})
        assert done.returncode == status, f"{self.name}: {command}: status {done.returncode}\n{done.stdout}{done.stderr}"
        self.printed = done.stdout + done.stderr

    def command(self, line):
        line, _, comment = line.partition("    # ")
        status = re.match(r"status (\d+)", comment)
        self.run(line.strip(), int(status.group(1)) if status else 0)
        self.done += 1

    def yaml(self, text):
        saved = re.match(r"# (\S+\.yaml)\n", text)
        (self.here / (saved.group(1) if saved else "scene.yaml")).write_text(text)
        if not saved:
            self.run([str(QUERN), "plan", "scene.yaml"])

    def python(self, text):
        self.run([sys.executable, "-c", text])
        self.done += 1

    def text(self, text):
        for line in text.splitlines():
            assert line.strip() in self.printed, f"{self.name}: the program does not print '{line}'\n{self.printed}"


def play(name, least):
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        (here / "build").symlink_to(QUERN.parent)
        (here / "configs").symlink_to(SOURCE / "configs")
        (here / "out").mkdir()
        page = Page(name, here)
        for block, text, command in PIECE.findall((SOURCE / name).read_text()):
            page.command(command) if command else getattr(page, block)(text)
        assert page.done >= least, f"{name} shows {page.done} commands and pieces of Python, fewer than it did"
        print(f"ok  {name}: {page.done}")


def notebook():
    """The cells of docs/notebook.ipynb, one after the other."""
    cells = json.loads((SOURCE / "docs/notebook.ipynb").read_text())["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert len(cells) >= 10 and all(not cell["outputs"] for cell in cells if cell["cell_type"] == "code"), "ten cells, kept without output"
    with tempfile.TemporaryDirectory() as folder:
        here = pathlib.Path(folder)
        (here / "configs").symlink_to(SOURCE / "configs")
        (here / "out").mkdir()
        environment = os.environ | {"PYTHONPATH": str(SOURCE / "python"), "MPLBACKEND": "svg"}
        done = subprocess.run([sys.executable, "-c", "\n".join(code)], cwd=here, capture_output=True, text=True, env=environment)
        assert done.returncode == 0, f"docs/notebook.ipynb:\n{done.stdout}{done.stderr}"
    print(f"ok  docs/notebook.ipynb: {len(cells)} cells\n{done.stdout}", end="")


def links():
    for path in [SOURCE / "README.md", SOURCE / "CONTRIBUTING.md", *(SOURCE / "docs").rglob("*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", path.read_text()):
            assert (path.parent / link).exists(), f"{path.name} links to {link}, which is not there"
    print("ok  every link leads somewhere")


def tour():
    """Every file of docs/tour.md is there, and every name that stands with a file is in it."""
    text = (SOURCE / "docs/tour.md").read_text().replace("\n", " ")
    found = re.findall(r"`(\w+)` in +`((?:core|drive|plugins)/[\w/.]+)`", text)
    found += [(name, file) for file, name in re.findall(r"`((?:core|drive|plugins)/[\w/.]+)`, `(\w+)`", text)]
    assert len(found) >= 25, f"{len(found)} names in docs/tour.md"
    for file in set(re.findall(r"`((?:core|drive|plugins|configs)/[\w/.]+\.\w+)`", text)):
        assert (SOURCE / file).exists(), f"docs/tour.md names {file}, which is not there"
    for name, file in found:
        assert re.search(rf"\b{name}\b", (SOURCE / file).read_text()), f"docs/tour.md looks for {name} in {file}"
    print(f"ok  {len(found)} names of docs/tour.md are where it says")


links()
tour()
notebook()
for page, fewest in PAGES.items():
    play(page, fewest)
for tool in "reference", "manual":
    if tool == "reference" and not (pathlib.Path(os.environ["QUERN_PLUGINS_DIR"]) / "coupling.exact.so").exists():
        print("built without coupling.exact: docs/scene.md, which names it, is not compared")
        continue
    subprocess.run([SOURCE / "tools" / tool, "--check"], check=True)
print("ok  docs/scene.md and docs/quern.1 are what the program says")
