# SPDX-License-Identifier: MIT
"""Boundaries and stress in the ground by files: what results, log, checkpoint and messages hold of them."""

import unittest

from faults import differences
from results_case import ResultsTest
from support import h5py

if h5py is not None:
    import numpy as np

# A column 2 x 4 in four courses, no fixed points.
GEOMETRY = """\
0.001
7 4
0
0
0
0
0
0
0 0 2 0 1
2 0 2 4 1
2 4 0 4 1
0 4 0 0 1
0 1 2 1 1
0 2 2 2 1
0 3 2 3 1
"""
ANALYSIS = """\
0
40
1 1
0.01
0.01
1e9
2500 25000 1e9 0.2
0 0 0
0 0 0
0 0 0
30 0 0
1.4
"""
WEIGHT, SIDE = 8 * 25000, 0.5 * 4 * 4 * 25000 / 2
OPTIONS = """\
&contact formulation = 'length' /
&boundary along = 0,4, 0,0, kind = 'roller' /
&boundary along = 0,0, 2,0, kind = 'fixed' /
&boundary along = 2,0, 2,4, kind = 'roller' /
&boundary along = 0,4, 2,4, kind = 'traction', pressure = 1000, table = 0,0, 0.05,1 /
&in_situ surface = 4, k0 = 0.5 /
"""
MOVING = OPTIONS.replace("'fixed'", "'moving', velocity = 0.1,-0.05").replace(
    "kind = 'roller' /\n&in", "kind = 'fixed' /\n&in"
)


