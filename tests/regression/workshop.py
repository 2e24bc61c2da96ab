# SPDX-License-Identifier: MIT
"""Plugins made and broken at test time: compiles sources with cc and runs the program on them."""
import os
import pathlib
import subprocess

QUERN = os.environ["QUERN"]
SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
PLUGINS = pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
SANITIZED = any(name in pathlib.Path(QUERN).read_bytes() for name in (b"__asan_init", b"__tsan_init"))
for sanitizer in ("ASAN_OPTIONS", "TSAN_OPTIONS"):  # plugins crash on purpose: the program's own handlers shall see it
    os.environ[sanitizer] = os.environ.get(sanitizer, "") + ":handle_segv=0:handle_sigill=0"
FLAGS = ["-std=c17", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno",
         "-fno-trapping-math", "-fopenmp-simd"]


def compile(text, name, folder, *link, beside=""):
    """An object `name`.so in `folder` from C text; `link`: more flags for the linker, `beside`: the folder that its own
    includes are relative to."""
    stem = pathlib.Path(folder) / name
    stem.with_name(name + ".c").write_text(text)
    steps = [["cc", *FLAGS, "-c", "-I", SOURCE / "include", "-I", SOURCE / "plugins" / beside, f"{stem}.c",
              "-o", f"{stem}.o"],
             ["cc", "-shared", f"{stem}.o", "-o", f"{stem}.so", "-lm", *link]]
    for step in steps:
        done = subprocess.run(list(map(str, step)), capture_output=True, text=True)
        assert done.returncode == 0, f"{name} does not compile:\n{done.stderr}"
    return f"{stem}.so"


def template(kind):
    """The template of a kind, where its other files are."""
    found = [*SOURCE.glob(f"plugins/*/template.{kind}.c"), *SOURCE.glob(f"core/templates/template.{kind}.c")]
    assert len(found) == 1, f"{kind}: {len(found)} templates"
    return found[0]


def source_of(path):
    """A plugin's source, or that of the template of a kind, whose plugin is called mine."""
    if "/" in path:
        return (SOURCE / "plugins" / path).read_text()
    return template(path).read_text().replace("my_name", "mine")


def source(path, *changes):
    """The same with some places changed; each must be there once."""
    text = source_of(path)
    for old, new in changes:
        assert text.count(old) == 1, f"{path}: '{old}' stands there {text.count(old)} times"
        text = text.replace(old, new)
    return text


def quern(*arguments, status, timeout=300, **environment):
    """Runs the program; returns what it prints, output and errors together."""
    done = subprocess.run([QUERN, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=timeout, env={**os.environ, **environment})
    assert done.returncode == status, f"{arguments}: exit status {done.returncode}, not {status}\n{done.stdout}"
    return done.stdout
