# SPDX-License-Identifier: MIT
"""Text files as people have them, with any line end and encoding: the same numbers, or an error with the place."""

import unittest
from pathlib import Path

from support import ProgramTest

ROOT = Path(__file__).resolve().parents[2]
MODEL = """\
&model geometry = 'two.blk', title = 'Böschung Müller' /
&block_material number = 1, name = 'grès', density = 2500, young = 1e10, poisson = 0.2 /
&joint_material number = 1, friction = 30 / ! a comment
&load gravity = 9.81, base_acceleration = 'base.csv' /
&region name = 'Stoß', polygon = 0,0, 1,0, 1,1 /
&run steps = 3 /
"""
BLOCKS = """\
rockdda-blocks 1
# a wall
e0 0.001
blocks 2
vertices 8
fixed 2
loading 0
measured 0
bolts 0
block 1 1 4
0 0 1
2 0 1
2 1 1
0 1 1
block 2 1 4
0.5 1 1
1.5 1 1
1.5 2 1
0.5 2 1
fixed_points
0.25 0.25 1
1.75 0.25 1
loading_points
measured_points
bolt_list
end
"""
BASE = "t,ax,ay\n0,0,0\n0.5,1,-0.5\n"


def energies(log):
    """The rows of a log, without times of the clock."""
    return [line for line in log.splitlines() if line.strip()[:1].isdigit() and len(line.split()) > 10]


