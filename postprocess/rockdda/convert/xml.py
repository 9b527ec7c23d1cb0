# SPDX-License-Identifier: MIT
"""XML as a tree that remembers where everything was."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from xml.parsers import expat

from ..text import shown
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

    A semicolon is a word of its own.
    """

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

    Nothing outside the text is read, and entities are refused: no file of DDA for Windows has any.
    """
    parser = expat.ParserCreate("utf-8")  # the text is decoded already: whatever encoding its first line names
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
