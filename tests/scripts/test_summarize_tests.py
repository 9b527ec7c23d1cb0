# SPDX-License-Identifier: MIT
"""The end of a test run: table, closing line, exit code."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "summarize_tests.py"

PASSED = '<testcase name="a" status="run"/>'
FAILED = '<testcase name="b" status="fail"><failure message="no"/></testcase>'
SKIPPED = '<testcase name="c" status="notrun"><skipped message="no data"/></testcase>'


@pytest.fixture
def summarize(tmp_path):
    def run(cases, log="", pytest_cases=None):
        (tmp_path / "ctest.xml").write_text(f"<testsuite>{cases}</testsuite>")
        (tmp_path / "ctest.log").write_text(log)
        if pytest_cases is not None:
            (tmp_path / "pytest.xml").write_text(f"<testsuites><testsuite>{pytest_cases}</testsuite></testsuites>")
        return subprocess.run([sys.executable, SCRIPT, tmp_path], capture_output=True, text=True)

    return run


def closing_line(result):
    return result.stdout.splitlines()[-1]


def test_counts_of_both_runners_are_added(summarize):
    result = summarize(PASSED * 3, pytest_cases=PASSED * 2)
    assert closing_line(result) == "5 passed, 0 failed, 0 skipped"
    assert result.returncode == 0


def test_a_failure_fails_the_run(summarize):
    result = summarize(PASSED, pytest_cases=PASSED + FAILED)
    assert closing_line(result) == "2 passed, 1 failed, 0 skipped"
    assert result.returncode == 1


def test_skipped_tests_are_named_apart(summarize):
    result = summarize(PASSED + SKIPPED)
    assert closing_line(result) == "1 passed, 0 failed, 1 skipped"
    assert result.returncode == 0


def test_tests_skipped_inside_one_that_passed_are_counted(summarize):
    log = "\n.\nSKIPPED | built without CHOLMOD\n\nRan 3 tests in 0.1s\n\nOK (skipped=2)\n"
    result = summarize(PASSED * 2, log)
    assert closing_line(result) == "2 passed, 0 failed, 3 skipped"


@pytest.mark.parametrize("cases", ["", SKIPPED])
def test_a_run_without_tests_fails(summarize, cases):
    result = summarize(cases)
    assert closing_line(result) == f"0 passed, 0 failed, {cases.count('<skipped')} skipped"
    assert "no test ran" in result.stdout
    assert result.returncode == 1


def test_results_that_cannot_be_read_are_a_failure(summarize, tmp_path):
    result = summarize(PASSED, pytest_cases="<broken")
    assert closing_line(result) == "1 passed, 1 failed, 0 skipped"
    assert result.returncode == 1


def test_validation_results_are_collected_in_one_table(summarize):
    log = "noise\nVALIDATION | slide | 3.2 | 3.21 | 0.003 | 0.003\nVALIDATION | fall | 1 | 1 | 0 | 1e-9\nmore noise\n"
    lines = summarize(PASSED, log).stdout.splitlines()
    start = lines.index("== Validation")
    assert lines[start + 1].split() == ["case", "computed", "expected", "error", "limit"]
    assert lines[start + 3].split() == ["fall", "1", "1", "0", "1e-9"]
    assert lines[start + 4].split() == ["slide", "3.2", "3.21", "0.003", "0.003"]


@pytest.mark.parametrize("error", ["0.0031", "-0.0031", "NaN", "********"])
def test_an_error_beyond_its_limit_fails_the_run(summarize, error):
    result = summarize(PASSED, f"VALIDATION | slide | 3.2 | 3.21 | {error} | 0.003\n")
    assert closing_line(result) == "1 passed, 1 failed, 0 skipped"
    assert "FAILED" in result.stdout
    assert result.returncode == 1


def test_results_without_a_limit_are_only_shown(summarize):
    result = summarize(PASSED, "VALIDATION | test 1 | 0.21 | 0.093 | 1.26 | -\n")
    assert closing_line(result) == "1 passed, 0 failed, 0 skipped"
    assert "0.093" in result.stdout
