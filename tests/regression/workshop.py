"""Plugins made and broken at test time: compiles sources with cc and runs the program on them."""
import os
import pathlib
import subprocess

QUERN = os.environ["QUERN"]
SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
PLUGINS = pathlib.Path(os.environ["QUERN_PLUGINS_DIR"])
FLAGS = ["-std=c17", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno",
         "-fno-trapping-math", "-fopenmp-simd"]


def compile(text, name, folder, *flags, beside=""):
    """An object `name` in `folder` from C text; `beside`: the folder its own includes are relative to."""
    path = pathlib.Path(folder) / (name + ".c")
    path.write_text(text)
    command = ["cc", *FLAGS, "-shared", "-I", SOURCE / "include", "-I", SOURCE / "plugins" / beside, path,
               "-o", pathlib.Path(folder) / (name + ".so"), "-lm", *flags]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    assert done.returncode == 0, f"{name} does not compile:\n{done.stderr}"
    return str(pathlib.Path(folder) / (name + ".so"))


def source(path, *changes):
    """A plugin's source with some places changed; each must be there once."""
    text = (SOURCE / "plugins" / path).read_text()
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
