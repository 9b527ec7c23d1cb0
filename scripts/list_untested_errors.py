#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""List the lines that make an error, or leave because of one, which no test has run.

list_untested_errors.py COVERAGE.json     as gcovr writes it
"""

import json
import re
import sys
from pathlib import Path

# A line that makes an error or a message of one ...
MAKES = re.compile(r"\b(make_error|add_context|severity%error|complain|show_error|report_failure|refuse|fail)\b")
# ... or belongs to the lines that follow a test for one.
TESTS = re.compile(
    r"^\s*(else\s+)?if\s*\((.*allocated\(\w*error\w*\)|\.not\. ok|.*(status|info|code)\s*(/=|<)\s*0).*\)\s*then"
)


def handling(lines):
    """Numbers of the lines that handle errors."""
    found = set()
    depth = 0
    for number, line in enumerate(lines, start=1):
        code = line.split("!")[0]
        if MAKES.search(code):
            found.add(number)
        if TESTS.match(code):
            depth = 1
            continue
        if depth and re.match(r"^\s*(end if|else)", code):
            depth = 0
        if depth:
            found.add(number)
    return found


def main(path):
    total = missed = 0
    for file in json.loads(Path(path).read_text())["files"]:
        name = file["file"]
        if not name.endswith((".f90", ".F90")) or not Path(name).is_file():
            continue
        lines = Path(name).read_text().splitlines()
        wanted = handling(lines)
        counts = {}
        for line in file["lines"]:
            number = line["line_number"]
            counts[number] = counts.get(number, 0) + line["count"]
        for number in sorted(wanted & set(counts)):
            total += 1
            if counts[number] == 0:
                missed += 1
                print(f"{name}:{number}: {lines[number - 1].strip()}")
    print(f"{total} lines handle errors, {missed} of them were never run")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
