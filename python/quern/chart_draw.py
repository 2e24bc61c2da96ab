# SPDX-License-Identifier: MIT
"""Pictures of charts, by Matplotlib. Lines differ by colour, and by dash or marker for eyes that do not tell the colours apart."""
import io
import math
import os
import pathlib

import numpy as np

from . import chart_labels, errors
from .chart_data import Curve, Picture
from .program import QuernError
from .table import SURE

# Okabe and Ito's colours but for yellow, which is faint on white, and black, which is the reference's.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES = ("-", (0, (5, 2)), (0, (1.2, 1.6)), (0, (6, 2, 1.2, 2)))
MARKERS = "osD^vP*X<>"
REFERENCE = "black"
STYLE = {"font.family": "DejaVu Sans", "font.size": 9.0, "svg.fonttype": "none", "svg.hashsalt": "quern", "axes.spines.top": False,
         "axes.spines.right": False, "axes.grid": True, "grid.color": "#e6e6e6", "grid.linewidth": 0.6, "axes.axisbelow": True,
         "legend.frameon": False, "axes.titlelocation": "left", "axes.titlesize": 10.0, "lines.linewidth": 1.5, "pdf.fonttype": 42,
         "axes.unicode_minus": True, "axes.formatter.useoffset": False, "figure.dpi": 72}
PREFIXED = {"m", "s", "Pa", "J", "N", "W", "N/m", "J/m"}
PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
MOST_NAMED = 12  # points with their names beside them; more get numbers and a key
MAYBE = 0.05
WIDTH, HEIGHT = 5.2, 3.6  # inches, of the axes
FIGURE_SPACE = "\N{FIGURE SPACE}"  # as wide as a digit
KEY_PITCH = 11.0  # points from line to line
PNG_DPI = 200


def scaled(unit: str, arrays: list[np.ndarray]) -> tuple[float, str]:
    """What to divide by so that numbers stay short, and the unit then."""
    most = max((float(np.max(np.abs(data[np.isfinite(data)]))) for data in arrays if np.isfinite(data).any()), default=0.0)
    if unit not in PREFIXED or most <= 0:
        return 1.0, unit
    power = min(9, max(-9, 3 * math.floor(math.log10(most) / 3 + 1e-9)))
    return 10.0 ** power, PREFIXES[power] + unit


def powers(unit: str) -> str:
    """Powers as letters above the line: text that stays text."""
    return "".join(part if k == 0 else part[:end].translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")) + part[end:]
                   for k, part in enumerate(unit.split("^")) for end in [len(part) - len(part.lstrip("-0123456789"))])


def named(word: str, unit: str) -> str:
    return word if unit in ("1", "") else f"{word} [{powers(unit)}]"


def write_ticks(axis, span: float = 0) -> None:
    """Ticks that are written as people write numbers; `span` is the ratio of the ends of an axis that is logarithmic."""
    from matplotlib import ticker
    plain = ticker.FuncFormatter(lambda value, _: f"{value:g}".replace("-", "\N{MINUS SIGN}"))
    axis.set_major_formatter(plain)
    if span >= 10:
        axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5) if span < 200 else (1,), numticks=30))
    else:  # 1, 2, 5 could all be beyond the ends
        axis.set_major_locator(ticker.MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axis.set_minor_locator(ticker.NullLocator())


def write_powers(axis, low: float, high: float) -> None:
    """Ticks of a logarithmic axis: as people write numbers where there are few powers of ten, else as powers."""
    from matplotlib import ticker
    write_ticks(axis, min(max(high / low, 10), 199 if high / low < 1e3 else math.inf))
    if high / low > 1e4:
        axis.set_major_locator(ticker.LogLocator(numticks=9))
        axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: powers(f"10^{round(math.log10(value))}")))


