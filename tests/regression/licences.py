# SPDX-License-Identifier: MIT
"""Every source file says its licence in its first lines, by SPDX; templates do not, since what is made of them is its author's."""
import os
import pathlib

SOURCE = pathlib.Path(os.environ["QUERN_SOURCE"])
LINE = "SPDX-License-Identifier: MIT"

files = [path for folder in ("core", "drive", "include", "plugins", "python", "render", "studies", "tests", "tools") for path in (SOURCE / folder).rglob("*")
         if path.is_file() and "__pycache__" not in path.parts and (path.suffix in (".c", ".h", ".cc", ".py") or path.name == "meson.build" or path.parent.name == "tools" and path.suffix == "")]
for path in files:
    template = path.name.startswith("template.")
    head = "".join(path.read_text().splitlines(keepends=True)[:2])
    assert (LINE in head) != template, f"{path}: {'a template says' if template else 'does not say'} {LINE}"
print(f"{len(files)} files")
