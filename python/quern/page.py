# SPDX-License-Identifier: MIT
"""What `quern chart` writes into a page of documentation: pictures, the table of points and sentences that follow from it. No sentence
is there before its numbers are, so that each is true of whatever table there is."""
import math
import os
import pathlib

import numpy as np

from .chart_data import Front, Picture
from .chart_draw import class_of, scaled
from .chart_study import Made
from .program import QuernError
from .workers import read_json

BEGIN, END = "<!-- quern chart -->", "<!-- end -->"


def split(path: pathlib.Path) -> tuple[str, str]:
    """What stands before and after the part that is written anew."""
    text = path.read_text()
    before, found, rest = text.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not found or not closed or BEGIN in rest:
        raise QuernError(f"{path} must have one line '{BEGIN}' and after it '{END}'; what stands between is written anew", 2)
    return before, after


def listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def settings(front: Front, which: list[int]) -> str:
    """Points by their labels, which may hold commas of their own."""
    return listed([f"*{front.labels[k]}*" for k in which])


def number(value: float, spread: float = math.nan) -> str:
    """Three digits, or as many as its standard error leaves."""
    if not math.isfinite(value):
        return "?"
    if not math.isfinite(spread) or spread <= 0:
        return f"{value:.3g}"
    digits = max(0, 1 - math.floor(math.log10(spread)))
    return f"{value:.{digits}f} ± {spread:.{digits}f}"


def cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def table(head: list[str], rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(cell(word) for word in row)} |" for row in [head, ["---"] * len(head), *rows])


def runs_word(made: Made, point: int) -> str:
    """How many runs of a point came to their end, and how the others ended."""
    rows = np.flatnonzero((made.runs["model"] == "") & (made.runs["point"] == point))
    ends = [made.runs["status"][k] for k in rows]
    others = [f"{ends.count(word)} {word}" for word in sorted(set(ends)) if word != "done"]
    return f"{ends.count('done')} of {len(ends)}" + (f": {', '.join(others)}" if others else "")


# ---- of a chart of cost and error ----

def off(picture: Picture, k: int) -> str:
    """The error of a point, with its unit."""
    unit = picture.y[1]
    by, short = scaled(unit, [picture.curves[0].y])
    text = number(picture.curves[0].y[k] / by, picture.curves[0].dy[k] / by)
    return f"({text}) {short}" if "±" in text and short != "1" else text if short == "1" else f"{text} {short}"


def share_word(share: float) -> str:
    return "one seed" if math.isnan(share) else f"{100 * share:.0f} %"


def cost_word(picture: Picture, k: int) -> str:
    text = number(picture.curves[0].x[k], picture.curves[0].dx[k])
    return text if picture.front.relative else f"({text}) s" if "±" in text else f"{text} s"


def front_table(made: Made, picture: Picture) -> str:
    front = picture.front
    head = ["", "setting", f"cost over {front.reference}" if front.relative else "cost", "error", "on the front", "runs"]
    rows = [[str(k + 1), front.labels[k] + (" **(marked)**" if k in front.marks else ""), cost_word(picture, k), off(picture, k),
             share_word(front.shares[k]), runs_word(made, front.points[k])] for k in range(len(front.labels))]
    return table(head, rows)


def about_front(front: Front) -> list[str]:
    by_class = [[k for k in range(len(front.labels)) if class_of(front.shares[k]) == number] for number in range(4)]
    sure = settings(front, by_class[0]) if by_class[0] else ""
    verb = "is" if len(by_class[0]) == 1 else "are"
    said = [f"Surely on the front of cost and error, in at least 95 % of the resamples of the seeds, {verb} {sure}." if sure else
            "No point is surely on the front of cost and error: none is there in 95 % of the resamples of the seeds."]
    if by_class[1]:
        said.append("Chance decides about " + listed([f"*{front.labels[k]}* ({share_word(front.shares[k])})" for k in by_class[1]]) + ".")
    if by_class[3]:
        said.append(f"Nothing can be said of {settings(front, by_class[3])}, of one seed.")
    return said


def about_mark(picture: Picture, k: int) -> str:
    """Where a marked point stands, against those that are surely on the front."""
    front, (x, y) = picture.front, (picture.curves[0].x, picture.curves[0].y)
    said = f"The marked *{front.labels[k]}* costs {cost_word(picture, k)} and is off by {off(picture, k)}"
    if class_of(front.shares[k]) == 0:
        return f"{said}; it is itself surely on the front."
    better = [j for j in range(len(x)) if class_of(front.shares[j]) == 0 and x[j] <= x[k] and y[j] <= y[k] and (x[j] < x[k] or y[j] < y[k])]
    if not better:
        return f"{said}; no point that is surely on the front is at most as dear and at most as wrong."
    words = [f"*{front.labels[j]}*, which costs {100 * (1 - x[j] / x[k]):.0f} % less and is off by {off(picture, j)}" for j in better]
    return f"{said}; in the means it is beaten by {listed(words)}."


