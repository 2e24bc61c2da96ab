# SPDX-License-Identifier: MIT
"""quern chart - the charts of a study, or of runs without one. docs/charts.md is the page about it."""
import argparse
import hashlib
import pathlib
import shlex
import sys
from typing import NoReturn

from . import page
from .chart_data import FROM_RUNS, Group, Picture, as_csv, of_tables, told
from .chart_draw import save
from .chart_form import METRES, Chart
from .chart_study import Made, picture_of, read_made
from .program import QuernError, call, sentence_of
from .reader import QUANTITY, StudyError
from .study import Study, read
from .workers import save as save_text

USAGE = "quern chart STUDY.yaml [OPTION]...\n" \
    "       quern chart RUN... (--series A[,B] | --profile LABEL.COLUMN | --line FIELD | --distribution FIELD) [OPTION]...\n" \
    "       quern chart FILE.csv... --table X,Y[,Y] [OPTION]..."
FORMATS = (".svg", ".png", ".pdf")


class Parser(argparse.ArgumentParser):
    """Help and faults in the form that the other commands have."""

    def error(self, message: str) -> NoReturn:
        print(f"quern chart: {message}\nusage: {USAGE}; see quern chart --help", file=sys.stderr)
        sys.exit(1)


def arguments(words: list[str] | None) -> argparse.Namespace:
    parser = Parser(prog="quern chart", usage=USAGE, add_help=False,
                    formatter_class=lambda prog: argparse.HelpFormatter(prog, max_help_position=30, width=200))
    parser.add_argument("what", metavar="WHAT", nargs="+",
                        help="a study (.yaml) whose charts are drawn, folders of runs, or tables (.csv); docs/charts.md")
    parser.add_argument("-o", "--output", metavar="PATH",
                        help="of a study its folder, default: out/NAME; of runs and tables the picture, .svg, .png or .pdf, default: chart.svg")
    parser.add_argument("--only", metavar="NAME", help="of a study: draw this chart alone")
    parser.add_argument("--series", metavar="A[,B]", help="columns of series.csv over time")
    parser.add_argument("--profile", metavar="LABEL.COLUMN", help="all slabs of an observer such as profile.density")
    parser.add_argument("--line", metavar="FIELD", help="a field along a line --from --to")
    parser.add_argument("--distribution", metavar="FIELD", help="which share of grains or points is at or below each value")
    parser.add_argument("--table", metavar="X,Y[,Y]", help="columns of tables, such as those of quern drive, over another")
    parser.add_argument("--frame", metavar="K", type=int, default=-1, help="the frame, counted from 0; default: the last")
    parser.add_argument("--from", dest="begin", metavar="X,Y[,Z]", help="where the line begins, in m or with units: 10mm,0")
    parser.add_argument("--to", dest="end", metavar="X,Y[,Z]", help="where it ends")
    parser.add_argument("--width", metavar="W", help="what lies within half of this beside the line counts; default: a fiftieth of its length")
    parser.add_argument("--bins", metavar="N", type=int, default=40, help="along the line; default: 40")
    parser.add_argument("--title", metavar="TEXT", default="", help="above the chart")
    parser.add_argument("-h", "--help", action="help", help="this text")
    found = parser.parse_args(merged(sys.argv[1:] if words is None else words))
    check(parser, found)
    return found


def merged(words: list[str]) -> list[str]:
    """`--from -1,0` as `--from=-1,0`: a place may begin with a minus."""
    found = list(words)
    for option in ("--from", "--to"):
        if option in found[:-1]:
            k = found.index(option)
            found[k:k + 2] = [f"{option}={found[k + 1]}"]
    return found


def kinds_of(options: argparse.Namespace) -> list[str]:
    return [kind for kind in (*FROM_RUNS, "table") if getattr(options, kind)]


