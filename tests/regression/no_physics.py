# SPDX-License-Identifier: MIT
"""The core knows no physics: no name of a set, a section, a plugin, a kind or a field of any solver stands in core/, neither as a
text nor as a word of its code or its comments where it is no plain English. What a documented format needs all the same is listed
here, and is still needed."""
import json
import os
import pathlib
import re
import subprocess

QUERN = os.environ["QUERN"]
CORE = pathlib.Path(os.environ["QUERN_SOURCE"]) / "core"
# file: what docs/run_folder.md promises to readers of every run, and the sums that quern/solver.h says the program knows
DOCUMENTED = {
    "output/summary.c": {"grains", "grain_steps", "points", "point_steps", "discrete_share", "observer.discrete_share",
                         "mass", "momentum", "energy", "elastic"},
    "run/account.c": {"mass"},
    "check/check_scene.c": {"mass"},
    "run/run.c": {"mass"},
    "run/prospect.c": {"mass"},
    "output/frame.c": {".position"},  # the first dataset of a group, by which programs place the others
    "store/field.c": {"cells"},  # the group of the host's own set "cell"
}
ENGLISH = {"body", "contact", "contacts", "energy", "mass", "material", "motion", "node", "point", "points", "shape",
           "touch"}  # words that mean something else too: only as texts of their own
OWN = {"total", "cell", "solver", "observer", "grid"}  # the host's own sets and kinds, and what it reckons on


def ask(*words):
    return json.loads(subprocess.run([QUERN, *words, "--json"], check=True, capture_output=True, text=True).stdout)


def names():
    """(names that must not stand there as a text, types of the code, sets and sections and solvers, fields)"""
    texts, words, sets, fields = set(), set(), set(), set()
    for plugin in ask("list"):
        kind, name = plugin["id"].split(".")
        texts |= {plugin["id"], name}
        if kind == "check":
            continue
        words.add(f"quern_{kind}_ops" if kind not in OWN else "")
        texts.add(kind)
        if kind == "solver":
            said = ask("describe", plugin["id"])
            for one in said["sets"]:
                texts |= {one["name"], one["plural"]}
                sets |= {one["name"], one["plural"]}
            for stage in said["stages"]:
                texts.add(stage["name"])
                for use in stage["uses"]:
                    fields |= {use["field"]} if not use["field"].split(".")[0] in OWN else set()
                    texts |= {use["field"], use["field"].split(".")[0] + ".", "." + use["field"].split(".")[1]}
            texts.add(said["section"])
            sets |= {said["section"], name}
    texts -= OWN | {"total.", "cell."}
    return texts, words - {""}, sets, fields


def strings(text):
    """Literals of a C source without what stands in comments."""
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    return re.findall(r'"((?:[^"\\\n]|\\.)*)"', re.sub(r"^#include.*$", "", text, flags=re.M)), text


def check():
    texts, words, sets, fields = names()
    assert len(texts) > 150 and {"grain", "points", "contact.force", "hybrid", "linear"} <= texts, sorted(texts)
    needed, faults = {name: set() for name in DOCUMENTED}, []
    for path in sorted(CORE.rglob("*.[ch]")):
        if path.parent.name == "templates":
            continue
        name = str(path.relative_to(CORE))
        whole = path.read_text()
        literals, code = strings(whole)
        # a name as a whole literal, or followed by a dot, as in "grain.velocity" or "grain.%s"
        found = {t for t in literals if t in texts or t.split(".")[0] + "." in texts and "." in t}
        found |= {w for w in re.findall(r"\w+", code) if w in words}
        found |= {w for w in re.findall(r"\w+", whole) if w in sets - ENGLISH}
        found |= {f for f in re.findall(r"\b\w+\.\w+", whole) if f in fields}
        if name in DOCUMENTED:
            needed[name] = {t for t in DOCUMENTED[name] if any(t == literal or (t[0] == "." and t in literal) for literal in literals)}
            found = {t for t in found if not any(t == d or (d[0] == "." and d in t) for d in DOCUMENTED[name])}
        if found:
            faults.append(f"core/{name} knows {', '.join(sorted(found))}")
    assert not faults, "\n".join(faults)
    for name, promised in DOCUMENTED.items():
        assert needed[name] == promised, f"core/{name} no longer needs {', '.join(promised - needed[name])}"
    print(f"none of {len(texts)} names of {len(ask('list'))} plugins stands in core/, but for "
          f"{sum(map(len, DOCUMENTED.values()))} that formats promise")


if __name__ == "__main__":
    check()
