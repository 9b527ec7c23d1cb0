# SPDX-License-Identifier: MIT
"""Water: what the check says, results and checkpoints, and the same bits whatever stops or shares the run."""

import unittest

from support import ProgramTest, h5py

if h5py is not None:
    import numpy as np

# A stack of two blocks on a base, and a third beside them.
GEOMETRY = """0.001
14 4
0
0
4
0
0
0
  -3 -1  6 -1  1
  6 -1  6 0  1
  6 0  -3 0  1
  -3 0  -3 -1  1
  2 0  2 1  2
  2 1  0 1  2
  0 1  0 0  2
  1.5 1  1.5 2  2
  1.5 2  0.2 2  2
  0.2 2  0.2 1  2
  2.5 0  3.5 0.5  2
  3.5 0.5  3 1.5  2
  3 1.5  2 1  2
  2 1  2.5 0  2
  -3 -1  -3 -1
  6 -1  6 -1
  -3 0  -3 0
  6 0  6 0
"""
BASE = """&model geometry = 'pile.dc' /
&block_material number = 1, name = 'rock', density = 2600, young = 5e9, poisson = 0.25 /
&joint_material number = 1, name = 'base', friction = 30 /
&joint_material number = 2, name = 'joint', friction = 20 /
&load gravity = 9.81 /
&contact formulation = 'length' /
&time dt_max = 2e-3 /
&run steps = 60, save_every = 20 /
"""
POOL = """&water name = 'pool', table = -3,0.5, 1,1.5, 6,0.8, unit_weight = 9810, level = 0,0, 0.1,0.4 /
"""


SEEPAGE = [(x, y, 9810 * max(0.0, 1.5 + 0.1 * x - y)) for x in range(-4, 8) for y in range(-2, 4)]