def check(parser: Parser, options: argparse.Namespace) -> None:
    """What does not go together."""
    kinds = kinds_of(options)
    if len(kinds) > 1:
        parser.error(f"give one of --{' and --'.join(kinds)}, not {'both' if len(kinds) == 2 else 'all'}")
    if not kinds and len(options.what) > 1:
        parser.error("give one study, or runs with --series, --profile, --line or --distribution")
    if not kinds and pathlib.Path(options.what[0]).is_dir():
        parser.error(f"{options.what[0]} is a folder; say what of the run to draw by --series, --profile, --line or --distribution")
    if options.only and kinds:
        parser.error("--only names a chart of a study; runs have one chart")
    if options.line and not (options.begin and options.end):
        parser.error("--line needs --from X,Y and --to X,Y")
    if not 1 <= options.bins <= 10_000:
        parser.error(f"--bins {options.bins}: give a whole number between 1 and 10000")
    if kinds and options.output and pathlib.Path(options.output).suffix not in FORMATS:
        parser.error(f"-o {options.output}: the picture's name must end with .svg, .png or .pdf")


def length(parser_word: str, text: str) -> float:
    match = QUANTITY.fullmatch(text.strip())
    if not match or (match[2] or "") not in METRES:
        raise QuernError(f"{parser_word}: '{text}' is no length such as 0.1 or 10mm")
    return float(match[1]) * METRES[match[2] or ""]


def place(word: str, text: str) -> tuple[float, ...]:
    parts = text.split(",")
    if len(parts) not in (2, 3):
        raise QuernError(f"{word} {text}: a place is X,Y or X,Y,Z")
    return tuple(length(word, part) for part in parts)


# ---- what the files say of themselves ----

