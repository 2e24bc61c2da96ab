# SPDX-License-Identifier: MIT
"""findings - what scripts beside a study share: the rows of its table, and a page between whose marks they write."""
import argparse
import csv
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def rows(folder):
    """Of a sweep's table.csv, those of runs that came to their end: by names without units."""
    with open(folder / "table.csv") as file:
        for line in csv.DictReader(file):
            row = {key.split(" [")[0]: value for key, value in line.items()}
            if row["status"] == "done":
                yield row


def write(doc, study, mark, table, page=None):
    """Prints what `table` makes of the folder of a sweep, and puts it between <!-- mark --> and <!-- end of mark --> of the study's page, or of
    that other one."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sweep", type=pathlib.Path, default=ROOT / "out" / study)
    parser.add_argument("--page", type=pathlib.Path, default=ROOT / f"docs/validation/{page or study}.md")
    args = parser.parse_args()
    begin, end = f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"
    before, found, rest = args.page.read_text().partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        sys.exit(f"{args.page} must have a line '{begin.strip()}' and after it '{end}'")
    text = table(args.sweep)
    args.page.write_text(before + begin + text + end + after)
    print(text, end="")