class Texts(ProgramTest):
    def files(self, change=lambda text: text, encoding="utf-8", end=""):
        for name, text in (("two.nml", MODEL), ("two.blk", BLOCKS), ("base.csv", BASE)):
            Path(self.folder, name).write_bytes((change(text) + end).encode(encoding))

    def rows(self):
        outcome = self.run_program("run", "two.nml", "--force", "--quiet")
        self.assertEqual(outcome.code, 0, outcome.err)
        return energies(Path(self.folder, "two.log").read_text(encoding="utf-8", errors="replace"))

    def test_every_line_end_and_encoding_gives_the_same_run(self):
        """With CR a whole options file was a comment; UTF-16 was a binary file."""
        self.files()
        wanted = self.rows()
        self.assertEqual(len(wanted), 3)
        for change, encoding, end in (
            (lambda text: text.replace("\n", "\r"), "utf-8", ""),
            (lambda text: text.replace("\n", "\r\n"), "latin-1", "\x1a"),
            (lambda text: text, "utf-8-sig", "\n\x1a\x1a\n\0"),
            (lambda text: text.replace("\n", "\r"), "utf-16", "\x1a"),
            (lambda text: "\ufeff" + text, "utf-16-le", ""),
            (lambda text: "\ufeff" + text, "utf-16-be", ""),
        ):
            with self.subTest(encoding=encoding, end=end):
                self.files(change, encoding, end)
                self.assertEqual(self.rows(), wanted)

    def test_line_and_column_count_in_every_encoding(self):
        for encoding in ("utf-8", "latin-1", "utf-16"):
            self.files(lambda text: text.replace("friction = 30", "friction = x").replace("\n", "\r"), encoding)
            outcome = self.run_program("check", "two.nml")
            self.assertEqual(outcome.code, 2)
            self.assertIn("two.nml:3:40: error: friction: expected a number, found 'x'", outcome.err)

    def test_other_spaces_are_blanks(self):
        """A no-break space was an invisible word in an error."""
        self.write("a.dc", "0.01\n4 4\n0 0 0 0 0 0\n0 0 1 0 1\n1 0 1 1 1\n1 1 0 1 1\n0 1 0 0 1\n")
        wanted = self.run_program("cut", "a.dc", "-o", "a.blk").out
        text = self.path("a.dc").read_text()
        for space, encoding in (("\u00a0", "utf-8"), ("\u00a0", "latin-1"), ("\u202f", "utf-8"), ("\u3000", "utf-8")):
            with self.subTest(space=space, encoding=encoding):
                self.path("a.dc").write_bytes(text.replace("1 1 0 1", f"1{space}1{space}{space}0 1").encode(encoding))
                outcome = self.run_program("cut", "a.dc", "-o", "a.blk", "--force")
                self.assertEqual((outcome.code, outcome.out), (0, wanted), outcome.err)
        # letters of which it is a part stay
        self.files(lambda text: text.replace("Müller", "à la mode"))
        self.assertIn("à la mode", self.run_program("run", "two.nml", "--force", "--steps", "1").err + Path(
            self.folder, "two.log").read_text(encoding="utf-8"))  # fmt: skip

    def test_text_behind_ctrl_z_is_refused(self):
        self.files()
        with Path(self.folder, "two.nml").open("a") as stream:
            stream.write("\x1a\n&run steps = 5 /\n")
        outcome = self.run_program("check", "two.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("two.nml:7:1: error: there is a Ctrl-Z (the end of a file for DOS) and more text", outcome.err)

    def test_decimal_commas_of_lists_are_refused(self):
        """Also where their count fits."""
        for old, new, message in (
            (
                "polygon = 0,0, 1,0, 1,1",
                "polygon = 0,0, 1,05, 1,1",
                "5:40: error: polygon: '1,05' seems to be a number",
            ),
            ("polygon = 0,0, 1,0, 1,1", "polygon = 0,5,0, 1,5,0", "5:35: error: polygon: '0,5' seems to be a number"),
            (
                "gravity = 9.81",
                "gravity = 9,81",
                "4:19: error: gravity: expected one number, found 2 values; if '9,81'",
            ),
        ):
            with self.subTest(new=new):
                self.files(lambda text, old=old, new=new: text.replace(old, new))
                outcome = self.run_program("check", "two.nml")
                self.assertEqual(outcome.code, 2)
                self.assertIn(message, outcome.err)

    def test_commas_without_blanks_separate_the_coordinates_of_a_list(self):
        """However signs, blanks and line ends stand; some lists were refused for a decimal comma that was not there."""
        x, y = -15, 15
        corners = [(x, x), (x, y), (y, y), (y, x)]
        lines = [(*a, *b) for a in corners for b in corners if a != b]
        lists = [f"polygon = {blank.join(map(str, sum(corners, ())))}" for blank in (",", " ", ", ", " ,", ",\n")]
        lists += ["polygon = 0,0,10,0 10,10,0,10", "polygon = 1,2,3,4,5, 6,7,8", "polygon = -5,-5,5,-5,5,5"]
        groups = [f"&region name = 'a', {one} /" for one in lists]
        groups += [f"&boundary kind = 'fixed', along = {','.join(map(str, line))} /" for line in lines]
        groups += ["&water table = -20,-10,20,-10, unit_weight = 9810 /", "&region name = 'b', box = -15,-10,15,10 /"]
        self.files(lambda text: text + "\n".join(groups) + "\n" if text.startswith("&") else text)
        outcome = self.run_program("check", "two.nml")
        self.assertNotIn("decimal comma", outcome.err)
        self.assertNotIn("expected", outcome.err)

    def test_blanks_that_part_rows_show_decimal_commas(self):
        for given, place in (("0,5,0 1,5,0", "'0,5'"), ("0,0 1,5,0 2,2,5 1,1", "'1,5'"), ("-1,5,0, -2,5,1", "'-1,5'")):
            with self.subTest(given=given):
                self.files(lambda text, given=given: text.replace("0,0, 1,0, 1,1", given))
                outcome = self.run_program("check", "two.nml")
                self.assertEqual(outcome.code, 2)
                self.assertIn(f"polygon: {place} seems to be a number with a decimal comma", outcome.err)

    def test_decimal_commas_of_tables(self):
        """Read between semicolons and tabs, refused elsewhere."""
        self.files()
        wanted = self.rows()
        for text in ("t;ax;ay\n0;0;0\n0,5;1;-0,5\n", "0\t0\t0\n0,5\t1\t-0,5\n", "t; ax; ay\r0;0;0;\r5D-1;1;-0,5;\r"):
            Path(self.folder, "base.csv").write_text(text)
            self.assertEqual(self.rows(), wanted)
        for text, place in (
            ("t,ax,ay\n0,0,0\n0,5,1,-0,5\n", "3:7: error: row 2: expected 3 numbers on this line, found 5; if '0,5'"),
            ("0,0 0,0 0,0\n0,5 1,0 -0,5\n", "1:2:"),
            ("0,00,0,00,0,00\n", "1:2:"),
            ("0;0;0\n0,5;1.0;-0,5\n", "2:2:"),
            ("0\t0\t0\n0,5\t1.5\t-0,5\n", "2:2:"),
            ("0;0;0\n1 000;1,5;2\n", "2:2:"),
            ("0;0;0\n1,000,5;1,5;2\n", "2:2:"),
        ):
            with self.subTest(text=text):
                Path(self.folder, "base.csv").write_text(text)
                outcome = self.run_program("check", "two.nml")
                self.assertEqual(outcome.code, 2)
                self.assertIn(f"base.csv:{place}", outcome.err)


if __name__ == "__main__":
    unittest.main()
