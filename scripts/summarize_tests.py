#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Print the validation results of a test run and the closing line "N passed, N failed, N skipped".

    summarize_tests.py FOLDER     with ctest.xml, ctest.log and perhaps pytest.xml in it

A test reports a validation result by printing a line

    VALIDATION | case | computed | expected | error | limit

where `error` is measured as `limit` is (relative or absolute, as the case says); a limit of "-" means that the result
is reported only. A Fortran test that returns because something it needs is missing prints a line

    SKIPPED | reason

and counts once more, as skipped; of what unittest skips below ctest, its last line states the number. The exit code is
1 when a test failed, when an error exceeds its limit, or when no test ran.
"""

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

COLUMNS = ("case", "computed", "expected", "error", "limit")


def read_validation(text):
    """Rows of five texts, in the order of the cases' names, each row once."""
    rows = set()
    for line in text.splitlines():
        # pytest and ctest may put something in front of what a test prints
        _, found, rest = line.partition("VALIDATION |")
        cells = tuple(cell.strip() for cell in rest.split("|"))
        if found and len(cells) == len(COLUMNS):
            rows.add(cells)
    return sorted(rows)


def count_marks(text):
    """Tests that ctest counts as a part of one that passed, but that were skipped, in its log."""
    marks = sum("SKIPPED | " in line for line in text.splitlines())
    return marks + sum(map(int, re.findall(r"^(?:OK|FAILED) \(.*\bskipped=(\d+)", text, re.MULTILINE)))


def exceeds_limit(row):
    """Is the error of a row larger than its limit, or no number?"""
    if row[4] == "-":
        return False
    try:
        return not abs(float(row[3])) <= float(row[4])
    except ValueError:
        return True


def format_table(rows):
    marked = [(*row, "FAILED" if exceeds_limit(row) else "") for row in rows]
    table = [(*COLUMNS, ""), *marked]
    widths = [max(len(row[i]) for row in table) for i in range(len(table[0]))]
    lines = []
    for row in table:
        cells = [
            row[0].ljust(widths[0]),
            *(cell.rjust(width) for cell, width in zip(row[1:5], widths[1:5], strict=True)),
            row[5],
        ]
        lines.append("  ".join(cells).rstrip())
    lines.insert(1, "-" * max(len(line) for line in lines))
    return "\n".join(lines)


def count_tests(path):
    """(passed, failed, skipped) of a JUnit file; a file that is missing or broken counts as one failure."""
    try:
        cases = list(ElementTree.parse(path).getroot().iter("testcase"))
    except (OSError, ElementTree.ParseError) as problem:
        print(f"{path.name}: {problem}", file=sys.stderr)
        return 0, 1, 0
    passed = failed = skipped = 0
    for case in cases:
        kinds = {child.tag for child in case}
        if kinds & {"failure", "error"} or case.get("status") == "fail":
            failed += 1
        elif "skipped" in kinds or case.get("status") in ("notrun", "disabled"):
            skipped += 1
        else:
            passed += 1
    return passed, failed, skipped


def main(folder):
    files = [folder / "ctest.xml"]
    if (folder / "pytest.xml").exists():
        files.append(folder / "pytest.xml")
    passed, failed, skipped = (sum(counts) for counts in zip(*map(count_tests, files), strict=True))

    text = (folder / "ctest.log").read_text(errors="replace") if (folder / "ctest.log").exists() else ""
    skipped += count_marks(text)
    rows = read_validation(text)
    if rows:
        print("\n== Validation")
        print(format_table(rows))
    beyond = sum(map(exceeds_limit, rows))
    if beyond:
        print(f"\n{beyond} validation result(s) beyond the limit, each counted as a failed test")
        failed += beyond
    if passed + failed == 0:
        print("no test ran")
    print(f"\n{passed} passed, {failed} failed, {skipped} skipped")
    return 1 if failed or passed == 0 else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1])))
