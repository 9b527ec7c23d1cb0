#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Indent Fortran files with fprettify, but leave the alignment of continuation lines to their author.

    format_fortran.py [--check] FILE...

With --check nothing is written; files that would change are listed and the exit code is 1. So it is for a comment with
a blank line behind it, which belongs into the head of the module or to what it explains, and for a second `use` of a
module. fprettify's own alignment of continuation lines pushes text to the right margin where it does not fit, which
helps nobody.
"""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
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


def find_faults(lines):
    """Line and description of comments that belong to nothing, and of a second `use` of a module."""
    used = set()
    for n, (line, after) in enumerate(pairwise([*lines, "end"]), 1):
        text = line.strip()
        if text.startswith("!") and not text.startswith("!$") and not after.strip():
            yield n, "the comment belongs to nothing: a blank line follows"
        if line.startswith(" " * INDENT + "use "):
            name = text.split()[1].rstrip(",")
            if name in used:
                yield n, f"a second use of {name}"
            used.add(name)


def format_file(path):
    """(path, text before, text after)"""
    old = path.read_text()
    # fprettify moves a line that is too long, or nearly, to the left until it fits: fortitude complains of such lines
    command = ["fprettify", "--stdout", "--silent", "--line-length", "1000", str(path)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    before, after = old.split("\n"), run.stdout.split("\n")
    if len(before) != len(after):
        raise ValueError(f"{path}: fprettify changes the number of lines")
    return path, old, "\n".join(line.rstrip() for line in keep_continuations(before, after))


def main(arguments):
    check = "--check" in arguments
    paths = [Path(argument) for argument in arguments if argument != "--check"]
    changed, faults = [], []
    with ThreadPoolExecutor(cpu_count()) as pool:
        for path, old, new in pool.map(format_file, paths):
            faults += [f"{path}:{n}: {fault}" for n, fault in find_faults(new.split("\n"))]
            if old == new:
                continue
            changed.append(path)
            if not check:
                path.write_text(new)
    for path in changed:
        print(f"{path}: {'layout differs: run scripts/lint --fix' if check else 'laid out'}")
    for fault in faults:
        print(fault)
    return 1 if faults or (check and changed) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