def style_of(number: int, one: Curve, references: int) -> dict:
    if one.reference:
        return {"color": REFERENCE, "linestyle": DASHES[(references + 1) % 4], "marker": ""}
    return {"color": COLOURS[number % 6], "linestyle": DASHES[number // 6 % 4], "marker": MARKERS[number % 10]}


def draw_lines(axes, picture: Picture, x_by: float, y_by: float) -> None:
    """Lines with a band of one standard error, or two in a chart of scalars, whose points have bars."""
    plain = references = 0
    scalar = picture.kind == "scalar"
    for one in picture.curves:
        style = style_of(plain, one, references)
        references, plain = references + one.reference, plain + (not one.reference)
        x, y = one.x / x_by, one.y / y_by
        spread = None if one.dy is None or not np.isfinite(one.dy).any() else (2 if scalar else 1) * one.dy / y_by
        if spread is not None and (one.reference or not scalar):
            axes.fill_between(x, y - spread, y + spread, color=style["color"], alpha=0.18, linewidth=0)
        if scalar and not one.reference:
            axes.errorbar(x, y, None if spread is None else np.nan_to_num(spread), markersize=5, capsize=2.5, elinewidth=1, label=one.label, **style)
            continue
        there = np.isfinite(y)
        alone = there & ~np.append(there[1:], False) & ~np.append(False, there[:-1])  # a line does not show these
        many = len(x) > 12 and not alone.any()
        axes.plot(x, y, label=one.label, markersize=4, markevery=(plain * max(1, len(x) // 40), max(1, len(x) // 8)) if many else None,
                  drawstyle="steps-post" if picture.kind == "distribution" and not one.straight else "default", **style)


def draw_words(axes, picture: Picture, by: float) -> None:
    """Scalars over words lie: a row for each word reads better than words that stand on end. Lines of one row lie beside each other."""
    lines = [one for one in picture.curves if not one.reference]
    for number, one in enumerate(lines):
        style = style_of(number, one, 0)
        shift = (number - (len(lines) - 1) / 2) * min(0.22, 0.7 / len(lines))
        spread = None if one.dy is None or not np.isfinite(one.dy).any() else 2 * np.nan_to_num(one.dy) / by
        axes.errorbar(one.y / by, one.x + shift, xerr=spread, color=style["color"], marker=style["marker"], linestyle="", markersize=5,
                      capsize=2.5, elinewidth=1, label=one.label)
    for number, one in enumerate(one for one in picture.curves if one.reference):
        dashes = DASHES[(number + 1) % 4]
        for k, (place, value) in enumerate(zip(one.x, one.y / by)):
            axes.plot([value, value], [place - 0.45, place + 0.45], color=REFERENCE, linestyle=dashes, label=one.label if k == 0 else None)
            if one.dy is not None and math.isfinite(one.dy[k]):
                axes.fill_betweenx([place - 0.45, place + 0.45], *(value + side * 2 * one.dy[k] / by for side in (-1, 1)), color=REFERENCE,
                                   alpha=0.12, linewidth=0)
    axes.set_yticks(range(len(picture.words)), picture.words)
    axes.set_ylim(len(picture.words) - 0.5, -0.5)
    axes.grid(axis="y", visible=False)


# ---- beyond limits ----

def draw_ended(axes, picture: Picture) -> None:
    """Crosses where runs were ended; at the top and in the line's colour where nothing was measured before."""
    style = {"linestyle": "", "marker": "x", "markersize": 8, "markeredgewidth": 1.2, "color": "black", "zorder": 4}
    known = [one for one in picture.curves if one.ended is not None]
    for number, one in enumerate(known):
        seen = np.isfinite(one.y)
        axes.plot(one.x[one.ended & seen], one.y[one.ended & seen], **style)
        unseen = one.x[one.ended & ~seen]
        axes.plot(unseen, np.full(len(unseen), 0.97 - 0.035 * number), transform=axes.get_xaxis_transform(),
                  **{**style, "color": style_of(number, one, 0)["color"]})
    if any(one.ended.any() for one in known):
        axes.plot([], [], label="ended by Quern", **style)


def draw_marks(axes, picture: Picture) -> None:
    """Limits as upright lines with their names along them."""
    for at, word in picture.marks:
        axes.axvline(at, color="#444444", linestyle=DASHES[1], linewidth=1, zorder=1.5)
        left = axes.get_xlim()[0] > at - 0.05 * np.ptp(axes.get_xlim())  # no room before it
        axes.annotate(word, (at, 1), (4 if left else -2.5, -3), ("data", "axes fraction"), "offset points", rotation=90,
                      ha="left" if left else "right", va="top", fontsize=8,
                      color="#444444", zorder=5, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85})


def draw_limits(axes, picture: Picture) -> None:
    set_logarithmic(axes, picture)
    if picture.reaches:
        axes.set_ylim(picture.reaches)
    draw_ended(axes, picture)
    draw_marks(axes, picture)


def set_logarithmic(axes, picture: Picture) -> None:
    for axis, scale, bounds in ((axes.xaxis, axes.set_xscale, axes.get_xlim), (axes.yaxis, axes.set_yscale, axes.get_ylim)):
        if axis.axis_name in picture.log:
            scale("log")
            write_powers(axis, *bounds())


# ---- cost against error ----

def class_of(share: float) -> int:
    """0: surely on the front, 1: may be, 2: surely not, 3: nobody knows, of one seed."""
    return 3 if math.isnan(share) else 0 if share >= SURE else 1 if share > MAYBE else 2


CLASSES = (("surely on the front", {"marker": "o", "markersize": 7, "markerfacecolor": "#D55E00", "markeredgecolor": "#D55E00"}),
           ("may be on the front", {"marker": "D", "markersize": 5.5, "markerfacecolor": "#F2BE99", "markeredgecolor": "#D55E00"}),
           ("surely not", {"marker": "o", "markersize": 4.5, "markerfacecolor": "white", "markeredgecolor": "#0072B2"}),
           ("of one seed: not known", {"marker": "s", "markersize": 4.5, "markerfacecolor": "#BBBBBB", "markeredgecolor": "#555555"}))


def x_bars(one: Curve) -> np.ndarray:
    """One standard error to each side; to the left it ends before 0, which a logarithmic axis does not have."""
    dx = np.nan_to_num(one.dx)
    return np.array([np.minimum(dx, 0.9 * one.x), dx])


def draw_front(axes, picture: Picture, y_by: float) -> None:
    """Points with one standard error, the steps of the front of the means, the scatter of the reference."""
    one, front = picture.curves[0], picture.front
    x, y = one.x, one.y / y_by
    if math.isfinite(front.scatter):
        axes.axhspan(0, front.scatter / y_by, color="#999999", alpha=0.18, linewidth=0, label=f"scatter of single runs of {front.reference}")
    if front.relative:
        axes.axvline(1, color=REFERENCE, linestyle=DASHES[2], linewidth=1, label=f"cost of {front.reference}")
    axes.errorbar(x, y, np.nan_to_num(one.dy / y_by), x_bars(one), linestyle="", color="#AAAAAA", elinewidth=0.9, zorder=2)
    on = np.flatnonzero(errors.front(x, y))
    on = on[np.argsort(x[on], kind="stable")]
    axes.step(x[on], y[on], where="post", color="#D55E00", linewidth=0.9, linestyle=DASHES[1], zorder=1.5, label="front of the means")
    for number, (word, style) in enumerate(CLASSES):
        which = [k for k in range(len(x)) if class_of(front.shares[k]) == number]
        if which:
            axes.plot(x[which], y[which], linestyle="", zorder=3, label=word, **style)
    for number, word in enumerate(dict.fromkeys(front.marks.values())):
        which = [k for k, mark in front.marks.items() if mark == word]
        axes.plot(x[which], y[which], linestyle="", marker="s", markersize=13, markerfacecolor="none", markeredgecolor="black",
                  markeredgewidth=1.2, zorder=3.5, label=word)


def extents(figure, axes, texts: list[str]) -> np.ndarray:
    """Sizes of texts in points."""
    renderer, sizes = figure.canvas.get_renderer(), []
    for text in texts:
        trial = axes.text(0, 0, text, fontsize=8)
        box = trial.get_window_extent(renderer)
        sizes.append((box.width, box.height))
        trial.remove()
    return np.array(sizes)


def bars(axes, one: Curve, y_by: float) -> np.ndarray:
    """Boxes of the error bars, upright ones and lying ones."""
    left_right, none, dy = x_bars(one), np.zeros_like(one.x), np.nan_to_num(one.dy)
    found = []
    for (left, right), (down, up) in ((left_right, (none, none)), ((none, none), (dy, dy))):
        ends = [axes.transData.transform(np.column_stack([one.x + across, (one.y + along) / y_by]))
                for across, along in ((-left, -down), (right, up))]
        found.append(np.hstack([ends[0] - 0.5, ends[1] + 0.5]))
    return np.concatenate(found)


def label_points(figure, axes, picture: Picture, y_by: float) -> str:
    """Names beside points; numbers where there are many, and their key is returned."""
    one, front = picture.curves[0], picture.front
    count = len(one.x)
    width = len(str(count))
    texts = [label + share_words(share) for label, share in zip(front.labels, front.shares)]
    if count > MOST_NAMED:
        texts = [str(k + 1) for k in range(count)]
    figure.canvas.draw()
    anchors = axes.transData.transform(np.column_stack([one.x, one.y / y_by]))
    frame = axes.get_window_extent()
    corner = np.array([frame.x0, frame.y0])
    sizes = extents(figure, axes, texts)
    around = np.array([[15.0 if k in front.marks else 9.0] * 2 for k in range(count)])
    covered = [chart_labels.boxes(anchors, around), bars(axes, one, y_by)]
    if front.relative:
        at = axes.transData.transform((1, 0))[0]
        covered.append(np.array([[at - 1, frame.y0, at + 1, frame.y1]]))
    centres = chart_labels.place(anchors, sizes, np.concatenate(covered),
                                 np.array([frame.x0 + 2, frame.y0 + 2, frame.x1, frame.y1]))
    for text, anchor, centre, size in zip(texts, anchors, centres, sizes):
        off = centre - anchor
        anchor, centre = anchor - corner, centre - corner
        edge = np.clip(-off, -size / 2, size / 2) + off  # the place of the text's box that is nearest to the point
        if np.hypot(*edge) > 7:
            leader = {"arrowstyle": "-", "color": "#333333", "linewidth": 0.5}
            axes.annotate("", anchor + edge, anchor, "axes points", "axes points", arrowprops=leader, zorder=2.5)
        axes.annotate(text, anchor, centre, "axes points", "axes points", ha="center", va="center", fontsize=8, zorder=4, annotation_clip=False)
    if count <= MOST_NAMED:
        return ""
    return "\n".join(f"{str(k + 1).rjust(width, FIGURE_SPACE)}  {front.labels[k]}{share_words(front.shares[k])}" for k in range(count))


def percent(share: float) -> str:
    """As exact as a thousand draws are; with a digit more where rounding would make sure what is not."""
    return f"{100 * share:.{0 if class_of(round(share, 2)) == class_of(share) else 1}f} %"


def share_words(share: float) -> str:
    return f" ({percent(share)})" if class_of(share) == 1 else ""


def write_key(figure, axes, key: str, below: float) -> None:
    """Numbers and what they stand for, in a column beside the axes, or two."""
    lines = key.split("\n")
    half = len(lines) if len(lines) <= 40 else math.ceil(len(lines) / 2)
    left = 16.0
    for begin in range(0, len(lines), half):
        part = lines[begin:begin + half]
        for k, line in enumerate(part):
            axes.annotate(line, (1, 1), (left, below - k * KEY_PITCH), "axes fraction", "offset points", fontsize=8, va="top", annotation_clip=False)
        left += float(extents(figure, axes, part)[:, 0].max()) + 14


def size_of(picture: Picture) -> tuple[float, float]:
    if picture.words:
        lines = max(1, sum(not one.reference for one in picture.curves))
        return WIDTH, max(1.2, len(picture.words) * max(0.26, 0.12 * lines + 0.1))
    keyed = len(picture.front.labels) if picture.front else 0
    if keyed > MOST_NAMED:  # as high as the key beside it
        return WIDTH, min(6.5, max(HEIGHT, (120 + KEY_PITCH * keyed) / 72))
    return WIDTH, HEIGHT


def bounds_of_front(axes, picture: Picture, y_by: float) -> None:
    one = picture.curves[0]
    y, dy = one.y / y_by, np.nan_to_num(one.dy / y_by)
    scatter = picture.front.scatter / y_by if math.isfinite(picture.front.scatter) else 0
    left, right = x_bars(one)
    low, high = float((one.x - left).min()), float((one.x + right).max())
    if picture.front.relative:
        low, high = min(low, 1.0), max(high, 1.0)
    if low > 0:  # a clock can find that a short run has cost nothing
        axes.set_xscale("log")
        room = max(1.1, (high / low) ** 0.06)
        axes.set_xlim(low / room, high * room)
    top = 1.12 * max(float((y + dy).max()), scatter) or 1.0
    axes.set_ylim(-0.03 * top, top)
    write_ticks(axes.xaxis, high / low if low > 0 else 0)
    write_ticks(axes.yaxis)


def figure_of(picture: Picture):
    """The figure; call it within the style."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    width, height = size_of(picture)
    figure = Figure(figsize=(width + 2, height + 2))
    FigureCanvasAgg(figure)
    axes = figure.add_axes([1 / (width + 2), 1 / (height + 2), width / (width + 2), height / (height + 2)])
    x_by, x_unit = scaled(picture.x[1], [one.x for one in picture.curves] if not picture.words and not picture.front else [])
    y_by, y_unit = scaled(picture.y[1], [one.y for one in picture.curves])
    key = ""
    if picture.front:
        draw_front(axes, picture, y_by)
        bounds_of_front(axes, picture, y_by)
        key = label_points(figure, axes, picture, y_by)
    elif picture.words:
        draw_words(axes, picture, y_by)
        write_ticks(axes.xaxis)
        set_logarithmic(axes, picture)
    else:
        draw_lines(axes, picture, x_by, y_by)
        axes.margins(x=0.02)
        if picture.kind == "line":
            axes.set_xlim(0, picture.curves[0].x[[0, -1]].sum() / x_by)
        for axis in (axes.xaxis, axes.yaxis):
            write_ticks(axis)
        draw_limits(axes, picture)
    below, across = named(picture.x[0], x_unit), named(picture.y[0], y_unit)
    axes.set_xlabel(across if picture.words else below)
    axes.set_ylabel("" if picture.words else across)
    if picture.title:
        axes.set_title(picture.title, pad=10)
    bottom = write_legend(figure, axes, picture)
    if key:
        write_key(figure, axes, key, bottom - 8)
    return figure


def write_legend(figure, axes, picture: Picture) -> float:
    """Beside the axes, if there is more than one line; returns where it ends, from the top of the axes."""
    known = dict(zip(*reversed(axes.get_legend_handles_labels())))
    whole = picture.front or any(one.ended is not None for one in picture.curves)
    handles = list(known.values()) if whole else [known[one.label] for one in picture.curves if one.label in known]
    if len(handles) < 2 and not picture.front:
        return 0.0
    legend = axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.02), borderaxespad=0, bbox_transform=axes.transAxes,
                         fontsize=8, handlelength=3)
    figure.canvas.draw()
    return legend.get_window_extent().y0 - axes.get_window_extent().y1


def metadata_for(kind: str, about: dict[str, str]) -> dict:
    """Title, Creator (program), Description (command) and Source (study and its hash), as each format calls them; no dates."""
    if kind == "svg":
        return {"Title": about["Title"], "Creator": about["Creator"], "Description": about["Description"], "Source": about["Source"], "Date": None}
    if kind == "png":
        return {"Title": about["Title"], "Software": about["Creator"], "Description": about["Description"], "Source": about["Source"]}
    return {"Title": about["Title"], "Creator": about["Creator"], "Subject": about["Description"], "Keywords": about["Source"], "CreationDate": None,
            "Producer": None}


def save(picture: Picture, paths: list[pathlib.Path], about: dict[str, str]) -> None:
    """The picture in the form that each path ends with: svg, png or pdf; written aside and renamed."""
    try:
        import matplotlib
    except ImportError:
        raise QuernError("charts need Matplotlib (Debian: python3-matplotlib)", 1) from None
    with matplotlib.rc_context({**matplotlib.rcParamsDefault, **STYLE}):
        figure = figure_of(picture)
        for path in paths:
            kind, out = path.suffix[1:], io.BytesIO()
            figure.savefig(out, format=kind, dpi=PNG_DPI if kind == "png" else 72, bbox_inches="tight", pad_inches=0.12,
                           metadata=metadata_for(kind, about))
            aside = path.with_name(f"{path.name}.{os.getpid()}.part")
            aside.write_bytes(out.getvalue())
            aside.replace(path)
