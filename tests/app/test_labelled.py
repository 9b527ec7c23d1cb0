# SPDX-License-Identifier: MIT
"""Labelled files: a whole model in one options file."""

import os
import re
import shutil
import unittest
from pathlib import Path

from support import GEOMETRY, PEER_ANALYSIS, ProgramTest, h5py

INPUTS = Path(__file__).resolve().parents[2] / "inputs"
SHARED = Path(os.environ.get("ROCKDDA_SHARED", INPUTS.parent.parent / "shared"))

LABELLED = """\
&model           geometry = 'block.dc', title = 'A block on a base' /
&block_material  number = 1, name = 'Rock', density = 2500, young = 5e9, poisson = 0.25 /
&joint_material  number = 1, name = 'bedding', friction = 30 /
&load            gravity = 9.81 /
&run             steps = 10 /
"""


def datasets(path):
    """All arrays of results but the input texts."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: (
                found.update({name: item[()].tobytes()})
                if isinstance(item, h5py.Dataset) and not name.startswith("input/")
                else None
            )
        )
    return found


class LabelledFile(ProgramTest):
    def labelled(self, text=LABELLED, name="slope.nml"):
        return self.write(name, text)

    def messages(self, text):
        """Lines with file and place of what is wrong with a labelled file."""
        self.labelled(text)
        outcome = self.run_program("run", "slope.nml")
        self.assertEqual(outcome.code, 2, outcome.err)
        return [line for line in outcome.err.splitlines() if re.match(r"\S+(:\d+:\d+)?: error:", line)]

    def test_dynamic_steps_are_of_second_order_by_default(self):
        for more, scheme in (
            ("", "generalized_alpha"),
            ("&time integrator = 'shi' /\n", "shi"),
            ("&contact preset = 'dda_windows' /\n", "shi"),
        ):
            self.labelled(LABELLED + more)
            outcome = self.run_program("run", "slope.nml", "--force")
            self.assertEqual(outcome.code, 0, outcome.err)
            self.assertRegex(self.path("slope.log").read_text(), rf"\n  integrator += {scheme}\n")
        # a legacy pair keeps its scheme, also as a labelled file
        self.assertIn("integrator = 'shi'", self.run_program("check", "--as-namelist", "block.dc", "block.df").out)

    @unittest.skipUnless(h5py, "needs h5py")
    def test_a_labelled_file_runs_without_an_analysis_file(self):
        self.labelled()
        outcome = self.run_program("run", "slope.nml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        with h5py.File(self.path("slope.h5")) as file:
            self.assertEqual(file["input/analysis"][()], b"")
            self.assertEqual(file["input/config"][()].decode(), LABELLED)
            self.assertEqual(file.attrs["title"], "A block on a base")
            self.assertEqual(len(file["history/time"]), 10)
            # fixed points are fixed, the loading point carries no load: the block sinks by less than its weight asks
            displacement = file["history/measured_displacement"][-1, 0]
            self.assertLess(displacement[1], 0)
            self.assertGreater(displacement[1], -1e-4)
        log = self.path("slope.log").read_text()
        for number in ("contact stiffness (g0)", "time step (dt_max)", "displacement ratio (g2)"):
            self.assertIn(f"note: {number} is automatic: ", log)
        # a folder is run by its labelled file, also beside a legacy pair
        outcome = self.run_program("run", ".", "-o", "folder.h5")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(datasets(self.path("slope.h5")), datasets(self.path("folder.h5")))

    @unittest.skipUnless(h5py, "needs h5py")
    def test_a_run_resumes_with_the_same_bits(self):
        self.labelled()
        self.assertEqual(self.run_program("run", "slope.nml", "-o", "whole.h5").code, 0)
        self.assertEqual(self.run_program("run", "slope.nml", "--steps", "4", "--save-every", "1").code, 0)
        outcome = self.run_program("resume", "slope.ckpt.h5", "--steps", "6")
        self.assertEqual(outcome.code, 0, outcome.err)
        whole, resumed = datasets(self.path("whole.h5")), datasets(self.path("slope.h5"))
        self.assertEqual(whole["history/energy"], resumed["history/energy"])
        self.assertEqual(whole["frames/vertices"], resumed["frames/vertices"])

    def test_a_stage_too_short_for_a_step_is_named_by_its_duration(self):
        """It was over by 'until_time -1.79769e+308'."""
        stages = "&stage name = 'a', duration = 0.01 /\n&stage name = 'b', duration = 1e-30 /\n"
        self.labelled(LABELLED.replace("&run             steps = 10 /\n", stages))
        outcome = self.run_program("run", "slope.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertIn("stage 'b' was over before it began: its duration of 1e-30 s had passed", outcome.err)

    def test_all_mistakes_in_one_pass(self):
        found = self.messages(
            "&model geometry = 'block.dc', titlx = 'x' /\n"
            "&block_material number = 2, name = 'Rock', density = -1, young = 5e9, poisson = 0.2 /\n"
            "&block_material number = 3, name = 'rock', density = 2000, poisson = 0.2 /\n"
            "&joint_material number = 2, name = 'bedding', friction = 30, law = 'velocity' /\n"
            "&joint_law material = 'beddingg', damping_ratio = 0.1 /\n"
            "&region name = 'roof', material = 'rok' /\n"
            "&subdivide region = 'rof', size = 1, joint_material = 'BEDDNIG' /\n"
            "&load gravity = -9.81 /\n"
        )
        expected = [
            "slope.nml:1:31: error: unknown name 'titlx' in &model; did you mean 'title'?",
            "slope.nml:2:54: error: density: must be greater than 0, found '-1'",
            "slope.nml:5:24: error: &joint_law: there is no joint material 'beddingg'; did you mean 'bedding'?",
            "slope.nml:8:17: error: gravity: must not be negative (it acts in -y), found '-9.81'",
            "block.dc:9:9: error: joint material 1, used by line 1 (and by 6 more), is not described: "
            "add &joint_material number = 1, ... /",
            "block.dc: error: block material 1, used by block 1 and all others without a material line, is not "
            "described: add &block_material number = 1, ... /",
            "slope.nml:6:36: error: &region: there is no block material 'rok'; did you mean 'Rock'?",
            "slope.nml:7:22: error: &subdivide: there is no region 'rof'; did you mean 'roof'?",
            "slope.nml:7:56: error: &subdivide: there is no joint material 'BEDDNIG'; did you mean 'bedding'?",
            "slope.nml:1:1: error: the run has no end: give &run steps or t_end, or an end to the last &stage",
            "slope.nml:3:1: error: block material 3: 'young' is missing",
            "slope.nml:3:1: error: block materials 2 and 3 have one name, 'rock'",
        ]
        self.assertEqual(found[: len(expected)], expected)
        self.assertTrue(found[len(expected)].startswith("slope.nml:4:1: error: law of joint material 2: "), found)
        self.assertEqual(len(found), len(expected) + 1)

    def test_files_that_do_not_fit(self):
        self.labelled()
        for text, expected in {
            LABELLED.replace("block.dc", "missing.dc"): "slope.nml:1:18: error: geometry: missing.dc: no such file",
            LABELLED.replace("'block.dc', ", "'block.dc', analysis = 'none.df', "): "error: analysis: none.df: no such",
            LABELLED + "&load base_acceleration = 'a/b.csv' /\n": "error: base_acceleration: a/b.csv: no such file",
            LABELLED.replace(
                "block.dc", "block.df"
            ): "block.df: expected a geometry or block file, found an analysis file",
            LABELLED.replace("geometry = 'block.dc', ", ""): "&model: 'geometry' is missing",
            LABELLED.replace("&run ", "&run strict = .true., stepps = 3,"): "unknown name 'stepps' in &run",
        }.items():
            with self.subTest(expected):
                self.assertIn(expected, "\n".join(self.messages(text)))
        self.write("block.nml", LABELLED)
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "block.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("a file with &model is a whole model: run it by itself", outcome.err)
        outcome = self.run_program("run", "block.nml", "--config", "block.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("a labelled file holds all options; leave out --config", outcome.err)
        self.write("options.nml", "&run steps = 3 /\n")
        outcome = self.run_program("run", "options.nml")
        self.assertEqual(outcome.code, 2)
        self.assertIn("expected a labelled file (.nml with &model)", outcome.err)

    def test_numbers_that_no_unit_explains(self):
        text = LABELLED.replace("9.81", "0").replace("title", "units = 'none', title")
        for changed, expected in (
            (text.replace("5e9", "1e-308"), "contact stiffness (g0) cannot be automatic: it would be "),
            (
                text.replace("5e9", "1e-29").replace("2500", "1e55"),
                "time step (dt_max) cannot be automatic: it would be ",
            ),
        ):
            self.assertIn(f"slope.nml:1:1: error: {expected}", "\n".join(self.messages(changed)))

    @unittest.skipUnless(h5py, "needs h5py")
    def test_values_of_the_analysis_file_and_what_wins(self):
        """Beside a legacy pair, or with `analysis`, materials change only what they name."""
        self.write("more.nml", "&block_material number = 1, name = 'Rock', density = 2000 / &load gravity = 10 /\n")
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "more.nml", "-o", "pair.h5")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.write(
            "whole.nml",
            "&model geometry = 'block.dc', analysis = 'block.df' / &material plane = 'stress' /\n"
            "&joint_material number = 1, brittle = .true. /\n" + self.path("more.nml").read_text(),
        )
        outcome = self.run_program("run", "whole.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(datasets(self.path("pair.h5")), datasets(self.path("whole.h5")))
        log = self.path("whole.log").read_text()
        self.assertRegex(log, r"block material 1 +Rock|block material 1 .*density 2000")

    def test_the_end_of_the_run(self):
        text = LABELLED.replace("&run             steps = 10 /\n", "")
        for group, planned in {
            "&run steps = 4 /": 4,
            "&stage until_step = 2 / &stage until_step = 5, k01 = 0 /": 5,
            "&run steps = 7 / &stage until_step = 3 / &stage k01 = 0 /": 7,
        }.items():
            with self.subTest(group):
                self.labelled(text + group + "\n")
                outcome = self.run_program("run", "slope.nml", "--force", "--json")
                self.assertEqual(outcome.code, 0, outcome.err)
                self.assertEqual(outcome.json["steps"], planned)

    def test_check_describes_the_model(self):
        self.labelled()
        outcome = self.run_program("check", "slope.nml", "--json")
        self.assertEqual(outcome.code, 0, outcome.err)
        model = outcome.json["model"]
        self.assertEqual((model["blocks"], model["height"], model["smallest_angle"]), (2, 2, 90))
        self.assertAlmostEqual(model["smallest_block_area"], 2)
        # the weight of a column of the height of the model, and what the joint bears there
        self.assertAlmostEqual(model["stress_at_the_base"], 2500 * 9.81 * 2)
        self.assertIn(
            "shear strength under the stress at half depth 14160, at the base 28319", model["joint_material_1"]
        )
        self.assertIn("Rock: 2 blocks, unit weight 24525", model["block_material_1"])
        self.assertEqual(model["plane"], "strain")
        reasons = [m["message"] for m in outcome.json["messages"] if "is automatic" in m["message"]]
        self.assertEqual(len(reasons), 3)
        text = self.run_program("check", "slope.nml").out
        self.assertIn("  stress at the base      49.05 kPa\n", text)
        # a legacy pair is described, too
        self.assertEqual(self.run_program("check", "block.dc", "block.df", "--json").json["model"]["blocks"], 2)

    def test_units_that_cannot_be(self):
        """Where the units are not said: warnings."""
        text = LABELLED.replace("title", "units = 'none', title")
        for old, new, expected in [
            ("friction = 30", "friction = 0.52", "is it in radians?"),
            ("young = 5e9", "young = 5e3", "is E in the unit of stress that fits the weights?"),
            ("density = 2500", "density = 2500, unit_weight = 2500", "is not its density times the gravity"),
        ]:
            with self.subTest(new):
                self.labelled(text.replace(old, new))
                err = self.run_program("check", "slope.nml").err
                self.assertIn(expected, err)
                line = 1 + LABELLED[: LABELLED.index(old)].count("\n")
                self.assertIn(f"slope.nml:{line}:1: warning: ", err)


class AsNamelist(ProgramTest):
    """`rockdda check --as-namelist`: the labelled file of a model has the same bits."""

    parent = "/dev/shm" if Path("/dev/shm").is_dir() else None

    @unittest.skipUnless(h5py, "needs h5py")
    def compare(self, *files, steps=3):
        printed = self.run_program("check", "--as-namelist", *files)
        self.assertEqual(printed.code, 0, printed.err)
        self.write("labelled/one.nml", printed.out)
        config = ["--config", files[2]] if len(files) > 2 else []
        both = []
        for name, arguments in (("a", [*files[:2], *config]), ("b", ["labelled/one.nml"])):
            outcome = self.run_program("run", *arguments, "-o", f"{name}.h5", "--steps", steps, "--quiet", "--force")
            both.append((outcome.code, datasets(self.path(f"{name}.h5"))))
        self.assertEqual(both[0][0], both[1][0])
        self.assertEqual(both[0][1].keys(), both[1][1].keys())
        different = [name for name in both[0][1] if both[0][1][name] != both[1][1][name]]
        self.assertEqual(different, [])
        # the labelled file of a labelled file is itself, but for the comment
        again = self.run_program("check", "--as-namelist", "one.nml", cwd=self.path("labelled")).out
        self.assertEqual(
            [line for line in again.splitlines() if line[:1] != "!" and "&model" not in line],
            [line for line in printed.out.splitlines() if line[:1] != "!" and "&model" not in line],
        )

    def test_models_of_the_inputs(self):
        folders = sorted(path.parent for path in INPUTS.glob("*/*.df"))
        self.assertGreater(len(folders), 15)
        for folder in folders:
            with self.subTest(folder.name):
                self.compare(folder)

    @unittest.skipUnless((SHARED / "legacy").is_dir(), "the legacy files are not here")
    def test_legacy_files(self):
        compared = 0
        for analysis in sorted((SHARED / "legacy").rglob("*.ana")):
            geometry = analysis.with_suffix(".geo")
            if not geometry.exists() or self.run_program("check", geometry, analysis).code != 0:
                continue
            with self.subTest(analysis.name):
                self.compare(geometry, analysis, steps=1)
                compared += 1
        self.assertGreater(compared, 0)

    def test_everything_that_a_pair_can_say(self):
        """Both dialects; tables of points, laws, loads, stages and base motion of an options file."""
        self.write(
            "more.nml",
            "&run title = 'It''s a test', t_end = 0.05, save_every = 2 /\n"
            "&time cut_factor = 0.25, rotation = 'linear' / &solver method = 'pcg', tolerance = 1e-9 /\n"
            "&load gravity = 9.8, base_acceleration = 'base.csv', harmonic = 1, 0, 3, 0, 0 /\n"
            "&line_load ends = 1.5, 2, 2.5, 2, force_start = 0, -1e3, table = 0, 0, 1, 1 /\n"
            "&joint_material number = 1, name = 'joint', cohesion = 10, normal_stiffness = 3e9 /\n"
            "&joint_material number = 2, friction = 12, tie = .true. /\n"
            "&joint_law material = ' JOINT ', law = 'velocity', parameters = 20, 0.5 /\n"
            "&stage until_step = 2, k01 = 0, gravity = 0.5 / &stage release = 1 /\n"
            "&region name = 'top', box = 0, 1, 4, 2 /\n"
            "&contact formulation = 'length' / &output contacts = .false. / &block_damping mass_proportional = 0.3 /\n",
        )
        self.write("base.csv", "0,0,0\n1,0.5,0.25\n")
        self.write("labelled/base.csv", "0,0,0\n1,0.5,0.25\n")
        self.compare("block.dc", "block.df", "more.nml", steps=6)
        self.compare("block.dc", "block.df", steps=6)
        self.write("peer.df", PEER_ANALYSIS)
        self.compare("block.dc", "peer.df", steps=6)
        # a tension without cohesion is what legacy files may say
        self.write("peer.df", PEER_ANALYSIS.replace("30 0 0", "30 0 500"))
        self.compare("block.dc", "peer.df", steps=6)

    def test_as_namelist_needs_the_files_of_a_run(self):
        outcome = self.run_program("check", "--as-namelist", "block.dc")
        self.assertEqual((outcome.code, outcome.out), (2, ""))
        self.assertIn("--as-namelist needs the files of one run", outcome.err)
        outcome = self.run_program("check", "--as-namelist", "block.dc", "block.df", "--json")
        self.assertIn("&model geometry = 'block.dc'", outcome.json["namelist"])

    def setUp(self):
        super().setUp()
        # paths in the printed file count from its folder
        self.path("labelled").mkdir()
        shutil.copy(self.path("block.dc"), self.path("labelled/block.dc"))
        self.assertEqual(self.path("block.dc").read_text(), GEOMETRY)


if __name__ == "__main__":
    unittest.main()
