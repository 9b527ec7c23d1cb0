# SPDX-License-Identifier: MIT
"""The limit of stability by a grid and bisection, and the report without such a limit."""

import math
from dataclasses import asdict

import pytest
from rockdda.errors import InputError
from rockdda_validation.case import Comparison
from rockdda_validation.report import _comparisons
from rockdda_validation.report_entry import Entry
from rockdda_validation.thresholds import find_threshold


def halves(low, high):
    return None if high - low <= 1.0 else 0.5 * (low + high)


def whole(many, few):
    return None if many - few <= 1 else (many + few) // 2


def test_a_single_change_is_bisected():
    tried = []

    def stands(angle):
        tried.append(angle)
        return angle >= 37.3

    found = find_threshold(stands, (20.0, 40.0, 60.0, 80.0), halves)
    assert found.bracket[0] < 37.3 <= found.bracket[1]
    assert found.bracket[1] - found.bracket[0] <= 1.0
    assert tried[:4] == [20.0, 40.0, 60.0, 80.0]  # the whole grid: a second change would be seen
    assert found.words("°") == f"between {found.bracket[0]:g} and {found.bracket[1]:g}°"


def test_numbers_of_blocks_fall():
    found = find_threshold(lambda blocks: blocks <= 13, (32, 16, 8, 2), whole)
    assert found.bracket == (14, 13)
    assert found.words("m", lambda blocks: f"{8 / blocks:.3f}") == "between 0.571 and 0.615 m"


@pytest.mark.parametrize(
    ("stands", "words"),
    [
        (lambda x: False, "none of the 4 values tried from 20° to 80° is stable"),
        (lambda x: True, "stable from 20° on, the first of 4 values up to 80°"),
        (lambda x: x == 40, "not monotonic: unstable at 20°; stable at 40°; unstable at 60, 80°"),
        (lambda x: x < 50, "not monotonic: stable at 20, 40°; unstable at 60, 80°"),
    ],
)
def test_no_number_where_there_is_no_single_change(stands, words):
    found = find_threshold(stands, (20, 40, 60, 80), halves)
    assert found.bracket is None
    assert found.words("°") == words


def test_a_cheaper_condition_spares_runs():
    tried = []

    def stands(angle):
        tried.append(angle)
        return angle >= 50.0

    found = find_threshold(stands, (20.0, 40.0, 60.0, 80.0), halves, necessary=lambda angle: angle >= 30.0)
    assert found.bracket[0] < 50.0 <= found.bracket[1]
    assert 20.0 not in tried and 80.0 not in tried and tried[:2] == [40.0, 60.0]
    found = find_threshold(lambda angle: False, (20.0, 40.0), halves, necessary=lambda angle: angle > 30.0)
    assert found.words("°") == "none of the 2 values tried from 20° to 40° is stable"
    with pytest.raises(InputError, match="two values"):
        find_threshold(stands, (20.0,), halves)


def rows_of(comparison: Comparison) -> str:
    """The table of a case with this comparison."""
    return "\n".join(_comparisons(Entry({"identifier": "7.1", "comparisons": [asdict(comparison)]})))


def test_the_report_says_what_is_found_instead_of_a_number():
    table = rows_of(Comparison("limit", math.nan, "°", published=78.0, found="no stable value"))
    assert "| limit | no stable value |" in table and "nan" not in table and "undefined" not in table
    assert "no number" in rows_of(Comparison("limit", math.nan, "°", published=78.0))
