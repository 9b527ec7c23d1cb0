# SPDX-License-Identifier: MIT
"""Cutting, checking, describing; and what the program says to bad input."""

import signal
import time
import unittest
from pathlib import Path

from support import ANALYSIS, GEOMETRY, PEER_ANALYSIS, ProgramTest


class Cut(ProgramTest):
    def test_block_file_goes_to_the_current_folder(self):
        work = self.path("elsewhere")
        work.mkdir()
        outcome = self.run_program("cut", "../block.dc", cwd=work)
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        self.assertTrue(outcome.out.startswith("block.blk: 2 blocks, 8 vertices\n"), outcome.out)
        self.assertIn("area: blocks 6 + holes 0, enclosed 6, difference", outcome.out)
        self.assertEqual(self.files(), ["block.dc", "block.df", "elsewhere/block.blk"])

    def test_areas_have_the_units_of_the_options(self):
        self.write("run.nml", "&model geometry = 'block.dc' /\n")
        outcome = self.run_program("cut", "block.dc", "--config", "run.nml")
        self.assertIn("area: blocks 6 m² + holes 0 mm², enclosed 6 m², difference", outcome.out)

    def test_json(self):
        data = self.run_program("cut", "block.dc", "-o", "x.blk", "--json").json
        self.assertEqual(data["blocks"], 2)
        self.assertEqual(data["output"], "x.blk")
        # a sum of two areas: rounding only
        self.assertAlmostEqual(data["area_of_blocks"], 6.0, delta=1e-14)
        self.assertLess(abs(data["area_difference"]), 1e-14)

    def test_existing_file_needs_force(self):
        self.write("block.blk", "mine")
        message = "rockdda: error: block.blk: the file exists; use --force to overwrite it"
        self.assertFails(self.run_program("cut", "block.dc"), 2, message)
        self.assertEqual(self.path("block.blk").read_text(), "mine")
        self.assertEqual(self.run_program("cut", "block.dc", "--force").code, 0)
        self.assertTrue(self.path("block.blk").read_text().startswith("rockdda-blocks"))

    def test_input_is_never_the_output(self):
        outcome = self.run_program("cut", "block.dc", "-o", "./block.dc", "--force")
        self.assertFails(outcome, 2, "rockdda: error: ./block.dc: the output would overwrite the input")
        self.assertEqual(self.path("block.dc").read_text(), GEOMETRY)

    def test_dropped_lines_are_named(self):
        text = GEOMETRY.replace("7 4 ", "8 4 ").replace("3 2 3 1 1\n", "3 2 3 1 1\n0.2 0.2 0.4 0.3 1\n")
        self.write("block.dc", text)
        outcome = self.run_program("cut", "block.dc")
        self.assertEqual(outcome.code, 0)
        self.assertIn("block.dc:16:1: warning: ", outcome.err)
        self.assertIn("dropped 1", outcome.out)
        self.assertEqual(self.run_program("cut", "block.dc", "--force", "--quiet").err, "")

    def test_many_dropped_lines_are_one_warning(self):
        loose = "".join(f"0.2 0.{k} 0.4 0.{k} 1\n" for k in (3, 4, 5)) + "0 0.7 0.4 0.7 1\n0 0.8 0.4 0.8 1\n"
        self.write("block.dc", GEOMETRY.replace("7 4 ", "12 4 ").replace("3 2 3 1 1\n", "3 2 3 1 1\n" + loose))
        self.write("block.df", ANALYSIS)
        warning = (
            "block.dc: warning: 5 lines bound no block: dropped (3 of them meet no other line): line 8 (block.dc:16), "
            "line 9 (block.dc:17), line 10 (block.dc:18) and 2 more; 'rockdda check' lists all\n"
        )
        self.assertEqual(self.run_program("cut", "block.dc").err, warning)
        self.assertEqual(self.run_program("run", "block.dc", "block.df").err.count("warning"), 1)
        log = self.path("block.log").read_text()
        checked = self.run_program("check", "block.dc")
        self.assertEqual(checked.out, "1 file checked: 0 errors, 5 warnings\n")
        for text in (log, checked.err):
            self.assertEqual(text.count("warning: line "), 5)
            self.assertEqual(text.count("lines bound no block"), 0)
        outcome = self.run_program("cut", "block.dc", "--force", "--json")
        self.assertEqual((outcome.json["warnings"], len(outcome.json["messages"])), (1, 1))

    def test_file_of_somebody_else(self):
        # in a folder like /tmp: others may add files, but not replace this one
        nobody = self.as_nobody()
        if not nobody:
            self.skipTest("needs root to be two users")
        self.write("block.blk", "mine")
        self.folder.chmod(0o1777)
        outcome = self.run_program("cut", "block.dc", "--force", **nobody)
        self.assertFails(outcome, 5, "rockdda: error: block.blk: could not be written")
        self.assertEqual(self.path("block.blk").read_text(), "mine")
        self.assertEqual(self.files(), ["block.blk", "block.dc", "block.df"])

    def test_signals_while_lines_are_cut(self):
        # 2,000 lines, a million blocks: many seconds; nothing is there yet, so nothing is left
        n = 1000
        lines = [f"{x} 0 {x} {n} 1" for x in range(n + 1)] + [f"0 {y} {n} {y} 1" for y in range(n + 1)]
        counts = ["0.01", f"{len(lines)} 0", *["0"] * 6]
        self.write("mesh.dc", "\n".join([*counts, *lines]) + "\n")
        self.write("mesh.df", PEER_ANALYSIS)
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
            for command in (("cut", "mesh.dc"), ("run", "mesh.dc", "mesh.df")):
                for delay in (0.0, 0.1):
                    with self.subTest(signal=number.name, command=command, delay=delay):
                        process = self.start_program(*command)
                        time.sleep(delay)
                        process.send_signal(number)
                        _, err = process.communicate(timeout=60)
                        self.assertEqual((process.returncode, err), (-number, b""))
                        self.assertEqual(self.files(), ["block.dc", "block.df", "mesh.dc", "mesh.df"])

    def test_unwritable_output(self):
        advice = "the folder 'none/a b' does not exist; make it first: mkdir -p 'none/a b'"
        for arguments in (("cut", "block.dc"), ("run", "block.dc", "block.df")):
            outcome = self.run_program(*arguments, "-o", "none/a b/x")
            self.assertFails(outcome, 5, f"rockdda: error: none/a b/x: {advice}")
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_full_disk(self):
        if not Path("/dev/full").exists():
            self.skipTest("no /dev/full")
        outcome = self.run_program("cut", "block.dc", "-o", "/dev/full")
        self.assertFails(outcome, 5, "rockdda: error: /dev/full: No space left on device")


