# SPDX-License-Identifier: MIT
"""What is said of lines that share an edge."""

from support import ProgramTest


class Lines(ProgramTest):
    def warnings(self, *joints):
        rows = ["0 0 10 0 1", "10 0 10 10 1", "10 10 0 10 1", "0 10 0 0 1", *joints]
        self.write("a.dc", "\n".join(["0.01", f"{len(rows)} 4", "0 0 0 0 0 0", *rows, ""]))
        outcome = self.run_program("check", "a.dc")
        return [line.split("warning: ")[1] for line in outcome.err.splitlines() if "warning: " in line]

    def test_lines_that_cross_at_a_small_angle_do_not_lie_on_each_other(self):
        # 0.2 in 12; the upright lines cross both where they are within 0.002 of each other
        (text,) = self.warnings("-1 5 11 5 1", "-1 4.9 11 5.1 2", "4.9 -1 4.9 11 1", "5.1 -1 5.1 11 1")
        self.assertRegex(
            text, r"line 5 crosses line 6 near \(.*\) at an angle of 0.95 degrees, closer than the edge-node"
        )

    def test_lines_side_by_side_lie_on_each_other(self):
        (text,) = self.warnings("-1 5 11 5 1", "2 5 8 5.002 2")
        self.assertEqual(text, "line 5 lies on line 6: the joint material of line 6 holds there")