@unittest.skipIf(h5py is None, "h5py is missing")
class Boundaries(ResultsTest):
    def setUp(self):
        super().setUp()
        self.write("column.dc", GEOMETRY)
        self.write("column.df", ANALYSIS)
        self.write("column.nml", OPTIONS)

    def check(self, options, *, code=2):
        self.write("column.nml", options)
        outcome = self.run_program("check", "column.dc", "column.df", "column.nml")
        self.assertEqual(outcome.code, code, outcome.err)
        return [line for line in outcome.err.splitlines() if line.startswith("column.nml:")]

    def test_results_hold_edges_and_forces(self):
        data, attributes = self.run_model("column.dc", "column.df", "--config", "column.nml")
        edges = data["model/boundary_edges"]
        self.assertEqual(np.bincount(edges[:, 0]).tolist(), [4, 1, 4, 1])
        self.assertEqual(attributes["model/boundary_edges"]["kind"].tolist(), ["roller", "fixed", "roller", "traction"])
        # the upper edge begins at its right end
        self.assertEqual(data["model/vertices"][edges[-1, 1]].tolist(), [2.0, 4.0])
        force = data["history/boundary_force"]
        self.assertEqual(force.shape, (40, 4, 2))
        # the pressure grows to 1000 in five steps; the edge gets longer by 1e-9 of itself
        load = 2 * 1000 * np.minimum(1, data["history/time"] / 0.05)
        np.testing.assert_allclose(force[:, 3, 1], -load, rtol=1e-8)
        # what the base bears follows, as fast as inertia lets a static step: the rest decays to 1e-8 in 40 steps
        np.testing.assert_allclose(force[-1, 1], [0, WEIGHT + 2000], rtol=1e-6, atol=1)
        # the load of the first step is 1e-3 of the weight
        np.testing.assert_allclose(force[0, :, 0], [SIDE, 0, -SIDE, 0], rtol=1e-3, atol=1)
        np.testing.assert_array_equal(force[:, (0, 2), 1], 0)

    def test_log_names_the_forces(self):
        data, _ = self.run_model("column.dc", "column.df", "--config", "column.nml")
        log = self.path("out.log").read_text()
        self.assertIn("&boundary 2 (fixed): 1 edge of blocks", log)
        lines = [line for line in log.splitlines() if line.startswith("# boundary")]
        self.assertEqual([line.split(":")[0] for line in lines][:2], ["# boundary 1 (roller)", "# boundary 2 (fixed)"])
        last = float(lines[1].split("(")[-1].rstrip(")").split(",")[1])
        self.assertAlmostEqual(last, data["history/boundary_force"][-1, 1, 1], delta=1e-4)

    def test_a_resumed_run_has_the_same_bits(self):
        for options in (OPTIONS, MOVING):
            self.write("column.nml", options)
            files = ("column.dc", "column.df", "--config", "column.nml")
            for arguments in (
                ("run", *files, "--steps", "8", "-o", "all.h5", "--force"),
                ("run", *files, "--steps", "3", "-o", "parts.h5", "--force"),
                ("resume", "parts.ckpt.h5", "--steps", "5"),
                ("run", *files, "--steps", "8", "-o", "2.h5", "--force", "--threads", "2"),
            ):
                outcome = self.run_program(*arguments)
                self.assertEqual(outcome.code, 0, outcome.err)
            self.assertEqual(differences(self.path("all.h5"), self.path("parts.h5")), [])
            self.assertEqual(differences(self.path("all.h5"), self.path("2.h5")), [])

    def test_stress_that_joints_cannot_bear_is_told(self):
        slanted = GEOMETRY.replace("0 2 2 2 1", "0 1.2 2 2.8 1")
        self.write("column.dc", slanted)
        outcome = self.run_program("run", "column.dc", "column.df", "--config", "column.nml", "-o", "out.h5")
        self.assertNotIn("will move from the stress", outcome.err)
        weak = ANALYSIS.replace("30 0 0", "5 0 0")
        self.write("column.df", weak)
        outcome = self.run_program("run", "column.dc", "column.df", "--config", "column.nml", "-o", "out.h5", "--force")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn(
            "will move from the stress of &in_situ: its shear exceeds the strength of 2 contact points", outcome.err
        )

    def test_all_mistakes_come_in_one_pass(self):
        found = self.check(
            "&boundary along = 0,4, 0,0, kind = 'free_field', table = 0,1, 1,1 /\n"
            "&boundary along = 0,4, 0,0, kind = 'rollr' /\n"
            "&boundary along = 0,4, 0, kind = 'fixed' /\n"
            "&boundary along = 0,4, 0,0, kind = 'moving', table = 1,1, 0,0 /\n"
            "&boundary alon = 0,4, kind = 'fixed' /\n"
            "&boundary along = 0,0, kind = 'traction', velocity = 1,2 /\n"
            "&in_situ surface = 4, k0 = -1 /\n"
            "&in_situ profile = 2,4, 0,4, k0 = 1, region = 'colum' /\n"
            "&in_situ stress = 1,2,3, surcharge = 1 /\n"
            "&region name = 'column', box = 0,0, 2,4 /\n"
        )
        places = {line.split(": error: ")[0].removeprefix("column.nml:"): line.split(": error: ")[1] for line in found}
        expected = {
            "1:1": "&boundary 1: table belongs to kinds 'moving' and 'traction'",
            "2:36": "did you mean 'roller'?",
            "3:11": "expected a multiple of 2 numbers, found 3",
            "4:59": "the times must not decrease",
            "5:11": "unknown name 'alon' in &boundary; did you mean 'along'?",
            "7:28": "k0: must not be negative",
        }
        for place, words in expected.items():
            self.assertIn(words, places.get(place, ""), places)
        for words in (
            "column.nml:4:1: error: &boundary 4: kind 'moving' needs velocity",
            "column.nml:5:1: error: &boundary: 'along' is missing",
            "column.nml:6:1: error: &boundary 6: along: at least two points are needed",
            "column.nml:6:1: error: &boundary 6: velocity belongs to kind 'moving'",
            "column.nml:6:1: error: &boundary 6: kind 'traction' needs one of",
            "column.nml:8:1: error: &in_situ: profile: x must increase",
            "column.nml:8:48: error: &in_situ: there is no region 'colum'; did you mean 'column'?",
            "column.nml:9:1: error: &in_situ: surcharge belongs to",
        ):
            self.assertTrue(any(line.startswith(words) for line in found), (words, found))

    def test_a_free_field_is_for_sides(self):
        found = self.check("&boundary along = 0,0, 2,0, kind = 'free_field' /\n")
        words = (
            "&boundary 1: kind 'free_field' is for the sides of a model; the edge from (0, 0) to (2, 0) is no upright"
        )
        self.assertTrue(any(line.startswith("column.nml:1:1: error: " + words) for line in found), found)

    def test_nothing_carries_weight_on_quiet_boundaries_in_dynamic_steps(self):
        boundary = "&boundary along = 0,0, 2,0, kind = 'viscous' /\n"
        for stages, warned in (
            ("", True),
            ("&stage until = 'equilibrium' /\n&stage k01 = 1, until_step = 40 /\n", False),
        ):
            self.write("column.nml", "&time k01 = 1 /\n" + boundary + stages)
            outcome = self.run_program("check", "column.dc", "column.df", "column.nml")
            words = "column.nml:2:1: warning: &boundary 1 (viscous) holds in static steps only"
            self.assertEqual(words in outcome.err, warned, outcome.err)

    def test_a_free_field_goes_on_after_a_checkpoint(self):
        """Stopped four times: the same bits."""
        self.write("wave.csv", "0 0\n0.05 1\n0.1 -1\n0.2 0\n")
        options = (
            "&run steps = 60 /\n&time k01 = 1, integrator = 'generalized_alpha' /\n"
            "&boundary along = 0,0, 2,0, kind = 'viscous' /\n"
            "&boundary along = 0,4, 0,0, kind = 'free_field' /\n&boundary along = 2,0, 2,4, kind = 'free_field' /\n"
            "&quake record = 'wave.csv', apply = 'viscous_base' /\n"
        )
        self.write("column.nml", options)
        whole = self.run_program("run", "column.dc", "column.df", "--config", "column.nml", "-o", "whole.h5")
        self.assertEqual(whole.code, 0, whole.err)
        outcome = self.run_program(
            "run", "column.dc", "column.df", "--config", "column.nml", "-o", "half.h5", "--max-wall", "1e-9"
        )
        self.assertEqual(outcome.code, 4, outcome.err)
        for steps in ("7", "1", "1", "51"):
            outcome = self.run_program("resume", "half.ckpt.h5", "--steps", steps)
            self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("whole.h5")) as a, h5py.File(self.path("half.h5")) as b:
            force = a["history/boundary_force"][()]
            self.assertGreater(np.abs(force[:, 1]).max(), 0)
            self.assertTrue(np.array_equal(force, b["history/boundary_force"][()]))

    def test_boundaries_that_do_not_fit_the_model(self):
        found = self.check(
            "&boundary along = 0,4.5, 2,4.5, kind = 'fixed' /\n"
            "&boundary along = 0,0, 2,0, kind = 'fixed' /\n"
            "&boundary along = 2,0, 0,0, kind = 'roller' /\n"
            "&boundary along = 0,1, 2,1, kind = 'traction', pressure = 1 /\n"
        )
        errors = [line for line in found if ": error: " in line]
        self.assertEqual([line.split(":")[1] for line in errors], ["1", "3", "4"])
        self.assertIn("the nearest one leads from (2, 4) to (0, 4), 0.5 away", errors[0])
        self.assertIn("kind 'roller' holds the edge from (0, 0) to (2, 0), which boundary 2 holds already", errors[1])
        self.assertIn("no outer edge", errors[2])

    def test_material_stress_is_replaced_with_a_note(self):
        self.write("column.df", ANALYSIS.replace("0 0 0\n", "-1 -1 0\n", 1))
        found = self.check("&in_situ surface = 4, k0 = 0.5 /\n", code=0)
        self.assertIn(
            "column.nml:1:1: note: &in_situ replaces the initial stress of the block material in 4 blocks", found
        )


if __name__ == "__main__":
    unittest.main()
