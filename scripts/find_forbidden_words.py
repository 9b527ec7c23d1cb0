#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Words of speech in comments, messages and help texts, where a technical word says more: see CONTRIBUTING.md.

Checks comments and texts in quotes of Fortran, C and Python, and help texts and templates as a whole.
"""

import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("src", "postprocess/rockdda")
FORBIDDEN = re.compile(
    r"\b(?:tells?|told|asks?|looks?|knows?|goes\s+on|so\s+many|stands?\s+for|whatever|what\s+of)\b", re.IGNORECASE
)
# comments and texts in quotes of each language, whichever begins first; None: all of the file
PROSE = {
    ".f90": re.compile(r"""![^\n]*|'(?:[^'\n]|'')*'|"(?:[^"\n]|"")*\""""),
    ".c": re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL),
    ".txt": None,
    ".nml": None,
}
PROSE[".h"] = PROSE[".c"]


def prose_of_python(text: str) -> Iterator[tuple[int, str]]:
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if tokenize.tok_name[token.type] in ("COMMENT", "STRING", "FSTRING_MIDDLE"):
            # before Python 3.12 a text with fields is one token
            is_field = re.match(r"\w*f", token.string, re.IGNORECASE) and tokenize.tok_name[token.type] == "STRING"
            yield token.start[0], re.sub(r"\{[^{}\n]*\}", "", token.string) if is_field else token.string


def prose(path: str, text: str) -> Iterator[tuple[int, str]]:
    """First line and text of each part that a reader of the program or of its source reads as English."""
    suffix = Path(path).suffix.lower()
    if suffix == ".py":
        yield from prose_of_python(text)
    elif suffix in PROSE:
        pattern = PROSE[suffix]
        if pattern is None:
            yield 1, text
        else:
            yield from ((text.count("\n", 0, part.start()) + 1, part[0]) for part in pattern.finditer(text))


def find_words(path: str, text: str) -> list[tuple[int, str]]:
    """Line and word of each place."""
    found = []
    for line, part in prose(path, text):
        found += [(line + part.count("\n", 0, word.start()), word[0]) for word in FORBIDDEN.finditer(part)]
    return found


def read_texts() -> dict[str, str]:
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *FOLDERS],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.split()
    names = [name for name in listed if Path(name).suffix.lower() in (*PROSE, ".py") and (ROOT / name).exists()]
    return {name: (ROOT / name).read_text(encoding="utf-8") for name in names}


if __name__ == "__main__":
    faults = [
        f"{path}:{line}: write a technical word in place of '{' '.join(word.split())}'"
        for path, text in read_texts().items()
        for line, word in find_words(path, text)
    ]
    if faults:
        print("\n".join(faults))
    sys.exit(1 if faults else 0)
