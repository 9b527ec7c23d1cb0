#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Preprocessor of the pFUnit stand-in: the same .pf files, without pFUnit.

    pf.py convert test_x.pf test_x.F90   one test file to Fortran
    pf.py driver driver.f90 test_x ...   main program that runs the tests of these test modules

It accepts the subset of pFUnit 4 that the project uses; everything else is an error with file and line.
"""

import re
import sys
from pathlib import Path

# assertion: procedure of funit.f90 with its first argument, number of wrapped operands
CALLS = {
    "true": ("funit_judge(.true., ", 0),
    "false": ("funit_judge(.false., ", 0),
    "isfinite": ("funit_is_finite(", 0),
}
ORDERS = ("LessThan", "LessThanOrEqual", "GreaterThan", "GreaterThanOrEqual")
for relation in ("Equal", "RelativelyEqual", "NotEqual", *ORDERS):
    CALLS[relation.lower()] = (f"funit_compare('{relation}', ", 2)

SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(?!procedure\b)(\w+)\s*(!.*)?$", re.IGNORECASE)
ASSERTION = re.compile(r"\s*@assert(\w+)\s*\((.*)\)\s*$", re.IGNORECASE)
DIRECTIVE = re.compile(r"\s*@(test|before|after)\s*$", re.IGNORECASE)
IGNORABLE = re.compile(r"\s*(!.*)?$")


class PfError(Exception):
    """Something in a test file that the stand-in (or pFUnit) does not understand."""


def code_of(text):
    """The text with dots in place of strings and comments."""
    return re.sub(r"'[^']*'|\"[^\"]*\"|!.*", lambda found: "." * len(found[0]), text)


def split_arguments(text):
    """Arguments of a call, split at the commas of the outermost level; nothing when parentheses do not match."""
    parts, start, depth = [], 0, 0
    for i, char in enumerate(code_of(text)):
        depth += (char in "([") - (char in ")]")
        if depth < 0:
            return []
        if char == "," and depth == 0:
            parts.append(text[start:i].strip())
            start = i + 1
    return [] if depth else [*parts, text[start:].strip()]


class Converter:
    """State of the conversion of one file."""

    def __init__(self, path):
        self.path = Path(path)
        self.lines = [f'#line 1 "{path}"']
        self.module = ""
        self.tests = []
        self.fixture = {}
        self.waiting = ""  # a directive whose subroutine follows

    def fail(self, number, message):
        raise PfError(f"{self.path}:{number}: error: {message}")

    def convert(self):
        source = self.path.read_text(encoding="utf-8").splitlines()
        for number, line in enumerate(source, start=1):
            if line.lstrip().startswith("@"):
                self.directive(number, line)
            else:
                self.code(number, line)
        if self.waiting:
            self.fail(len(source), f"@{self.waiting} without a subroutine behind it")
        if not self.module:
            self.fail(len(source), "no module found")
        return "\n".join(self.lines) + "\n" + self.suite()

    def code(self, number, line):
        """A line of Fortran."""
        if "@" in code_of(line):
            self.fail(number, "a directive or an assertion must stand alone on its line")
        module = MODULE.match(line)
        if module and not self.module:
            self.module = module[1]
            if self.module.lower() != self.path.stem.lower():
                self.fail(number, f"module {self.module} must have the name of its file, {self.path.stem}")
        if self.waiting and not IGNORABLE.match(line):
            found = SUBROUTINE.match(line)
            if not found:
                self.fail(number, f"@{self.waiting} must be followed by a subroutine without arguments")
            if self.waiting == "test":
                self.tests.append(found[1])
            else:
                self.fixture[self.waiting] = found[1]
            self.waiting = ""
        self.lines.append(line)

    def directive(self, number, line):
        """A line that begins with @."""
        found = DIRECTIVE.match(line)
        if not found:
            self.assertion(number, line)
        elif self.waiting or found[1].lower() in self.fixture:
            self.fail(number, f"a second @{found[1].lower()}, or a directive without its subroutine")
        else:
            self.waiting = found[1].lower()
            self.lines.append("!" + line)

    def assertion(self, number, line):
        found = ASSERTION.match(line)
        call, n_wrapped = CALLS.get(found[1].lower(), ("", 0)) if found else ("", 0)
        arguments = split_arguments(found[2]) if call else []
        if len(arguments) < max(n_wrapped, 1) or not all(arguments):
            self.fail(number, f"unknown, malformed or not one line: {line.strip()}")
        parts = [f"call {call}&"]
        for argument in arguments[:n_wrapped]:
            parts += ["funit_flat(funit_value( &", f"{argument} &", ")), &"]
        parts += [f"{argument}, &" for argument in arguments[n_wrapped:]]
        parts += [f"location=SourceLocation('{self.path.name}', {number}))", "if (anyExceptions()) return"]
        for part in parts:
            self.lines += [f'#line {number} "{self.path}"', part]
        self.lines.append(f'#line {number + 1} "{self.path}"')

    def suite(self):
        """The external subroutine that runs the tests of the module."""
        name = f"{self.path.stem}_suite"
        fixture = "".join(f", &\n      {key}={procedure}" for key, procedure in self.fixture.items())
        runs = [f"   call funit_run('{name}.{test}', &\n      {test}{fixture})" for test in self.tests]
        head = [f'#line 1 "{name}"', f"subroutine {name}()", "   use funit", f"   use {self.module}"]
        return "\n".join([*head, "   implicit none", *runs, f"end subroutine {name}", ""])


def driver(modules):
    """Main program that runs the tests of the given test modules."""
    calls = [f"   call {module}_suite()" for module in modules]
    names = [f"   external :: {module}_suite" for module in modules]
    head = ["program run_tests", "   use funit, only : funit_finish", "   implicit none"]
    return "\n".join([*head, *names, *calls, "   call funit_finish()", "end program run_tests", ""])


def main(arguments):
    command, rest = arguments[0] if arguments else "", arguments[1:]
    try:
        if command == "convert" and len(rest) == 2:
            Path(rest[1]).write_text(Converter(rest[0]).convert(), encoding="utf-8")
        elif command == "driver" and len(rest) >= 2:
            Path(rest[0]).write_text(driver(rest[1:]), encoding="utf-8")
        else:
            print(__doc__, file=sys.stderr)
            return 2
    except (PfError, OSError) as problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
