# SPDX-License-Identifier: MIT
"""Values that are allowed but hardly meant: `check` and `run` warn, each once."""

import re
import unittest
from pathlib import Path

from support import ANALYSIS, GEOMETRY, PEER_ANALYSIS, ProgramTest

INPUTS = Path(__file__).parents[2] / "inputs"
MATERIAL = "1000 9810 1e8 0.2"


class Plausibility(ProgramTest):
    def warnings(self, analysis=PEER_ANALYSIS, geometry=GEOMETRY, options="&run steps = 1 /\n"):
        """Those of `check`; `run` must give the same."""
        self.write("x.dc", geometry)
        self.write("x.df", analysis)
        self.write("x.nml", options)
        checked = self.run_program("check", "x.dc", "x.df", "x.nml")
        ran = self.run_program("run", "x.dc", "x.df", "--config", "x.nml", "--force")
        self.assertEqual((checked.code, ran.code), (0, 0), checked.err + ran.err)
        # that soft blocks do sink into each other is found by the run alone
        pattern = r"^(.*): warning: (?!blocks stand inside each other)(.*)$"
        found = [re.findall(pattern, outcome.err, re.MULTILINE) for outcome in (checked, ran)]
        self.assertEqual(found[0], found[1])
        return found[0]

    def check(self, expected, *arguments, file="x.df", **keywords):
        found = self.warnings(*arguments, **keywords)
        self.assertEqual(len(found), 1, found)
        self.assertEqual(found[0][0], file)
        self.assertIn(expected, found[0][1])

    def test_nothing_to_say(self):
        self.assertEqual(self.warnings(), [])
        self.assertEqual(self.warnings(ANALYSIS), [])

    def test_radians(self):
        text = PEER_ANALYSIS.replace("30 0 0", "0.52 0 0")
        self.check("is 0.52 degrees: is it in radians? (0.52 rad are 29.8 degrees)", text)
        self.assertEqual(self.warnings(PEER_ANALYSIS.replace("30 0 0", "0 0 0")), [])
        self.assertEqual(self.warnings(PEER_ANALYSIS.replace("30 0 0", "2 0 0")), [])

    def test_joints_that_the_stress_closes_by_much(self):
        options = (
            "&contact stiffness = 1e9 /\n&in_situ stress = -1e4, -3e4, 0 /\n&run steps = 1 /\n"
            "&joint_material number = 1, normal_stiffness = {}{} /\n"
        )
        # the blocks are 1 thick
        self.check(
            "joints of material 1 close by 0.3 under the initial stress of block 1 at (2, 0.5), 30 % of its thickness "
            "(2 blocks by more than 20 %)",
            options=options.format("1e5", ""),
            file="x.nml:4:1",
        )
        self.assertEqual(self.warnings(options=options.format("2e5", "")), [])
        # without a stiffness of its own, with contacts at vertices, and as intact rock there is no closure
        self.assertEqual(self.warnings(options=options.replace(", normal_stiffness = {}{}", "")), [])
        at_vertices = options.format("1e5", "").replace("stiffness", "formulation = 'vertex', stiffness", 1)
        self.check("normal_stiffness has no effect", options=at_vertices, file="x.nml:4:1")
        self.assertEqual(self.warnings(options=options.format("1e5", ", tie = .true., brittle = .false.")), [])

    def test_material_that_no_edge_has(self):
        text = PEER_ANALYSIS.replace("1 20 1 1", "1 20 1 2") + "0.52 0 0\n"
        self.assertEqual(self.warnings(text), [])

    def test_no_weight(self):
        text = PEER_ANALYSIS.replace(MATERIAL, "1000 0 1e8 0.2")
        self.assertNotEqual(text, PEER_ANALYSIS)
        options = "&run steps = 1 /\n"
        self.check("nothing moves the blocks", text, options=options)
        self.assertEqual(self.warnings(text, options=options + "&in_situ stress = -1e3, -1e3, 0 /\n"), [])

    def test_weight_in_kilonewtons_with_density_in_kilograms(self):
        self.check("weight 25.5 and density 2600", PEER_ANALYSIS.replace(MATERIAL, "2600 25.5 1e8 0.2"))
        self.assertEqual(self.warnings(PEER_ANALYSIS.replace(MATERIAL, "2.6 25.5 1e8 0.2")), [])
        # tonnes, millimetres, newtons
        self.assertEqual(self.warnings(PEER_ANALYSIS.replace(MATERIAL, "2.6e-9 2.55e-5 1e4 0.2")), [])

    def test_modulus_in_megapascals(self):
        # the contact stiffness that follows from it is not named as well
        text = PEER_ANALYSIS.replace(MATERIAL, "2600 25500 2e4 0.2")
        self.check("Young's modulus of block material 1 is 20000: the weight of the model, 25500 times", text)

    def test_soft_contacts(self):
        soft = "&contact stiffness = 1e3 /\n"
        self.check("contact stiffness g0 = 1000: under the weight", options=soft, file="x.nml:1:10")
        soft = "&contact stiffness = 1 /\n"
        stressed = PEER_ANALYSIS.replace("9810 1e8 0.2  0", "0 1e8 0.2  -1")
        self.check("g0 = 1 is 1e-08 times Young's modulus 1e+08", stressed, options=soft, file="x.nml:1:10")

    def test_numbers_shifted_by_a_decimal_comma_end_as_sor_factor(self):
        for row, factor in (("20,5 0 0", "0"), ("30 0,5 1.5", "1.5"), ("20,5,0,0", "0")):
            text = PEER_ANALYSIS.replace("30 0 0", row)
            self.write("x.dc", GEOMETRY)
            self.write("x.df", text)
            outcome = self.run_program("check", "x.dc", "x.df")
            self.assertEqual(outcome.code, 2)
            self.assertRegex(
                outcome.err,
                rf"x\.df:3:\d: error: .* the last number of the file, {factor}, is then read as an SOR factor",
            )
        # commas as separators
        self.assertEqual(self.warnings(PEER_ANALYSIS.replace("30 0 0", "30,0,0,1.4")), [])
        self.assertEqual(self.warnings(PEER_ANALYSIS + "9\n"), [])

    def test_automatic_stiffness_is_2_e_and_that_of_the_preset_50_e(self):
        for options, stiffness in (
            ("", 2e8),
            ("&contact formulation = 'vertex' /\n", 1e8),
            ("&contact preset = 'dda_windows' /\n", 5e9),
            ("&contact preset = 'peer' /\n", 5e9),
        ):
            with self.subTest(options=options):
                self.warnings(options="&run steps = 1 /\n" + options)
                log = (Path(self.folder) / "x.log").read_text()
                self.assertEqual(float(re.search(r"contact stiffness \(g0\) += (\S+)", log)[1]), stiffness)

    def test_strict_without_the_energy_balance_is_refused(self):
        self.write("x.dc", GEOMETRY)
        self.write("x.df", PEER_ANALYSIS)
        self.write("x.nml", "&run steps = 1 /\n&output energy = .false. /\n")
        run = ("run", "x.dc", "x.df", "--config", "x.nml", "--quiet", "--force")
        message = "error: strict needs the energy balance, but &output energy is .false.: leave one of them out"
        self.assertFails(self.run_program(*run, "--strict"), 2, message)
        self.write("x.nml", "&run strict = .true. /\n&output energy = .false. /\n")
        outcome = self.run_program(*run)
        self.assertEqual((outcome.code, outcome.err.splitlines()[0]), (2, "x.nml:1:6: " + message))
        self.write("x.nml", "&run steps = 1 /\n&output energy = .false. /\n")
        self.assertEqual(self.run_program(*run).code, 0)

    def test_no_load(self):
        text = PEER_ANALYSIS.replace(" 9810 ", " 0 ")
        self.check("the weight of all blocks is 0", text)
        self.assertEqual(self.warnings(text, options="&load gravity = 9.81 /\n"), [])
        self.assertEqual(self.warnings(text, options="&load harmonic = 1, 0, 2, 0, 0 /\n"), [])
        stressed = text.replace("0.2  0 0 0", "0.2  -1e3 0 0")
        self.assertEqual(self.warnings(stressed), [])

    def test_nothing_fixed(self):
        lines = GEOMETRY.splitlines()
        lines[4] = "0"
        free = "\n".join(lines[:15] + lines[17:]) + "\n"
        self.check("no fixed point or boundary holds one of them", geometry=free)
        thrown = PEER_ANALYSIS.replace("0 0 0\n30", "1 0 0\n30")
        self.assertEqual(self.warnings(thrown, geometry=free), [])

    def test_velocity_of_a_block_that_is_held(self):
        thrown = PEER_ANALYSIS.replace("0 0 0\n30", "1 0 0\n30")
        self.check("block 1 is held by 2 fixed points, and block material 1 gives it a velocity", thrown)

    def test_sleep_without_effect(self):
        sleep = "&run steps = 1 /\n&time sleep = 'on' /\n"
        self.assertEqual(self.warnings(options=sleep), [])
        harmonic = sleep + "&load harmonic = 1, 0, 2, 0, 0 /\n"
        self.check("no block sleeps in a model with a harmonic base motion", options=harmonic, file="x.nml:2:7")
        restitution = sleep + "&joint_law material = 1, restitution = 0.5 /\n"
        self.check("no block sleeps in a model with restitution", options=restitution, file="x.nml:2:7")

    def test_sleep_while_a_table_changes(self):
        """No block sleeps before the last table has ended: ten steps of 0.01 are not enough for one that lasts 0.1."""
        sleep = "&run steps = 10 /\n&time sleep = 'on' /\n&line_load ends = 0,1, 0.5,1, force_start = 0,-1, "
        sleep += "force_end = 0,-1, table = 0,1, {},{} /\n"
        self.check(
            "loads, supports or tractions that change until time 0.1, when the run is over",
            options=sleep.format(0.1, 2),
            file="x.nml:2:7",
        )
        self.assertEqual(self.warnings(options=sleep.format(0.05, 2)), [])
        self.assertEqual(self.warnings(options=sleep.format(5, 1)), [])

    def test_sleep_tolerance_without_sleep(self):
        self.check(
            "sleep_tolerance has no effect without sleep = 'on'",
            options="&run steps = 1 /\n&time sleep_tolerance = 1e-2 /\n",
            file="x.nml:2:7",
        )

    def test_sleep_that_holds_what_slides(self):
        sleep = "&run steps = 1 /\n&time sleep = 'on', sleep_tolerance = {} /\n"
        self.check("blocks sleep that lack this share of the forces", options=sleep.format(0.2), file="x.nml:2:21")
        self.assertEqual(self.warnings(options=sleep.format(0.05)), [])

    def test_steps_that_do_not_follow_the_base(self):
        # g1 of the analysis file is 0.01
        harmonic = "&run steps = 1 /\n&load harmonic = 1, 0, {}, 0, 0 /\n"
        self.check(
            "do not follow the motion of the base: the base has a period of 0.04; give dt_max, at most 0.004",
            options=harmonic.format(25),
            file="x.df",
        )
        self.assertEqual(self.warnings(options=harmonic.format(9.5)), [])
        self.write("x.csv", "t,a\n" + "".join(f"{0.0005 * i},{i % 2}\n" for i in range(50)))
        record = "&run steps = 1 /\n&quake record = 'x.csv' /\n&time dt_max = {} /\n"
        self.check(
            "the record has a row each 0.0005; give dt_max, at most 0.0025",
            options=record.format(3e-3),
            file="x.nml:3:7",
        )
        self.assertEqual(self.warnings(options=record.format(2.4e-3)), [])

    def test_no_false_alarm(self):
        # notes of cutting aside, which name a line
        folders = [path.parent for path in sorted(INPUTS.glob("*/*.df"))]
        self.assertGreater(len(folders), 10)
        for folder in folders:
            with self.subTest(model=folder.name):
                outcome = self.run_program("check", folder)
                self.assertEqual(outcome.code, 0)
                self.assertNotRegex(outcome.err, r"\.(df|nml): warning: ")


if __name__ == "__main__":
    unittest.main()
