# SPDX-License-Identifier: MIT
"""Bolts, loads and measured points on blocks that stages excavate and place: told, and with the forces of statics."""

import unittest

from results_case import ResultsTest
from support import h5py

if h5py is not None:
    import numpy as np

#: Three blocks of 1 m x 1 m upon each other, from below a, b, c; the weight of each.
WEIGHT = 25000.0
REST = "until = 'equilibrium', tolerance = 1e-8"
LINES = ((0, 0, 1, 0), (1, 0, 1, 3), (1, 3, 0, 3), (0, 3, 0, 0), (0, 1, 1, 1), (0, 2, 1, 2))


@unittest.skipIf(h5py is None, "h5py is missing")
class ColumnTest(ResultsTest):
    def write_column(self, *stages, bolts=(), loading=(), measured=(), more=""):
        """Write the column and its stages; `bolts`, `loading` and `measured` are rows of the geometry."""
        rows = ["0.001", f"{len(LINES)} 4", "0", str(len(bolts)), "0", str(len(loading)), str(len(measured)), "0"]
        rows += [" ".join(map(str, line)) + " 1" for line in LINES]
        rows += [" ".join(map(str, row)) for row in (*bolts, *loading, *measured)]
        self.write("column.dc", "\n".join(rows) + "\n")
        self.write(
            "column.nml",
            "&model geometry = 'column.dc' /\n"
            "&block_material number = 1, density = 2500, young = 1e10, poisson = 0 /\n"
            "&joint_material number = 1, friction = 35 /\n&load gravity = 10 /\n&time dt_max = 0.01 /\n"
            "&boundary along = 0,0, 1,0, kind = 'fixed' /\n"
            "&region name = 'top', box = 0,2, 1,3 /\n" + "".join(f"&stage {stage} /\n" for stage in stages) + more,
        )

    def run_column(self, *stages, resumed_after=None, **more):
        """Run the column through stages."""
        self.write_column(*stages, **more)
        if resumed_after is None:
            return self.run_model("column.nml")[0]
        for arguments in (
            ("run", "column.nml", "-o", "part.h5", "--force", "--steps", resumed_after),
            ("resume", "part.ckpt.h5", "--steps", 1000),
        ):
            outcome = self.run_program(*arguments, "--quiet")
            self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("part.h5")) as file:
            return {name: file[name][()] for name in ("history/unbalanced", "history/boundary_force")}

    def messages(self):
        return [item["message"] for item in self.run_program("check", "column.nml", "--json").json["messages"]]

    def reactions(self, data):
        """Vertical force of the base at the end of each stage, in weights of a block."""
        stage, force = data["history/stage"], data["history/boundary_force"][:, 0, 1]
        return [force[np.flatnonzero(stage == i)[-1]] / WEIGHT for i in range(stage[-1] + 1)]

    def stresses(self, data):
        """Vertical stress of the blocks from below in the last frame, in weights."""
        return data["frames/stress"][-1][np.argsort(data["model/block_centroid"][:, 1]), 1] / WEIGHT


