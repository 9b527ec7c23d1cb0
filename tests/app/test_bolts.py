# SPDX-License-Identifier: MIT
"""Bolts of the options, `&bolt`: as those of a geometry file, with a name, and between cells of one block."""

import unittest

from support import ProgramTest, h5py

COLUMNS = "0.5 0.5 0.5 3.5  1e6 1e3 2e4\n"
GEOMETRY = """\
0.001
8 0
0
{count}
2
0
1
0
0 0 1 0 1
1 0 1 1 1
1 1 0 1 1
0 1 0 0 1
0 3 1 3 1
1 3 1 4 1
1 4 0 4 1
0 4 0 3 1
{columns}0.1 3.5 0.1 3.5
0.9 3.5 0.9 3.5
0.5 0.5
"""
MODEL = """\
&model geometry = 'hung.dc' /
&block_material number = 1, density = 2500, young = 1e10, poisson = 0.2 /
&joint_material number = 1, friction = 30 /
&joint_material number = 2, friction = 30, tie = .true. /
&load gravity = 9.81 /
&run steps = 20 /
&time dt_max = 0.01 /
"""
GROUP = (
    "&bolt name = 'hanger', from = 0.5, 0.5, to = 0.5, 3.5, stiffness = 1e6, pretension = 1e3, yield_force = 2e4 /\n"
)


class Bolts(ProgramTest):
    def hang(self, group=GROUP, columns="", name="hung"):
        self.write(f"{name}.dc", GEOMETRY.format(count=columns.count("\n"), columns=columns))
        self.write(f"{name}.nml", MODEL.replace("hung", name) + group)

    def run_well(self, *arguments):
        outcome = self.run_program(*arguments)
        self.assertEqual(outcome.code, 0, outcome.err)
        return outcome

    def history(self, name):
        with h5py.File(self.path(name)) as file:
            names = ("history/measured_displacement", "frames/bolt_force", "model/bolt_properties")
            return [file[name][()].tobytes() for name in names]

    @unittest.skipUnless(h5py, "needs h5py")
    def test_a_group_is_the_bolt_of_the_columns(self):
        self.hang()
        self.hang("", COLUMNS, "columns")
        self.run_well("run", "hung.nml")
        self.run_well("run", "columns.nml")
        self.assertEqual(self.history("hung.h5"), self.history("columns.h5"))
        # both kinds in one model: those of the geometry file come first
        self.hang(GROUP.replace("1e6", "2e6"), COLUMNS, "both")
        self.run_well("run", "both.nml")
        with h5py.File(self.path("both.h5")) as file:
            self.assertEqual(file["model/bolt_properties"][()].tolist(), [[1e6, 1e3, 2e4], [2e6, 1e3, 2e4]])

    @unittest.skipUnless(h5py, "needs h5py")
    def test_a_resumed_run_has_the_same_bits(self):
        self.hang()
        self.run_well("run", "hung.nml", "-o", "whole.h5")
        self.run_well("run", "hung.nml", "--steps", "7", "--save-every", "1")
        self.run_well("resume", "hung.ckpt.h5", "--steps", "13")
        self.assertEqual(self.history("hung.h5")[0], self.history("whole.h5")[0])
        line = "bolt 1                             = name hanger, from (0.5 0.5) m, to (0.5 3.5) m, stiffness 1 MN/m, "
        self.assertIn(line + "pretension 1 kN, yield_force 20 kN\n", self.path("hung.log").read_text())

    def test_check_and_cut_have_it(self):
        self.hang()
        self.assertEqual(self.run_well("check", "hung.nml", "--json").json["model"]["bolts"], 1)
        self.write("bolts.nml", GROUP)
        self.run_well("cut", "hung.dc", "--config", "bolts.nml", "-o", "hung.blk")
        self.assertIn("\nbolts 1\n", self.path("hung.blk").read_text())
        # a block file takes bolts of the options, too
        self.write("hung.nml", (MODEL + GROUP).replace("hung.dc", "hung.blk"))
        self.assertEqual(self.run_well("check", "hung.nml", "--json").json["model"]["bolts"], 2)

    def test_bolts_that_hold_nothing(self):
        self.hang(GROUP.replace("0.5, 3.5", "0.5, 5"))
        outcome = self.run_program("check", "hung.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("hung.nml:8:1: error: bolt 'hanger': its end at (0.5, 5) lies in no block", outcome.err)
        self.hang("&bolt from = 0.5, 0.5, to = 0.5, 0.7, stiffness = 1e6 /\n")
        self.assertIn("hung.nml:8:1: warning: bolt 1 has both ends in block", self.run_program("check", "hung.nml").err)
        self.hang("&bolt from = 0.5, 0.5, to = 0.5, 3.5 /\n&bolt from = 0, to = 1, 1, stiffness = 0 /\n")
        outcome = self.run_program("check", "hung.nml")
        self.assertIn("hung.nml:8:1: error: &bolt: 'stiffness' is missing", outcome.err)
        self.assertIn("hung.nml:9:7: error: from: expected 2 numbers, found 1", outcome.err)
        self.assertIn("hung.nml:9:40: error: stiffness: must be greater than 0, found '0'", outcome.err)

    def test_a_bolt_joins_cells_of_a_block(self):
        inside = "&bolt from = 0.25, 0.5, to = 0.75, 0.5, stiffness = 1e6 /\n"
        self.hang(inside)
        self.assertEqual(self.run_well("check", "hung.nml", "--json").json["model"]["bolts"], 0)
        self.hang("&subdivide size = 0.5, joint_material = 2 /\n" + inside)
        self.assertEqual(self.run_well("check", "hung.nml", "--json").json["model"]["bolts"], 1)


if __name__ == "__main__":
    unittest.main()
