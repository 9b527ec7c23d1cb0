# SPDX-License-Identifier: MIT
"""The judgements of a model before its run (tests/data/checks/cases.txt): each with input that fails it."""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "data/checks"
MESSAGE = re.compile(r"(?:^|: )(error|warning|note): ")


@dataclass
class Case:
    """A judgement."""

    judged: str
    why: str
    file: str  # from src
    command: str
    files: dict[str, str]
    find: str = ""  # in the message; empty: the first error or warning

    def message(self, program: str) -> tuple[str, str]:
        """The severity and the line that the program prints."""
        with tempfile.TemporaryDirectory() as folder:
            for name, text in self.files.items():
                Path(folder, name).write_bytes(text.encode())
            command = [program, *self.command.split()]
            lines = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False).stderr.splitlines()
        for line in lines:
            found = MESSAGE.search(line)
            if found and self.find in line and (self.find or found[1] != "note"):
                return found[1], line
        raise ValueError(f"{self.judged}: no message with {self.find!r} in\n" + "\n".join(lines))


@dataclass
class Subject:
    """Judgements of one kind."""

    title: str
    command: str
    cases: list[Case] = field(default_factory=list)


def plain(text: str) -> str:
    """A text without escapes."""
    return text.replace("\\n", "\n").replace("\\0", "\0")


def edit(case: Case, line: str) -> None:
    """Carry out one line of a case."""
    if line.startswith("$ "):
        case.command = line[2:]
    elif line.startswith("? "):
        case.find = line[2:]
    else:
        name, kind, text = re.fullmatch(r"(\S+?)(:| \+| =) ?(.*)", line).groups()
        if kind == ":":
            old, new = (plain(part) for part in re.fullmatch(r"(.*?) => ?(.*)", text).groups())
            if old not in case.files[name]:
                raise ValueError(f"{case.judged}: {name} has no {old!r}")
            case.files[name] = case.files[name].replace(old, new, 1)
        else:
            case.files[name] = plain(text) if kind == " =" else case.files[name] + plain(text) + "\n"


def read_subjects() -> list[Subject]:
    """All cases."""
    base = {path.name: path.read_text() for path in FOLDER.iterdir() if path.name != "cases.txt"}
    subjects: list[Subject] = []
    text = (FOLDER / "cases.txt").read_text(encoding="utf-8")
    for line in text[text.index("\n# ") + 1 :].splitlines():
        if line.startswith("# "):
            subjects.append(Subject(*line[2:].split(" | ")))
        elif line.startswith("  "):
            edit(subjects[-1].cases[-1], line[2:])
        elif line:
            subjects[-1].cases.append(Case(*line.split(" | "), subjects[-1].command, dict(base)))
    return subjects


SUBJECTS = read_subjects()
