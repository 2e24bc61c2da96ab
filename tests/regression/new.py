# SPDX-License-Identifier: MIT
"""`quern new`: a plugin of every kind, built outside the source tree against an installed Quern, checked, described
and run."""
import concurrent.futures
import os
import pathlib
import subprocess
import tempfile

QUERN = pathlib.Path(os.environ["QUERN"])
KINDS = ["contact", "neighbours", "integrator", "body", "material", "shape", "transfer", "strain", "coupling", "oracle", "packer",
         "observer", "solver", "check"]

HEAD = """
quern: 1
dimension: {dimension}
gravity: {gravity}
domain: {domain}
time: {{end: 20 ms}}
output: {{every: 20 ms{fields}}}
"""
BOX = {2: {"dimension": 2, "gravity": "[0, -9.81]", "domain": "{lower: [0, 0], upper: [0.1, 0.1]}"},
       3: {"dimension": 3, "gravity": "[0, 0, -9.81]",
           "domain": "{lower: [0, 0, 0], upper: [0.1, 0.04, 0.1]}"}}
FLOOR = {2: "- plane: {point: [0, 0], normal: [0, 1]}", 3: "- plane: {point: [0, 0, 0], normal: [0, 0, 1]}"}
BALL = {2: "- mine: {centre: [0.05, 0], radius: 0.02}", 3: "- mine: {centre: [0.05, 0.02, 0], radius: 0.02}"}
REGION = {2: "{lower: [0.01, 0.03], upper: [0.09, 0.06]}",
          3: "{lower: [0.01, 0.01, 0.03], upper: [0.09, 0.03, 0.05]}"}
SCENES = {
    "grains": """
bodies:
  {floor}
  {ball}
grains:
  material: {{density: 2500, radius: {{mean: 2 mm, spread: 10 %}}}}
  contact: {{mine: {{stiffness: 1e5, damping: 0.3, friction: 0.5}}}}
  neighbours: mine
  integrator: {{mine: {{drag: 0.1}}}}
  fill: {{region: {{box: {region}}}, packer: mine}}
observe: [mine]
""",
    "continuum": """
bodies:
  {floor}
continuum:
  cell: 5 mm
  material: {{mine: {{bulk_modulus: 1e5, density: 1000}}}}
  shape: mine
  transfer: {{mine: {{rate: 10}}}}
  strain: {{mine: {{part: 0.7}}}}
  fill: {{region: {{box: {region}}}}}
""",
    "hybrid": """
bodies:
  {floor}
grains:
  material: {{density: 2500, radius: {{mean: 2 mm, spread: 10 %}}}}
  contact: {{linear: {{stiffness: 1e5}}}}
  fill: {{region: {{box: {region}}}}}
continuum: {{cell: 10 mm, material: mu_i}}
hybrid:
  oracle: [{{mine: {{height: 0.05, depth: 20 mm}}}}]
  coupling: {{mine: {{share: 0.5}}}}
""",
    "solver": """
grains: {{solver: mine, radius: 1 mm}}
""",
}


def run(*command, status=0, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=120, **options)
    assert done.returncode == status, f"{command}: exit status {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def install(place):
    """The program of this build, its plugins, its headers and quern.pc, below a folder of their own."""
    run("meson", "install", "-C", QUERN.parent, "--no-rebuild", "--quiet", "--destdir", place)
    program, = place.glob("**/bin/quern")
    package, = place.glob("**/quern.pc")
    environment = dict(os.environ, PKG_CONFIG_PATH=str(package.parent), PKG_CONFIG_SYSROOT_DIR=str(place))
    environment.pop("QUERN_PLUGIN_PATH", None)
    return program, environment


def make(kind, program, folder, environment):
    run(program, "new", kind, "mine", cwd=folder, env=environment)
    place = folder / f"{kind}.mine"
    text = "".join(file.read_text() for file in place.iterdir())
    assert "my_kind" not in text and "my_name" not in text, f"{kind}: a token was not replaced"
    environment = dict(environment, CFLAGS="-Werror -Wshadow -Wconversion -Wundef -Wmissing-prototypes")
    run("meson", "setup", "build", cwd=place, env=environment)
    run("ninja", "-C", "build", cwd=place, env=environment)
    assert len(list((place / "build").glob("*.so"))) == 3, f"{kind}: not one object per instruction set"
    run(program, "check", place / f"build/{kind}.mine.so", env=environment)
    return kind


def refusals(program, folder, environment):
    for words, status, part in [(["contact", "mine"], 4, "is there already"), (["contct", "a"], 1, "did you mean 'contact'"),
                                (["contact", "Mine"], 1, "is no name"), (["contact", "linear"], 1, "installed already"),
                                (["contact", "v3"], 1, "instruction set"), (["contact"], 1, "missing"),
                                (["contact", "a", "-o", "/dev/null/here"], 4, "cannot be written")]:
        said = run(program, "new", *words, cwd=folder, env=environment, status=status)
        assert part in said, f"new {words}: {said}"


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        program, environment = install(folder / "installed")
        assert "contact.linear" in run(program, "list", env=environment), "the installed program finds no plugins"
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            for kind in pool.map(lambda kind: make(kind, program, folder, environment), KINDS):
                print(f"{kind}.mine: made, built and checked")
        refusals(program, folder, environment)
        environment["QUERN_PLUGIN_PATH"] = ":".join(str(folder / f"{kind}.mine/build") for kind in KINDS)
        listed = run(program, "list", "--all", env=environment)
        for kind in KINDS:
            assert f"{kind}.mine " in listed, f"quern list does not show {kind}.mine"
            assert f"{kind}.mine 0.1.0" in run(program, "describe", f"{kind}.mine", env=environment)
        for scene, text in SCENES.items():
            for d in (2, 3):
                file = folder / f"{scene}{d}.yaml"
                fields = ", fields: [grain.velocity]" if scene == "solver" else ""
                file.write_text(f"name: {scene}" + HEAD.format(fields=fields, **BOX[d]) +
                                text.format(floor=FLOOR[d], ball=BALL[d], region=REGION[d]))
                run(program, "run", file, "--quiet", "-o", folder / f"{scene}{d}", env=environment)
                print(f"{scene}, {d}-D: runs with them")


if __name__ == "__main__":
    main()
