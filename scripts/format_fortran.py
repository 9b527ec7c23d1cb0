#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Indent Fortran files with fprettify, but leave the alignment of continuation lines to their author.

    format_fortran.py [--check] FILE...

With --check nothing is written; files that would change are listed and the exit code is 1. fprettify's own alignment
of continuation lines pushes text to the right margin where it does not fit, which helps nobody.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from pathlib import Path

INDENT = 3


def continued(line):
    """Does the statement go on in the next line?"""
    quote = ""
    code = ""
    for char in line:
        if quote:
            if char == quote:
                quote = ""
        elif char in "'\"":
            quote = char
        elif char == "!":
            break
        code += char
    return code.rstrip().endswith("&")


def indentation(line):
    return len(line) - len(line.lstrip(" "))


def keep_continuations(old, new):
    """The new lines, with continuation lines as they were."""
    result = []
    inside = False
    for before, after in zip(old, new, strict=True):
        result.append(before if inside else after)
        # comments and blank lines may stand between the lines of a statement
        if before.strip() and not before.lstrip().startswith("!"):
            inside = continued(before)
    return result


def format_file(path):
    """(path, text before, text after)"""
    old = path.read_text()
    run = subprocess.run(["fprettify", "--stdout", "--silent", str(path)], capture_output=True, text=True, check=True)
    before, after = old.split("\n"), run.stdout.split("\n")
    if len(before) != len(after):
        raise ValueError(f"{path}: fprettify changes the number of lines")
    kept = keep_continuations(before, after)
    # fprettify moves a line that is too long, or nearly, to the left until it fits: leave it where it is
    lines = [line if indentation(line) % INDENT == 0 else same for same, line in zip(before, kept, strict=True)]
    return path, old, "\n".join(line.rstrip() for line in lines)


def main(arguments):
    check = "--check" in arguments
    paths = [Path(argument) for argument in arguments if argument != "--check"]
    changed = []
    with ThreadPoolExecutor(cpu_count()) as pool:
        for path, old, new in pool.map(format_file, paths):
            if old == new:
                continue
            changed.append(path)
            if not check:
                path.write_text(new)
    for path in changed:
        print(f"{path}: {'layout differs: run scripts/lint --fix' if check else 'laid out'}")
    return 1 if check and changed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
