# SPDX-License-Identifier: MIT
"""What `quern chart` writes into a page of documentation: pictures, the table of points and sentences that follow from it. No sentence
is there before its numbers are, so that each is true of whatever table there is."""
import math
import pathlib
import urllib.parse

import numpy as np

from .chart_data import Front, Picture
from .chart_draw import class_of, percent, scaled
from .chart_study import Made, label_of
from .errors import SHARES
from .program import QuernError
from .workers import read_json, save

BEGIN, END = "<!-- quern chart -->", "<!-- end -->"


def split(path: pathlib.Path) -> tuple[str, str]:
    """What stands before and after the part that is written anew."""
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise QuernError(f"{path} is not text in UTF-8; write it anew as such", 2) from None
    before, found, rest = text.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not found or not closed or BEGIN in rest:
        raise QuernError(f"{path} must have one line '{BEGIN}' and after it '{END}'; what stands between is written anew", 2)
    return before, after


def listed(words: list[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def short(value: float) -> str:
    """Three digits, without an exponent where people would write none."""
    return f"{float(f'{value:.3g}'):g}"


def number(value: float, spread: float = math.nan) -> str:
    """Three digits, or as many as its standard error leaves. One that is a millionth of the number is what rounding leaves, no chance."""
    if not math.isfinite(value):
        return "?"
    if not math.isfinite(spread) or spread <= 1e-6 * abs(value):
        return short(value)
    last = math.floor(math.log10(spread)) - 1  # the power of ten of the last digit
    if not 1e-6 < max(abs(value), spread) < 1e6:
        digits = math.floor(math.log10(max(abs(value), spread))) - last
        return f"{value:.{digits}e} ± {spread:.1e}"
    return f"{round(value, -last):.{max(0, -last)}f} ± {round(spread, -last):.{max(0, -last)}f}"


def cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def quoted(label: str) -> str:
    """Within a sentence, since labels hold commas and words of all kinds."""
    return f"*{cell(label)}*"


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
    by, unit = scaled(unit, [picture.curves[0].y])
    text = number(picture.curves[0].y[k] / by, picture.curves[0].dy[k] / by)
    return f"({text}) {unit}" if "±" in text and unit != "1" else text if unit == "1" else f"{text} {unit}"


def share_word(share: float) -> str:
    return "one seed" if math.isnan(share) else percent(share)


def cost_word(picture: Picture, k: int) -> str:
    text = number(picture.curves[0].x[k], picture.curves[0].dx[k])
    return text if picture.front.relative else f"({text}) s" if "±" in text else f"{text} s"


def costs(picture: Picture, k: int) -> str:
    return f"costs {cost_word(picture, k)}" + (f" times as much as {picture.front.reference}" if picture.front.relative else "")


def less(own: float, other: float) -> str:
    """How much less than `other` costs what costs `own`, which is at most as much."""
    share = 100 * (1 - own / other) if other > 0 else 0.0
    return f"costs {share:.0f} % less" if 0.5 <= share < 99 else f"costs {share:.4g} % less" if share >= 99 else "costs as much"


def front_table(made: Made, picture: Picture) -> str:
    front = picture.front
    head = ["", "setting", f"cost over {front.reference}" if front.relative else "cost", "error", "on the front", "runs"]
    rows = [[str(k + 1), front.labels[k] + (" **(marked)**" if k in front.marks else ""), cost_word(picture, k), off(picture, k),
             share_word(front.shares[k]), runs_word(made, front.points[k])] for k in range(len(front.labels))]
    return table(head, rows)


def about_front(front: Front) -> list[str]:
    by_class = [[k for k in range(len(front.labels)) if class_of(front.shares[k]) == number] for number in range(4)]
    if len(by_class[3]) == len(front.labels):
        return ["Of one seed nothing can be said about what chance does to the front of cost and error."]
    sure = listed([quoted(front.labels[k]) for k in by_class[0]]) if by_class[0] else ""
    verb = "is" if len(by_class[0]) == 1 else "are"
    said = [f"Surely on the front of cost and error, in at least 95 % of the resamples of the seeds, {verb} {sure}." if sure else
            "No point is surely on the front of cost and error: none is there in 95 % of the resamples of the seeds."]
    if by_class[1]:
        said.append("Chance decides about " + listed([f"{quoted(front.labels[k])} ({share_word(front.shares[k])})" for k in by_class[1]]) + ".")
    if by_class[3]:
        said.append(f"Nothing can be said of {listed([quoted(front.labels[k]) for k in by_class[3]])}, of one seed.")
    if front.gone:
        said.append(f"Cost or error of {listed([quoted(label) for label in front.gone])} is not known.")
    return said


def about_mark(picture: Picture, k: int) -> str:
    """Where a marked point stands, against those that are surely on the front."""
    front, (x, y) = picture.front, (picture.curves[0].x, picture.curves[0].y)
    said = f"The marked {quoted(front.labels[k])} {costs(picture, k)} and is off by {off(picture, k)}"
    if class_of(front.shares[k]) == 0:
        return f"{said}; it is itself surely on the front."
    if np.isnan(front.shares).all():  # of one seed
        return f"{said}."
    better = [j for j in range(len(x)) if class_of(front.shares[j]) == 0 and x[j] <= x[k] and y[j] <= y[k] and (x[j] < x[k] or y[j] < y[k])]
    if not better:
        return f"{said}; no point that is surely on the front is at most as dear and at most as wrong."
    words = [f"{quoted(front.labels[j])}, which {less(x[j], x[k])} and is off by {off(picture, j)}" for j in better]
    return f"{said}; in the means it is beaten by {'; '.join(words)}."


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
        return [f"{said}; no point is off by more, and {quoted(front.labels[cheapest])} is the cheapest."]
    return [f"{said}; {len(within)} of {len(one.y)} points are off by no more: {listed([quoted(front.labels[k]) for k in within])}.",
            f"The cheapest of those {costs(picture, cheapest)}: {quoted(front.labels[cheapest])}."]


def front_words(made: Made, picture: Picture) -> list[str]:
    said = about_front(picture.front) + [about_mark(picture, k) for k in sorted(picture.front.marks)] + about_scatter(picture)
    return [front_table(made, picture), "\n".join(said)]


# ---- of the whole study ----

def column(made: Made, name: str, of: str, head: str, spread: str = "", share: bool = False) -> tuple[str, list[str]]:
    """A column of the table of points: its head with the unit, and its numbers; a `share` in per cent."""
    points, path = made.points, f"{name}.{of}"
    values, errors = points[path], points[f"{name}.{spread}"] if spread else np.full(len(points), math.nan)
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
            columns.append(column(made, name, "error", f"error of {measure.name}", "error.standard_error", measure.kind in SHARES))
    axes = [axis.name for axis in study.axes]
    rows = [[labels[axis] for axis in axes] + [cells[k] for _, cells in columns] + [runs_word(made, k)] for k, labels in enumerate(made.labels)]
    return table(axes + [head for head, _ in columns] + ["runs"], rows)


def one_each(keys: np.ndarray) -> list[int]:
    """The first row of each run."""
    first: dict[str, int] = {}
    for k, key in enumerate(keys):
        first.setdefault(key, k)
    return list(first.values())


def about_ends(made: Made) -> str:
    """How the runs ended; what those say that did not come to their end."""
    runs = made.runs
    alone = one_each(runs["run"])  # a point may be the reference as well
    bad = [k for k in alone if runs["status"][k] != "done"]
    if not bad:
        return f"All {len(alone)} runs came to their end." if len(alone) > 1 else "The run came to its end."
    sentences: dict[str, int] = {}
    for k in bad:
        what = (runs["message"][k].splitlines() or ["not made yet" if runs["status"][k] == "missing" else "no sentence"])[0]
        labels = {} if runs["model"][k] else made.labels[int(runs["point"][k])]
        point = label_of(made, labels, labels)
        line = f"{runs['status'][k]}: {runs['model'][k] or point or made.study.name}: {what}"
        sentences[line] = sentences.get(line, 0) + 1
    rows = [f"- {line}" + (f" ({count} runs)" if count > 1 else "") for line, count in sentences.items()]
    return f"{len(bad)} of {len(alone)} runs did not come to their end:\n\n" + "\n".join(rows)


def about_cost(made: Made) -> str:
    """Processor time, and what the runs' own files say of program and machine."""
    known = [cost for cost in made.runs["cost.processor"][one_each(made.runs["run"])] if math.isfinite(cost)]
    spent = math.fsum(known)
    took = f"{short(spent / 3600)} hours" if spent >= 360 else f"{short(spent)} s"
    least = f", each counted at the least of {made.study.timings} times" * (made.study.timings > 1)
    said = [f"{len(known)} run{'s' * (len(known) != 1)} took {took} of processor time{least}."] if known else []
    programs, machines = {}, {}
    for key in dict.fromkeys(made.runs["run"]):
        told = read_json(made.folder / "runs" / key / "summary.json").get("provenance")
        if isinstance(told, dict):
            words = [told.get("program"), f"commit {told['commit']}" if "commit" in told else "", told.get("compiler")]
            programs[", ".join(word for word in words if isinstance(word, str) and word)] = 1
        machine = read_json(made.folder / "runs" / f"{key}.json").get("machine")
        if isinstance(machine, str):
            machines[machine] = 1
    programs.pop("", None)
    if programs:
        said.append(f"They were made by {'; '.join(programs)}.")
    if machines:
        said.append(f"They ran on {'; '.join(machines)}.")
    return " ".join(said)


def part(made: Made, drawn: dict[str, Picture], page: pathlib.Path) -> str:
    """What stands between the two marks."""
    pieces = []
    for name, picture in drawn.items():
        pieces.append(f"![{cell(picture.title or name)}]({urllib.parse.quote(f'{page.stem}_{name}.svg')})")
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
    save(page, f"{before}{BEGIN}\n{part(made, drawn, page)}\n{END}{after}")
