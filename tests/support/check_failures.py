#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""What must fail does fail: every assertion, the runner's exit code and options, the preprocessor's messages."""

import argparse
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).with_name("pf.py")
SENTENCE = "*** Encountered 1 or more failures/errors during testing ***"

FAILING_ASSERTIONS = """\
@assertTrue(.false.)
@assertTrue([.true., .false.])
@assertFalse(.true.)
@assertFalse([.false., .true.])
@assertEqual(.true., .false.)
@assertEqual([.true., .true.], [.true., .false.])
@assertEqual(1, 2)
@assertEqual(1, 2_int64)
@assertEqual([1, 2], [1, 3])
@assertEqual([1, 2], [1, 2, 3])
@assertEqual([1, 2], triple)
@assertEqual(triple, [1, 2])
@assertEqual([1], 1)
@assertNotEqual(2, 2)
@assertLessThan(2, 2)
@assertLessThanOrEqual(3, 2)
@assertGreaterThan(2, 2)
@assertGreaterThanOrEqual(1, 2)
@assertEqual(1.0_real64, 1.0_real64 + epsilon(1.0_real64))
@assertEqual(1, 1.5_real64)
@assertEqual(1.0_real64, 1.2_real64, tolerance=0.1_real64)
@assertEqual(nan, nan)
@assertEqual(nan, nan, tolerance=1.0_real64)
@assertEqual(1.0_real64, nan, tolerance=huge(1.0_real64))
@assertEqual(infinite, -infinite, tolerance=huge(1.0_real64))
@assertEqual(1.0_real64, infinite, tolerance=huge(1.0_real64))
@assertEqual([1.0_real64, 2.0_real64], [1.0_real64, 2.5_real64], tolerance=0.1_real64)
@assertEqual(matrix, transpose(matrix))
@assertEqual(matrix, matrix(:, 1:1))
@assertEqual(matrix, matrix(:, :n))
@assertEqual(matrix, reshape(matrix, [4]), tolerance=9.0_real64)
@assertLessThan([0.0_real64], matrix(:, 2))
@assertEqual(1.0_real64, matrix)
@assertRelativelyEqual(1.0_real64, 1.2_real64, tolerance=0.1_real64)
@assertRelativelyEqual(0.0_real64, 0.0_real64, tolerance=0.1_real64)
@assertRelativelyEqual(nan, nan, tolerance=0.1_real64)
@assertNotEqual(2.0_real64, 2.0_real64)
@assertNotEqual(2.0_real64, nan)
@assertLessThan(2.0_real64, 2.0_real64)
@assertLessThan([1.0_real64, 2.0_real64], [3.0_real64, 1.0_real64])
@assertLessThanOrEqual(2.5_real64, 2.0_real64)
@assertLessThanOrEqual(nan, 2.0_real64)
@assertGreaterThan(2.0_real64, 2.0_real64)
@assertGreaterThanOrEqual(2.0_real64, 2.5_real64)
@assertIsFinite(nan)
@assertIsFinite(infinite)
@assertEqual('abc', 'abd')
@assertEqual('abc', 'abcd')
@assertEqual(' a', 'a', whitespace=KEEP_ALL)
@assertEqual(['a', 'b'], ['a', 'c'])
@assertEqual(['a', 'b'], ['a', 'b', 'c'])
@assertEqual('a', ['a', 'c'])
@assertEqual(1.0_real64, 1)
@assertEqual(1, .true.)
@assertEqual(1, 1, tolerance=1.0_real64)
@assertLessThan(1, 2, tolerance=1.0_real64)
@assertLessThan('a', 'b')
@assertRelativelyEqual(1, 1, tolerance=1.0_real64)
""".splitlines()

HEADER = """\
module {name}
   use, intrinsic :: iso_fortran_env, only : real64, int64
   use, intrinsic :: ieee_arithmetic, only : ieee_value, ieee_quiet_nan, ieee_positive_inf
   use funit
   implicit none
   real(real64) :: matrix(2, 2) = reshape([1.0_real64, 2.0_real64, 3.0_real64, 4.0_real64], [2, 2])
   real(real64) :: nan = 0.0_real64, infinite = 0.0_real64
   integer, allocatable :: triple(:)
   integer :: n = 1
contains
   @before
   subroutine set_up()
      nan = ieee_value(1.0_real64, ieee_quiet_nan)
      infinite = ieee_value(1.0_real64, ieee_positive_inf)
      triple = [1, 2, 3]
   end subroutine set_up
"""