class Check(ProgramTest):
    def test_a_word_between_lines_is_reported_once_at_its_place(self):
        """An error; in files of records a comment between two of them, with a warning."""
        self.assertEqual(self.run_program("cut", "block.dc").code, 0)
        for name, row, kind in (
            ("block.dc", 3, "warning"),
            ("block.df", 2, "warning"),
            ("block.blk", 8, "error"),
        ):
            with self.subTest(name=name, row=row):
                rows = self.path(name).read_text().splitlines()
                rows.insert(row, "foo")
                path = "bad" + name[name.index(".") :]
                self.write(path, "\n".join(rows) + "\n")
                outcome = self.run_program("check", path)
                self.assertEqual(outcome.code, 2 if kind == "error" else 0)
                self.assertIn(f"{path}:{row + 1}:1: {kind}: ", outcome.err)
                self.assertIn("'foo'", outcome.err)
                self.assertEqual(outcome.err.count(f" {kind}: "), 1, outcome.err)
        # what follows all numbers is comment
        self.write("end.dc", self.path("block.dc").read_text() + "foo\n")
        self.assertEqual(self.run_program("check", "end.dc").code, 0)

    def test_good_files(self):
        outcome = self.run_program("check", "block.dc", "block.df")
        self.assertEqual(outcome.code, 0)
        self.assertTrue(outcome.out.endswith("2 files checked: 0 errors, 0 warnings\n"))
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_folder(self):
        outcome = self.run_program("check", ".", "--json")
        self.assertEqual(outcome.code, 0)
        kinds = {Path(f["file"]).name: f["kind"] for f in outcome.json["files"]}
        self.assertEqual(kinds, {"block.dc": "geometry file", "block.df": "analysis file"})

    def test_problems_of_all_files_come_together(self):
        self.write("block.dc", GEOMETRY.replace("1 2 3 2 1\n", "1 2 abcd 2 1\n"))
        self.write("block.df", ANALYSIS.replace("30 0 0\n", "30 0 -5\n"))
        self.write("run.nml", "&run steps = 5, stpes = 6 /\n")
        outcome = self.run_program("check", "block.dc", "block.df", "run.nml", "--quiet")
        self.assertEqual(outcome.code, 2)
        places = [line.split(" error: ")[0] for line in outcome.err.splitlines() if " error: " in line]
        self.assertEqual(sorted(places), ["block.dc:14:5:", "block.df:14:6:", "run.nml:1:17:"])
        self.assertIn("did you mean 'steps'?", outcome.err)
        self.assertEqual(outcome.out, "3 files checked: 3 errors, 0 warnings\n")

    def test_materials_are_checked_across_files(self):
        self.write("block.dc", GEOMETRY.replace("1 2 3 2 1\n", "1 2 3 2 7\n"))
        outcome = self.run_program("check", "block.dc", "block.df")
        self.assertEqual(outcome.code, 2)
        self.assertIn(
            "block.dc:14:9: error: joint material 7, used by line 6, is not described: "
            "the analysis file has 1 joint material",
            outcome.err,
        )

    def test_line_shows_the_place(self):
        self.write("block.df", ANALYSIS.replace("30 0 0\n", "30.0  0.0  abcd\n"))
        outcome = self.run_program("check", "block.dc", "block.df", "--quiet")
        self.assertFails(
            outcome,
            2,
            "block.df:14:12: error: tensile strength of joint material 1: expected a number, found 'abcd'",
            "    30.0  0.0  abcd",
            "               ^",
        )


