# SPDX-License-Identifier: MIT
"""Models as a stranger writes them: water in stressed ground, map coordinates, records, fill, and what is told."""

import math
import unittest

from results_case import ResultsTest
from support import h5py

if h5py is not None:
    import numpy as np

# A column 2 x 4; the joints between y = 1.8 and 2.3 are inclined, one is upright.
LINES = (
    (0, 0, 2, 0),
    (2, 0, 2, 4),
    (2, 4, 0, 4),
    (0, 4, 0, 0),
    (0, 1, 2, 1),
    (0, 1.8, 2, 2.3),
    (0, 3, 2, 3),
    (1, 0, 1, 4),
)


def model(dx=0.0, dy=0.0, more="", water=True, stress=""):
    """Geometry and labelled file of the column, moved by (dx, dy)."""

    def moved(*numbers):
        return ", ".join(repr(float(v) + (dx, dy)[i % 2]) for i, v in enumerate(numbers))

    rows = ["0.001", "8 4", *"000000", *(moved(*line).replace(",", "") + " 1" for line in LINES)]
    text = f"""\
&model geometry = 'column.dc' /
&block_material number = 1, density = 2500, young = 1e9, poisson = 0.2 /
&joint_material number = 1, friction = 35 /
&load gravity = 10 /
&boundary along = {moved(0, 4, 0, 0)}, kind = 'roller' /
&boundary along = {moved(0, 0, 2, 0)}, kind = 'fixed' /
&boundary along = {moved(2, 0, 2, 4)}, kind = 'roller' /
&in_situ surface = {4 + dy!r}, k0 = 0.8{stress} /
"""
    if water:
        # crosses blocks and the upright joint, has a kink
        text += f"&water name = 'ground', table = {moved(0, 2.7, 1.3, 3.2, 2, 2.4)}, unit_weight = 9810 /\n"
    return "\n".join(rows) + "\n", text + more


#: less than the blocks weigh: they settle
LESS = ", unit_weight = 2e4"


@unittest.skipIf(h5py is None, "h5py is missing")
class GroundTest(ResultsTest):
    def run_column(self, *, steps=100, code=0, **choice):
        geometry, text = model(**choice)
        self.write("column.dc", geometry)
        if steps:
            text += f"&time k01 = 0 /\n&run steps = {steps} /\n"
        self.write("column.nml", text)
        return self.run_model("column.nml", code=code)[0]

    def said(self, text, code=0):
        self.write("column.nml", text)
        outcome = self.run_program("check", "column.nml")
        self.assertEqual(outcome.code, code, outcome.err)
        return outcome.err


class Water(GroundTest):
    def test_stressed_ground_with_water_stays(self):
        # the stress of the blocks is the total one, contacts and supports begin with what the water leaves
        data = self.run_column()
        moved = np.abs(data["frames/vertices"][-1] - data["model/vertices"]).max()
        self.assertLess(moved, 1e-6 * 2)
        np.testing.assert_allclose(data["frames/stress"][-1], data["frames/stress"][0], atol=1e-6 * 1e5)
        # sides: total thrust k0 gamma h^2/2 less that of the water, h = 2.7 and 2.4 at the sides
        thrust = 0.8 * 25000 * 16 / 2
        water = [9810 * depth**2 / 2 for depth in (2.7, 2.4)]
        force = data["history/boundary_force"][-1]
        self.assertAlmostEqual(force[0, 0], thrust - water[0], delta=1e-6 * thrust)
        self.assertAlmostEqual(force[2, 0], water[1] - thrust, delta=1e-6 * thrust)
        # the base: the weight less the uplift
        uplift = 9810 * (1.3 * (2.7 + 3.2) / 2 + 0.7 * (3.2 + 2.4) / 2)
        self.assertAlmostEqual(force[1, 1], 8 * 25000 - uplift, delta=1e-6 * 8 * 25000)
        # contacts carry effective forces: those on a level y less the pressure there (dry above the table)
        self.assertLess(data["history/unbalanced"][-1], 1e-9)

    def test_the_same_stopped_at_once_and_resumed(self):
        whole = self.run_column(steps=6)
        self.run_column(steps=1)
        outcome = self.run_program("resume", "out.ckpt.h5", "--steps", "5")
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("out.h5")) as file:
            np.testing.assert_array_equal(file["frames/vertices"][-1], whole["frames/vertices"][-1])
            np.testing.assert_array_equal(file["history/boundary_force"][-1], whole["history/boundary_force"][-1])


