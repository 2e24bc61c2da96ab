# SPDX-License-Identifier: MIT
"""Interfaces grow at the end of their structs: a program built with longer tables takes the plugins of this build, which
have shorter ones, and gives the same lists, plans and bits; this program refuses plugins of the longer ones by a sentence."""
import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import tempfile

import frozen
import lab
from workshop import FLAGS, PLUGINS, QUERN, SOURCE, source

BUILD = pathlib.Path(QUERN).parent
MAJOR, MINOR = lab.interface()
# What plugins fill has a size or a stride; what the host fills and hands over by pointer may be longer than they know.
LONGER = (r"\} (quern_(?:param|use|plugin|library|setup|step|host|kind|function|output|set|slot|stage|bound|\w+_ops|\w+_batch|"
          r"neighbour_job|coupling_job|check|check_host|check_instance|check_kernel|check_column));")


def newer_headers(folder):
    """include/quern as it may look one minor version later."""
    place = folder / "include/quern"
    place.mkdir(parents=True)
    longer = 0
    for header in (SOURCE / "include/quern").iterdir():
        text = header.read_text().replace(f"#define QUERN_ABI_MINOR {MINOR}u", f"#define QUERN_ABI_MINOR {MINOR + 1}u")
        text, n = re.subn(LONGER, r"\tuint64_t grown[3];\n} \1;", text)
        longer += n
        (place / header.name).write_text(text)
    assert longer > 25, f"only {longer} structs are longer"
    return folder / "include"


def run(words, **options):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{words}\n{done.stdout}{done.stderr}"
    return done.stdout


def newer_program(folder, include):
    """The program of this build again, by the build's own commands, with other headers and unoptimised."""
    commands = [shlex.split(line) for line in run(["ninja", "-C", BUILD, "-t", "commands", "quern"]).splitlines()]
    ours = f"-I{os.path.relpath(SOURCE / 'include', BUILD)}"
    objects, steps = [], []
    for words in commands:
        if "-c" not in words:
            continue
        objects.append(folder / f"{len(objects)}.o")
        words[words.index("-o") + 1] = objects[-1]
        words[words.index("-MF") + 1] = f"{objects[-1]}.d"
        assert ours in words, f"{ours} is not among {words}"
        steps.append([f"-I{include}" if word == ours else word for word in words] + ["-O0", "-Wno-error"])
    assert len(steps) > 50
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda words: run(words, cwd=BUILD), steps))
    link = commands[-1]
    out = link.index("-o")
    rest = [word for word in link[:out] + link[out + 2:] if not word.endswith((".o", ".a"))]
    program = folder / "quern"
    run([*rest[:1], "-o", program, *objects, *rest[1:]], cwd=BUILD)
    return str(program)


def same_words(newer, *words):
    environment = {**os.environ, "QUERN_PLUGIN_PATH": str(PLUGINS)}
    ours, theirs = (run([program, *words], env=environment) for program in (QUERN, newer))
    assert ours == theirs, f"{words}: the newer program says\n{theirs}"
    return ours


def check_older_plugins(newer, folder):
    for plugin in json.loads(same_words(newer, "list", "--json")):
        same_words(newer, "describe", plugin["id"], "--json")
    same_words(newer, "schema")
    for scene in ("two_grains", "column", "column_3d", "elastic_bar"):
        same_words(newer, "plan", "--json", lab.scene(scene))
    environment = {"QUERN_PLUGIN_PATH": str(PLUGINS)}
    for name, program in (("ours", QUERN), ("theirs", newer)):
        lab.run("two_grains", folder / name, program=program, **environment)
        lab.run("column", folder / (name + "2"), *lab.SMALL["column"], "--set=time.end=1 ms", "--set=output.every=0.5 ms",
                program=program, **environment)
    lab.same(folder / "ours", folder / "theirs", "two grains")
    lab.same(folder / "ours2", folder / "theirs2", "a column")
    checked = run([newer, "check", PLUGINS / "contact.linear.so"], env={**os.environ, **environment})
    assert "all ok" in checked
    print("a newer program takes the plugins of this build")


def check_newer_plugin(folder, include):
    path = folder / "contact.linear.so"
    (folder / "linear.c").write_text(source("dem/contact.linear.c"))
    run(["cc", *FLAGS, "-I", include, "-shared", folder / "linear.c", "-o", path, "-lm"])
    done = subprocess.run([QUERN, "describe", path], capture_output=True, text=True)
    assert done.returncode == 2 and f"plugin {path} is built for interface {MAJOR}.{MINOR + 1}, this program speaks {MAJOR}.{MINOR}: rebuild" in done.stderr
    print("this program refuses a plugin of a newer minor version")


def check_shorter_ops(folder):
    """A table of functions that ends before the last ones has none of these."""
    text = source("dem/contact.linear.c", (".size = sizeof ops,", ".size = offsetof(quern_contact_ops, period),"))
    (folder / "short.c").write_text(text)
    path = folder / "contact.linear.so"
    run(["cc", *FLAGS, "-I", SOURCE / "include", "-shared", folder / "short.c", "-o", path, "-lm"])
    plan = run([QUERN, "plan", lab.scene("two_grains")], env={**os.environ, "QUERN_PLUGIN_PATH": str(folder)})
    assert "half-period" not in plan, "a function beyond the end of its table was called"
    print("ops are read as far as they say they go")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        place = pathlib.Path(name)
        headers = newer_headers(place)
        check_shorter_ops(place)
        check_newer_plugin(place, headers)
        newer = newer_program(place, headers)
        check_older_plugins(newer, place)
        frozen.check({"this program": QUERN, "a newer one": newer}, place)