class Info(ProgramTest):
    def test_facts_of_input_files(self):
        self.run_program("cut", "block.dc")
        self.write("run.nml", "&run steps = 5 / &output frames = .false. /\n")
        outcome = self.run_program("info", "block.dc", "block.df", "block.blk", "run.nml", "--json")
        self.assertEqual(outcome.code, 0)
        geometry, analysis, blocks, options = outcome.json["files"]
        self.assertEqual((geometry["kind"], geometry["lines"], geometry["x_max"]), ("geometry file", 7, 4.0))
        self.assertEqual((analysis["dialect"], analysis["contact_stiffness"]), ("g0", 1e8))
        self.assertEqual((blocks["blocks"], blocks["area"], blocks["fixed_points"]), (2, 6.0, 2))
        self.assertEqual((options["&run"], options["&output"]), ("steps", "frames"))
        text = self.run_program("info", "block.dc").out
        self.assertIn("\n  loading points          1\n", text)

    def test_folder(self):
        outcome = self.run_program("info", ".", "--json")
        self.assertEqual(outcome.code, 0)
        kinds = {Path(f["file"]).name: f["kind"] for f in outcome.json["files"]}
        self.assertEqual(kinds, {"block.dc": "geometry file", "block.df": "analysis file"})
        self.path("block.df").unlink()
        outcome = self.run_program("info", ".")
        self.assertEqual(outcome.code, 2)
        self.assertIn("found 1 geometry or block file (block.dc), no analysis file", outcome.err)

    def test_missing_file(self):
        outcome = self.run_program("info", "absent.dc")
        self.assertFails(outcome, 2, "absent.dc: error: no such file")


