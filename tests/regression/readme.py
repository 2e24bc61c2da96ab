"""Every command that README shows works as it stands there."""
import os
import pathlib
import re
import subprocess
import tempfile

SOURCE, QUERN = pathlib.Path(os.environ["QUERN_SOURCE"]), pathlib.Path(os.environ["QUERN"])

text = (SOURCE / "README.md").read_text()
commands = [line.strip() for line in re.findall(r"^    (build/quern .*)$", text, re.M)]
assert len(commands) >= 10, "README shows too few commands"

with tempfile.TemporaryDirectory() as folder:
    here = pathlib.Path(folder)
    (here / "build").symlink_to(QUERN.parent)
    (here / "configs").symlink_to(SOURCE / "configs")
    for command in commands + [command for command in commands if " run " in command]:  # again: the folders are there
        done = subprocess.run(command, shell=True, cwd=here, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}: exit {done.returncode}\n{done.stderr}"
        print(f"ok  {command}")
    scene = re.search(r"```yaml\n(.*?)```", text, re.S).group(1)
    (here / "scene.yaml").write_text(scene)
    done = subprocess.run([QUERN, "plan", "scene.yaml"], cwd=here, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    grains = re.sub(r"^(continuum|hybrid):.*\n(  .*\n)*", "", scene, flags=re.M)
    assert "grains:" in grains and "continuum" not in grains and "hybrid" not in grains
    (here / "grains.yaml").write_text(grains)
    done = subprocess.run([QUERN, "plan", "grains.yaml"], cwd=here, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    print("ok  the scene of README plans, without continuum and hybrid too")

for link in re.findall(r"\]\(([^)]+)\)", text):
    assert (SOURCE / link).exists(), f"README links to {link}, which is not there"
print("ok  every link of README leads somewhere")
