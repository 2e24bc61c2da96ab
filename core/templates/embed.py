# SPDX-License-Identifier: MIT
"""Writes the templates into one C file, line by line: embed.py OUT FILE..."""
import pathlib
import sys

out, *files = map(pathlib.Path, sys.argv[1:])
text = '#include "templates.h"\n#include <stddef.h>\n\n'
for number, file in enumerate(files):
    text += f"static const char *const text_{number}[] = {{\n"
    for line in file.read_text().splitlines():
        text += '\t"' + line.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t") + '",\n'
    text += "\tNULL\n};\n"
text += "\nconst quern_template quern_templates[] = {\n"
for number, file in enumerate(files):
    text += f'\t{{ "{file.name}", text_{number} }},\n'
out.write_text(text + "\t{ NULL, NULL }\n};\n")
