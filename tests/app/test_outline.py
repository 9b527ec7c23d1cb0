# SPDX-License-Identifier: MIT
"""Lines meant as the outer boundary that leave a gap, or bound no block, are an error that names both ends."""

import math
import random

from support import ProgramTest

# a slope of 12 m: base, right side, bench, face, top, left side; a joint from the face to the left side
OUTLINE = ["0 0 40 0", "40 0 40 8", "40 8 26 8", "26 8 18 20", "18 20 0 20", "0 20 0 0"]
JOINTS = ["-1 10 30 10", "10 -1 10 30"]
MODEL = """\
&model geometry = 'slope.dc' /
&block_material number = 1, density = 2600, young = 20e9, poisson = 0.25 /
&joint_material number = 1, friction = 40 /
&load gravity = 9.81 /
&boundary along = 0,0, 40,0, kind = 'fixed' /
&run steps = 1{} /
"""
WAY_OUT = "--allow-open runs all the same (&run allow_open)"


class Outline(ProgramTest):
    def write_slope(self, outline, joints=JOINTS, option=""):
        rows = [f"{row} 1" for row in [*outline, *joints]]
        self.write("slope.dc", "\n".join(["0.001", f"{len(rows)} {len(outline)}", "0 0 0 0 0 0", *rows, ""]))
        self.write("slope.nml", MODEL.format(option))

    def problems(self, *arguments, code=2, level="error"):
        outcome = self.run_program(*arguments, "--force")
        self.assertEqual(outcome.code, code, outcome.err)
        return [line for line in outcome.err.splitlines() if f": {level}: " in line]

    def test_a_gap_is_an_error_of_check_cut_and_run_that_names_both_ends(self):
        for joints in (JOINTS, []):
            self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", *OUTLINE[4:]], joints)
            expected = (
                "slope.dc:7:1: error: the outline does not close: line 4 ends at (18.3, 19.6) and line 5 at (18, 20), "
                f"0.5 apart: let both end at one point, or draw the boundary line between them; {WAY_OUT}"
            )
            for arguments in (("check", "slope.nml"), ("check", "slope.dc"), ("cut", "slope.dc"), ("run", "slope.nml")):
                with self.subTest(arguments=arguments, joints=len(joints)):
                    self.assertEqual(self.problems(*arguments), [expected])

    def test_a_gap_was_missed_where_no_line_counts_as_boundary(self):
        for joints in (JOINTS, ["-1 10 30 10"]):
            self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", *OUTLINE[4:]], joints)
            text = self.path("slope.dc").read_text().splitlines()
            text[1] = text[1].split()[0] + " 0"
            self.write("slope.dc", "\n".join(text) + "\n")
            (problem,) = self.problems("check", "slope.nml")
            self.assertIn("line 4 ends at (18.3, 19.6) and line 5 at (18, 20), 0.5 apart", problem)

    def test_a_gap_was_missed_at_the_end_of_a_drift_where_all_four_directions_meet_blocks(self):
        outline = ["0 0 20 0", "20 0 20 10", "20 10 6 10", "6 10 6 6", "6 6 14 6", "14 6 14 5.1", "14 4.9 14 4"]
        outline += ["14 4 4 4", "4 4 4 10", "4 10 0 10", "0 10 0 0"]
        joints = ["-1 2 21 2", "-1 8 4 8", "6 8 21 8", "2 -1 2 11", "16 -1 16 11", "12 -1 12 4", "12 6 12 11"]
        self.write_slope(outline, joints)
        text = self.path("slope.dc").read_text().splitlines()
        text[1] = text[1].split()[0] + " 0"
        self.write("slope.dc", "\n".join(text) + "\n")
        (problem,) = self.problems("check", "slope.dc")
        self.assertIn("line 6 ends at (14, 5.1) and line 7 at (14, 4.9), 0.2 apart", problem)

    def test_a_gap_was_missed_where_both_lines_close_another_compartment(self):
        # walls of the boundary from the face to the left side and through the bench
        walls = ["-1 10 30 10", "10 -1 10 30"]
        self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", *OUTLINE[4:], *walls], [])
        (problem,) = self.problems("check", "slope.nml")
        self.assertIn("line 4 ends at (18.3, 19.6) and line 5 at (18, 20), 0.5 apart", problem)

    def test_joints_drawn_beyond_the_outline_or_with_bridges_are_no_gap(self):
        beyond = [f"{-5 - k % 3} {4 + 0.5 * k} {5 + 2 * k} {4 + 0.5 * k}" for k in range(6)]
        bridges = ["20 2 26 4", "26.4 4.1 33 6"]
        for count in (6, 0):
            self.write_slope(OUTLINE, [*beyond, *bridges])
            text = self.path("slope.dc").read_text().splitlines()
            text[1] = f"{text[1].split()[0]} {count}"
            self.write("slope.dc", "\n".join(text) + "\n")
            self.assertEqual(self.problems("check", "slope.nml", code=0), [])

    def test_pairs_of_joints_that_end_beyond_the_outline_were_refused(self):
        walls = ["-5 4 45 4", "-5 4.5 45 4.5", "-5 12 30 12"]
        chains = [row for y in (6, 6.4, 14) for row in (f"-5 {y} 5 {y + 0.5}", f"5 {y + 0.5} 15 {y}")]
        for outline, joints in (([*OUTLINE, *walls], []), (OUTLINE, walls), (OUTLINE, [*walls, *chains])):
            for count in (len(outline), 0):
                self.write_slope(outline, joints)
                text = self.path("slope.dc").read_text().splitlines()
                text[1] = f"{text[1].split()[0]} {count}"
                self.write("slope.dc", "\n".join(text) + "\n")
                with self.subTest(boundary=count, lines=len(outline) + len(joints)):
                    self.assertEqual(self.problems("check", "slope.nml", code=0), [])

    def test_random_joints_across_a_square_that_no_line_counts_as_boundary_were_refused(self):
        draw = random.Random(3)
        square = ["0 0 9 0", "9 0 9 9", "9 9 0 9", "0 9 0 0"]
        joints = []
        for _ in range(300):
            x, y = draw.uniform(0, 9), draw.uniform(0, 9)
            angle, length = draw.choice((0.3, 1.4)) + draw.gauss(0, 0.1), draw.expovariate(0.25)
            dx, dy = length * math.cos(angle), length * math.sin(angle)
            joints.append(f"{x - dx:.6f} {y - dy:.6f} {x + dx:.6f} {y + dy:.6f}")
        rows = [f"{row} 1" for row in [*square, *joints]]
        self.write("net.dc", "\n".join(["0.001", f"{len(rows)} 0", "0 0 0 0 0 0", *rows, ""]))
        self.assertEqual(self.problems("cut", "net.dc", code=0), [])

    def test_two_gaps_and_a_side_that_is_missing(self):
        self.write_slope([OUTLINE[0], "40 0 40 7.75", OUTLINE[2], *OUTLINE[4:]])
        first, second = self.problems("check", "slope.nml")
        self.assertIn("line 2 ends at (40, 7.75) and line 3 at (40, 8), 0.25 apart", first)
        self.assertIn("line 3 ends at (26, 8) and line 4 at (18, 20), 14.4 apart", second)

    def test_a_line_that_ends_before_the_middle_of_another(self):
        self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", "19 20 0 20", OUTLINE[5]])
        (problem,) = self.problems("check", "slope.nml")
        self.assertIn("line 4 ends at (18.3, 19.6) and passes line 5 at (18.3, 20), 0.4 apart", problem)

    def test_a_boundary_line_that_bounds_nothing_is_named(self):
        self.write_slope([*OUTLINE, "50 0 50 9"])
        self.assertEqual(
            self.problems("check", "slope.nml"),
            [
                "slope.dc:10:1: error: line 7 of the boundary, from (50, 0) to (50, 9), bounds no block: delete it, or "
                f"draw it as a joint; {WAY_OUT}"
            ],
        )

    def test_allowed_outlines_run_with_a_warning(self):
        self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", *OUTLINE[4:]])
        for arguments in (("check", "slope.nml"), ("check", "slope.dc"), ("cut", "slope.dc"), ("run", "slope.nml")):
            with self.subTest(arguments=arguments):
                said = self.problems(*arguments, "--allow-open", code=0, level="warning")
                self.assertIn("line 4 ends at (18.3, 19.6)", said[0])
        self.write_slope([*OUTLINE[:3], "26 8 18.3 19.6", *OUTLINE[4:]], option=", allow_open = .true.")
        for arguments in (("run", "slope.nml"), ("check", "slope.nml")):
            self.assertIn("0.5 apart", self.problems(*arguments, code=0, level="warning")[0])
        self.write("cut.nml", "&run allow_open = .true. /\n")
        self.problems("cut", "slope.dc", "--config", "cut.nml", code=0)

    def test_outlines_that_close_are_no_problem(self):
        for name, outline in {
            "closed": OUTLINE,
            "lines cross at the corners": ["-1 0 41 0", "40 -1 40 9", "41 8 25 8", "26.6667 7 17.3333 21",
                                           "19 20 -1 20", "0 21 0 -1"],
            "a joint is part of the outline": [*OUTLINE[:3], "26 8 24.6667 10", "10 20 0 20", OUTLINE[5]],
            "gap below e0": [*OUTLINE[:3], "26 8 18.0005 20", *OUTLINE[4:]],
            "a wall inside": [*OUTLINE, "10 0 10 10"],
            "an island": [*OUTLINE, "20 2 24 2", "24 2 24 6", "24 6 20 2"],
        }.items():  # fmt: skip
            with self.subTest(name):
                self.write_slope(outline)
                self.assertEqual(self.problems("check", "slope.nml", code=0), [])
                self.assertEqual(
                    [w for w in self.problems("cut", "slope.dc", code=0, level="warning") if "outline d" in w], []
                )
