# SPDX-License-Identifier: MIT
"""Formulation of contacts: whose word prevails, and what is said of options that have no effect in it."""

import re
import unittest

from results_case import ResultsTest

FILES = ("block.dc", "block.df")
TIE = "&joint_material number = 1, tie = .true. /"


class Formulation(ResultsTest):
    def formulation(self, *lines, code=0):
        """The formulation of a run with these lines as its options, and the lines of `rockdda check` on them."""
        self.write("run.nml", "\n".join([*lines, ""]))
        outcome = self.run_program("check", *FILES, "run.nml")
        self.assertEqual(outcome.code, code, outcome.err)
        said = [line for line in outcome.err.splitlines() if line.startswith("run.nml:")]
        if code:
            return None, said
        outcome = self.run_program("run", *FILES, "--config", "run.nml", "--steps", "1", "--force")
        self.assertEqual(outcome.code, 0, outcome.err)
        log = self.path("block.log").read_text()
        return re.search(r"contact formulation += (\w+)\n", log)[1], said

    def test_the_word_of_the_user_prevails_over_a_preset(self):
        taken, said = self.formulation("&contact preset = 'dda_windows',", " formulation = 'length' /")
        self.assertEqual(taken, "length")
        self.assertEqual(len(said), 1)
        self.assertTrue(said[0].startswith("run.nml:2:2: note: formulation 'length' is given: of the preset"), said)
        for options in ("&contact preset = 'dda_windows' /", "&contact formulation = 'vertex' /"):
            self.assertEqual(self.formulation(options), ("vertex", []))

    def test_a_tie_needs_contacts_by_length(self):
        needs = "joint material 1: tie = .true. needs formulation 'length'"
        taken, said = self.formulation("&contact formulation = 'vertex' /", TIE)
        self.assertEqual(taken, "length")
        self.assertEqual(
            said, [f"run.nml:2:1: warning: {needs}, which all contacts of the run take in place of 'vertex'"]
        )
        _, said = self.formulation("&contact preset = 'dda_windows' /", TIE, code=2)
        self.assertEqual(len(said), 1)
        self.assertTrue(said[0].startswith(f"run.nml:2:1: error: {needs}, and the preset 'dda_windows' has"), said)
        # a later group takes it back
        untie = "&joint_law material = 1, tie = .false. /"
        self.assertEqual(self.formulation("&contact preset = 'dda_windows' /", TIE, untie), ("vertex", []))
        self.assertEqual(
            self.formulation("&contact preset = 'dda_windows', formulation = 'length' /", TIE)[0], "length"
        )

    def test_options_without_effect_are_told_with_their_place(self):
        options = (
            "points = 5,",
            "corner_radius = 0.02 /",
            "&joint_material number = 1, normal_stiffness = 1e9, shear_stiffness = 1e9 /",
            "&joint_law material = 1, shear_stiffness = 1e9 /",
        )
        said = self.formulation("&contact formulation = 'vertex',", *options)[1]
        none = (
            "has no effect with formulation 'vertex': there a contact is one vertex, with a sharp corner, on an edge, "
            "and has the stiffness g0"
        )
        places = ((3, "corner_radius"), (4, "normal_stiffness"), (4, "shear_stiffness"))
        expected = [f"run.nml:{line}:1: warning: {name} {none}" for line, name in (*places, (5, "shear_stiffness"))]
        exact = "points has no effect: a joint is integrated exactly over the part that is closed"
        unused = [f"run.nml:2:1: warning: {exact}"]
        self.assertEqual(said, expected + unused)
        self.assertEqual(self.formulation("&contact formulation = 'length',", *options)[1], unused)


if __name__ == "__main__":
    unittest.main()
