# SPDX-License-Identifier: MIT
"""What is said of lines that share an edge."""

from support import ProgramTest


class Lines(ProgramTest):
    def warnings(self, *joints, e0="0.01"):
        rows = ["0 0 10 0 1", "10 0 10 10 1", "10 10 0 10 1", "0 10 0 0 1", *joints]
        self.write("a.dc", "\n".join([e0, f"{len(rows)} 4", "0 0 0 0 0 0", *rows, ""]))
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

    def test_joints_that_the_edge_node_distance_merges_are_told(self):
        """A plate between two joints was gone, and the other one askew, without a word."""
        first, second = self.warnings("0 5 10 5 1", "0 5.5 10 5.5 1", e0="1")
        self.assertEqual(first, "line 5 is moved by 0.5 near (0, 5.5) and is one with line 6")
        self.assertEqual(second, "line 6 is moved by 0.5 near (10, 5) and is one with line 5")
        outcome = self.run_program("cut", "a.dc", "-o", "a.blk")
        self.assertRegex(outcome.err, r"moved by 0.5 .* 7.1 % of the size of a block: the edge-node distance 1")
        # two ends that become one
        (text,) = self.warnings("0 5 10 5 1", "0 5.6 10 9 1", e0="1")
        self.assertRegex(text, r"line 5 is moved by 0.6 near \(0, 5.6\), .* the edge-node distance 1 merges")
        # what merging is for: ends that miss a line, and lines drawn twice, by little
        self.assertEqual(self.warnings("0.2 5 9.9 5 1", "0.1 5.05 9.8 5.05 1", e0="0.21"), [])
        self.assertEqual(self.warnings("0 5 10 5 1", "0 5.5 10 5.5 1", e0="0.4"), [])

    def test_an_outline_that_touches_itself_is_shown_where_it_does(self):
        """Its first corner was named."""
        texts = self.warnings("10 5 8 4 1", "8 4 8 6 1", "8 6 10 5 1", e0="0.001")
        self.assertEqual(texts, ["the outline of block 1 touches itself at a corner near (10, 5)"])

    def test_an_opening_is_no_island(self):
        inner = ("4 4 6 4 1", "6 4 6 6 1", "6 6 4 6 1", "4 6 4 4 1")
        (text,) = self.warnings(*inner)
        self.assertRegex(text, "belongs to an island: a closed loop inside block 1 that")
        self.path("a.dc").write_text(self.path("a.dc").read_text().replace("0 0 0 0 0 0", "0 0 0 0 0 1") + "5 5\n")
        outcome = self.run_program("check", "a.dc")
        self.assertIn("belongs to an opening: a closed loop inside block 1 that", outcome.err)
        self.assertNotIn("island", outcome.err)
