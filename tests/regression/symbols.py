# SPDX-License-Identifier: MIT
"""A plugin exports its table and nothing else; all that has external linkage, in every object of the program and in every
archive, begins with quern_; and the program gives plugins nothing else than that.
"""
import os
import pathlib
import re
import subprocess

QUERN, PLUGINS = pathlib.Path(os.environ["QUERN"]), pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
ENDS = {"exit", "_exit", "_Exit"}  # a plugin that calls them finds the program's, see core/plugin/watch.c
LINKER = {"__bss_start", "_edata", "_end"}  # where sections end
SANITIZER = re.compile(r"_{0,3}(odr_)?(asan|ubsan|tsan|sanitizer)[._]")


def symbols(path, *options):
    """Defined ones that others can see; those of sanitizers left out."""
    out = subprocess.run(["nm", "--defined-only", *options, path], capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in out.splitlines()]
    found = {words[-1] for words in lines if len(words) == 3 and words[-2] in "BCDGRSTVWu"}
    return {name for name in found if not SANITIZER.match(name)}


plugins = sorted(PLUGINS.glob("*.so"))
assert len(plugins) > 30
for plugin in plugins:
    found = symbols(plugin, "-D")
    assert found == {"quern_library_2"}, f"{plugin.name} exports {sorted(found)}"
print(f"{len(plugins)} plugins export quern_library_2 alone")

archives = sorted(QUERN.parent.glob("core/**/*.a")) + sorted(QUERN.parent.glob("plugins/**/*.a"))
objects = sorted(QUERN.parent.glob("quern*.p/*.o"))
assert archives and len(objects) > 20
names = set().union(*(symbols(path, "-g") for path in [*archives, *objects]))
assert len(names) > 200
wrong = {name for name in names - ENDS - {"main"} if not name.startswith("quern_")}
assert not wrong, f"external linkage without the prefix quern_: {sorted(wrong)}"
print(f"{len(names)} symbols of {len(objects)} objects and {len(archives)} archives begin with quern_")

runtime = subprocess.run(["nm", QUERN], capture_output=True, text=True, check=True).stdout
if any(name in runtime for name in ("__asan_init", "__tsan_init", "__ubsan_handle")):
    print("a sanitizer's program: what it exports is not looked at")
else:
    # a name with @ is a copy of a library's variable
    foreign = {name for name in symbols(QUERN, "-D") - ENDS - LINKER if "@" not in name and not name.startswith("quern_")}
    assert not foreign, f"the program exports {sorted(foreign)}"
    print("the program exports quern_, the ends of programs, and what the linker makes")
