# SPDX-License-Identifier: MIT
"""YAML with the place of everything: faults are collected, each with line and column, and told all at once."""
import difflib
import json
import math
import re

import yaml

QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s*([A-Za-z%].*))?")
Sets = tuple[str, ...]  # key=value, as --set takes it


def number_label(label: str) -> tuple[float, str] | None:
    """Number and unit of a label, such as 8 mm; None of a word. A blank stands between the two: 2D is a word."""
    match = re.fullmatch(r"(\S+)(?: (\S.*))?", label)
    number = match and QUANTITY.fullmatch(match[1])
    if not number or number[2] or not math.isfinite(float(number[1])):
        return None
    return float(number[1]), match[2] or "1"


class StudyError(Exception):
    """All faults of a study, a line each."""


class Reader:
    """Collects faults with their places."""

    def __init__(self, name: str):
        self.name, self.faults = name, []
        self.clean = True  # the last mapping had no fault: what is missing in it is not only misspelt

    def fault(self, node: yaml.Node, text: str) -> None:
        mark = node.start_mark
        self.faults.append((mark.line, mark.column, f"{self.name}:{mark.line + 1}:{mark.column + 1}: error: {text}"))

    def mapping(self, node: yaml.Node, where: str, known: tuple[str, ...] = ()) -> dict[str, tuple[yaml.Node, yaml.Node]]:
        """Key and value by name; unknown and repeated keys are faults."""
        found, before = {}, len(self.faults)
        if not isinstance(node, yaml.MappingNode):
            self.fault(node, f"{where} must be a mapping, KEY: VALUE, not {kind(node)}")
            self.clean = False
            return found
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or not key.value:
                self.fault(key, f"{where}: a key must be a word")
            elif key.value in found:
                self.fault(key, f"{where}: '{key.value}' stands here twice, first in line {found[key.value][0].start_mark.line + 1}")
            elif known and key.value not in known:
                self.fault(key, f"{where}: unknown key '{key.value}'{nearest(key.value, known)}")
            else:
                found[key.value] = (key, value)
        self.clean = len(self.faults) == before
        return found

    def require(self, node: yaml.Node, found: dict, where: str, keys: dict[str, str]) -> None:
        """Directly after `mapping`: keys that must be there, each with what it is, or nothing."""
        if self.clean:
            for key, what in keys.items():
                if key not in found:
                    self.fault(node, f"{where}'{key}' is missing" + (f", {what}" if what else ""))

    def text(self, node: yaml.Node, where: str, what: str = "a text") -> str:
        if isinstance(node, yaml.ScalarNode) and node.value:
            return node.value
        self.fault(node, f"{where} must be {what}, not {kind(node)}")
        return ""

    def choice(self, node: yaml.Node, where: str, words: tuple[str, ...]) -> str:
        word = self.text(node, where, f"one of {', '.join(words)}")
        if word and word not in words:
            self.fault(node, f"{where}: '{word}' is none of {', '.join(words)}{nearest(word, words, '')}")
        return word

    def whole(self, node: yaml.Node, where: str, least: int, most: int) -> int:
        text = node.value if isinstance(node, yaml.ScalarNode) else ""
        if re.fullmatch(r"\d{1,18}", text) and least <= int(text) <= most:
            return int(text)
        self.fault(node, f"{where} must be a whole number between {least} and {most}, not {kind(node)}")
        return least

    def quantity(self, node: yaml.Node, where: str) -> tuple[float, str] | None:
        match = isinstance(node, yaml.ScalarNode) and QUANTITY.fullmatch(node.value)
        if match and math.isfinite(float(match[1])):
            return float(match[1]), match[2] or ""
        self.fault(node, f"{where} must be a number, with a unit if it has one, not {kind(node)}")
        return None

    def items(self, node: yaml.Node, where: str, what: str) -> list[yaml.Node]:
        if isinstance(node, yaml.SequenceNode) and node.value:
            return node.value
        self.fault(node, f"{where} must be a list of {what}, not {kind(node)}")
        return []


def kind(node: yaml.Node) -> str:
    if isinstance(node, yaml.ScalarNode):
        return f"'{node.value}'" if node.value else "nothing"
    word = "mapping" if isinstance(node, yaml.MappingNode) else "list"
    return f"a {word}" if node.value else f"an empty {word}"


def nearest(word: str, known, otherwise: str = "keys: ") -> str:
    near = difflib.get_close_matches(word, known, 1)
    return f"; did you mean '{near[0]}'?" if near else f"; {otherwise}{', '.join(known)}" if otherwise else ""


def flow(node: yaml.Node, within: bool = False) -> str:
    """A value in one line, as --set takes it, its words as they stand in the file; `within` a list or a mapping some need quotes."""
    if isinstance(node, yaml.SequenceNode):
        return "[" + ", ".join(flow(item, True) for item in node.value) + "]"
    if isinstance(node, yaml.MappingNode):
        return "{" + ", ".join(f"{flow(key, True)}: {flow(value, True)}" for key, value in node.value) + "}"
    if "\n" in node.value:
        return json.dumps(node.value)
    if node.style in ("'", '"', "|", ">") or within and re.search(r"[,\[\]{}]", node.value):
        return "'" + node.value.replace("'", "''") + "'"
    return node.value or "null"


def is_path(key: str) -> bool:
    return not re.search(r"[=\s]|^\.|\.$|\.\.", key)


def read_sets(reader: Reader, node: yaml.Node, where: str) -> Sets:
    sets = []
    for key, (at, value) in reader.mapping(node, where).items():
        if key == "seed":
            reader.fault(at, f"{where}: seeds are set by 'repeats: {{seeds: ...}}'")
        elif not is_path(key):
            reader.fault(at, f"{where}: '{key}' is no path of a key such as time.end")
        else:
            sets.append(f"{key}={flow(value)}")
    return tuple(sets)


def compose(path, name: str) -> yaml.Node:
    """The file as a tree of nodes; StudyError where it is none. Aliases are refused: they can stand for more than any memory holds."""
    try:
        text = path.read_text(encoding="utf-8")
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent):
                mark = event.start_mark
                raise StudyError(f"{name}:{mark.line + 1}:{mark.column + 1}: error: an alias, *{event.anchor}, is not taken here; write out what it stands for")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except (OSError, UnicodeDecodeError, yaml.reader.ReaderError) as why:
        what = why.strerror if isinstance(why, OSError) else "it is not text in UTF-8"
        raise StudyError(f"{name}: error: cannot be read: {what}") from None
    except yaml.MarkedYAMLError as why:
        mark = why.problem_mark or why.context_mark
        raise StudyError(f"{name}:{mark.line + 1}:{mark.column + 1}: error: not valid YAML: {why.problem}") from None
    except RecursionError:
        raise StudyError(f"{name}: error: lists and mappings stand in each other too deep") from None
    if root is None:
        raise StudyError(f"{name}: error: the study is empty; begin it with 'study: 1' and 'base: SCENE.yaml'")
    return root
