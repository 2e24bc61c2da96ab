"""A plugin exports its table and nothing else; what the core links by name begins with quern_."""
import os
import pathlib
import subprocess

QUERN, PLUGINS = pathlib.Path(os.environ["QUERN"]), pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])


def symbols(path, *options):
    out = subprocess.run(["nm", *options, path], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1] for line in out.splitlines() if len(line.split()) >= 2 and line.split()[-2] in "BCDRTVW"}


plugins = sorted(PLUGINS.glob("*.so"))
assert len(plugins) > 30
for plugin in plugins:
    found = symbols(plugin, "-D", "--defined-only")
    foreign = {s for s in found if not s.startswith(("__asan", "__ubsan", "__tsan", "___asan"))}
    assert foreign == {"quern_library_1"}, f"{plugin.name} exports {sorted(foreign)}"
print(f"{len(plugins)} plugins export quern_library_1 alone")

names = symbols(QUERN.parent / "core/libcore.a", "-g", "--defined-only")
assert len(names) > 100
ends = {"exit", "_exit", "_Exit"}  # a plugin that calls them finds the program's, see core/watch.c
wrong = {s for s in names - ends if not s.startswith(("quern_", "__", "_", "asan."))}
assert not wrong, f"without the prefix quern_: {sorted(wrong)}"
print(f"{len(names)} symbols of the core begin with quern_")