class BadInput(ProgramTest):
    """`run` with bad input: the message, exit code 2, and nothing written."""

    def check(self, files, *lines):
        for name, text in files.items():
            self.write(name, text)
        before = self.files()
        outcome = self.run_program("run", "block.dc", "block.df")
        errors = [line for line in outcome.err.splitlines() if " error: " in line]
        self.assertEqual(errors, list(lines))
        self.assertEqual(outcome.code, 2)
        self.assertEqual(outcome.out, "")
        self.assertEqual(self.files(), before)

    def test_missing_files(self):
        outcome = self.run_program("run", "a.dc", "b.df")
        self.assertFails(outcome, 2, "a.dc: error: no such file", "b.df: error: no such file")

    def test_directory_for_a_file(self):
        self.path("folder.df").mkdir()
        outcome = self.run_program("run", "block.dc", "folder.df")
        self.assertFails(outcome, 2, "folder.df: error: is a directory, not a file")

    def test_no_permission(self):
        nobody = self.as_nobody()
        self.path("block.df").chmod(0)
        outcome = self.run_program("run", "block.dc", "block.df", **nobody)
        self.assertFails(outcome, 2, "block.df: error: permission denied")
        self.path("model").mkdir(mode=0)
        outcome = self.run_program("run", "model", **nobody)
        self.assertFails(outcome, 2, "model: error: the folder cannot be read")
        self.path("model").chmod(0o755)
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_block_file_without_blocks(self):
        self.write("empty.blk", "# nothing\n")
        outcome = self.run_program("check", "empty.blk")
        self.assertFails(outcome, 2, "empty.blk:1:1: error: the file holds no blocks", "    # nothing", "    ^")

    def test_swapped_files(self):
        outcome = self.run_program("run", "block.df", "block.dc")
        self.assertFails(
            outcome,
            2,
            "block.df: error: expected a geometry or block file; the two files are in the wrong order, "
            "found an analysis file",
        )

    def test_two_geometries(self):
        outcome = self.run_program("run", "block.dc", "block.dc")
        self.assertFails(outcome, 2, "block.dc: error: expected an analysis file, found a geometry file")

    def test_empty_files(self):
        self.check(
            {"block.dc": "", "block.df": ""},
            "block.dc:1:1: error: the file is empty",
            "block.df:1:1: error: the file is empty",
        )

    def test_a_model_of_comments_alone(self):
        """A labelled file that was cut off in its first comment was checked without an error; options may be empty."""
        for text in ("! a slope\n! with a joint", "\n\n! a slope, in m", "!"):
            self.write("slope.nml", text)
            outcome = self.run_program("check", "slope.nml")
            self.assertEqual((outcome.code, outcome.out), (2, "1 file checked: 1 error, 0 warnings\n"))
            self.assertRegex(outcome.err, r"^slope.nml: error: the file holds no groups: a model has &model, ")
            for command in ("run", "fos"):
                self.assertFails(self.run_program(command, "slope.nml"), 2, outcome.err.strip())
            self.assertEqual(self.run_program("check", "block.dc", "block.df", "slope.nml").code, 0)
            self.assertEqual(self.run_program("check", "block.dc", "slope.nml").code, 0)

    def test_binary_file(self):
        self.check({"block.df": bytes(range(256))}, "block.df:1:1: error: this is a binary file, not text")

    def test_ddaml(self):
        self.write("block.dc", "<?xml version='1.0'?>\n<DDA></DDA>\n")
        advice = "this is a DDAML (XML) file; convert it first with 'rockdda-post convert'"
        self.assertFails(self.run_program("run", "block.dc", "block.df"), 2, "block.dc: error: " + advice)
        for command in ("check", "cut", "lines"):
            self.assertFails(self.run_program(command, "block.dc"), 2, "block.dc: error: " + advice)
        outcome = self.run_program("info", "block.dc")
        self.assertEqual((outcome.code, outcome.err), (0, f"block.dc: warning: {advice}\n"))

    def test_text_for_a_number(self):
        self.check(
            {"block.df": ANALYSIS.replace("30 0 0\n", "30 0 none\n")},
            "block.df:14:6: error: tensile strength of joint material 1: expected a number, found 'none'",
        )

    def test_not_a_number(self):
        self.check(
            {"block.dc": GEOMETRY.replace("1 2 3 2 1\n", "1 2 NaN 2 1\n")},
            "block.dc:14:5: error: x2 of line 6: expected a number, found 'NaN'",
        )

    def test_unknown_joint_material(self):
        self.write("block.dc", GEOMETRY.replace("1 2 3 2 1\n", "1 2 3 2 7\n"))
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertEqual(outcome.code, 2)
        self.assertIn(
            "block.dc:14:9: error: joint material 7, used by line 6, is not described: "
            "the analysis file has 1 joint material",
            outcome.err,
        )

    def test_point_in_no_block(self):
        self.write("block.dc", GEOMETRY.replace("3.5 0.5 3.5 0.5\n", "9 9 9 9\n"))
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertEqual(outcome.code, 2)
        self.assertIn("block.dc:17:1: error: ", outcome.err)
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_unknown_option_in_the_namelist(self):
        self.write("run.nml", "&run\n  stpes = 5\n/\n")
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml")
        self.assertEqual(outcome.code, 2)
        self.assertTrue(outcome.err.startswith("run.nml:2:3: error: unknown name 'stpes' in &run"), outcome.err)

    def test_options_that_do_not_fit_the_model(self):
        # all of them at once, each with its place
        groups = {
            "&stage until_step = 3, release = 7 /": "stage 1 releases fixed point 7, but the model has 2",
            "&stage k01 = 1 /": "",
            "&line_load ends = 0.5, 0.5, 1.5, 0.7, force_start = 0, -1 /": "line load 1: no block has both ends "
            "(0.5, 0.5) and (1.5, 0.7) on its outline; &boundary kind = 'traction' loads the edges of several blocks",
            "&joint_law material = 1, law = 'velocity', parameters = 20 /": "law of joint material 1: velocity takes 2 "
            "parameters: friction angle at high rates [deg], rate",
            "&joint_law material = 2, law = 'coulomb' /": "joint law 2: joint material 2 is unknown, there is "
            "1 joint material",
        }
        self.write("run.nml", "\n".join([*groups, ""]))
        expected = {
            (f"run.nml:{line}:1: error: {message}", f"    {group}", "    ^")
            for line, (group, message) in enumerate(groups.items(), 1)
            if message
        }
        for arguments in (("run", "--config"), ("check",)):
            command, *option = arguments
            outcome = self.run_program(command, "block.dc", "block.df", *option, "run.nml", "--quiet")
            lines = outcome.err.splitlines()
            self.assertEqual({tuple(lines[i : i + 3]) for i in range(0, len(lines), 3)}, expected)
            self.assertEqual(outcome.code, 2)
            self.assertFalse(self.path("block.h5").exists())

    def test_joint_materials_in_a_config_file(self):
        """A group changes what it names; another number adds a material; faults are told with their place."""
        self.write(
            "run.nml",
            "&run steps = 1 / &contact formulation = 'length', corner_radius = 0.02 /\n"
            "&joint_material number = 1, name = 'bedding', cohesion = 5, tension = 2, normal_stiffness = 5e9,\n"
            "  shear_stiffness = 2e9, brittle = .false. /\n"
            "&joint_material number = 2, friction = 40, tie = .true. /\n"
            "&joint_law material = 1, law = 'residual', residual_friction = 20, slip_length = 0.01 /\n",
        )
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml")
        self.assertEqual(outcome.code, 0, outcome.err)
        log = self.path("block.log").read_text()
        for text in (
            "contact formulation                = length\n",
            "corner radius over the shorter edge = 0.02\n",
            "joint_material 1                   = number 1, name bedding, friction 30, cohesion 5, tension 2, "
            "normal_stiffness 5000000000, shear_stiffness 2000000000, law residual, residual_friction 20, "
            "slip_length 0.01, "
            "dilation 0, damping_ratio 0, brittle .false., tie .false.\n",
            "joint_material 2                   = number 2, friction 40, cohesion 0, tension 0, law coulomb, "
            "dilation 0, damping_ratio 0, brittle .true., tie .true.\n",
        ):
            self.assertIn("\n  " + text, log)
        faults = {
            "&joint_material number = 1, friction = 95 /": (
                40,
                "friction: must be at least 0 and less than 90 degrees",
            ),
            "&joint_material number = 1, frction = 30 /": (
                29,
                "unknown name 'frction' in &joint_material; did you mean 'friction'?",
            ),
            "&joint_material number = 1, restitution = 1.5 /": (43, "restitution: must be at least 0 and at most 1"),
            "&contact points = 6 /": (19, "points: must be at least 3 and at most 5"),
        }
        later = {
            "&joint_material number = 3, friction = 30 /": "joint material 3: there is 1 joint material, the next "
            "number is 2",
            "&joint_material number = 1, law = 'barton_bandis', jrc = 5 /": "law of joint material 1: barton_bandis "
            "needs jrc, jcs and residual_friction",
            "&joint_material number = 1, tension = 5 /": "joint material 1 has tensile strength but no cohesion",
            "&joint_material number = 1, dilation = 40 /": "law of joint material 1: the dilation angle must not be "
            "larger than the friction angle",
        }
        for group, (column, message) in faults.items():
            self.write("bad.nml", group + "\n")
            outcome = self.run_program("check", "bad.nml")
            self.assertTrue(outcome.err.startswith(f"bad.nml:1:{column}: error: {message}"), outcome.err)
        for group, message in later.items():
            self.write("bad.nml", "\n" + group + "\n")
            outcome = self.run_program("check", "block.dc", "block.df", "bad.nml", "--quiet")
            self.assertTrue(outcome.err.startswith(f"bad.nml:2:1: error: {message}"), outcome.err)

    def test_smallest_step_beyond_the_largest(self):
        self.write("run.nml", "&time\n  dt_min = 3\n/\n")
        outcome = self.run_program("check", "block.dc", "block.df", "run.nml", "--quiet")
        self.assertFails(
            outcome,
            2,
            "run.nml:2:3: error: dt_min = 3 is larger than the largest time step 0.01",
            "      dt_min = 3",
            "      ^",
        )
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml", "--quiet", "--json")
        self.assertEqual(outcome.code, 2)
        told = [one for one in outcome.json["messages"] if one["severity"] == "error"]
        self.assertEqual([(one["file"], one["line"], one["column"]) for one in told], [("run.nml", 2, 3)])
        self.assertFalse(self.path("block.h5").exists())

    def test_wrong_number_of_values(self):
        self.write("block.df", PEER_ANALYSIS.replace("30 0 0\n", "30 0\n"))
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertEqual(outcome.code, 2)
        self.assertIn("block.df:", outcome.err)
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_folder_without_a_model(self):
        self.path("empty").mkdir()
        outcome = self.run_program("run", "empty")
        self.assertEqual(outcome.code, 2)
        self.assertTrue(outcome.err.startswith("empty: error: "), outcome.err)

    def test_many_errors_are_shown_up_to_fifty(self):
        lines = "\n".join(f"{i} 0 x 1 1" for i in range(80))
        text = GEOMETRY.replace("7 4 ", "87 4 ").replace("0 1 0 0 1\n", "0 1 0 0 1\n" + lines + "\n")
        self.write("block.dc", text)
        outcome = self.run_program("check", "block.dc")
        self.assertEqual(outcome.code, 2)
        self.assertEqual(outcome.err.count(" error: "), 50)
        self.assertIn("more", outcome.err.splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
