# SPDX-License-Identifier: MIT
"""Checkpoints: a run that stopped goes on as if nothing had happened, and what is no checkpoint is refused."""

import random
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from resume_case import BLOCK, ResumeTest
from support import h5py

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from works import write_wall

if h5py is not None:
    import checkpoints
    import numpy as np
    from faults import shipped_models

SOLVERS = ("cholmod", "pcg", "sor", "dense", "auto")


class Bits(ResumeTest):
    """N steps, resume, N more: bit by bit what 2N steps give."""

    def check(self, model, solver, n):
        options = ("--solver", solver, "--save-every", "3", "--quiet", "--force")
        whole = self.run_program("run", model, "-o", "whole.h5", "--steps", 2 * n, *options)
        if "not built in" in whole.err:
            self.skipTest(whole.err)
        self.assertEqual(whole.code, 0, whole.err)
        self.good("run", model, "-o", "out.h5", "--steps", n, "--threads", "2", *options)
        self.good("resume", "out.ckpt.h5", "--steps", n, "--threads", "1", "--quiet")
        self.assertSame("whole.h5", "out.h5")

    def test_every_shipped_model(self):
        for k, model in enumerate(shipped_models()):
            with self.subTest(model=model.name):
                # PCG does not converge where ties are a thousand times stiffer than the cells that they join
                self.check(model, "auto" if model.name == "cantilever" else SOLVERS[k % 2], 5)

    def test_every_solver(self):
        models = {path.name: path for path in shipped_models()}
        for solver in SOLVERS:
            with self.subTest(solver=solver):
                self.check(models["six_block_beam"], solver, 8)

    def test_where_the_automatic_solver_changes_its_mind(self):
        # contacts change from step to step, and direct solves lie between those of PCG: its preconditioner must be that
        # of the present contacts also without a restart
        model = next(path for path in shipped_models() if path.name == "jointed_slope")
        options = ("--t-end", "15", "--save-every", "10", "--threads", "1", "--quiet")
        self.good("run", model, "-o", "whole.h5", "--steps", "405", *options)
        self.good("run", model, "-o", "out.h5", "--steps", "399", *options)
        self.good("resume", "out.ckpt.h5", "--steps", "6", "--threads", "1", "--quiet")
        self.assertSame("whole.h5", "out.h5")

    def test_with_a_coarse_space(self):
        # soft for its long steps: PCG with groups of blocks, which are made anew from the places in each step
        files = write_wall(Path(self.path("wall")), 3200, 2000.0)
        model = (*files, "--dialect", "g0", "--solver", "auto")
        options = ("--save-every", "1", "--quiet")
        self.good("run", *model, "-o", "whole.h5", "--steps", "2", "--threads", "1", *options)
        self.assertIn("pcg: with a coarse space", Path(self.path("whole.log")).read_text())
        self.good("run", *model, "-o", "out.h5", "--steps", "1", "--threads", "2", *options)
        self.good("resume", "out.ckpt.h5", "--steps", "1", "--threads", "3", "--quiet")
        self.assertSame("whole.h5", "out.h5")

    def test_while_blocks_sleep(self):
        # a block falls for a second on three that sleep, and wakes them
        boxes = [(-4, -1, 8, 1), (0, 0, 2, 1), (0, 1, 2, 1), (0, 2, 2, 1), (0.8, 7.9, 0.4, 0.4)]
        corners = [((x, y), (x + b, y), (x + b, y + h), (x, y + h)) for x, y, b, h in boxes]
        lines = ["rockdda-blocks 1", "e0 0.001", "blocks 5", "vertices 20", "fixed 4", "loading 0", "measured 0"]
        lines += ["bolts 0"]
        for number, block in enumerate(corners, start=1):
            lines += [f"block {number} 1 4", *(f"{x} {y} 1" for x, y in block)]
        lines += ["fixed_points", *(f"{x} {y} 1" for x, y in corners[0])]
        lines += ["loading_points", "measured_points", "bolt_list", "end"]
        self.write("drop.blk", "\n".join(lines) + "\n")
        rock = "2500 24525 1e10 0.25 0 0 0 0 0 0 0 0 0"
        self.write("drop.df", f"1\n200\n1\n1\n0.1\n0.01\n1e9\n0 0 0 0\n{rock}\n30 0 0\n1.4\n")
        self.write("sleep.nml", "&time sleep = 'on' /\n")
        model = ("drop.blk", "drop.df", "--dialect", "g0", "--config", "sleep.nml")
        options = ("--save-every", "10", "--quiet")
        self.good("run", *model, "-o", "whole.h5", "--steps", "150", "--threads", "1", *options)
        for first in (70, 101, 103):
            self.good("run", *model, "-o", "out.h5", "--steps", first, "--threads", "2", "--force", *options)
            if first == 70:
                self.assertEqual(self.in_checkpoint("out.ckpt.h5", "state/asleep").tolist(), [1, 1, 1, 1, 0])
            self.good("resume", "out.ckpt.h5", "--steps", 150 - first, "--threads", "1", "--quiet")
            self.assertSame("whole.h5", "out.h5")
        self.assertLess(self.in_checkpoint("out.ckpt.h5", "state/asleep").sum(), 4)

    def test_frames_of_the_end_are_no_frames_of_a_run_that_goes_on(self):
        self.good(*BLOCK, "-o", "whole.h5", "--steps", "12", "--save-every", "5")
        self.good(*BLOCK, "-o", "out.h5", "--steps", "3", "--save-every", "5")
        for n, frames in ((4, [0, 5, 7]), (0, [0, 5, 7]), (3, [0, 5, 10]), (2, [0, 5, 10, 12])):
            outcome = self.good("resume", "out.ckpt.h5", "--steps", n)
            self.assertIn(f"({len(frames)} frames)", outcome.out)
            with h5py.File(self.path("out.h5")) as file:
                self.assertEqual(file["frames/step"][()].tolist(), frames)
        self.assertSame("whole.h5", "out.h5")

    def test_end_time_and_frames_by_time(self):
        self.write("run.nml", "&run save_dt = 0.017 /\n")
        options = ("--config", "run.nml", "--t-end", "0.1")
        self.good(*BLOCK, "-o", "whole.h5", *options)
        self.good(*BLOCK, "-o", "out.h5", *options, "--steps", "4")
        self.good("resume", "out.ckpt.h5", "--t-end", "0.1")
        self.assertSame("whole.h5", "out.h5")

    def test_frames_of_single_precision(self):
        self.write("single.nml", "&output precision = 'single' /\n")
        options = ("--steps", "12", "--save-every", "1")
        self.good(*BLOCK, "-o", "double.h5", *options)
        self.good(*BLOCK, "-o", "whole.h5", "--config", "single.nml", *options)
        self.good(*BLOCK, "-o", "out.h5", "--config", "single.nml", *options[2:], "--steps", "5")
        self.good("resume", "out.ckpt.h5", "--steps", "7")
        self.assertSame("whole.h5", "out.h5")
        self.assertEqual(self.run_program("info", "out.h5").code, 0)
        rounded = set()
        with h5py.File(self.path("double.h5")) as exact, h5py.File(self.path("out.h5")) as found:
            for group in ("history", "frames"):
                for name, item in exact[group].items():
                    values = found[group][name]
                    if values.dtype == item.dtype:
                        np.testing.assert_array_equal(values[()], item[()], name)
                        continue
                    self.assertEqual((item.dtype.str, values.dtype.str), ("<f8", "<f4"), name)
                    np.testing.assert_array_equal(values[()], item[()].astype("f4"), name)
                    rounded.add(f"{group}/{name}")
        contacts = ("force", "opening", "slip", "length", "normal_stress", "shear_stress", "strength")
        blocks = ("rotation", "stress", "velocity", "bolt_force")
        self.assertEqual(rounded, {f"frames/{n}" for n in (*blocks, *(f"contact_{c}" for c in contacts))})

    def test_without_frames_or_contacts(self):
        for k, what in enumerate(("frames = .false.", "contacts = .false.")):
            self.write("run.nml", f"&output {what} /\n")
            whole, out = f"whole{k}.h5", f"out{k}.h5"
            self.good(*BLOCK, "-o", whole, "--config", "run.nml", "--steps", "6")
            self.good(*BLOCK, "-o", out, "--config", "run.nml", "--steps", "3")
            self.good("resume", f"out{k}.ckpt.h5", "--steps", "3")
            self.assertSame(whole, out)

    def test_other_names_of_results(self):
        for name, checkpoint in (("a.hdf5", "a.ckpt.h5"), ("b", "b.ckpt.h5"), ("c.d/e f.h5", "c.d/e f.ckpt.h5")):
            self.path("c.d").mkdir(exist_ok=True)
            self.good(*BLOCK, "-o", name, "--steps", "3")
            # both files may move
            outcome = self.good("resume", checkpoint, "--steps", "2", "--json")
            self.assertEqual((outcome.json["output"], outcome.json["steps"]), (name, 5))
        shutil.copy(self.path("a.hdf5"), self.path("moved.hdf5"))
        shutil.copy(self.path("a.ckpt.h5"), self.path("moved.ckpt.h5"))
        self.good("resume", "a.ckpt.h5", "--steps", "2")
        self.good("resume", "moved.ckpt.h5", "--steps", "2")
        self.assertSame("a.hdf5", "moved.hdf5")


