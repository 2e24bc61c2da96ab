# SPDX-License-Identifier: MIT
"""Every public header compiles alone, without a warning, as C17 and as C++17, and a plugin in C++ is as good as one in C.

With the compilers that are there; skipped, with exit status 77, where there is none of C++.
"""
import pathlib
import shutil
import subprocess
import sys

import lab

STRICT = ["-Wpedantic", "-Wall", "-Wextra", "-Wshadow", "-Wconversion", "-Werror", f"-I{lab.SOURCE}/include"]
HEADERS = sorted((lab.SOURCE / "include/quern").glob("*.h"))
C = ["gcc", "clang-14", "clang"]
CPP = ["g++", "clang++-14", "clang++"]


def compiles(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr}"


def alone(compilers, standard, suffix, place):
    for header in HEADERS:
        file = place / f"{header.stem}{suffix}"
        file.write_text(f"#include <quern/{header.name}>\n")
        for compiler in compilers:
            compiles(compiler, f"-std={standard}", *STRICT, "-fsyntax-only", str(file))
    print(f"{len(HEADERS)} headers alone, {standard}: {', '.join(compilers)}")


def plugin(compiler, place):
    """Built, tabled and checked like any other."""
    built = place / compiler / "oracle.layer.so"
    built.parent.mkdir()
    compiles(compiler, "-std=c++17", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden", *STRICT,
             str(lab.SOURCE / "tests/plugins/oracle.layer.cc"), "-o", str(built))
    done = subprocess.run([lab.QUERN, "check", str(built)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"{compiler}: {done.stdout}{done.stderr}"
    print(f"oracle.layer by {compiler}: checked")


def main():
    found, found_cpp = ([name for name in names if shutil.which(name)] for names in (C, CPP))
    assert len(HEADERS) >= 6 and found
    with lab.workplace() as name:
        place = pathlib.Path(name)
        alone(found, "c17", ".c", place)
        alone(found_cpp, "c++17", ".cc", place)
        for compiler in found_cpp:
            plugin(compiler, place)
    return 0 if found_cpp else 77


if __name__ == "__main__":
    sys.exit(main())
