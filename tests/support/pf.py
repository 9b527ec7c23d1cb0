#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Preprocessor of the pFUnit stand-in: the same .pf files, without pFUnit.

    pf.py convert test_x.pf test_x.F90   one test file to Fortran
    pf.py driver driver.f90 test_x ...   main program that runs the suites of these test modules
    pf.py assertions funit.f90           module `funit` with the assertions of every kind and rank

It accepts the subset of pFUnit 4 that the project uses; everything else is an error with file and line.
"""

import re
import sys
from pathlib import Path

ASSERTIONS = """
    True False All Any None NotAll Equal NotEqual LessThan LessThanOrEqual GreaterThan GreaterThanOrEqual
    RelativelyEqual IsNaN IsFinite SameShape Fail ExceptionRaised Equivalent Associated NotAssociated Unassociated
"""
CANONICAL = {name.lower(): name for name in ASSERTIONS.split()}

SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(([\w\s,]*)\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(\w+)\s*(!.*)?$", re.IGNORECASE)
ASSERTION = re.compile(r"\s*@assert(\w+)\s*\((.*)\)\s*$", re.IGNORECASE)
TEST = re.compile(r"\s*@test\s*(?:\(\s*(ifdef|ifndef)\s*=\s*(\w+)\s*\))?\s*$", re.IGNORECASE)
SIMPLE = re.compile(r"\s*@(disable|before|after)\s*$", re.IGNORECASE)
DIRECTIVE = re.compile(r"\s*@")
FIXTURE_KEYWORDS = (("before", "setUp"), ("after", "tearDown"))
IGNORABLE = re.compile(r"\s*(!.*)?$")


class PfError(Exception):
    """Something in a test file that the stand-in (or pFUnit) does not understand."""

    def __init__(self, path, line, message):
        super().__init__(f"{path}:{line}: error: {message}")


def code_mask(text):
    """For each character: is it code (not in a string, not in a comment)?"""
    mask = []
    quote = ""
    comment = False
    for char in text:
        if comment:
            mask.append(False)
        elif quote:
            mask.append(False)
            if char == quote:
                quote = ""
        elif char in "'\"":
            mask.append(False)
            quote = char
        elif char == "!":
            mask.append(False)
            comment = True
        else:
            mask.append(True)
    return mask


def split_arguments(text):
    """Arguments of a call, split at the commas of the outermost level."""
    parts, start, depth = [], 0, 0
    for i, (char, is_code) in enumerate(zip(text, code_mask(text), strict=True)):
        if not is_code:
            continue
        if char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
            if depth < 0:
                raise ValueError("unbalanced parentheses")
        elif char == "," and depth == 0:
            parts.append(text[start:i].strip())
            start = i + 1
    if depth != 0:
        raise ValueError("unbalanced parentheses")
    last = text[start:].strip()
    return [*parts, last] if parts or last else []


def expand_assertion(name, arguments):
    """The procedure to call and its arguments, location excluded."""
    if name not in ("Equivalent", "Associated", "NotAssociated", "Unassociated"):
        return "assert" + name, arguments
    named = [a for a in arguments if re.match(r"message\s*=", a, re.IGNORECASE)]
    operands = [a for a in arguments if a not in named]
    limits = {"Equivalent": (2, 3)}.get(name, (1, 3))
    if not limits[0] <= len(operands) <= limits[1]:
        raise ValueError(f"@assert{name} has the wrong number of arguments")
    if name == "Equivalent":
        condition, rest = f"({operands[0]}) .eqv. ({operands[1]})", operands[2:]
        return "assertTrue", [condition, *rest, *named]
    condition = f"associated({', '.join(operands[:2])})"
    procedure = "assertTrue" if name == "Associated" else "assertFalse"
    return procedure, [condition, *operands[2:], *named]


class Converter:
    """State of the conversion of one file."""

    def __init__(self, path):
        self.path = Path(path)
        self.lines = []
        self.tests = []
        self.module = None
        self.fixture = {}
        self.pending = None
        self.waiting = None

    def fail(self, number, message):
        raise PfError(self.path, number, message)

    def convert(self):
        source = self.path.read_text(encoding="utf-8").splitlines()
        self.lines.append(f'#line 1 "{self.path}"')
        for number, line in enumerate(source, start=1):
            self.convert_line(number, line)
        end = len(source)
        if self.pending is not None:
            self.fail(end, "@test without a subroutine behind it")
        if self.waiting is not None:
            self.fail(end, f"@{self.waiting} without a subroutine behind it")
        if self.module is None:
            self.fail(end, "no module found")
        return "\n".join(self.lines) + "\n" + self.suite()

    def convert_line(self, number, line):
        if self.waiting is not None and not IGNORABLE.match(line):
            match = SUBROUTINE.match(line)
            if not match or (match.group(3) or "").strip():
                self.fail(number, f"@{self.waiting} must be followed by a subroutine without arguments")
            self.fixture[self.waiting] = match.group(1)
            self.waiting = None
            self.lines.append(line)
            return
        if DIRECTIVE.match(line):
            self.directive(number, line)
            return
        for i, is_code in enumerate(code_mask(line)):
            if is_code and line[i] == "@":
                self.fail(number, "a directive or an assertion must stand alone on its line")
        match = MODULE.match(line)
        if match and self.module is None and match.group(1).lower() != "procedure":
            self.module = match.group(1)
            if self.module.lower() != self.path.stem.lower():
                self.fail(number, f"module {self.module} must have the name of its file, {self.path.stem}")
        if self.pending is not None:
            match = SUBROUTINE.match(line)
            if match:
                if (match.group(3) or "").strip():
                    self.fail(number, "a test with arguments (test cases, parameters) is not supported")
                self.tests.append(dict(self.pending, name=match.group(1)))
                self.pending = None
        self.lines.append(line)

    def directive(self, number, line):
        match = TEST.match(line)
        if match:
            kind, macro = match.groups()
            self.pending = {"guard": f"#{kind.lower()} {macro}" if kind else "", "disabled": False}
            self.lines.append("!" + line)
            return
        match = SIMPLE.match(line)
        if match:
            word = match.group(1).lower()
            if word == "disable":
                if self.pending is None:
                    self.fail(number, "@disable must stand between @test and the subroutine")
                self.pending["disabled"] = True
            elif word in self.fixture:
                self.fail(number, f"a second @{word}")
            else:
                self.waiting = word
            self.lines.append("!" + line)
            return
        match = ASSERTION.match(line)
        if match and match.group(1).lower() in CANONICAL:
            self.assertion(number, CANONICAL[match.group(1).lower()], match.group(2))
            return
        word = re.match(r"\s*(@\w*)", line).group(1)
        if word[7:].lower() in CANONICAL and word.lower().startswith("@assert"):
            self.fail(number, f"{word} must be one line that ends with the closing parenthesis")
        self.fail(number, f"unknown or malformed directive {word}")

    def assertion(self, number, name, text):
        try:
            procedure, arguments = expand_assertion(name, split_arguments(text))
        except ValueError as problem:
            self.fail(number, str(problem))
        operands = "".join(f"{argument}, " for argument in arguments)
        self.lines += [
            f'#line {number} "{self.path}"',
            f"  call {procedure}({operands}&",
            f'#line {number} "{self.path}"',
            f"    & location=SourceLocation('{self.path.name}', {number}))",
            f'#line {number} "{self.path}"',
            "  if (anyExceptions()) return",
            f'#line {number + 1} "{self.path}"',
        ]

    def suite(self):
        """The external function that lists the tests of the module."""
        name = f"{self.path.stem}_suite"
        out = [
            f'#line 1 "{name}"',
            f"function {name}() result(suite)",
            "   use funit",
            f"   use {self.module}",
            "   implicit none",
            "   type(TestSuite) :: suite",
            f"   suite = TestSuite('{name}')",
        ]
        fixture = [f"{key}={self.fixture[word]}" for word, key in FIXTURE_KEYWORDS if word in self.fixture]
        for test in self.tests:
            arguments = [f"'{test['name']}'"] + ([] if test["disabled"] else [test["name"], *fixture])
            entry = ["   call suite%addTest(TestMethod( &"]
            entry += [f"      {argument}, &" for argument in arguments[:-1]] + [f"      {arguments[-1]}))"]
            out += [test["guard"], *entry, "#endif"] if test["guard"] else entry
        out += [f"end function {name}", ""]
        return "\n".join(out)


def driver(modules):
    """Main program that runs the suites of the given test modules."""
    out = ["program run_tests", "   use funit", "   use funit_core, only : run_suites"]
    out += ["   implicit none", "   interface"]
    for module in modules:
        out += [
            f"      function {module}_suite() result(suite)",
            "         import :: TestSuite",
            "         type(TestSuite) :: suite",
            f"      end function {module}_suite",
        ]
    out += ["   end interface", f"   type(TestSuite) :: suites({len(modules)})"]
    out += [f"   suites({i}) = {module}_suite()" for i, module in enumerate(modules, start=1)]
    out += ["   call run_suites(suites)", "end program run_tests", ""]
    return "\n".join(out)


MAX_RANK = 5
RELATIONS = ["Equal", "NotEqual", "LessThan", "LessThanOrEqual", "GreaterThan", "GreaterThanOrEqual"]


def dimension(rank):
    return f"({', '.join(':' * rank)})" if rank else ""


def flat(name, rank, conversion):
    """An operand as a rank 1 array of the common kind."""
    value = conversion.format(name)
    return f"reshape({value}, [size({name})])" if rank else f"[{value}]"


def ranks():
    """Allowed pairs (rank of expected, rank of actual): the same, or a scalar against an array."""
    yield 0, 0
    for rank in range(1, MAX_RANK + 1):
        yield 0, rank
        yield rank, rank


def specific(name, relation, checker, kinds, rank_pair, conversion, extra="", tolerance=None):
    """One specific assertion: flatten both operands and hand them to the checker."""
    (type_e, type_a), (rank_e, rank_a) = kinds, rank_pair
    arguments = ["expected", "actual"] + (["tolerance"] if tolerance else []) + ["message", "location"]
    out = [
        f"   subroutine {name}({', '.join(arguments)})",
        f"      {type_e}, intent(in) :: expected{dimension(rank_e)}",
        f"      {type_a}, intent(in) :: actual{dimension(rank_a)}",
    ]
    if tolerance:
        out.append(f"      {tolerance}, intent(in) :: tolerance")
    out += [
        "      character(len=*), intent(in), optional :: message",
        "      type(SourceLocation), intent(in), optional :: location",
        f"      call {checker}('{relation}', {flat('expected', rank_e, conversion)}, &",
        f"         {flat('actual', rank_a, conversion)}, &",
        f"         shape(expected), shape(actual), {extra}&",
    ]
    if tolerance:
        out.append("         tolerance=real(tolerance, real64), &")
    out += ["         message=message, location=location)", f"   end subroutine {name}"]
    return out


def generic_modules():
    """(module name, generic name, specific procedures) of every generated assertion."""
    single, double = "real(real32)", "real(real64)"
    real_pairs = [(single, single), ("integer", single), (double, double), (single, double), ("integer", double)]
    integer_pairs = [(f"integer(int{n})", f"integer(int{n})") for n in (8, 16, 32, 64)]
    integer_pairs += [("integer", f"integer(int{n})") for n in (8, 16, 64)]
    for relation in [*RELATIONS, "RelativelyEqual"]:
        body, names = [], []

        def add(*arguments, body=body, names=names, relation=relation, **options):
            name = f"{relation.lower()}_{len(names) + 1}"
            names.append(name)
            body.extend(specific(name, relation, *arguments, **options))

        for pair in real_pairs:
            is_single = pair[1] == single
            convert = "real(real({}, real32), real64)" if is_single else "real({}, real64)"
            extra = f"single={'.true.' if is_single else '.false.'}, "
            tolerances = {"Equal": [None, single, double], "RelativelyEqual": [single, double]}.get(relation, [None])
            for tolerance in tolerances:
                if is_single and tolerance == double:
                    continue
                for rank_pair in ranks():
                    add("check_reals", pair, rank_pair, convert, extra=extra, tolerance=tolerance)
        if relation != "RelativelyEqual":
            for pair in integer_pairs:
                for rank_pair in ranks():
                    add("check_integers", pair, rank_pair, "int({}, int64)")
        if relation == "Equal":
            for rank_pair in ranks():
                add("check_logicals", ("logical", "logical"), rank_pair, "{}")
            names += ["assert_equal_strings", "assert_equal_string_array", "assert_equal_string_arrays"]
        yield relation, names, body
    for relation in ("All", "Any", "None", "NotAll"):
        body, names = [], []
        for rank in range(MAX_RANK + 1):
            names.append(f"{relation.lower()}_{rank}")
            body += [
                f"   subroutine {names[-1]}(conditions, message, location)",
                f"      logical, intent(in) :: conditions{dimension(rank)}",
                "      character(len=*), intent(in), optional :: message",
                "      type(SourceLocation), intent(in), optional :: location",
                f"      call check_logicals('{relation}', [.true.], {flat('conditions', rank, '{}')}, [integer ::], &",
                "         shape(conditions), message=message, location=location)",
                f"   end subroutine {names[-1]}",
            ]
        yield relation, names, body


def assertions():
    """Text of the modules funit_* and of module funit, which gathers everything under pFUnit's names."""
    out, modules = ["! Generated by pf.py."], []
    for relation, names, body in generic_modules():
        module = f"funit_{relation.lower()}"
        modules.append(module)
        out += [
            f"module {module}",
            "   use, intrinsic :: iso_fortran_env, only : real32, real64, int8, int16, int32, int64",
            "   use funit_core, only : SourceLocation",
            "   use funit_check",
            "   implicit none",
            "   private",
            f"   public :: assert{relation}",
            f"   interface assert{relation}",
            *[f"      procedure {name}" for name in names],
            f"   end interface assert{relation}",
            "contains",
            *body,
            f"end module {module}",
        ]
    out += [
        "module funit",
        "   use funit_core, only : SourceLocation, throw, anyExceptions, catch, TestMethod, TestSuite",
        "   use funit_core, only : assertFail, assertExceptionRaised",
        "   use funit_check, only : assertTrue, assertFalse, assertIsNaN, assertIsFinite, assertSameShape",
        "   use funit_check, only : WhitespaceOptions, TRIM_ALL, KEEP_ALL, IGNORE_ALL, IGNORE_DIFFERENCES",
        *[f"   use {module}" for module in modules],
        "   implicit none",
        "   public",
        "end module funit",
        "",
    ]
    return "\n".join(out)


def main(arguments):
    command, rest = arguments[0] if arguments else "", arguments[1:]
    try:
        if command == "convert" and len(rest) == 2:
            Path(rest[1]).write_text(Converter(rest[0]).convert(), encoding="utf-8")
        elif command == "driver" and len(rest) >= 2:
            Path(rest[0]).write_text(driver(rest[1:]), encoding="utf-8")
        elif command == "assertions" and len(rest) == 1:
            Path(rest[0]).write_text(assertions(), encoding="utf-8")
        else:
            print(__doc__, file=sys.stderr)
            return 2
    except (PfError, OSError) as problem:
        print(problem, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