class Command(ResumeTest):
    def setUp(self):
        super().setUp()
        self.good(*BLOCK, "--steps", "5")

    def test_a_run_that_is_done(self):
        before = self.path("block.h5").read_bytes()
        outcome = self.good("resume", "block.ckpt.h5")
        self.assertEqual(
            outcome.err, "rockdda: nothing left to do: the run has done all its 5 steps; --steps N adds N more\n"
        )
        self.assertTrue(outcome.out.startswith("done: 5 steps"))
        outcome = self.good("resume", "block.ckpt.h5", "--quiet", "--json")
        self.assertEqual((outcome.err, outcome.json["status"], outcome.json["steps"]), ("", "done", 5))
        self.assertEqual(self.path("block.h5").read_bytes(), before)

    def test_a_run_that_has_reached_its_end(self):
        outcome = self.good("resume", "block.ckpt.h5", "--t-end", "0.05", "--steps", "3")
        self.assertEqual(
            outcome.err,
            "rockdda: nothing left to do: the run has reached its end, time 0.05; --t-end T or --steps N "
            "continues it\n",
        )
        # more steps are done, as after any complete run
        done = self.good("resume", "block.ckpt.h5", "--json").json["steps"]
        self.assertEqual(self.good("resume", "block.ckpt.h5", "--steps", "3", "--json").json["steps"], done + 3)

    def test_a_run_whose_stages_are_over(self):
        self.write("staged.nml", "&stage name = 'one', until_step = 2 /\n")
        self.good(*BLOCK, "--config", "staged.nml", "-o", "staged.h5", "--quiet")
        outcome = self.good("resume", "staged.ckpt.h5", "--steps", "3")
        self.assertEqual(
            outcome.err,
            "rockdda: nothing left to do: the last stage of the run is over, after 2 steps; to continue, run the model "
            "with one more &stage\n",
        )

    def test_json(self):
        summary = self.good("resume", "block.ckpt.h5", "--steps", "2", "--json").json
        self.assertEqual(summary["checkpoint"], "block.ckpt.h5")
        self.assertEqual((summary["command"], summary["first_step"], summary["steps"]), ("resume", 5, 7))

    def test_log_goes_on(self):
        self.good("resume", "block.ckpt.h5", "--steps", "2")
        log = self.path("block.log").read_text()
        self.assertEqual(log.count("end: finished"), 2)
        self.assertRegex(log, r"resumed: from step 5 at time 0\.05, \d{4}-\d\d-\d\dT")

    def test_info_and_check(self):
        facts = self.good("info", "block.ckpt.h5", "--json").json["files"][0]
        self.assertEqual((facts["kind"], facts["step"], facts["blocks"]), ("checkpoint file", 5, 2))
        self.assertEqual((facts["results"], facts["last_step_of_run"]), ("block.h5", 5))
        # anybody can check the digests
        for command, digest in (
            ("head -c -124 block.ckpt.h5", facts["sha256"]),
            ("cat block.dc", facts["sha256_of_geometry"]),
            ("cat block.df", facts["sha256_of_analysis"]),
        ):
            found = subprocess.run(f"{command} | sha256sum", shell=True, cwd=self.folder, capture_output=True)
            self.assertEqual(found.stdout.decode().split()[0], digest)
        self.assertEqual(self.good("check", "block.ckpt.h5").out, "1 file checked: 0 errors, 0 warnings\n")
        self.path("block.h5").unlink()
        outcome = self.good("check", "block.ckpt.h5")
        self.assertEqual(outcome.err, "block.ckpt.h5: warning: its results block.h5 are not beside it\n")

    def test_a_new_run_has_nothing_of_an_old_one(self):
        self.good(*BLOCK, "--steps", "3", "--force")
        self.assertEqual(self.good("info", "block.ckpt.h5", "--json").json["files"][0]["step"], 3)

    def test_usage(self):
        self.refused(
            "rockdda: error: 'rockdda resume' needs one checkpoint file; found 0 files, see 'rockdda resume --help'"
        )
        outcome = self.run_program("resume", "block.ckpt.h5", "--solver", "sor")
        self.assertFails(outcome, 2, "rockdda: error: option --solver does not belong to 'rockdda resume'")
        message = "rockdda: error: option --t-end: the checkpoint is at time 0.05 already"
        self.refused(message, "block.ckpt.h5", "--t-end", "0.01")


