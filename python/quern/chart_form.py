# SPDX-License-Identifier: MIT
"""What a study says of its charts and its page: `charts` and `page`. docs/charts.md says what may stand there."""
import dataclasses
import pathlib
import re
from dataclasses import dataclass

import yaml

from .reader import Reader, kind, nearest

COMMON = ("name", "kind", "title", "where")
KINDS = {"front": ("measure", "mark", "relative_cost"), "scalar": ("measure", "over", "by"), "series": ("column", "by"),
         "profile": ("measure", "by"), "distribution": ("field", "by", "frame"),
         "line": ("field", "from", "to", "width", "bins", "frame", "zone", "by")}
NEEDS = {"front": ("measure",), "scalar": ("measure", "over"), "series": ("column",), "profile": ("measure",), "distribution": ("field",),
         "line": ("field", "from", "to", "width")}
METRES = {"": 1, "m": 1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "km": 1e3}
ZONES = ("discrete", "hybrid", "continuum")
MOST_BINS = 10_000


@dataclass
class Chart:
    name: str
    kind: str
    title: str = ""
    measure: str = ""
    column: str = ""
    field: str = ""
    over: str = ""
    by: tuple[str, ...] = ()
    where: dict[str, str] = dataclasses.field(default_factory=dict)  # axis: label
    mark: dict[str, str] = dataclasses.field(default_factory=dict)
    relative_cost: bool = False
    frame: int = -1
    ends: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())  # m
    width: float = 0.0  # m
    bins: int = 20
    zone: str = ""


def read_axis(reader: Reader, node: yaml.Node, where: str, study) -> str:
    names = [axis.name for axis in study.axes]
    word = reader.text(node, where, "the name of an axis")
    if word and word not in names:
        reader.fault(node, f"{where}: no axis is called '{word}'{nearest(word, names, 'axes: ') if names else '; the study has no axes'}")
        return ""
    return word


def read_by(reader: Reader, node: yaml.Node, where: str, study) -> tuple[str, ...]:
    """One axis or a list; `model` is the reference and the points, which stand beside each other anyway."""
    nodes = node.value if isinstance(node, yaml.SequenceNode) and node.value else [node]
    words = [read_axis(reader, item, where, study) for item in nodes if not (isinstance(item, yaml.ScalarNode) and item.value == "model")]
    return tuple(word for word in words if word)


def read_places(reader: Reader, node: yaml.Node, where: str, study) -> dict[str, str]:
    """AXIS: VALUE for some axes, values as the axis spells them."""
    found, labels = {}, {axis.name: [value.label for value in axis.values] for axis in study.axes}
    for name, (at, value) in reader.mapping(node, where).items():
        word = reader.text(value, f"{where}.{name}", "a value of the axis")
        if name not in labels:
            reader.fault(at, f"{where}: no axis is called '{name}'{nearest(name, labels, 'axes: ') if labels else '; the study has no axes'}")
        elif word and labels[name] and word not in labels[name]:
            reader.fault(value, f"{where}.{name}: the axis has no value '{word}'{nearest(word, labels[name], 'values: ')}")
        elif word:
            found[name] = word
    return found


def read_measure(reader: Reader, node: yaml.Node, what: str, study) -> str:
    """The name of a measure that this kind of chart can show."""
    word, known = reader.text(node, "charts.measure", "the name of a measure"), {one.name: one for one in study.measures}
    if not word or word not in known:
        if word:
            others = nearest(word, known, "measures: ") if known else "; the study has no measures"
            reader.fault(node, f"charts.measure: no measure is called '{word}'{others}")
        return word
    one = known[word]
    if what == "scalar" and not one.single:
        reader.fault(node, f"charts.measure: '{word}' is many numbers for each run; kind scalar draws one, such as 'at: last' of one column")
    if what == "profile" and (not one.vector or one.at == "every"):
        reader.fault(node, f"charts.measure: '{word}' is no profile; that is a series such as 'profile.density_*' at one time")
    if what == "front" and one.source == "cost":
        reader.fault(node, f"charts.measure: '{word}' is a cost, which has no error; name a measure that is a result")
    if what == "front" and not study.reference:
        reader.fault(node, "charts.measure: a front is of cost and error, and there is no error without a 'reference' of the study")
    return word


def read_yes(reader: Reader, node: yaml.Node, where: str) -> bool:
    return reader.choice(node, where, ("yes", "no", "true", "false")) in ("yes", "true")


def read_frame(reader: Reader, node: yaml.Node) -> int:
    words = {"last": -1, "first": 0}
    text = node.value if isinstance(node, yaml.ScalarNode) else ""
    return words[text] if text in words else frame_number(reader, node, text)


def frame_number(reader: Reader, node: yaml.Node, text: str) -> int:
    if re.fullmatch(r"\d{1,9}", text):
        return int(text)
    reader.fault(node, f"charts.frame must be first, last or the number of a frame, not {kind(node)}")
    return -1


def read_length(reader: Reader, node: yaml.Node, where: str) -> float:
    got = reader.quantity(node, where)
    if got and got[1] not in METRES:
        reader.fault(node, f"{where} is in '{got[1]}'; it must be a length in m, cm, mm, um or km")
    return got[0] * METRES.get(got[1], 1) if got else 0.0


def read_end(reader: Reader, node: yaml.Node, where: str) -> tuple[float, ...]:
    items = reader.items(node, where, "two or three lengths, [X, Y] or [X, Y, Z]")
    if items and len(items) not in (2, 3):
        reader.fault(node, f"{where} must have two lengths, or three in 3-D, not {len(items)}")
    return tuple(read_length(reader, item, where) for item in items)