class Bolts(ColumnTest):
    #: From the middle of a to the middle of c, pretension of two weights; so soft that nothing changes it.
    PRETENSION = 2
    BOLT = (0.5, 0.5, 0.5, 2.5, 1e5, PRETENSION * WEIGHT, 0)

    def test_its_force_is_released_with_the_excavation(self):
        p = self.PRETENSION
        for share in (0.25, 1):
            data = self.run_column(
                REST, f"{REST}, excavate = 'top', relax = {share}", bolts=[self.BOLT], resumed_after=None
            )
            held = 1 - share
            # c weighed on b, and the bolt pulled both together; a is pulled up by what is held of the bolt
            on_b = held * (1 + p)
            under_a = 2 + on_b - held * p
            np.testing.assert_allclose(self.reactions(data), [3, under_a], rtol=1e-4)
            expected = [-(under_a + 1 + on_b) / 2, -(1 + 2 * on_b) / 2, 0]
            np.testing.assert_allclose(self.stresses(data), expected, rtol=1e-4, atol=1e-9)
            # before, the bolt pressed the blocks together; it gives no force when it is gone
            self.assertAlmostEqual(data["frames/bolt_force"][-1][0], 0, delta=1e-9)
        self.assertIn(
            "&stage 'stage 2': 1 bolt with an end in excavated blocks: their force is released with the excavation",
            self.messages(),
        )

    def test_it_has_its_pretension_when_its_block_is_placed(self):
        p = self.PRETENSION
        stages = (REST, f"{REST}, place = 'top'")
        data = self.run_column(*stages, bolts=[self.BOLT])
        np.testing.assert_allclose(self.reactions(data), [2, 3], rtol=1e-5)
        np.testing.assert_allclose(self.stresses(data), [-2.5 - p / 2, -1.5 - p, -0.5 - p / 2], rtol=1e-4)
        self.assertAlmostEqual(data["frames/bolt_force"][-1][0] / WEIGHT, p, delta=1e-4)
        self.assertIn(
            "&stage 'stage 2': 1 bolt with an end in placed blocks, with their pretension from then on",
            self.messages(),
        )
        n = len(data["history/step"])
        resumed = self.run_column(*stages, bolts=[self.BOLT], resumed_after=n - 2)
        for name, values in resumed.items():
            np.testing.assert_array_equal(values, data[name], err_msg=name)

    def test_and_again_when_the_block_comes_back(self):
        p = self.PRETENSION
        data = self.run_column(REST, f"{REST}, excavate = 'top'", f"{REST}, place = 'top'", bolts=[self.BOLT])
        np.testing.assert_allclose(self.reactions(data), [3, 2, 3], rtol=1e-5)
        np.testing.assert_allclose(self.stresses(data), [-2.5 - p / 2, -1.5 - p, -0.5 - p / 2], rtol=1e-4)


