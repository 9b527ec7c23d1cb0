# SPDX-License-Identifier: MIT
"""Which lines the formatter takes for continuations."""

import shutil
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

from format_fortran import continued, find_faults, format_file, keep_continuations


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


@pytest.mark.skipif(shutil.which("fprettify") is None, reason="needs fprettify (scripts/setup --lint)")
def test_a_line_that_is_too_long_is_indented_all_the_same(tmp_path):
    path = tmp_path / "a.f90"
    path.write_text(f"module a\nuse b, only: {'c' * 120}\nend module a\n")
    assert format_file(path)[2] == f"module a\n   use b, only: {'c' * 120}\nend module a\n"


def test_a_comment_of_nothing_and_a_second_use_are_found():
    lines = [
        "! licence",
        "module a",
        "   use c, only : d",
        "   use c",
        "   ! of nothing",
        "",
        "   !> of b",
        "   integer b",
        "",
    ]
    assert [n for n, _ in find_faults(lines)] == [4, 5]