class StandIn(unittest.TestCase):
    """Each test writes .pf text, converts, builds and runs it in a folder of its own."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = Path(self.folder.name)

    def command(self, *arguments):
        return subprocess.run([str(a) for a in arguments], cwd=self.path, capture_output=True, text=True)

    def convert(self, text, name="sample"):
        (self.path / f"{name}.pf").write_text(text)
        return self.command(sys.executable, SCRIPT, "convert", f"{name}.pf", f"{name}.F90")

    def run_file(self, text, *options, name="sample"):
        converted = self.convert(text, name)
        self.assertEqual(converted.returncode, 0, converted.stderr)
        self.command(sys.executable, SCRIPT, "driver", "driver.f90", name)
        built = self.command(
            OPTIONS.compiler, "-O0", f"-I{OPTIONS.modules}", f"{name}.F90", "driver.f90", "-o", name,
            OPTIONS.library, *OPTIONS.link_flags.split(),
        )  # fmt: skip
        self.assertEqual(built.returncode, 0, built.stderr)
        return self.command(self.path / name, *options)

    def test_every_assertion_can_fail_and_says_where(self):
        lines = HEADER.format(name="sample").splitlines()
        places = []
        for i, assertion in enumerate(FAILING_ASSERTIONS):
            lines += ["   @test", f"   subroutine test_{i}()", f"      {assertion}"]
            places.append(len(lines))
            lines += ["      print '(a)', 'the test went on after a failure'", f"   end subroutine test_{i}"]
        lines.append("end module sample")
        result = self.run_file("\n".join(lines) + "\n")
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        for i, (assertion, line) in enumerate(zip(FAILING_ASSERTIONS, places, strict=True)):
            block = f" in: \nsample_suite.test_{i}\n  Location: \n[sample.pf:{line}]\n"
            self.assertIn(block, result.stdout, assertion)
        self.assertNotIn("the test went on", result.stdout)
        count = len(FAILING_ASSERTIONS)
        self.assertIn(f"Tests run: {count}, Failures: {count}\n", result.stdout)
        self.assertIn(SENTENCE, result.stdout)

    def test_message_comes_before_the_details(self):
        text = HEADER.format(name="sample") + (
            "   @test\n   subroutine a()\n      @assertEqual([1, 2], [1, 3], message='mine')\n   end subroutine a\n"
            "end module sample\n"
        )
        result = self.run_file(text)
        self.assertIn(
            "mine\nArrayAssertEqual failure:\n      Expected: <2>\n        Actual: <3>\n      at index: [2]\n",
            result.stdout,
        )

    def test_operands_of_other_shapes_are_named(self):
        text = HEADER.format(name="sample") + (
            "   @test\n   subroutine a()\n      @assertEqual(matrix, matrix(:, :n))\n   end subroutine a\n"
            "   @test\n   subroutine b()\n      @assertEqual(transpose(matrix), matrix)\n   end subroutine b\n"
            "end module sample\n"
        )
        result = self.run_file(text)
        self.assertIn("expected shape [2,2], actual shape [2,1]\n", result.stdout)
        self.assertIn("Expected: <3.", result.stdout)
        self.assertIn("at index: [2,1]\n", result.stdout)

    def test_filter_and_verbose(self):
        text = HEADER.format(name="sample") + "".join(
            f"   @test\n   subroutine {name}()\n      @assertTrue(.false., 'ran')\n   end subroutine {name}\n"
            for name in ("one", "two", "three")
        )
        text += "end module sample\n"
        result = self.run_file(text, "--verbose", "-f", "sample_suite.t")
        self.assertEqual(result.returncode, 2)
        self.assertIn("Tests run: 2, Failures: 2", result.stdout)
        self.assertIn("Start: <sample_suite.two>", result.stdout)
        self.assertNotIn("sample_suite.one", result.stdout)

    def test_failed_set_up_skips_the_test_and_failed_test_is_torn_down(self):
        text = (
            "module sample\n   use funit\n   implicit none\n   integer :: calls = 0\ncontains\n"
            "   @before\n   subroutine b()\n      calls = calls + 1\n      if (calls == 2) then\n"
            "         @assertTrue(.false., 'set-up failed')\n      end if\n   end subroutine b\n"
            "   @after\n   subroutine a()\n      print '(a,i0)', 'torn down ', calls\n   end subroutine a\n"
            "   @test\n   subroutine one()\n      @assertTrue(.false., 'one failed')\n   end subroutine one\n"
            "   @test\n   subroutine two()\n      @assertTrue(.false., 'two ran')\n   end subroutine two\n"
            "end module sample\n"
        )
        result = self.run_file(text)
        self.assertIn("one failed", result.stdout)
        self.assertIn("torn down 1", result.stdout)
        self.assertIn("set-up failed", result.stdout)
        self.assertNotIn("two ran", result.stdout)
        self.assertNotIn("torn down 2", result.stdout)

    def test_failure_in_a_helper_leaves_only_the_helper(self):
        text = (
            "module sample\n   use funit\n   implicit none\ncontains\n"
            "   @test\n   subroutine one()\n      call helper()\n      print '(a)', 'went on'\n   end subroutine one\n"
            "   subroutine helper()\n      @assertTrue(.false., 'failed')\n      print '(a)', 'helper went on'\n"
            "   end subroutine helper\nend module sample\n"
        )
        result = self.run_file(text)
        self.assertEqual(result.returncode, 2)
        self.assertIn("went on", result.stdout)
        self.assertNotIn("helper went on", result.stdout)

    def test_private_tests_do_not_compile(self):
        text = (
            "module sample\n   use funit\n   implicit none\n   private\ncontains\n"
            "   @test\n   subroutine one()\n      @assertTrue(.true.)\n   end subroutine one\nend module sample\n"
        )
        self.assertEqual(self.convert(text).returncode, 0)
        built = self.command(OPTIONS.compiler, f"-I{OPTIONS.modules}", "-c", "sample.F90")
        self.assertNotEqual(built.returncode, 0)
        self.assertIn("one", built.stderr)

    def test_preprocessor_reports_what_it_does_not_understand(self):
        body = "module sample\n   use funit\ncontains\n{}\nend module sample\n"
        cases = {
            "   @tset\n": "sample.pf:4: error: unknown, malformed or not one line: @tset",
            "   @suite(name='x')\n": "sample.pf:4: error: unknown, malformed or not one line: @suite",
            "   @test(npes=[1])\n": "sample.pf:4: error: unknown, malformed or not one line: @test",
            "   @assertEqal(1, 2)\n": "sample.pf:4: error: unknown, malformed or not one line: @assertEqal",
            "   @assertEqual(1)\n": "sample.pf:4: error: unknown, malformed or not one line: @assertEqual",
            "   @assertTrue()\n": "sample.pf:4: error: unknown, malformed or not one line: @assertTrue",
            "   @assertTrue(a) ! no\n": "sample.pf:4: error: unknown, malformed or not one line: @assertTrue",
            "   @assertTrue(a, &\n   b)\n": "sample.pf:4: error: unknown, malformed or not one line: @assertTrue",
            "   if (a) @assertTrue(b)\n": "sample.pf:4: error: a directive or an assertion must stand alone",
            "   @assertTrue(a) ; @assertTrue(b))\n": "sample.pf:4: error: unknown, malformed or not one line",
            "   @before\n   integer :: i\n": "sample.pf:5: error: @before must be followed by a subroutine",
            "   @test\n   @after\n": "sample.pf:5: error: a second @after, or a directive without its subroutine",
            "   @test\n   subroutine a(this)\n": "sample.pf:5: error: @test must be followed by a subroutine",
            "   @test\n": "@test must be followed by a subroutine",
        }
        for text, message in cases.items():
            result = self.convert(body.format(text))
            self.assertEqual(result.returncode, 1, text)
            self.assertIn(message, result.stderr)
        result = self.convert("module other\nend module other\n")
        self.assertIn("sample.pf:1: error: module other must have the name of its file, sample", result.stderr)

    def test_compiler_messages_point_to_the_test_file(self):
        text = HEADER.format(name="sample") + (
            "   @test\n   subroutine a()\n      @assertTrue(.true.)\n      no_such_name = 1\n   end subroutine a\n"
            "end module sample\n"
        )
        self.assertEqual(self.convert(text).returncode, 0)
        built = self.command(OPTIONS.compiler, f"-I{OPTIONS.modules}", "-c", "sample.F90")
        line = text.splitlines().index("      no_such_name = 1") + 1
        self.assertIn(f"sample.pf:{line}:", built.stderr)


if __name__ == "__main__":
    PARSER = argparse.ArgumentParser()
    PARSER.add_argument("--compiler", required=True)
    PARSER.add_argument("--modules", required=True)
    PARSER.add_argument("--library", required=True)
    PARSER.add_argument("--link-flags", default="")
    OPTIONS, REST = PARSER.parse_known_args()
    unittest.main(argv=[sys.argv[0], *REST])
