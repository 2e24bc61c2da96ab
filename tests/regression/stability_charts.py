# SPDX-License-Identifier: MIT
"""The charts of docs/stability.md are those of the tables beside them: drawn again from the pages they have the same names, are of the same tables and are
XML with all lines and limits by name; what is drawn is the numbers of the table; a run that was ended has a cross; a table that is not there is said."""
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

import numpy as np

if not importlib.util.find_spec("matplotlib"):
    print("matplotlib is not there")
    sys.exit(77)

SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
PAGES = SOURCE / "docs/validation"
MADE_UP = """**A hybrid column at rest: largest kinetic energy**

| substeps | settled state | step over the continuum's limit | 1st | 4th | what Quern says |
|---|---|---|---|---|---|
| 1 | 7 | 0.1 | 1e-4 | 1e-5 | runs on |
| 5 | 7 | 0.5 | 3e-4 | 2e-5 | runs on |
| 9 | 7 | 0.9 | 5e-3 | 7e-5 | runs on |
| 9 | 1 | 0.9 | 9e+9 | 9e+9 | runs on |
| 30 | 7 | 3 | 2e-1 | 0.0e+00 | hybrid.audit, at t = 1 s: steps make energy |
"""


def draw(folder, status=0):
    done = subprocess.run([sys.executable, SOURCE / "tools/stability_charts", folder], capture_output=True, text=True)
    assert done.returncode == status, f"exit status {done.returncode}, not {status}\n{done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr


def source_of(path):
    """The hash of the table."""
    return re.search(r"sha256:[0-9a-f]{16}", path.read_text())[0]


def texts_of(path):
    return ["".join(element.itertext()).strip() for element in xml.parse(path).iter() if element.tag.endswith("}text")]


def of_pages(here):
    for page in PAGES.glob("stability-*.md"):
        shutil.copy(page, here)
    draw(here)
    drawn = {path.name: path for path in here.glob("*.svg")}
    kept = {path.name: path for path in PAGES.glob("stability-*.svg")}
    assert set(drawn) == set(kept) and len(kept) >= 8, set(drawn) ^ set(kept)
    text = (SOURCE / "docs/stability.md").read_text()
    for name, path in drawn.items():
        assert source_of(path) == source_of(kept[name]), f"{name} is not of the table that stands in its page: tools/stability_charts"
        assert f"](validation/{name})" in text, f"docs/stability.md does not show {name}"
        assert texts_of(path) == texts_of(kept[name]), f"{name}: other words"
        assert len(texts_of(path)) > 8, texts_of(path)
    for word in ("theory: Hertz", "hard limit", "ended by Quern", "linear, tangential, position Verlet"):
        assert word in texts_of(drawn["stability-grains_modes.svg"]), word
    before = {name: path.read_bytes() for name, path in drawn.items()}
    draw(here)
    assert before == {name: path.read_bytes() for name, path in drawn.items()}, "other bytes the second time"
    print(f"ok  {len(kept)} charts are of the tables in their pages")


def of_numbers(here):
    """Places on logarithmic axes, read back from the path of the first line."""
    (here / "stability-substeps.md").write_text(MADE_UP)
    draw(here)
    path = here / "stability-substeps_rest.svg"
    text = path.read_text()
    found = re.findall(r'<path d="([^"]*)"[^>]*style="fill: none; stroke: #0072b2; stroke-width: 1.5', text)
    places = np.array([[float(word) for word in pair] for pair in re.findall(r"[ML] (\S+) (\S+)", max(found, key=len))])
    for column, data in enumerate(([0.1, 0.5, 0.9, 3], [1e-4, 3e-4, 5e-3, 2e-1])):
        slope, offset = np.polyfit(np.log10(data), places[:, column], 1)
        assert slope * (1 if column == 0 else -1) > 0 and np.abs(slope * np.log10(data) + offset - places[:, column]).max() < 1e-3, places
    assert "ended by Quern" in texts_of(path) and "hard limit" in texts_of(path), texts_of(path)
    path.write_text("")
    (here / "stability-substeps.md").write_text(MADE_UP.replace("hybrid.audit, at t = 1 s: steps make energy", "runs on"))
    draw(here)
    assert "ended by Quern" not in texts_of(path), "nothing was ended"
    (here / "stability-substeps.md").write_text("**Another table**\n")
    assert "no table 'A hybrid column at rest'" in draw(here, 1)
    print("ok  what is drawn is the numbers of a table")


for check in of_pages, of_numbers:
    with tempfile.TemporaryDirectory() as folder:
        check(pathlib.Path(folder))
