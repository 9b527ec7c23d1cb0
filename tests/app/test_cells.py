# SPDX-License-Identifier: MIT
"""Blocks of regions become cells: what the commands say of them, and what results and checkpoints hold."""

import unittest

from faults import differences
from results_case import ResultsTest
from support import ProgramTest, h5py

if h5py is not None:
    import numpy as np

# The block on the base (2 x 1 about (2, 1.5): the circle holds 1.6 of its area) becomes 4 x 2 cells, the base stays.
OPTIONS = """\
&region name = 'Top', circle = 2,1.5, 0.9 /
&subdivide region = ' top ', size = 0.5, joint_material = 1 /
"""
# joint material 2 is one that the options add
NAMED = (
    "&joint_material number = 2, name = 'Tie', friction = 30, tie = .true. /\n"
    "&region name = 'Top', circle = 2,1.5, 0.9 /\n&subdivide region = 'top', size = 0.5, joint_material = ' TIE' /\n"
)
FILES = ("block.dc", "block.df")


@unittest.skipIf(h5py is None, "h5py is missing")
class Cantilevers(ProgramTest):
    """6 m long, 1 m high, held along its end, under its weight."""

    def write_model(self, above, joint="tie = .true.", below=0.25):
        lines = ["0 0 6 0 1", "6 0 6 1 1", "6 1 0 1 1", "0 1 0 0 1", "0 0.5 6 0.5 2"]
        self.write("beam.dc", "\n".join(["1e-4", "5 0", "0 0 0 0 1 0", *lines, "5.99 0.49\n"]))
        self.write(
            "beam.nml",
            "&model geometry = 'beam.dc' /\n"
            "&block_material number = 1, density = 2500, young = 20e9, poisson = 0.25 /\n"
            f"&joint_material number = 1, friction = 30 /\n&joint_material number = 2, friction = 50, {joint} /\n"
            "&joint_material number = 3, friction = 50, tie = .true. /\n&load gravity = 9.81 /\n"
            "&region name = 'low', box = 0,0, 6,0.5 /\n&region name = 'high', box = 0,0.5, 6,1 /\n"
            f"&subdivide region = 'low', size = {below}, joint_material = 3 /\n"
            f"&subdivide region = 'high', size = {above}, joint_material = 3 /\n"
            "&boundary along = 0,0, 0,1, kind = 'fixed' /\n&stage name = 'weight', until = 'equilibrium' /\n",
        )

    def test_a_held_edge_of_cells_lets_them_bend(self):
        """Held at both ends of its edge a cell could not: 0.84 of Timoshenko's deflection."""
        self.write_model(0.25)
        outcome = self.run_program("run", "beam.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        young, load, length = 20e9 / (1 - 0.25**2), 2500 * 9.81, 6
        expected = load * length**4 / (8 * young / 12) + load * length**2 / 2 / (20e9 / 2.5 * 5 / 6)
        with h5py.File(self.path("beam.h5")) as file:
            self.assertAlmostEqual(-file["history/measured_displacement"][-1, 0, 1] / expected, 1, delta=0.03)
            force = file["history/boundary_force"][-1, 0]
            self.assertAlmostEqual(force[1], load * length, delta=1e-3 * load * length)

    def test_layers_whose_cells_do_not_match_are_told(self):
        words = "joint material 2 holds cells of different blocks whose edges do not match, on "
        bond = "cohesion = 1e6, tension = 1e6, normal_stiffness = 4e12, shear_stiffness = 1e12"
        for joint, above, warned in (
            ("tie = .true.", 0.25, False),
            ("tie = .true.", 0.175, True),
            (bond, 0.25, False),
            (bond, 0.125, True),
            ("cohesion = 0", 0.175, False),
        ):
            with self.subTest(joint=joint, above=above):
                self.write_model(above, joint)
                self.assertIs(words in self.run_program("check", "beam.nml").err, warned)

    def test_tied_polygons_with_many_neighbours_are_told(self):
        """Cantilevers of such blocks deflect by 8 to 75 % too little: two rows of bricks 2:1 by 32 %."""

        def told(rows, size=1.0, joint="tie = .true.", more="", bond=0.5):
            lines = [(0, 0, 6, 0), (6, 0, 6, 1), (6, 1, 0, 1), (0, 1, 0, 0)]
            for row in range(rows):
                low, high = row / rows, (row + 1) / rows
                lines += [(0, low, 6, low)] * (row > 0)
                start = size * (1 - bond * (row % 2))
                lines += [
                    (start + k * size, low, start + k * size, high) for k in range(int((6 - start) / size - 1e-9) + 1)
                ]
            text = "".join(f"{x} {y} {u} {v} 2\n" for x, y, u, v in lines)
            self.write("beam.dc", f"1e-4\n{len(lines)} 4\n0 0 0 0 0 0\n{text}")
            self.write(
                "beam.nml",
                "&model geometry = 'beam.dc' /\n"
                "&block_material number = 1, density = 2500, young = 20e9, poisson = 0.25 /\n"
                f"&joint_material number = 2, friction = 50, {joint} /\n&load gravity = 9.81 /\n"
                f"&boundary along = 0,0, 0,1, kind = 'fixed' /\n&stage name = 'a', until = 'equilibrium' /\n{more}",
            )
            outcome = self.run_program("check", "beam.nml")
            self.assertEqual(outcome.code, 0, outcome.err)
            return "such polygons hardly bend" in outcome.err

        self.assertTrue(told(2))
        self.assertTrue(told(2, size=0.7))
        self.assertTrue(told(4))
        self.assertFalse(told(4, bond=0))
        self.assertFalse(told(4, joint="cohesion = 1e6, tension = 5e5"))
        for kind in ("rectangles", "triangles"):
            self.assertFalse(told(1, size=7, more=f"&subdivide size = 0.2, kind = '{kind}', joint_material = 2 /\n"))


@unittest.skipIf(h5py is None, "h5py is missing")
class Cells(ResultsTest):
    def setUp(self):
        super().setUp()
        self.write("cells.nml", OPTIONS)

    def messages(self, options, *, code):
        """Lines of `rockdda check` with this options file that name a problem, without those that quote the file."""
        self.write("cells.nml", options)
        outcome = self.run_program("check", *FILES, "cells.nml", "--quiet" if code else "--json")
        self.assertEqual(outcome.code, code, outcome.err)
        if code == 0:
            return [item["message"] for item in outcome.json["messages"]]
        return [line for line in outcome.err.splitlines() if ": error: " in line]

    def test_results_hold_the_cells_and_their_parents(self):
        whole, _ = self.run_model(*FILES, "--steps", "1")
        data, attributes = self.run_model(*FILES, "--config", "cells.nml", "--steps", "3")
        self.assertNotIn("model/parent", whole)
        parent = data["model/parent"]
        top = int(np.argmin(whole["model/block_area"]))
        expected = np.repeat([0, 1], [8, 1] if top == 0 else [1, 8])
        self.assertTrue(np.array_equal(parent, expected))
        self.assertEqual(parent.dtype.str, "<i4")
        area = np.bincount(parent, weights=data["model/block_area"])
        # areas of binary fractions are exact
        self.assertEqual(area.tolist(), whole["model/block_area"].tolist())
        # the fixed points stay in the base; the loading point (2, 1.5) lies where four cells meet
        base = int(np.flatnonzero(parent == 1 - top)[0])
        self.assertEqual(attributes["model/fixed_points"]["block"].tolist(), [base, base])
        first = int(np.flatnonzero(parent == top)[0])
        self.assertEqual(attributes["model/loading_points"]["block"].tolist(), [first + 1])
        self.assertEqual(data["frames/centroid"].shape[1], 9)

    def test_a_resumed_run_has_the_same_bits(self):
        for arguments in (
            ("run", *FILES, "--config", "cells.nml", "--steps", "6", "-o", "all.h5"),
            ("run", *FILES, "--config", "cells.nml", "--steps", "3", "-o", "parts.h5"),
            ("resume", "parts.ckpt.h5", "--steps", "3"),
        ):
            outcome = self.run_program(*arguments)
            self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(differences(self.path("all.h5"), self.path("parts.h5")), [])
        # the same by several threads
        threads = ("--threads", "2")
        outcome = self.run_program("run", *FILES, "--config", "cells.nml", "--steps", "6", "-o", "2.h5", *threads)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(differences(self.path("all.h5"), self.path("2.h5")), [])

    def test_the_commands_say_how_many_cells_there_are(self):
        self.run_model(*FILES, "--config", "cells.nml", "--steps", "1")
        said = self.messages(OPTIONS, code=0)
        self.assertIn("cells: 1 block of 2 cut into 8, 9 blocks in all", said)
        self.assertIn("region 'Top': 1 block", said)
        log = self.path("out.log").read_text()
        self.assertIn("cells: 1 block of 2 cut into 8, 9 blocks in all", log)
        self.assertRegex(log, r"region 1 += name Top, circle 1 row of x, y, r: \(2 1.5 0.9\)\n")
        self.assertRegex(log, r"subdivide 1 += region  top, size 0.5, kind rectangles, joint_material 1\n")
        facts = self.run_program("info", "out.h5", "--json").json["files"][0]
        self.assertEqual((facts["blocks"], facts["cells"], facts["blocks_before_subdivision"]), (9, 8, 2))
        outcome = self.run_program("cut", "block.dc", "--config", "cells.nml", "--json")
        self.assertEqual((outcome.json["blocks"], outcome.json["blocks_before_subdivision"]), (9, 2))
        # the block file is a model of its own
        self.assertEqual(len(self.run_model("block.blk", "block.df", "--steps", "1")[0]["model/block_area"]), 9)

    def test_groups_of_one_name_add_up_and_the_last_subdivision_counts(self):
        data, _ = self.run_model(
            *FILES,
            "--config",
            self.write(
                "several.nml",
                "&region name = 'all', box = 1,1, 3,2 /\n&region name = 'ALL', polygon = 0,0, 4,0, 4,1, 0,1 /\n"
                "&region name = 'one', material = '1' /\n"
                "&subdivide size = 0.1, joint_material = 1 /\n"
                "&subdivide region = 'one', size = 0.25, joint_material = 1 /\n"
                "&subdivide region = 'all', size = 1, kind = 'triangles', joint_material = 1 /\n",
            ),
            "--steps",
            "1",
        )
        # the base 4 x 1 in 8 triangles, the block 2 x 1 in 4
        self.assertEqual(sorted(np.bincount(data["model/parent"]).tolist()), [4, 8])
        self.assertEqual(np.diff(data["model/vertex_offset"]).tolist(), 12 * [3])

    def test_a_joint_material_of_the_options_by_name(self):
        data, _ = self.run_model(*FILES, "--config", self.write("named.nml", NAMED), "--steps", "1")
        # 4 x 2 cells have 2*3 + 4 inner sides, each the edge of two cells
        self.assertEqual(np.bincount(data["model/edge_joint"]).tolist()[2], 20)
        numbered = NAMED.replace("' TIE'", "2")
        same, _ = self.run_model(*FILES, "--config", self.write("numbered.nml", numbered), "--steps", "1")
        self.assertTrue(np.array_equal(data["model/edge_joint"], same["model/edge_joint"]))
        outcome = self.run_program("cut", "block.dc", "--config", "named.nml")
        self.assertEqual(outcome.code, 0, outcome.err)

    def test_a_region_without_a_block_is_a_warning(self):
        said = self.messages("&region name = 'far', box = 50,50, 60,60 /", code=0)
        self.assertIn("region 'far' has no block: none has more than half of its area inside", said)

    def test_how_many_blocks_a_region_has_is_not_said_before_an_error(self):
        for options, said in ((OPTIONS, True), (OPTIONS.replace(" top ", "tip"), False)):
            self.write("cells.nml", options)
            outcome = self.run_program("check", *FILES, "cells.nml")
            self.assertEqual(outcome.code, 0 if said else 2)
            self.assertEqual("region 'Top': 1 block" in outcome.err, said, outcome.err)

    def test_errors_name_what_is_wrong(self):
        region = "&region name = 'top', "
        one_of = "&region: give one of box, circle, polygon, material, outline; groups of one name add up"
        unknown_joint = OPTIONS.replace("joint_material = 1", "joint_material = 2")
        for options, expected in {
            OPTIONS.replace(" top ", "tip"): "&subdivide: there is no region 'tip'; did you mean 'Top'?",
            unknown_joint: "&subdivide: joint material 2 is unknown, there is 1 joint material",
            NAMED.replace("= ' TIE'", "= 'tei'"): "&subdivide: there is no joint material 'tei'; did you mean 'Tie'?",
            OPTIONS.replace("0.5,", "1e-5,"): "&subdivide: cells of size 1e-05 would be about 2e+10, more than 5e+06",
            region + "/": one_of,
            region + "box = 0,0,1,1, circle = 0,0,1 /": one_of,
            region + "box = 1,0,0,1 /": "&region: box: xmin < xmax and ymin < ymax must hold, found 1, 0, 0, 1",
            region + "circle = 1,0,0 /": "&region: circle: the radius must be greater than 0, found 0",
            region + "polygon = 1,0,0,1 /": "&region: polygon: at least three corners are needed, found 2",
            region + "material = '1, 2' /": "&region: block material 2 is unknown, there is 1 block material",
            region + "material = 'rock' /": "&region: there is no block material 'rock': without names they are called "
            "by their numbers, 1 to 1",
            "&region box = 0,0,1,1 /": "&region: 'name' is missing",
            "&region name = ' ', box = 0,0,1,1 /": "&region: name must have a letter and no comma, found ' '",
            "&subdivide size = 1 /": "&subdivide: 'joint_material' is missing",
            "&subdivide joint_material = 1 /": "&subdivide: 'size' is missing",
        }.items():
            with self.subTest(options=options):
                said = self.messages(options, code=2)
                self.assertEqual([line.split(": error: ")[1] for line in said], [expected])


if __name__ == "__main__":
    unittest.main()
