# SPDX-License-Identifier: MIT
"""Which lines the formatter takes for continuations."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

from format_fortran import continued, keep_continuations


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("x = 1 + &", True),
        ("x = 1 + & ! why", True),
        ("x = 1 ! and so on &", False),
        ("text = 'a ! b' // &", True),
        ("text = 'fish & chips'", False),
        ("text = 'it''s &'", False),
        ("", False),
    ],
)
def test_continued(line, expected):
    assert continued(line) is expected


def test_only_first_lines_of_statements_are_indented():
    before = ["x = f(a, &", "  ! why b", "  b)", "y = 1"]
    after = ["   x = f(a, &", "         ! why b", "         b)", "   y = 1"]
    assert keep_continuations(before, after) == ["   x = f(a, &", "  ! why b", "  b)", "   y = 1"]
