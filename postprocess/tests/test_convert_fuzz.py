# SPDX-License-Identifier: MIT
"""A short slice of the fuzzer; fuzz_convert.py runs more."""

import pytest
from fuzz_convert import KINDS, run_case


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_input_ends_soon_as_done_or_bad_input(kind, tmp_path):
    for number in range(25):
        folder = tmp_path / str(number)
        folder.mkdir()
        assert run_case(kind, number, folder) is None, number