def about_scatter(picture: Picture) -> list[str]:
    front, one = picture.front, picture.curves[0]
    if not math.isfinite(front.scatter):
        return []
    by, unit = scaled(picture.y[1], [one.y])
    within = [k for k in range(len(one.y)) if one.y[k] <= front.scatter]
    said = f"Single runs of {front.reference} scatter by {number(front.scatter / by)}{'' if unit == '1' else ' ' + unit}"
    if not within:
        return [f"{said}; every point is off by more."]
    cheapest = min(within, key=lambda k: one.x[k])
    if len(within) == len(one.y):
        return [f"{said}; no point is off by more, and *{front.labels[cheapest]}* is the cheapest."]
    return [f"{said}; {len(within)} of {len(one.y)} points are off by no more: {settings(front, within)}.",
            f"The cheapest of those is *{front.labels[cheapest]}*, at a cost of {cost_word(picture, cheapest)}."]


def front_words(made: Made, picture: Picture) -> list[str]:
    said = about_front(picture.front) + [about_mark(picture, k) for k in sorted(picture.front.marks)] + about_scatter(picture)
    return [front_table(made, picture), "\n".join(said)]


# ---- of the whole study ----

def column(made: Made, name: str, of: str, head: str, spread: str = "") -> tuple[str, list[str]]:
    """A column of the table of points: its head with the unit, and its numbers."""
    points, path = made.points, f"{name}.{of}"
    values, errors = points[path], points[f"{name}.{spread}"] if spread else np.full(len(points), math.nan)
    share = of == "error" and points.units[path] == "1"
    by, unit = (0.01, "%") if share else scaled(points.units[path], [values])
    cells = [number(value / by, error / by) if math.isfinite(value) else "" for value, error in zip(values, errors)]
    return head if unit == "1" else f"{head} [{unit}]", cells


def points_table(made: Made) -> str:
    """Means of all measures that are numbers, and errors against the reference, where there is no front."""
    study, columns = made.study, []
    for measure in study.measures:
        name = "cost." * (measure.source == "cost") + measure.name
        if measure.single:
            columns.append(column(made, name, "mean", measure.name, "standard_error"))
        nothing = measure.single and not np.any(made.points.columns.get(f"{name}.reference", 0.0))  # to be off from: the mean says it
        if f"{measure.name}.error" in made.points.columns and not nothing:
            if measure.single:
                columns.append(column(made, name, "reference", f"of {study.reference}"))
            columns.append(column(made, name, "error", f"error of {measure.name}", "error.standard_error"))
    axes = [axis.name for axis in study.axes]
    rows = [[labels[axis] for axis in axes] + [cells[k] for _, cells in columns] + [runs_word(made, k)] for k, labels in enumerate(made.labels)]
    return table(axes + [head for head, _ in columns] + ["runs"], rows)


def about_ends(made: Made) -> str:
    """How the runs ended; what those say that did not come to their end."""
    runs = made.runs
    bad = [k for k in range(len(runs)) if runs["status"][k] != "done"]
    if not bad:
        return f"All {len(runs)} runs came to their end."
    sentences: dict[str, int] = {}
    for k in bad:
        what = runs["message"][k].splitlines()[0] if runs["message"][k] else "no sentence"
        point = "" if runs["model"][k] or not made.labels else ", ".join(made.labels[int(runs["point"][k])].values())
        line = f"{runs['status'][k]}: {runs['model'][k] or point or made.study.name}: {what}"
        sentences[line] = sentences.get(line, 0) + 1
    rows = [f"- {line}" + (f" ({count} runs)" if count > 1 else "") for line, count in sentences.items()]
    return f"{len(bad)} of {len(runs)} runs did not come to their end:\n\n" + "\n".join(rows)


def about_cost(made: Made) -> str:
    """Processor time, and what the runs' own files say of program and machine."""
    spent = float(np.nansum(made.runs["cost.processor"]))
    took = f"{spent / 3600:.3g} hours" if spent >= 360 else f"{spent:.3g} s"
    said = [f"The {len(made.runs)} runs took {took} of processor time."]
    programs, machines = {}, {}
    for key in dict.fromkeys(made.runs["run"]):
        told = read_json(made.folder / "runs" / key / "summary.json").get("provenance")
        if isinstance(told, dict):
            programs[f"{told.get('program')}, commit {told.get('commit')}, {told.get('compiler')}"] = 1
        machine = read_json(made.folder / "runs" / f"{key}.json").get("machine")
        if isinstance(machine, str):
            machines[machine] = 1
    if programs:
        said.append(f"They were made by {listed(list(programs))}.")
    if machines:
        said.append(f"They ran on {listed(list(machines))}.")
    return " ".join(said)


def part(made: Made, drawn: dict[str, Picture], page: pathlib.Path) -> str:
    """What stands between the two marks."""
    pieces = []
    for name, picture in drawn.items():
        pieces.append(f"![{cell(picture.title or name)}]({page.stem}_{name}.svg)")
        if picture.front:
            pieces += front_words(made, picture)
    if not any(picture.front for picture in drawn.values()):
        pieces.append(points_table(made))
    return "\n\n".join([*pieces, about_ends(made), about_cost(made)])


def write(made: Made, drawn: dict[str, Picture]) -> None:
    """The page with its part written anew, and the pictures beside it; the page is replaced as a whole."""
    page = made.study.page
    before, after = split(page)
    for name in drawn:
        (page.parent / f"{page.stem}_{name}.svg").write_bytes((made.folder / "charts" / f"{name}.svg").read_bytes())
    aside = page.with_name(f"{page.name}.{os.getpid()}.part")
    aside.write_text(f"{before}{BEGIN}\n{part(made, drawn, page)}\n{END}{after}")
    aside.replace(page)