class MapCoordinates(GroundTest):
    FAR = (512345.678, 4812345.123)

    def test_a_model_far_from_zero_comes_to_rest_like_one_at_zero(self):
        rest = "&stage until = 'equilibrium' /\n"
        near = self.run_column(steps=0, more=rest, stress=LESS)
        far = self.run_column(steps=0, more=rest, stress=LESS, dx=self.FAR[0], dy=self.FAR[1])
        self.assertLessEqual(far["history/unbalanced"][-1], 1e-5)
        self.assertEqual(len(far["history/step"]), len(near["history/step"]))
        # results have the coordinates of the file
        np.testing.assert_allclose(
            far["frames/vertices"][-1], near["frames/vertices"][-1] + self.FAR, rtol=0, atol=2e-9
        )
        np.testing.assert_allclose(
            far["frames/contact_point"], near["frames/contact_point"] + self.FAR, rtol=0, atol=2e-9
        )
        np.testing.assert_allclose(far["frames/centroid"][0], far["model/block_centroid"], rtol=0, atol=2e-9)
        # the corners of the file have 1e-9 of rounding
        np.testing.assert_allclose(far["frames/stress"][-1], near["frames/stress"][-1], rtol=0, atol=1e-4 * 1e5)

    def test_a_run_far_from_zero_resumes_with_the_same_bits(self):
        choice = {"dx": self.FAR[0], "dy": self.FAR[1], "stress": LESS}
        whole = self.run_column(steps=8, **choice)
        self.run_column(steps=3, **choice)
        self.assertEqual(self.run_program("resume", "out.ckpt.h5", "--steps", "5").code, 0)
        with h5py.File(self.path("out.h5")) as file:
            for name in ("frames/vertices", "frames/stress", "frames/contact_point"):
                np.testing.assert_array_equal(file[name][-1], whole[name][-1], err_msg=name)


class Records(GroundTest):
    SHAKE = "&load harmonic = 2,0,4,0,0 /\n&stage name = 'rest', until = 'equilibrium' /\n"
    LATER = "&stage name = 'quake', kind = 'dynamic', duration = 0.2 /\n"

    def test_motion_begins_with_the_first_dynamic_stage(self):
        short = self.run_column(steps=0, more=self.SHAKE + self.LATER, water=False)
        long = self.run_column(
            steps=0,
            more=self.SHAKE.replace("'equilibrium'", "'equilibrium', tolerance = 1e-8") + self.LATER,
            water=False,
        )
        quake = [data["history/stage"] == 1 for data in (short, long)]
        # the stage before it is at rest from the start, however long it is
        self.assertEqual(np.sum(~quake[0]), 2)
        self.assertLess(short["history/max_displacement"][:2].max(), 1e-12)
        for name in ("history/boundary_force", "history/max_displacement"):
            np.testing.assert_allclose(short[name][quake[0]], long[name][quake[1]], rtol=1e-6, atol=1e-3, err_msg=name)
        # inertia of all blocks, m a, on the sides and the base: the base moves to the right
        push = short["history/boundary_force"][quake[0]].sum(axis=1)[:, 0]
        self.assertGreater(abs(push).max(), 0.5 * 2500 * 8 * 2)
        self.assertIn("base motion begins with stage 'quake', the first dynamic one", self.path("out.log").read_text())

    def test_a_stage_may_be_named(self):
        named = self.SHAKE.replace("0,0 /", "0,0, base_stage = 'Rest' /")
        self.write("column.dc", model()[0])
        text = model(more=named + self.LATER, water=False)[1]
        self.assertIn("base motion counts from the start of stage 'Rest' and acts in it", self.said(text))
        self.assertIn(
            "base_stage: there is no stage 'quke'; did you mean 'quake'?",
            self.said(text.replace("'Rest'", "'quke'"), 2),
        )


