# SPDX-License-Identifier: MIT
"""The version stands in meson.build; what else says one says the same: the program, its plugins, the citation."""
import json
import os
import pathlib
import re
import subprocess

QUERN, SOURCE = os.environ["QUERN"], pathlib.Path(os.environ["QUERN_SOURCE"])
VERSION = re.search(r"^  version: '([^']+)'", (SOURCE / "meson.build").read_text(), re.M).group(1)


def said(*words):
    return subprocess.run([QUERN, *words], check=True, capture_output=True, text=True).stdout


program = re.fullmatch(r"quern (\S+) \((\S+)\)\n", said("--version"))
assert program and program.group(1) == VERSION, said("--version")
others = {one["id"]: one["version"] for one in json.loads(said("list", "--json")) if one["version"] != VERSION}
assert not others, f"meson.build says {VERSION}, and {others}"
assert f"version: {VERSION}\n" in (SOURCE / "CITATION.cff").read_text(), "CITATION.cff names another version"
assert f"## {VERSION}" in (SOURCE / "CHANGELOG.md").read_text(), "CHANGELOG.md does not have this version"
print(f"{VERSION}, {program.group(2)}")
