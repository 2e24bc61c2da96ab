# SPDX-License-Identifier: MIT
"""The core's rooms can be read in the order that core/README.md gives: no file includes one of a later room, no header leads back
to itself, and nothing in the core includes a plugin."""
import os
import pathlib
import re

CORE = pathlib.Path(os.environ["QUERN_SOURCE"]) / "core"
ROOMS = re.findall(r"^- \*\*(\w+)\*\*", (CORE / "README.md").read_text(), re.M)
FILES = {path.name: path for path in CORE.rglob("*.[ch]") if path.parent.name != "templates"}


def included(path):
    """Files of the core that a file includes, by name."""
    names = re.findall(r'^#include "([^"]+)"', path.read_text(), re.M)
    assert not any("plugins/" in name for name in names), f"{path} includes a plugin"
    return [name for name in names if name in FILES]


def check_order():
    for name, path in FILES.items():
        room = path.parent.name
        assert room in ROOMS, f"{path} stands in no room of core/README.md"
        for other in included(path):
            theirs = FILES[other].parent.name
            assert ROOMS.index(theirs) <= ROOMS.index(room), f"{name} in {room} includes {other} of a later room, {theirs}"


def check_circles():
    """Headers reached from a header, itself not among them."""
    def reach(name, way):
        for other in included(FILES[name]):
            assert other not in way, "headers in a circle: " + " -> ".join(way + [other])
            reach(other, way + [other])
    for name in FILES:
        if name.endswith(".h"):
            reach(name, [name])


assert len({path.name for path in FILES.values()}) == len(list(FILES)), "two files of one name"
assert [r for r in ROOMS if r != "templates" and not (CORE / r).is_dir()] == []
check_order()
check_circles()
print(f"{len(FILES)} files in {len(ROOMS) - 1} rooms, in order")
