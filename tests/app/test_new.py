# SPDX-License-Identifier: MIT
"""`rockdda new`: models to begin with, and `rockdda help` on what stands in them."""

import re
import unittest

import h5py
import numpy as np
from support import ProgramTest

KINDS = {
    "slope": 2, "tunnel": 3, "arch": 1, "bridge": 1, "wall": 1, "dam": 2, "rocking": 2, "rockfall": 1, "shear": 1,
}  # stages  # fmt: skip
ALL = ", ".join(KINDS)


# a displacement in millimetres
FOUND = r"\((\S+) mm, (\S+) mm\)"


class NewModels(ProgramTest):
    def test_each_kind_runs_to_rest_without_a_warning(self):
        for kind, n_stages in KINDS.items():
            outcome = self.run_program("new", kind, f"my {kind}")
            self.assertEqual((outcome.code, outcome.err), (0, ""))
            self.assertIn(f"next: rockdda run my {kind}.nml", outcome.out)
            text = self.path(f"my {kind}.nml").read_text()
            self.assertNotIn("@", text)
            self.assertLessEqual(max(map(len, text.splitlines())), 120)
            checked = self.run_program("check", f"my {kind}.nml")
            self.assertIn("0 errors, 0 warnings", checked.out + checked.err)
            self.assertRegex(checked.out, rf"\n  stages +{n_stages}\n")
            # a stage that does not come to rest would end the run with exit 3
            ran = self.run_program("run", f"my {kind}.nml", "--json")
            # where a column that rocks stands at the end depends on each of its impacts: the run says so
            self.assertEqual((ran.code, ran.json["warnings"]), (0, int(kind == "rocking")), kind)

    def test_the_list_has_a_line_for_each_kind(self):
        told = self.run_program("new", "--list")
        self.assertEqual((told.code, told.err), (0, ""))
        self.assertEqual([line.split()[0] for line in told.out.splitlines()], list(KINDS))
        self.assertEqual(self.run_program("new", "--list", "--json").json["models"].keys(), KINDS.keys())
        for line in told.out.splitlines():
            kind, text = line.split(maxsplit=1)
            self.run_program("new", kind, kind)
            self.assertTrue(self.path(f"{kind}.nml").read_text().startswith(f"! {text}. Units: m, kg, s, N.\n"))

    def test_factors_of_wall_dam_and_shear_test(self):
        """Closed forms: the base of the wall slides, and the dam; the joint of the specimen has c + sigma tan(phi)."""
        tangent = np.tan(np.radians(35))
        weight = 3 * (1.6 + 1.3) / 2 * 2400 * 9.81
        earth = 0.3 * 18e3 * 3**2 / 2
        uplift, push = 24 * 28 * 9810 / 2, 28**2 * 9810 / 2
        dam = ((30 * (5 + 24) / 2) * 2400 * 9.81 - uplift) / push  # tan(45) = 1
        for arguments, expected in (
            (["wall", "--search", "load", "--loads", "earth"], weight * tangent / earth),
            (["dam", "--joints", "base"], dam),
            (["shear", "--search", "load", "--loads", "shear"], (0.1 + tangent) / 0.1),
        ):
            kind, *options = arguments
            self.run_program("new", kind, kind)
            factor = self.run_program("fos", f"{kind}.nml", *options, "--json").json["factor"]
            # 0.5 % for the interval of the factor, 0.5 % for the rotation of the dam on its elastic base
            self.assertAlmostEqual(factor, expected, delta=0.01 * expected, msg=kind)

    def test_water_of_the_slope_lowers_its_factor(self):
        self.run_program("new", "slope", "wet")
        text = self.path("wet.nml").read_text()
        dry = re.sub(r"&water .*?/\n", "", text, flags=re.S)
        self.write("dry.nml", dry.replace(", water = 'none'", "").replace(", water = 'wet season'", ""))
        wet, dry = (self.run_program("fos", f"{name}.nml", "--json").json["factor"] for name in ("wet", "dry"))
        # the table stands above the plane that slides: far more than the width of 0.5 % in which a factor is found
        self.assertLess(wet, 0.9 * dry)
        self.assertGreater(wet, 1.1)

    def test_measured_displacements_are_told_by_stage(self):
        self.run_program("new", "slope", "wet")
        ran = self.run_program("run", "wet.nml")
        with h5py.File(self.path("wet.h5"), "r") as file:
            stage = file["history/stage"][:]
            moved = file["history/measured_displacement"][:, 0] * 1e3
        # the second stage counts its displacements from its own start
        first, second = moved[stage == 0][-1], moved[stage == 1][-1]
        told = rf"'weight': {FOUND}; since the start {FOUND}\n.*'wet': {FOUND}; since the start {FOUND}"
        found = re.search(told, ran.out)
        self.assertIsNotNone(found, ran.out)
        values = [float(value) for value in found.groups()]
        for told, value in zip(values, [*first, *first, *second, *(first + second)], strict=True):
            self.assertAlmostEqual(told, value, delta=1e-3 * abs(value))  # four digits are printed
        self.assertIn(found.group().splitlines()[1], self.run_program("info", "wet.h5").out)
        summary = self.run_program("run", "wet.nml", "--force", "--json").json
        point = summary["measured_displacements"]["stage_2_point_1"]
        self.assertEqual(point["stage"], "wet")
        np.testing.assert_allclose(
            [*point["change"], *point["since_start"]], 1e-3 * np.array([*second, *(first + second)])
        )
        self.assertEqual(self.run_program("info", "wet.h5", "--json").json["files"][0]["stage_2_point_1"], point)

    def test_a_name_may_have_an_ending_and_a_folder(self):
        self.path("deep").mkdir()
        summary = self.run_program("new", "arch", "deep/bridge.nml", "--json").json
        self.assertEqual((summary["model"], summary["geometry"]), ("deep/bridge.nml", "deep/bridge.dc"))
        self.assertIn("geometry = 'bridge.dc'", self.path("deep/bridge.nml").read_text())
        self.assertEqual(self.run_program("check", "deep").code, 0)

    def test_files_that_exist_are_kept(self):
        self.path("mine.dc").write_text("mine")
        outcome = self.run_program("new", "slope", "mine")
        self.assertFails(outcome, 2, "rockdda: error: mine.dc: the file exists; use --force to overwrite it")
        self.assertEqual(self.path("mine.dc").read_text(), "mine")
        self.assertFalse(self.path("mine.nml").exists())
        self.assertEqual(self.run_program("new", "slope", "mine", "--force").code, 0)

    def test_mistakes(self):
        for arguments, told, *code in (
            ([], f"'rockdda new' needs the kind of a model ({ALL}) and a name"),
            (["slope"], f"'rockdda new' needs the kind of a model ({ALL}) and a name"),
            (["tunel", "x"], f"'tunel' is none of {ALL}; did you mean 'tunnel'?"),
            (["arch", "a'b"], "'a'b': expected a name of a file without quotes and '!'"),
            (["arch", "no/x"], "no/x: the folder 'no' does not exist; make it first: mkdir -p 'no'", 5),
        ):
            outcome = self.run_program("new", *arguments)
            self.assertEqual([outcome.code], code or [2])
            self.assertIn(f"rockdda: error: {told}", outcome.err)


