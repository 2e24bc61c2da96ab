# SPDX-License-Identifier: MIT
"""No multiplication is fused with an addition in what the compiler made: results would differ between instruction sets.

Looks into the program and every plugin for instructions of the kind vfmadd, vfmsub, vfnmadd, vfnmsub.
"""
import os
import pathlib
import re
import subprocess
import sys

QUERN, PLUGINS = pathlib.Path(os.environ["QUERN"]), pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
FUSED = re.compile(r"\s(vfn?m(?:add|sub|addsub|subadd)\w*)")


def fused(path):
    """The functions of an object that hold a fused instruction, with the first one in each."""
    done = subprocess.run(["objdump", "-d", "--no-show-raw-insn", path], capture_output=True, text=True, check=True)
    found, function, count = {}, "?", 0
    for line in done.stdout.splitlines():
        if line.endswith(">:"):
            function, count = line.split("<")[1][:-2], count + 1
        elif (match := FUSED.search(line)):
            found.setdefault(function, match[1])
    assert count > 3, f"{path}: objdump shows {count} functions"
    return found


def seen(compiler):
    """Proof that the search would find one: a file compiled without the project's flags."""
    source = "double f(double a, double b, double c) { return a * b + c; } int main(void) { return f(1, 2, 3) > 0; }"
    out = pathlib.Path(os.environ.get("MESON_BUILD_ROOT", ".")) / "contraction_probe.o"
    subprocess.run([compiler, "-O2", "-march=x86-64-v3", "-ffp-contract=fast", "-xc", "-", "-o", out, "-c"], input=source,
                   text=True, check=True)
    names = subprocess.run(["objdump", "-d", "--no-show-raw-insn", out], capture_output=True, text=True, check=True).stdout
    out.unlink()
    return FUSED.search(names)


if __name__ == "__main__":
    assert seen(sys.argv[1] if len(sys.argv) > 1 else "cc"), "the probe has no fused instruction: nothing would be found"
    objects = [QUERN, *sorted(PLUGINS.glob("*.so"))]
    assert len(objects) > 30
    for path in objects:
        found = fused(path)
        assert not found, f"{path.name}: " + ", ".join(f"{name} in {function}" for function, name in found.items())
    print(f"no fused instruction in {len(objects)} objects")
