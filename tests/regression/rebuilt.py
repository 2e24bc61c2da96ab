# SPDX-License-Identifier: MIT
"""A plugin that is rebuilt between a stop and a resume: refused by name with both versions, or taken with --force and noted. The
same plugin for another processor is the same plugin."""
import os
import pathlib
import subprocess

import lab
import workshop

ID = ('.id = "contact.linear"', '.id = "contact.mine"')
SCENE = "--set=grains.contact={mine: {stiffness: 1e6, restitution: 0.5}}"


def compile(folder, *changes):
    workshop.compile(workshop.source("dem/contact.linear.c", ID, *changes), "contact.mine", folder)


def run(folder, plugins, *options, status=0):
    words = [lab.QUERN, "run", lab.scene("two_grains"), "-o", str(folder), SCENE, *options]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60,
                          env={**os.environ, "QUERN_PLUGIN_PATH": str(plugins)})
    assert done.returncode == status, f"{words}: exit status {done.returncode}, not {status}\n{done.stderr}"
    return done.stderr


def rebuilt(place):
    plugins, out = place / "plugins", place / "out"
    plugins.mkdir()
    compile(plugins)
    run(out, plugins, "--until", "0.2 ms")
    run(out, plugins, "--resume", "--until", "0.4 ms")  # the same one goes on
    compile(plugins, (".revision = 1", ".revision = 2"), ('"0.1.0", "MIT"', '"0.2.0", "MIT"'))
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    said = run(out, plugins, "--resume", status=2)
    assert "contact.mine was 0.1.0, revision 1 (" in said and " and is 0.2.0, revision 2 (" in said, said
    assert "--force" in said and said.count("was 0.1.0") == 1, said
    assert all(path.read_bytes() == data for path, data in before.items()), "a refused run has changed its folder"
    said = run(out, plugins, "--resume", "--force", "--until", "0.6 ms")
    assert "contact.mine was 0.1.0" in said
    assert "changed: contact.mine was 0.1.0, revision 1" in (out / "log.txt").read_text()
    run(out, plugins, "--resume")  # from here on it is the run's own
    noted, = lab.summary(out)["provenance"]["plugins_replaced"]
    assert noted.startswith("from step 9 on") and "contact.mine was 0.1.0" in noted and "is 0.2.0" in noted, noted
    print("a rebuilt plugin is refused, or taken and noted:", noted)


def other_level(place):
    """What counts is the object for any processor, also where there is another one for this one."""
    base, out = place / "base", place / "level"
    words = [lab.QUERN, "run", "--quiet", lab.scene("two_grains"), "-o"]
    subprocess.run([*words, str(base)], check=True)
    subprocess.run([*words, str(out), "--until", "3 ms", "--set=run.instructions=v1"], check=True)
    subprocess.run([*words, str(out), "--until", "6 ms", "--set=run.instructions=v3", "--resume"], check=True)
    subprocess.run([*words, str(out), "--resume"], check=True)
    files = {plugin["file"] for plugin in lab.summary(out)["provenance"]["plugins"]}
    lab.same(base, out, f"on with other objects, {min(file.rsplit('/')[-1] for file in files)} and so on")


if __name__ == "__main__":
    with lab.workplace() as name:
        rebuilt(pathlib.Path(name))
        other_level(pathlib.Path(name))