class HelpOnGroups(ProgramTest):
    def test_every_group_has_help(self):
        groups = re.findall(r"^  &(\w+) +(\S.*)$", self.run_program("help", "groups").out, re.M)
        self.assertGreater(len(groups), 20)
        for name, meaning in groups:
            told = self.run_program("help", f"&{name}")
            self.assertEqual((told.code, told.err), (0, ""))
            self.assertRegex(told.out, rf"(?m)^&{name}( in a file of joint statistics \(\.dl\))?: {re.escape(meaning)}")
            self.assertRegex(told.out, r"(?m)^      (required|default: \S)")
        self.assertEqual(self.run_program("help", "&stage").out, self.run_program("help", "stage").out)

    def test_values_units_and_defaults(self):
        told = self.run_program("help", "stage").out
        self.assertIn("\n  duration = > 0 [time]\n      time that the stage lasts\n      default: another end\n", told)
        self.assertIn("\n  kind = 'static', 'dynamic'\n", told)

    def test_commands_and_unknown_topics(self):
        self.assertEqual(self.run_program("help", "run").out, self.run_program("run", "--help").out)
        self.assertEqual(self.run_program("help", "&STAGE").out, self.run_program("help", "stage").out)
        told = self.run_program("help", "cut_factor")
        self.assertEqual(told.code, 0)
        self.assertTrue(told.out.startswith("cut_factor, an option of &time:\n\n  cut_factor = "), told.out)
        self.assertTrue(told.out.endswith("All options of the group: 'rockdda help time'.\n"), told.out)
        for group in ("joint_material", "joint_law", "change"):
            self.assertIn(f"'rockdda help {group}'", self.run_program("help", "cohesion").out)
        self.assertFails(
            self.run_program("help", "cut_facto"),
            2,
            "rockdda: error: no help on 'cut_facto'; did you mean 'cut_factor'?",
        )
        told = self.run_program("help", "stages")
        self.assertFails(told, 2, "rockdda: error: no help on 'stages'; did you mean 'stage'?")


if __name__ == "__main__":
    unittest.main()