class Loads(ColumnTest):
    POINT = "&loading_point force = {} /\n"
    LINE = "&line_load ends = 0,3, 1,3, force_start = 0,-25000, force_end = 0,-25000 /\n"
    AT = (0.5, 2.5)

    def test_point_and_line_go_with_the_block(self):
        more = self.POINT.format("0,0,-50000") + self.LINE
        data = self.run_column(
            REST, f"{REST}, excavate = 'top', relax = 0.5", f"{REST}, relax = 1", loading=[self.AT], more=more
        )
        # the contact gave weight, point and line: half of it is held
        np.testing.assert_allclose(self.reactions(data), [3 + 2 + 1, 2 + 0.5 * (1 + 2 + 1), 2], rtol=1e-5)
        told = self.messages()
        for what in ("1 loading point", "1 line load"):
            self.assertIn(f"&stage 'stage 2': {what} on excavated blocks, without effect from then on", told)

    def test_they_act_from_when_the_block_is_placed(self):
        more = self.POINT.format("0,0,-50000") + self.LINE
        data = self.run_column(
            REST, f"{REST}, place = 'top'", f"{REST}, excavate = 'top'", loading=[self.AT], more=more
        )
        np.testing.assert_allclose(self.reactions(data), [2, 6, 2], rtol=1e-5)
        told = self.messages()
        for what in ("1 loading point", "1 line load"):
            self.assertIn(f"&stage 'stage 2': {what} on placed blocks, with effect from then on", told)

    def test_a_table_that_changes_after_the_equilibrium_is_told(self):
        """It never acted, without a word, while one that changes at once is waited for."""
        for stage, table, told in (
            (REST, "0.5,0, 0.6,1", True),
            (REST, "0,0, 0.05,1", False),
            (REST, "0,1, 5,1", False),
            ("kind = 'static', until_time = 0.4", "0.5,0, 0.6,1", False),
            ("kind = 'static', duration = 0.4", "0.5,0, 0.6,1", False),
        ):
            with self.subTest(stage=stage, table=table):
                self.write_column(stage, more=self.LINE.replace(" /", f", table = {table} /"))
                outcome = self.run_program("run", "column.nml", "-o", "late.h5", "--force")
                self.assertEqual(outcome.code, 0, outcome.err)
                text = r"warning: the table of &line_load 1 \(column.nml:9\) was used up to time 0\.0\d+ s of 0\.6 s: "
                (self.assertRegex if told else self.assertNotRegex)(outcome.err, text)

    def test_a_boundary_that_moves_later_lets_a_stage_come_to_rest(self):
        """It was said to move at all times; one that moves from the start does."""
        for table, told in (("0,0, 2,0, 2.1,1", False), ("0,0, 2,1", True), ("0,1, 2,1", True)):
            more = f"&boundary along = 0,3, 1,3, kind = 'moving', velocity = 0,-0.001, table = {table} /\n"
            self.write_column(REST, more=more)
            found = [text for text in self.messages() if "&boundary 2 moves at all times" in text]
            self.assertEqual(len(found), told, table)

    def test_a_pressure_on_its_edge_goes_too(self):
        more = "&boundary along = 0,3, 1,3, kind = 'traction', pressure = 25000 /\n"
        data = self.run_column(REST, f"{REST}, excavate = 'top'", more=more)
        np.testing.assert_allclose(self.reactions(data), [4, 2], rtol=1e-5)
        self.assertEqual(data["history/boundary_force"][-1, 1].tolist(), [0, 0])
        self.assertIn(
            "&stage 'stage 2': 1 boundary edge on excavated blocks, without effect from then on", self.messages()
        )

    def test_a_stage_does_not_end_while_a_load_grows(self):
        # each step adds 5e-8 of the weight: without the load in mind the stage would be over after some steps
        for name, more, loading in (
            ("point", self.POINT.format("0,0,0, 0.5,0,-0.0625"), [self.AT]),
            ("line", self.LINE.replace("25000", "0.0625").replace(" /", ", table = 0,0, 0.5,1 /"), []),
            (
                "traction",
                "&boundary along = 0,3, 1,3, kind = 'traction', pressure = 0.0625, table = 0,0, 0.5,1 /\n",
                [],
            ),
        ):
            with self.subTest(name):
                data = self.run_column(f"{REST}, max_steps = 400".replace("1e-8", "1e-6"), more=more, loading=loading)
                self.assertGreater(data["history/time"][-1], 0.5)
                self.assertGreaterEqual(len(data["history/step"]), 50)

    def test_a_load_that_is_gone_holds_nothing_up(self):
        # its table goes on for 1000 s
        more = self.POINT.format("0,0,-50000, 1000,0,0")
        data = self.run_column(
            "kind = 'static', duration = 0.05", f"{REST}, excavate = 'top'", loading=[self.AT], more=more
        )
        self.assertAlmostEqual(self.reactions(data)[1], 2, delta=1e-5)
        self.assertLess(len(data["history/step"]), 40)


class MeasuredPoints(ColumnTest):
    def test_they_stay_where_they_were(self):
        data = self.run_column(REST, f"{REST}, excavate = 'top'", measured=[(0.5, 2.5), (0.5, 1.5)])
        moved, stage = data["history/measured_displacement"], data["history/stage"]
        last = np.flatnonzero(stage == 0)[-1]
        np.testing.assert_array_equal(moved[stage == 1][:, 0], np.tile(moved[last, 0], ((stage == 1).sum(), 1)))
        self.assertTrue((data["history/measured_stress"][stage == 1][:, 0] == 0).all())
        # the other goes up with its block
        self.assertGreater(moved[-1, 1, 1], moved[last, 1, 1])
        self.assertIn(
            "&stage 'stage 2': 1 measured point on excavated blocks, without effect from then on", self.messages()
        )

    def test_in_placed_blocks_they_count_from_where_they_were_drawn(self):
        data = self.run_column(REST, f"{REST}, place = 'top'", measured=[(0.5, 2.5), (0.5, 1.5)])
        moved, stage = data["history/measured_displacement"], data["history/stage"]
        self.assertTrue((moved[stage == 0][:, 0] == 0).all())
        self.assertNotEqual(moved[-1, 0, 1], 0)
        np.testing.assert_allclose(data["history/measured_stress"][-1, 0, 1], -0.5 * WEIGHT, rtol=1e-4)


if __name__ == "__main__":
    unittest.main()