class Stages(GroundTest):
    REST = "&stage name = 'rest', until = 'equilibrium' /\n"

    def setUp(self):
        super().setUp()
        self.write("column.dc", model()[0])

    def test_an_end_that_has_passed_is_told(self):
        more = self.REST + "&stage name = 'late', until_time = 1e-6, excavate = 'top' /\n"
        more += "&region name = 'top', box = 0,3,2,4 /\n"
        text = model(more=more, water=False)[1]
        self.assertIn("&stage 2: until_time counts from the start of the run", self.said(text))
        self.write("column.nml", text)
        outcome = self.run_program("run", "column.nml", "-o", "out.h5")
        self.assertEqual(outcome.code, 0, outcome.err)
        told = "stage 'late' was over before it began: until_time 1e-06 s had passed, nothing of it"
        self.assertIn(told, outcome.err)
        self.write("column.nml", text + "&stage name = 'then', duration = 0.01 /\n")
        outcome = self.run_program("run", "column.nml", "-o", "out.h5", "--force")
        self.assertIn("had passed, what happens at its start was done with the next stage", outcome.err)
        with h5py.File(self.path("out.h5")) as file:
            self.assertEqual(file["frames/active"][-1].sum(), 6)
        late = text.replace("until_time = 1e-6", "until_step = 2")
        self.assertIn("&stage 2: must end later than the stage before it", self.said(late, 2))

    def test_rock_that_was_taken_out_can_be_filled_in(self):
        stages = "".join(
            f"&stage name = '{name}', until = 'equilibrium', tolerance = 1e-7, {what} /\n"
            for name, what in (("dig", "excavate = 'top'"), ("fill", "place = 'top'"))
        )
        fill = "&block_material number = 2, name = 'fill', density = 1800, young = 1e8, poisson = 0.2 /\n"
        change = "&change stage = 'fill', region = 'top', block_material = 2 /\n"
        more = "&region name = 'top', box = 0,3,2,4 /\n" + fill + self.REST + stages + change
        data = self.run_column(steps=0, more=more, water=False)
        stage = data["history/stage"]
        self.assertIn("&stage 'fill' places 2 blocks", self.path("out.log").read_text())
        active = data["frames/active"].sum(axis=1)
        self.assertEqual([active[0], active.min(), active[-1]], [8, 6, 8])
        # the base carries what is there; the fill stands where the rock was drawn, on rock that has come up a little
        base = data["history/boundary_force"][:, 1, 1]
        ends = [np.flatnonzero(stage == i)[-1] for i in range(3)]
        expected = [8 * 25000, 6 * 25000, 6 * 25000 + 2 * 18000]
        sides = data["history/boundary_force"][:, (0, 2), 1]
        for i, weight in zip(ends, expected, strict=True):
            self.assertAlmostEqual((base[i] + sides[i].sum()) / weight, 1, delta=1e-5)
        top = data["model/block_centroid"][:, 1] > 3
        # stress of the fill: its own weight, without what the rock had in it
        np.testing.assert_allclose(data["frames/stress"][-1][top, 1], -18000 * 0.5, rtol=2e-2)
        # stopped in the last stage, and resumed
        n = len(stage)
        whole = data["frames/vertices"][-1]
        outcome = self.run_program("run", "column.nml", "-o", "part.h5", "--steps", str(ends[1] + 3), "--quiet")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(self.run_program("resume", "part.ckpt.h5", "--steps", str(n - ends[1] - 3), "--quiet").code, 0)
        with h5py.File(self.path("part.h5")) as file:
            np.testing.assert_array_equal(file["frames/vertices"][-1], whole)

    def test_what_cannot_be_reached_is_an_error(self):
        for stage, words in (
            ("until = 'equilibrium', max_steps = 1", "max_steps: equilibrium takes at least 2 steps"),
            ("until = 'equilibrium', max_steps = 10, excavate = 'top'", "equilibrium takes at least 11 steps"),
        ):
            text = model(more=f"&region name = 'top', box = 0,3,2,4 /\n&stage {stage} /\n")[1]
            self.assertIn(words, self.said(text, 2))

    def test_a_misspelt_end_is_one_error(self):
        text = model(more="&stage until = 'equilibrim' /\n&stage duration = 1 /\n")[1]
        errors = [line for line in self.said(text, 2).splitlines() if ": error: " in line]
        self.assertEqual(len(errors), 1, errors)
        self.assertIn("did you mean 'equilibrium'?", errors[0])

    def test_contacts_too_stiff_for_the_digits_are_told(self):
        more = "&contact stiffness = 1e19 /\n&stage until = 'equilibrium', tolerance = 1e-9, max_steps = 30 /\n"
        text = model(more=more, water=False, stress=LESS)[1]
        self.write("column.nml", text)
        outcome = self.run_program("run", "column.nml", "-o", "out.h5")
        self.assertEqual(outcome.code, 3, outcome.err)
        self.assertIn("the contacts are so stiff that the rounding of positions makes", outcome.err)


class Told(GroundTest):
    def setUp(self):
        super().setUp()
        self.write("column.dc", model()[0])

    def test_a_material_that_is_described_twice(self):
        text = model(more=Stages.REST)[1]
        more = "&joint_material number = 1, cohesion = 1e4 /\n&block_material number = 1, young = 2e9 /\n"
        said = self.said(text + more)
        self.assertIn("warning: joint material 1: is described twice", said)
        self.assertIn("warning: block material 1: is described twice", said)
        self.assertNotIn("described twice", self.said(text))

    def test_a_second_options_file_in_the_folder(self):
        self.write("column.nml", model(more=Stages.REST)[1])
        self.write("more.nml", "&load gravity = 1 /\n")
        for command in ("check", "run"):
            outcome = self.run_program(command, ".")
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertRegex(outcome.err, r"warning: more\.nml in the folder \. is not read: .*column\.nml")

    def test_a_tie_that_never_breaks_needs_no_friction(self):
        text = model(more=Stages.REST, water=False)[1].replace("friction = 35", "tie = .true.")
        self.assertNotIn("friction", self.said(text).replace("friction 0 deg", ""))
        weak = text.replace("tie = .true.", "tie = .true., cohesion = 1e5")
        self.assertIn("needs its angle of friction", self.said(weak, 2))

    def test_surcharge_counts_at_the_base(self):
        text = model(more=Stages.REST, water=False)[1].replace("k0 = 0.8", "k0 = 0.8, surcharge = 5e4")
        self.write("column.nml", text)
        outcome = self.run_program("check", "column.nml", "--json")
        facts = outcome.json["model"]
        self.assertTrue(math.isclose(facts["stress_at_the_base"], 4 * 25000 + 5e4))

    def test_two_loads_of_one_edge(self):
        more = "&boundary along = 0,4, 2,4, kind = 'traction', pressure = 1, traction = 1,2 /\n"
        said = self.said(model(more=Stages.REST + more)[1], 2)
        self.assertIn("give one of stress, traction, pressure, not several", said)


if __name__ == "__main__":
    unittest.main()