class WaterTest(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("pile.dc", GEOMETRY)

    def model(self, groups=POOL):
        """The labelled file with these groups."""
        return self.write("pile.nml", BASE + groups)

    def run_to(self, name, *arguments):
        """A run that must succeed; its results."""
        outcome = self.run_program("run", *arguments, "-o", name)
        self.assertEqual(outcome.code, 0, outcome.err)
        return self.path(name)


class Messages(WaterTest):
    def test_unknown_names_suggest_the_nearest(self):
        wrong = POOL.replace("level", "joints = 'bsae, joint', region = 'dam', level")
        outcome = self.run_program("check", self.model(wrong))
        self.assertEqual(outcome.code, 2)
        self.assertIn("&water 1 'pool': there is no joint material 'bsae'; did you mean 'base'?", outcome.err)
        self.assertIn("&water 1 'pool': there is no region 'dam'", outcome.err)

    def test_water_that_does_little_is_a_warning(self):
        self.write("p.csv", "x,y,p\n0,0,1e4\n1,0,1e4\n0.3,1,2e3\n")
        for group, words in (
            ("table = 0,-9, unit_weight = 9810", "&water 1 wets nothing: the pressure is 0 on all"),
            ("table = 0,9, unit_weight = 9810, joints = 'none', surfaces = .false.", "&water 1 wets nothing: no edge"),
            ("pressure_file = 'p.csv'", "of edges begin beyond the points of pressure_file"),
        ):
            with self.subTest(group):
                outcome = self.run_program("check", self.model(f"&water {group} /\n"))
                self.assertEqual(outcome.code, 0, outcome.err)
                self.assertIn("warning: &water 1", outcome.err)
                self.assertIn(words, outcome.err)

    def test_mistakes_are_errors(self):
        self.write("p.csv", "x,y,p\n0,0,1e4\n1,0,1e4\n0.3,0,2e3\n")
        for group, words in (
            ("name = 'a'", "&water 1 'a': give one of table and pressure_file"),
            ("table = 0,1", "&water 1: table needs the unit_weight of the water"),
            ("table = 0,1, 0,2, unit_weight = 9810", "&water 1: table: x must increase from point to point"),
            ("pressure_file = 'p.csv'", "&water 1: pressure_file: the points make no triangle"),
        ):
            with self.subTest(group):
                outcome = self.run_program("check", self.model(f"&water {group} /\n"))
                self.assertEqual(outcome.code, 2, outcome.err)
                self.assertIn(words, outcome.err)


@unittest.skipIf(h5py is None, "h5py is missing")
class Runs(WaterTest):
    def assert_same(self, first, second):
        with h5py.File(first) as a, h5py.File(second) as b:
            for group in ("model", "history", "frames"):
                self.assertEqual(set(a[group]), set(b[group]))
                for name in a[group]:
                    np.testing.assert_array_equal(a[group][name][()], b[group][name][()], err_msg=f"{group}/{name}")

    def test_same_bits_resumed_and_with_threads(self):
        # a scattered field: every other row is shifted
        rows = "".join(f"{x + 0.1 * (y % 2)},{y},{p}\n" for x, y, p in SEEPAGE)
        self.write("p.csv", "x,y,p\n" + rows)
        dry = self.run_to("dry.h5", self.model(""))
        for group in (POOL, "&water pressure_file = 'p.csv', joints = '2, base' /\n"):
            with self.subTest(group):
                model = self.model(group)
                one = self.run_to("one.h5", model, "--threads", "1", "--force")
                two = self.run_to("two.h5", model, "--threads", "2", "--force")
                self.assert_same(one, two)
                part = self.run_to("part.h5", model, "--steps", "40", "--force")
                outcome = self.run_program("resume", "part.ckpt.h5", "--steps", "20")
                self.assertEqual(outcome.code, 0, outcome.err)
                self.assert_same(one, part)
                with h5py.File(one) as a, h5py.File(dry) as b:
                    self.assertGreater(np.abs(a["frames/vertices"][-1] - b["frames/vertices"][-1]).max(), 1e-4)

    def test_stages_choose_water(self):
        # a block 2 x 1 on a base 4 x 1; supports carry what the water leaves, under y = 1.5 the base and half the block
        head = BASE.replace("pile.dc", "block.dc").split("&time")[0]
        stages = "".join(
            f"&stage name = '{name}', until = 'equilibrium', tolerance = 1e-7{water} /\n"
            for name, water in (("dry", ", water = 'none'"), ("wet", ", water = 'POOL'"), ("still wet", ""))
        )
        groups = (
            "&water name = 'pool', table = 0,1.5, unit_weight = 9810 /\n&water name = 'sea', table = 0,9, "
            "unit_weight = 9810 /\n"
        )
        out = self.run_to("out.h5", self.write("stages.nml", head + groups + stages))
        weight = 2600 * 9.81 * 6
        with h5py.File(out) as file:
            carried = file["history/fixed_force"][()][:, :, 1].sum(axis=1)
            stage = file["history/stage"][()]
            for number, expected in enumerate((weight, weight - 9810 * 5, weight - 9810 * 5)):
                last = np.flatnonzero(stage == number)[-1]
                # the tolerance of equilibrium, and the block sinks by some micrometres
                self.assertAlmostEqual(carried[last] / expected, 1, delta=1e-5)
            self.assertEqual(
                [text.decode().strip() for text in file["model/water_stage"][()]], ["none", "POOL", "POOL"]
            )

    def test_an_unknown_water_of_a_stage(self):
        outcome = self.run_program("check", self.model(POOL + "&stage water = 'pol', duration = 1 /\n"))
        self.assertEqual(outcome.code, 2)
        self.assertIn("&stage: there is no &water 'pol'; did you mean 'pool'?", outcome.err)

    def test_results_hold_tables_and_wetted_edges(self):
        out = self.run_to("out.h5", self.model())
        self.assertEqual(self.run_program("info", out).code, 0)
        with h5py.File(out) as file:
            edges, ends = file["model/water_edges"][()], file["model/water_ends"][()]
            self.assertEqual([name.decode().strip() for name in file["model/water_names"][()]], ["pool"])
            self.assertTrue((edges[:, 0] == 0).all())
            self.assertTrue(((ends[:, 0] >= 0) & (ends[:, 1] > ends[:, 0]) & (ends[:, 1] <= 1)).all())
            np.testing.assert_array_equal(file["model/water_table"][()], [[-3, 0.5], [1, 1.5], [6, 0.8]])
            np.testing.assert_array_equal(file["model/water_level_rise"][()], [0, 0.4])
            # all edges, joints and free ones, from end to end
            length = np.zeros(len(file["model/vertices"]))
            np.add.at(length, edges[:, 1], ends[:, 1] - ends[:, 0])
            np.testing.assert_allclose(length, 1, atol=1e-12)
        dry = self.run_to("dry.h5", self.model(""))
        with h5py.File(dry) as file:
            self.assertNotIn("water_edges", file["model"])


if __name__ == "__main__":
    unittest.main()
