# SPDX-License-Identifier: MIT
"""Elements, numbers and flags of a DDAML file: an XML tree that remembers where everything was, for its messages."""

from __future__ import annotations

import difflib
import functools
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ..deck import number_text
from ..text import read_text, shown
from .report import Report

TOKEN = re.compile(r"[^\s,;]+")


@dataclass
class Word:
    """A piece of text and its place, from 1."""

    text: str
    line: int
    column: int


@dataclass
class Element:
    """An element without its namespace prefix; `words` are the pieces of its own text, split at blanks and commas.

    A semicolon is a word of its own."""

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    children: list[Element] = field(default_factory=list)
    words: list[Word] = field(default_factory=list)


class _EntityFound(Exception):
    pass


def parse_xml(text: str, report: Report) -> Element | None:
    """The root element; None, with errors in the report, when the text is not well-formed.

    Nothing outside the text is read, and entities are refused: no file of DDA for Windows has any."""
    parser = expat.ParserCreate("utf-8")  # the text is decoded already: regardless of the encoding its first line names
    parser.buffer_text = False
    stack: list[Element] = []
    roots: list[Element] = []

    def place() -> tuple[int, int]:
        return parser.CurrentLineNumber, parser.CurrentColumnNumber + 1

    def start(name: str, attributes: dict[str, str]) -> None:
        element = Element(name.rpartition(":")[2], attributes, *place())
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)

    def end(_: str) -> None:
        stack.pop()

    def characters(data: str) -> None:
        if not stack:
            return
        line, column = place()
        for i, part in enumerate(data.split("\n")):
            first = column if i == 0 else 1
            for match in re.finditer(r"[^\s,;]+|;", part):
                stack[-1].words.append(Word(match.group(), line + i, first + match.start()))

    def entity(name: str, *_: object) -> None:
        report.error(f"entity {shown(name)} is declared: entities are not supported", *place())
        raise _EntityFound

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(text.encode(), True)
    except _EntityFound:  # nothing is read any more: they can multiply
        pass
    except expat.ExpatError as error:
        report.error(f"the XML is broken: {expat.ErrorString(error.code)}", error.lineno, error.offset + 1)
    return roots[0] if roots and not report.errors else None


# Keys that files in circulation have instead of the correct one.
ALIASES = {"OCLimit": "Opencloselimit", "Boundarylist": "Boundlist", "Materiallinelist": "Matlinelist"}


LONGEST_NAME = 60  # of elements and attributes that are compared with keys
MOST_ATTRIBUTES = 100
MOST_UNKNOWN = 1000  # names of elements
LARGEST_COUNT = 2**31 - 1  # the program's whole numbers


@functools.lru_cache(maxsize=10_000)
def _nearest_key(name: str, keys: tuple[str, ...]) -> str | None:
    """The key that a name is almost."""
    lower = {key.lower(): key for key in keys}
    near = difflib.get_close_matches(name.lower(), lower, n=1, cutoff=0.8)
    return lower[near[0]] if near else None


class Reader:
    """Reads the elements of one file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._unknown: set[str] = set()
        text = read_text(path)
        self.report = Report(path, text)
        self.root = parse_xml(text, self.report)
        self.report.raise_errors()

    def section(self, name: str) -> Element | None:
        """The child of the root of that name (or the root itself)."""
        assert self.root is not None
        for element in [self.root, *self.root.children]:
            if element.name.lower() == name.lower():
                return element
        return None

    def error(self, message: str, at: Element | Word) -> None:
        """An error at an element or a word."""
        self.report.error(message, at.line, at.column)

    def warning(self, message: str, at: Element | Word) -> None:
        """A warning at an element or a word."""
        self.report.warning(message, at.line, at.column)

    def known(self, element: Element, keys: list[str]) -> str | None:
        """The key of an element; None after a warning when there is none like it."""
        if element.name in keys:
            return element.name
        meant = ALIASES.get(element.name)
        if meant not in keys:
            self._unknown.add(element.name)
            if len(self._unknown) > MOST_UNKNOWN:
                self.report.fail(f"there are more than {MOST_UNKNOWN} unknown elements", element.line, element.column)
            meant = _nearest_key(element.name[:LONGEST_NAME], tuple(keys))
        if meant is None:
            text = f"unknown element {shown(element.name)} is ignored"
        else:
            text = f"unknown element {shown(element.name)} (which DDA for Windows ignores) is taken as {meant!r}"
        self.warning(text, element)
        return meant

    def number(self, word: Word, what: str) -> float:
        """A finite number; 0 after an error."""
        try:
            value = float(word.text.replace("d", "e").replace("D", "e"))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            self.error(f"{what}: expected a number, found {shown(word.text)}", word)
            return 0.0
        return value

    def numbers(self, element: Element, count: int, what: str) -> list[float] | None:
        """The first numbers of an element's text; None after an error."""
        words = [word for word in element.words if word.text != ";"]
        if len(words) < count:
            self.error(f"{what}: expected {count} numbers, found {len(words)} in <{element.name}>", element)
            return None
        if len(words) > count:
            extra = words[count]
            self.warning(f"{what}: text after {count} numbers is ignored", extra)
        return [self.number(word, what) for word in words[:count]]

    def attribute(self, element: Element, name: str) -> str | None:
        """An attribute, or the only one of almost that name (after a warning)."""
        if name in element.attributes:
            return element.attributes[name].strip()
        names = [found for found in element.attributes if len(found) <= LONGEST_NAME][:MOST_ATTRIBUTES]
        near = difflib.get_close_matches(name, names, n=1, cutoff=0.75)
        if near:
            self.warning(f"unknown attribute {near[0]!r} of <{element.name}> is taken as {name!r}", element)
            return element.attributes[near[0]].strip()
        return None

    def value(self, element: Element, name: str) -> float:
        """A number in an attribute; 0 after an error."""
        text = self.attribute(element, name)
        if text is None:
            self.error(f"<{element.name}> has no attribute {name!r}", element)
            return 0.0
        return self.number(Word(text, element.line, element.column), f"{name} of <{element.name}>")

    def whole(self, element: Element, name: str, least: int, most: int = LARGEST_COUNT) -> int:
        """A whole number in an attribute, in a range; `least` after an error."""
        found = self.value(element, name)
        if not found.is_integer() or not least <= found <= most:
            if not self.report.errors or self.report.errors[-1].line != element.line:
                limit = f"of at least {least}" if found < most else f"of at most {most}"
                message = f"{name} of <{element.name}>: expected a whole number {limit}"
                self.error(f"{message}, found {number_text(found)}", element)
            return least
        return int(found)

    def flag(self, element: Element) -> bool:
        """Is the attribute `flag` 'yes'?"""
        text = (self.attribute(element, "flag") or "no").lower()
        if text not in ("yes", "no"):
            self.warning(f"flag of <{element.name}>: {text!r} is taken as 'no'; expected 'yes' or 'no'", element)
        return text == "yes"
