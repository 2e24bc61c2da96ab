# SPDX-License-Identifier: MIT
"""No multiplication is fused with an addition by the compiler: results would differ between instruction sets. What is fused is written down as such.

Looks into the program and every plugin for instructions of the kind vfmadd, vfmsub, vfnmadd, vfnmsub, and, where there are some, at the line that
each comes from: that of an intrinsic function, which plugins/common/fused.h calls.
"""
import os
import pathlib
import re
import subprocess
import sys

QUERN, PLUGINS = pathlib.Path(os.environ["QUERN"]), pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
FUSED = re.compile(r"\s*([0-9a-f]+):\s(vfn?m(?:add|sub|addsub|subadd)\w*)")
WRITTEN = re.compile(r"/(fma|avx512\w*)intrin\.h:")
SOLVERS = {f"solver.{name}.{level}.so" for name in ("mpm", "hybrid") for level in ("v3", "v4")}


def fused(path):
    """The fused instructions of an object, with their functions."""
    done = subprocess.run(["objdump", "-d", "--no-show-raw-insn", path], capture_output=True, text=True, check=True)
    found, function, count = [], "?", 0
    for line in done.stdout.splitlines():
        if line.endswith(">:"):
            function, count = line.split("<")[1][:-2], count + 1
        elif (match := FUSED.match(line)):
            found.append((match[1], match[2], function))
    assert count > 3, f"{path}: objdump shows {count} functions"
    return found


def of_compiler(path, found):
    """Those of them that no source asks for."""
    if not found or (path.name in SOLVERS and b"clang version" in path.read_bytes()):
        return []  # clang does not name the intrinsic; its results are compared with those of gcc, to the bit
    lines = subprocess.run(["addr2line", "-e", path], input="\n".join(address for address, _, _ in found), capture_output=True, text=True,
                           check=True).stdout.splitlines()
    assert len(lines) == len(found)
    if all(line.startswith("??") for line in lines):
        print(f"{path.name}: without line numbers nobody can say where its fused instructions come from")
        sys.exit(77)
    return [f"{name} in {function}, {line}" for (_, name, function), line in zip(found, lines) if not WRITTEN.search(line)]


def seen(compiler):
    """Proof that the search would find one: a file compiled without the project's flags."""
    source = "double f(double a, double b, double c) { return a * b + c; } int main(void) { return f(1, 2, 3) > 0; }"
    out = pathlib.Path(os.environ.get("MESON_BUILD_ROOT", ".")) / "contraction_probe.o"
    subprocess.run([compiler, "-O2", "-march=x86-64-v3", "-ffp-contract=fast", "-xc", "-", "-o", out, "-c"], input=source,
                   text=True, check=True)
    names = subprocess.run(["objdump", "-d", "--no-show-raw-insn", out], capture_output=True, text=True, check=True).stdout
    out.unlink()
    return any(FUSED.match(line) for line in names.splitlines())


if __name__ == "__main__":
    assert seen(sys.argv[1] if len(sys.argv) > 1 else "cc"), "the probe has no fused instruction: nothing would be found"
    objects = [QUERN, *sorted(PLUGINS.glob("*.so"))]
    assert len(objects) > 30
    written = set()
    for path in objects:
        found = fused(path)
        wrong = of_compiler(path, found)
        assert not wrong, f"{path.name}: " + "; ".join(wrong[:10])
        written |= {path.name} if found else set()
    assert written <= SOLVERS, f"fused on purpose, where nobody expects it: {sorted(written - SOLVERS)}"
    print(f"no fused instruction of the compiler's own in {len(objects)} objects; those of plugins/common/fused.h in {', '.join(sorted(written))}")