class Refused(ResumeTest):
    """Files from which no run can go on. Nothing may change."""

    def setUp(self):
        super().setUp()
        self.good(*BLOCK, "--steps", "5")
        self.checkpoint = self.path("block.ckpt.h5").read_bytes()

    def test_missing_or_foreign(self):
        self.refused("no.ckpt.h5: error: there is no such file", "no.ckpt.h5")
        self.write("text.ckpt.h5", "1 2 3\n")
        message = ": error: this is no checkpoint of RockDDA, or one that was cut off"
        self.refused("text.ckpt.h5" + message, "text.ckpt.h5")
        self.refused("block.dc" + message, "block.dc")
        self.refused("block.h5" + message + "; the checkpoint of these results is block.ckpt.h5", "block.h5")
        with h5py.File(self.path("other.ckpt.h5"), "w") as file:
            file["x"] = np.zeros(10)
        self.refused("other.ckpt.h5" + message, "other.ckpt.h5")
        self.path("folder.ckpt.h5").mkdir()
        self.refused("folder.ckpt.h5: error: this is not a file", "folder.ckpt.h5")
        self.path("block.ckpt.h5").rename(self.path("renamed.h5"))
        outcome = self.run_program("resume", "renamed.h5")
        self.assertIn("the name of a checkpoint ends in '.ckpt.h5'", outcome.err)

    def test_checkpoint_that_may_not_be_read(self):
        nobody = self.as_nobody()
        self.path("block.ckpt.h5").chmod(0)
        outcome = self.run_program("resume", "block.ckpt.h5", **nobody)
        self.assertFails(outcome, 2, "block.ckpt.h5: error: permission denied")

    def test_undo_file_that_may_not_be_read(self):
        nobody = self.as_nobody()
        for name in self.files():
            self.path(name).chmod(0o666)
        self.write("block.h5.undo", "anything").chmod(0)
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet", **nobody)
        self.assertFails(outcome, 2, "block.h5.undo: error: Permission denied")

    def test_damaged_or_cut(self):
        generator = random.Random(4)
        places = [0, 8, 100, len(self.checkpoint) - 2, *(generator.randrange(len(self.checkpoint)) for _ in range(8))]
        for place in places:
            damaged = bytearray(self.checkpoint)
            damaged[place] ^= 1 << generator.randrange(8)
            self.write("block.ckpt.h5", bytes(damaged))
            for command in ("resume", "check", "info"):
                outcome = self.run_program(
                    command,
                    "block.ckpt.h5",
                    "--steps" if command == "resume" else "--quiet",
                    *(["5"] if command == "resume" else []),
                )
                self.assertEqual(outcome.code, 2, (place, command, outcome.err))
                self.assertRegex(
                    outcome.err, r"\Ablock\.ckpt\.h5: error: (the checkpoint is damaged|this is no checkp)"
                )
        for length in (0, 1, 1000, len(self.checkpoint) // 2, len(self.checkpoint) - 1):
            self.write("block.ckpt.h5", self.checkpoint[:length])
            self.refused(
                "block.ckpt.h5: error: this is no checkpoint of RockDDA, or one that was cut off", "block.ckpt.h5"
            )

    def seal(self, change):
        """A checkpoint with other content and a digest that fits."""
        import hashlib

        path = self.write("block.ckpt.h5", self.checkpoint[:-124])
        with h5py.File(path, "r+") as file:
            change(file)
        content = path.read_bytes()
        line = "rockdda checkpoint, SHA-256 of all bytes before this line: " + hashlib.sha256(content).hexdigest()
        path.write_bytes(content + line.encode() + b"\n")

    def test_other_versions(self):
        self.seal(lambda file: file.attrs.modify("program_version", "0.0.1"))
        outcome = self.run_program("resume", "block.ckpt.h5")
        self.assertEqual(outcome.code, 2)
        self.assertIn(
            "block.ckpt.h5: error: was written by version 0.0.1 of the program, this is version ", outcome.err
        )
        versions = []
        self.seal(lambda file: versions.append(int(file.attrs["format_version"])))
        self.seal(lambda file: file.attrs.modify("format_version", 99))
        self.refused(
            "block.ckpt.h5: error: this program reads checkpoints of format version "
            f"{versions[0]}, not 99; start the run again",
            "block.ckpt.h5",
        )
        self.seal(lambda file: file.attrs.modify("format", "something"))
        self.refused("block.ckpt.h5: error: this is no checkpoint of RockDDA", "block.ckpt.h5")
        self.seal(lambda file: checkpoints.remove_small(file, "state/velocity"))
        self.assertEqual(self.run_program("resume", "block.ckpt.h5", "--steps", "2").code, 2)
        for name, value in (
            ("state/velocity", np.zeros((1, 6))),  # of one block only
            ("model/vertex_offset", np.int32(1)),  # no list
            ("results/history_rows", np.zeros(2, np.int32)),
            ("input/geometry", np.zeros(3)),  # no text
        ):
            with self.subTest(name=name):
                self.seal(lambda file, name=name, value=value: checkpoints.put(file, name, value))
                outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "2", "--quiet")
                self.assertEqual(outcome.code, 2, outcome.err)
                self.assertRegex(outcome.err, r"\Ablock\.ckpt\.h5: error: [^\n]+\n\Z")
        self.seal(lambda file: file.attrs.modify("build", "another"))
        outcome = self.good("resume", "block.ckpt.h5", "--steps", "2")
        self.assertIn("warning: block.ckpt.h5 was written by another build of this version", outcome.err)

    def test_numbers_that_their_meaning_forbids(self):
        """Logicals other than 0 and 1, blocks asleep where none sleeps, negative counts: some ended the program."""
        for name, value in (
            ("state/asleep", 1),
            ("state/asleep", -(2**31)),
            ("state/active", 2),
            ("state/accelerates", 255),
            ("state/calm", 2**31 - 1),
            ("contacts/bonded", 256),
            ("contacts/tied", -3),
            ("contacts/slip_sign", 257),
            ("control/released", 127),
            ("control/cuts", -3),
            ("construction/newborn", -128),
        ):
            with self.subTest(name=name, value=value):
                self.seal(
                    lambda file, name=name, value=value: checkpoints.put(
                        file, name, np.full_like(np.atleast_1d(checkpoints.value(file, name)), value)
                    )
                )
                self.refused(
                    f"block.ckpt.h5: error: the checkpoint is damaged: {name} holds an impossible number",
                    "block.ckpt.h5",
                    "--steps",
                    "2",
                )

    def test_time_too_short_for_a_step_is_refused(self):
        """Its square is 0: the checkpoint held accelerations that are not finite, and could not be resumed."""
        outcome = self.run_program(*BLOCK, "-o", "short.h5", "--t-end", "1e-300")
        self.assertEqual(outcome.code, 2)
        self.assertIn("end time (t_end) is too short: 1e-300; at least 1e-100", outcome.err)
        self.assertFalse(self.path("short.ckpt.h5").exists())
        self.good(*BLOCK, "-o", "short.h5", "--t-end", "1e-99")
        self.good("resume", "short.ckpt.h5", "--t-end", "0.01")

    def test_results_that_do_not_belong(self):
        results = self.path("block.h5").read_bytes()
        self.path("block.h5").unlink()
        self.refused("block.h5: error: the results of this checkpoint are missing", "block.ckpt.h5", "--steps", "2")
        self.good(*BLOCK, "-o", "short.h5", "--steps", "2")
        with h5py.File(self.path("short.h5"), "r+") as file, h5py.File(self.write("block.h5", results)) as long:
            file.attrs["created"] = long.attrs["created"]
        shutil.copy(self.path("short.h5"), self.path("block.h5"))
        message = (
            "block.h5: error: these results end before the checkpoint (step 5); was the file replaced by an older copy?"
        )
        self.refused(message, "block.ckpt.h5", "--steps", "2")
        message = "block.h5: error: these results are not those of the checkpoint; "
        with h5py.File(self.write("block.h5", results), "r+") as file:
            file.attrs["created"] = "2001-01-01T00:00:00Z"
        self.refused(message + "it was written by another run", "block.ckpt.h5", "--steps", "2")
        with h5py.File(self.write("block.h5", results), "r+") as file:
            file["history/energy"][4, 2] += 1
        self.refused(message + "they differ in step 5", "block.ckpt.h5", "--steps", "2")
        with h5py.File(self.path("block.h5"), "w") as file:
            file["x"] = 1.0
        self.refused(message + "it was written by another run", "block.ckpt.h5", "--steps", "2")
        self.write("block.h5", b"no HDF5 file")
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "2")
        self.assertEqual(outcome.code, 2, outcome.err)


if __name__ == "__main__":
    unittest.main()