def read_field(reader: Reader, node: yaml.Node) -> str:
    text = reader.text(node, "charts.field", "a field of frames such as grain.radius")
    if text and not re.fullmatch(r"(grain|point|cell)\.\w+(\.[xyz])?", text):
        reader.fault(node, f"charts.field: '{text}' is no field of grains, points or cells, such as grain.radius or point.velocity.x")
    return text


def read_line(reader: Reader, parts: dict, chart: Chart) -> None:
    ends = [read_end(reader, parts[key], f"charts.{key}") if key in parts else () for key in ("from", "to")]
    if {len(end) for end in ends} == {2, 3}:
        reader.fault(parts["to"], f"charts.to has {len(ends[1])} lengths and charts.from {len(ends[0])}; both are places in one space")
    elif all(ends) and ends[0] == ends[1]:
        reader.fault(parts["to"], "charts.to is the place of charts.from; a line needs two")
    chart.ends = ends[0], ends[1]
    if "width" in parts:
        chart.width = read_length(reader, parts["width"], "charts.width")
        if chart.width <= 0:
            reader.fault(parts["width"], "charts.width must be above 0: what lies within half of it beside the line counts")
    if "bins" in parts:
        chart.bins = reader.whole(parts["bins"], "charts.bins", 1, MOST_BINS)
    if "zone" in parts:
        chart.zone = reader.choice(parts["zone"], "charts.zone", ZONES)


def read_axes(reader: Reader, node: yaml.Node, parts: dict, chart: Chart, study) -> None:
    """over, by, where and mark; every axis that varies has its place, so that nothing is averaged over unasked."""
    if "over" in parts:
        chart.over = read_axis(reader, parts["over"], "charts.over", study)
    chart.where = read_places(reader, parts["where"], "charts.where", study) if "where" in parts else {}
    chart.mark = read_places(reader, parts["mark"], "charts.mark", study) if "mark" in parts else {}
    free = [axis.name for axis in study.axes if len(axis.values) > 1 and axis.name not in (chart.over, *chart.where)]
    chart.by = read_by(reader, parts["by"], "charts.by", study) if "by" in parts else tuple(free)
    left = [name for name in free if name not in chart.by]
    if left and "by" in parts:
        reader.fault(parts["by"], f"charts.by leaves out {', '.join(left)}; add it, or fix it by 'where: {{{left[0]}: VALUE}}'")
    if chart.over and chart.over in chart.by:
        reader.fault(parts["by"], f"charts.by: '{chart.over}' is what the chart goes over; it cannot tell the lines apart as well")


def read_chart(reader: Reader, node: yaml.Node, study) -> Chart | None:
    found = reader.mapping(node, "charts", (*COMMON, "kind", *dict.fromkeys(key for keys in KINDS.values() for key in keys)))
    reader.require(node, found, "charts: ", {"name": "by which its files are called", "kind": f"one of {', '.join(KINDS)}"})
    parts = {key: value for key, (_, value) in found.items()}
    if "kind" not in parts or "name" not in parts:
        return None
    name = reader.text(parts["name"], "charts.name", "a word")
    if name and not re.fullmatch(r"\w[\w-]*", name):
        reader.fault(parts["name"], f"charts.name: '{name}' must be a word of letters, digits, '-' and '_': files are called so")
    what = reader.choice(parts["kind"], "charts.kind", tuple(KINDS))
    if what not in KINDS:
        return None
    for key in parts:
        if key not in COMMON and key not in KINDS[what]:
            reader.fault(found[key][0], f"charts: a chart of kind {what} has no '{key}'; it has {', '.join(KINDS[what])}")
    for key in NEEDS[what]:
        if key not in parts and reader.clean:
            reader.fault(node, f"charts: a chart of kind {what} needs '{key}'")
    chart = Chart(name, what)
    chart.title = reader.text(parts["title"], "charts.title") if "title" in parts else ""
    chart.measure = read_measure(reader, parts["measure"], what, study) if "measure" in parts else ""
    chart.column = reader.text(parts["column"], "charts.column", "a column of series.csv such as runout.front") if "column" in parts else ""
    chart.field = read_field(reader, parts["field"]) if "field" in parts else ""
    chart.frame = read_frame(reader, parts["frame"]) if "frame" in parts else -1
    chart.relative_cost = read_yes(reader, parts["relative_cost"], "charts.relative_cost") if "relative_cost" in parts else False
    if chart.relative_cost and study.closed:
        reader.fault(parts["relative_cost"], "charts.relative_cost: the reference is a closed form, which costs nothing; leave 'relative_cost' out")
    read_line(reader, parts, chart)
    read_axes(reader, node, parts, chart, study)
    return chart


def read_charts(reader: Reader, node: yaml.Node, study) -> list[Chart]:
    charts, names = [], set()
    for item in reader.items(node, "charts", "charts, {name: ..., kind: ...}"):
        chart = read_chart(reader, item, study)
        if chart and chart.name in names:
            reader.fault(item, f"charts: the name '{chart.name}' is taken already")
        if chart:
            names.add(chart.name)
            charts.append(chart)
    return charts


def read_page(reader: Reader, node: yaml.Node, folder: pathlib.Path) -> pathlib.Path | None:
    found = reader.mapping(node, "page", ("file",))
    reader.require(node, found, "page: ", {"file": "the page that the charts and their words are written into"})
    if "file" not in found:
        return None
    text = reader.text(found["file"][1], "page.file", "the path of a page")
    if text and not (folder / text).is_file():
        reader.fault(found["file"][1], f"page.file: there is no page {text}; paths begin at the folder of the study")
    return folder / text
