# SPDX-License-Identifier: MIT
"""Which words of a source count as prose."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

from find_forbidden_words import find_words


@pytest.mark.parametrize(
    ("path", "text", "expected"),
    [
        ("a.f90", "told = .true.\nif (told) x = 1   ! else it was told\n", [(2, "told")]),
        ("a.f90", "text = 'it asks ! for'   !! so many\n", [(1, "asks"), (1, "so many")]),
        ("a.f90", "call tell(level, \"it''s a look\")\n", [(1, "look")]),
        (
            "a.c",
            'tell(1);  /* whatever\n * it goes on */ ask("\\"Tell\\"");\n',
            [(1, "whatever"), (2, "goes on"), (2, "Tell")],
        ),
        ("a.py", 'told = f"{told} of it"  # what of it\n"""One\nthat knows."""\n', [(1, "what of"), (3, "knows")]),
        ("a.txt", "one\nstands\nfor two\n", [(2, "stands\nfor")]),
        ("a.json", "whatever", []),
    ],
)
def test_comments_and_texts_are_checked_and_names_are_not(path, text, expected):
    assert find_words(path, text) == expected