def digest(path: pathlib.Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def about(words: list[str], title: str, source: str) -> dict[str, str]:
    """Metadata of a picture. Where it was put is not told: the same table gives the same bytes."""
    kept, skip = [], False
    for word in words:
        if not skip and not word.startswith(("-o", "--output")):
            kept.append(word)
        skip = word in ("-o", "--output")
    return {"Title": title, "Creator": call(["--version"]).stdout.strip(), "Description": shlex.join(["quern", "chart", *kept]), "Source": source}


def warn(text: str) -> None:
    print(f"quern chart: warning: {text}", file=sys.stderr)


# ---- of runs ----

def labels_of(paths: list[str]) -> list[str]:
    """Folders by their own names, or as they were given where two would be the same."""
    names = [pathlib.Path(path).resolve().name for path in paths]
    return names if len(set(names)) == len(names) else paths


def chart_of_runs(options: argparse.Namespace, words: list[str]) -> int:
    kind = kinds_of(options)[0]
    what, at = getattr(options, kind), options.frame
    chart = Chart(kind, kind, options.title, field=what, frame=options.frame, bins=options.bins)
    groups = [Group(label, [pathlib.Path(path)]) for label, path in zip(labels_of(options.what), options.what)]
    if kind == "line":
        chart.ends = place("--from", options.begin), place("--to", options.end)
        size = sum((a - b) ** 2 for a, b in zip(*chart.ends)) ** 0.5
        if size == 0 or len(chart.ends[0]) != len(chart.ends[1]):
            raise QuernError("--from and --to must be two places with as many coordinates")
        chart.width = length("--width", options.width) if options.width else size / 50
    if kind == "profile":
        chart.column = what if "*" in what else f"{what}_*"
    pictures = []
    for column in what.split(",") if kind == "series" else [""]:
        chart.column = column or chart.column
        pictures.append(FROM_RUNS[kind](chart, groups, at))
    notes = told([note for one in pictures for note in one.notes])
    if not any(one.curves for one in pictures):
        raise QuernError("\n".join(notes) or "there is nothing to draw", 2)
    for note in notes:
        warn(note)
    picture, *others = [one for one in pictures if one.curves]
    for one in picture.curves if others else ():
        one.label = f"{one.label}, {picture.y[0]}"
    for other in others:
        join(picture, other)
    return saved(picture, what, options, words)


def saved(picture: Picture, what: str, options: argparse.Namespace, words: list[str]) -> int:
    output = pathlib.Path(options.output or "chart.svg")
    save(picture, [output], about(words, options.title or what, ", ".join(options.what)))
    print(output)
    return 0


def chart_of_tables(options: argparse.Namespace, words: list[str]) -> int:
    columns = options.table.split(",")
    if len(columns) < 2:
        raise QuernError(f"--table {options.table}: give two columns or more, X,Y")
    tables = dict(zip(labels_of(options.what), map(pathlib.Path, options.what)))
    return saved(of_tables(tables, columns, options.title), options.table, options, words)


def join(picture: Picture, other: Picture) -> None:
    """Two columns in one chart: they must have one unit."""
    if other.y[1] != picture.y[1]:
        raise QuernError(f"{picture.y[0]} is in '{picture.y[1]}' and {other.y[0]} in '{other.y[1]}'; draw a chart for each")
    for one in other.curves:
        one.label = f"{one.label}, {other.y[0]}"
    picture.curves += other.curves
    picture.y = f"{picture.y[0]}, {other.y[0]}", picture.y[1]


# ---- of a study ----

def tell_missing(made: Made, path: str) -> None:
    """Runs that are not in the table, or did not come to their end."""
    counts = {word: int((made.runs["status"] == word).sum()) for word in dict.fromkeys(made.runs["status"])}
    if counts.get("missing"):
        warn(f"{counts['missing']} of {len(made.runs)} runs are missing; quern sweep {path} makes them")
    ended = [f"{n} {word}" for word, n in sorted(counts.items()) if word not in ("done", "missing")]
    if ended:
        warn(f"of {len(made.runs)} runs {', '.join(ended)}; their sentences are in {made.folder / 'table.csv'}")


def draw_chart(made: Made, chart: Chart, folder: pathlib.Path, words: list[str], source: str) -> Picture | None:
    picture = picture_of(made, chart)
    for note in told(picture.notes):
        warn(f"{chart.name}: {note}")
    if not picture.curves:
        warn(f"{chart.name}: there is nothing to draw")
        return None
    save(picture, [folder / f"{chart.name}.svg", folder / f"{chart.name}.png"], about(words, chart.title or chart.name, source))
    save_text(folder / f"{chart.name}.csv", as_csv(picture))
    return picture


def charts_of_study(study: Study, options: argparse.Namespace, words: list[str]) -> int:
    if not study.charts:
        raise QuernError(f"{options.what[0]} asks for no charts; list them under 'charts:', as docs/charts.md says", 2)
    names = [chart.name for chart in study.charts]
    if options.only and options.only not in names:
        raise QuernError(f"--only {options.only}: no chart is called so; charts: {', '.join(names)}")
    folder = pathlib.Path(options.output or pathlib.Path("out") / study.name).resolve()
    made = read_made(study, folder)
    tell_missing(made, options.what[0])
    if study.page:
        page.split(study.page)  # before anything is drawn
    (folder / "charts").mkdir(exist_ok=True)
    source = f"{study.path.name} sha256:{digest(study.path)}, points.csv sha256:{digest(folder / 'points.csv')}"
    drawn = {}
    for chart in study.charts:
        if not options.only or chart.name == options.only:
            picture = draw_chart(made, chart, folder / "charts", words, source)
            if picture:
                drawn[chart.name] = picture
    if study.page and not options.only:
        page.write(made, drawn)
    print(f"{len(drawn)} chart{'s' * (len(drawn) != 1)}; {folder / 'charts'}")
    return 0 if drawn else 2


def main(words: list[str] | None = None) -> int:
    words = sys.argv[1:] if words is None else words
    options = arguments(words)
    try:
        if options.table:
            return chart_of_tables(options, words)
        if kinds_of(options):
            return chart_of_runs(options, words)
        return charts_of_study(read(pathlib.Path(options.what[0]), options.what[0]), options, words)
    except StudyError as faults:
        count = len(str(faults).splitlines())
        print(f"{faults}\nquern chart: {count} fault{'s' * (count != 1)} in {options.what[0]}", file=sys.stderr)
        return 2
    except QuernError as error:
        print(f"quern chart: error: {error}", file=sys.stderr)
        return error.status
    except OSError as error:
        print(f"quern chart: error: {sentence_of(error)}", file=sys.stderr)
        return 4
