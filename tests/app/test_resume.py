# SPDX-License-Identifier: MIT
"""Checkpoints: a run that stopped, was killed or met a full disk goes on as if nothing had happened.

A few faults of each kind; scripts/torture tries many, on all shipped models.
"""

import os
import random
import resource
import shutil
import signal
import subprocess
import time
import unittest

from support import PROGRAM, ProgramTest, h5py

if h5py is not None:
    import numpy as np
    from faults import MEMORY, Case, Faults, differences, lost_rows, shipped_models

BLOCK = ("run", "block.dc", "block.df")
SOLVERS = ("cholmod", "pcg", "sor", "dense", "auto")
#: Seconds after which a test gives up, many times what a busy machine needs.
PATIENCE = 120
#: A checkpoint after every step.
EVERY_STEP = ("--checkpoint-every", "1e-9")


def child_seconds():
    """Processor time of all children that have ended, and of theirs."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@unittest.skipIf(h5py is None, "h5py is missing")
class ResumeTest(ProgramTest):
    parent = MEMORY if h5py is not None else None

    def good(self, *arguments):
        outcome = self.run_program(*arguments)
        self.assertEqual(outcome.code, 0, outcome.err)
        return outcome

    def assertSame(self, one, other):
        self.assertEqual(differences(self.path(one), self.path(other)), [])

    def refused(self, message, *arguments):
        before = {name: self.path(name).read_bytes() for name in self.files()}
        outcome = self.run_program("resume", *arguments, "--quiet")
        self.assertEqual((outcome.code, outcome.err), (2, message + "\n"))
        self.assertEqual({name: self.path(name).read_bytes() for name in self.files()}, before, "nothing was changed")


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
                self.check(model, SOLVERS[k % 2], 5)

    def test_every_solver(self):
        models = {path.name: path for path in shipped_models()}
        for solver in SOLVERS:
            with self.subTest(solver=solver):
                self.check(models["six_block_beam"], solver, 8)

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
        self.seal(lambda file: file.attrs.modify("format_version", 99))
        self.refused(
            "block.ckpt.h5: error: checkpoints of format version 99 are not known to this program, only 2",
            "block.ckpt.h5",
        )
        self.seal(lambda file: file.attrs.modify("format", "something"))
        self.refused("block.ckpt.h5: error: this is no checkpoint of RockDDA", "block.ckpt.h5")
        self.seal(lambda file: file.__delitem__("state/velocity"))
        self.assertEqual(self.run_program("resume", "block.ckpt.h5", "--steps", "2").code, 2)
        for name, value in (
            ("state/velocity", np.zeros((1, 6))),  # of one block only
            ("model/vertex_offset", np.int32(1)),  # no list
            ("results/history_rows", np.zeros(2, np.int32)),
            ("input/geometry", np.zeros(3)),  # no text
        ):
            with self.subTest(name=name):
                self.seal(lambda file, name=name, value=value: (file.__delitem__(name), file.__setitem__(name, value)))
                outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "2", "--quiet")
                self.assertEqual(outcome.code, 2, outcome.err)
                self.assertRegex(outcome.err, r"\Ablock\.ckpt\.h5: error: [^\n]+\n\Z")
        self.seal(lambda file: file.attrs.modify("build", "another"))
        outcome = self.good("resume", "block.ckpt.h5", "--steps", "2")
        self.assertIn("warning: block.ckpt.h5 was written by another build of this version", outcome.err)

    def test_results_that_do_not_belong(self):
        results = self.path("block.h5").read_bytes()
        self.path("block.h5").unlink()
        self.refused("block.h5: error: the results of this checkpoint are not there", "block.ckpt.h5", "--steps", "2")
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


class DamagedResults(ResumeTest):
    """A good checkpoint beside results with wrong bytes: refused, or, where the byte means nothing, no harm done."""

    steps = 30
    refusal = (
        r"\Ablock\.h5: error: (these results are damaged: .+|the file is damaged: HDF5 does not get through it|"
        r"these results are not those of the checkpoint; .+|these results end before the checkpoint .+|"
        r"cannot open the file .+)\n\Z"
    )

    def setUp(self):
        super().setUp()
        options = ("--save-every", "7", "--quiet")
        self.good(*BLOCK, "-o", "whole.h5", "--steps", self.steps + 9, *options)
        self.good(*BLOCK, "--steps", self.steps, *options)
        self.kept = {path.name: path.read_bytes() for path in self.folder.glob("block.*")}
        self.results = self.kept["block.h5"]

    def resume(self, results):
        """True when the run went on, with nothing wrong in its results; else it was refused and nothing changed."""
        for name, content in self.kept.items():
            self.write(name, content)
        self.write("block.h5", results)
        # seconds of processor time, which do not depend on what else the machine does: one, and the work of the run
        start = child_seconds()
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "9", "--quiet")
        self.assertLess(child_seconds() - start, 8)
        if outcome.code == 0:
            try:
                self.assertSame("whole.h5", "block.h5")
            except OSError as problem:
                # the length in a reference to a text: HDF5 1.10 does not look at it, later versions do
                self.assertIn("global heap object size", str(problem))
            return True
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertRegex(outcome.err, self.refusal)
        self.assertEqual(self.path("block.h5").read_bytes(), results)
        left = {path.name: path.read_bytes() for path in self.folder.glob("block.*")}
        self.assertEqual({**left, "block.h5": self.results}, self.kept, "nothing was changed")
        return False

    def test_one_bit(self):
        # most places are values, few are what leads to them
        generator = random.Random(11)
        places = [generator.randrange(len(self.results)) for _ in range(10)]
        for mark in (b"TREE", b"SNOD", b"GCOL", b"HEAP", b"exit_reason", b"complete", b"columns", b"block"):
            found = [k for k in range(len(self.results)) if self.results.startswith(mark, k)]
            self.assertTrue(found, mark)
            places += [generator.choice(found) + generator.randrange(48) for _ in range(2)]
        refused = 0
        for place in places:
            damaged = bytearray(self.results)
            damaged[place] ^= 1 << generator.randrange(8)
            with self.subTest(place=place):
                refused += not self.resume(bytes(damaged))
        self.assertGreater(refused, len(places) // 4)

    def test_every_kind_of_content(self):
        changes = {
            "history/energy": lambda file: file["history/energy"].__setitem__((3, 1), 7.0),
            "frames/velocity": lambda file: file["frames/velocity"].__setitem__((1, 0, 0), 1e-300),
            "frames/contact_state": lambda file: file["frames/contact_state"].__setitem__(0, 1),
            "the model": lambda file: file["model/block_area"].__setitem__(0, 1.0),
            "/ title": lambda file: file.attrs.__setitem__("title", "another"),
            "input/analysis": lambda file: file["input/analysis"].__setitem__((), "1 2 3"),
            "history/energy columns": lambda file: file["history/energy"].attrs.__setitem__("columns", ["a", "b"]),
            "the numbers of rows": lambda file: file["history/dt"].resize(100, axis=0),
        }
        for name, change in changes.items():
            with self.subTest(name=name):
                with h5py.File(self.write("changed.h5", self.results), "r+") as file:
                    change(file)
                self.assertFalse(self.resume(self.path("changed.h5").read_bytes()))
                outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "9", "--quiet")
                message = f"block.h5: error: these results are damaged: {name} differ from what the run has written\n"
                self.assertEqual((outcome.code, outcome.err), (2, message))
        with h5py.File(self.write("changed.h5", self.results), "r+") as file:
            del file.attrs["exit_reason"]
            del file["frames/rotation"]
        self.assertFalse(self.resume(self.path("changed.h5").read_bytes()))

    def test_a_note_in_the_results_is_no_damage(self):
        with h5py.File(self.write("changed.h5", self.results), "r+") as file:
            file.attrs["note"] = "the one with the soft joints"
        self.write("whole.h5", self.path("whole.h5").read_bytes())
        with h5py.File(self.path("whole.h5"), "r+") as file:
            file.attrs["note"] = "the one with the soft joints"
        self.assertTrue(self.resume(self.path("changed.h5").read_bytes()))

    def test_hdf5_that_never_ends(self):
        # an object of no length in the heap of texts: HDF5 1.10 walks on the spot
        heap = self.results.index(b"GCOL")
        damaged = bytearray(self.results)
        damaged[heap + 24 : heap + 32] = bytes(8)
        self.assertFalse(self.resume(bytes(damaged)))
        start = child_seconds()
        for command in ("info", "check"):
            outcome = self.run_program(command, "block.h5")
            self.assertEqual(outcome.code, 2, outcome.err)
        self.assertLess(child_seconds() - start, 8)

    def kill_a_run(self):
        """What a kill leaves when there are pages in the undo file: length of the results at the checkpoint, pages."""
        process = self.start_program(*BLOCK, "--steps", "100000000", "--quiet", "--force", "--checkpoint-every", "0.1")
        deadline = time.monotonic() + PATIENCE
        saved: set[int] = set()
        undo = self.path("block.h5.undo")
        length = 0
        while time.monotonic() < deadline:
            time.sleep(0.01)
            # stopped, so that what is seen is what the kill finds
            process.send_signal(signal.SIGSTOP)
            os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
            content = undo.read_bytes() if undo.exists() else b""
            length = int.from_bytes(content[8:16], "little")
            # a header of 72 bytes, records of 8 + 8 + 4096
            saved = {int.from_bytes(content[k : k + 8], "little") for k in range(72, len(content) - 4111, 4112)}
            if saved and length > 200000:
                break
            process.send_signal(signal.SIGCONT)
        process.kill()
        process.communicate()
        self.assertTrue(saved)
        self.assertGreater(length, 200000)
        return length, saved

    def test_damage_while_an_undo_file_waits(self):
        """After a kill the results are put back in memory first: refused, they are as the kill left them."""
        length, saved = self.kill_a_run()
        good = {path.name: path.read_bytes() for path in self.folder.glob("block.*")}
        # a page in the undo file is put back whatever is wrong with it: spoil all others
        damaged = bytearray(good["block.h5"])
        for page in set(range(length // 4096)) - saved:
            damaged[4096 * page] ^= 255
            damaged[4096 * page + 2048] ^= 255
        self.write("block.h5", bytes(damaged))
        before = {path.name: path.read_bytes() for path in self.folder.glob("block.*")}
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet")
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertRegex(outcome.err, self.refusal)
        self.assertEqual({path.name: path.read_bytes() for path in self.folder.glob("block.*")}, before)
        # shorter than it was at the checkpoint
        self.write("block.h5", before["block.h5"][:5000])
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet")
        self.assertEqual(outcome.code, 2, outcome.err)
        self.assertRegex(outcome.err, self.refusal)
        # the file as the kill left it is good
        self.write("block.h5", good["block.h5"])
        self.good("resume", "block.ckpt.h5", "--steps", "1", "--quiet")

    def test_damaged_undo_file(self):
        """Pages that are not put back would leave an index that belongs to other data."""
        self.kill_a_run()
        good = {path.name: path.read_bytes() for path in self.folder.glob("block.*")}
        undo = good["block.h5.undo"]
        message = (
            "block.h5.undo: error: this file is damaged, and without it the results do not lead back to the checkpoint"
        )
        generator = random.Random(5)
        places = [0, 8, 16, 48, 56, 64, 72, 80, 88, len(undo) - 1, *(generator.randrange(len(undo)) for _ in range(10))]
        for place in places:
            with self.subTest(place=place):
                damaged = bytearray(undo)
                damaged[place] ^= 1 << generator.randrange(8)
                self.write("block.h5.undo", bytes(damaged))
                self.refused(message, "block.ckpt.h5")
        for length in (73, len(undo) - 4112, len(undo) - 1):
            self.write("block.h5.undo", undo[:length])
            self.refused(message, "block.ckpt.h5")
        self.write("block.h5.undo", b"something else" * 100)
        self.refused(message, "block.ckpt.h5")
        # of an unfinished record nothing is needed, and after a crash of the machine there may be zeros only
        for ending in (b"x", bytes(4112), b"x" * 9000):
            for name, content in good.items():
                self.write(name, content)
            self.write("block.h5.undo", undo + ending)
            self.good("resume", "block.ckpt.h5", "--steps", "1", "--quiet")


class Interrupted(ResumeTest):
    def setUp(self):
        super().setUp()
        self.steps = 60
        options = ("--steps", self.steps, "--save-every", "7", "--quiet")
        self.good(*BLOCK, "-o", "whole.h5", *options)
        self.options = (*options, "-o", "out.h5")

    def test_wall_clock_limit_again_and_again(self):
        limit = 0.02
        code = self.run_program(*BLOCK, *self.options, "--max-wall", limit).code
        before = -1
        while code == 4:
            self.assertEqual(lost_rows(self.path("out.h5"), self.path("whole.h5")), [])
            step = self.good("info", "out.ckpt.h5", "--json").json["files"][0]["step"]
            # where a busy machine needs as long for the start as the limit, there are no steps: a longer limit then
            limit = 0.05 if step > before else 2 * limit
            self.assertLess(limit, PATIENCE)
            before = step
            code = self.run_program("resume", "out.ckpt.h5", "--max-wall", limit, "--quiet").code
        self.assertEqual(code, 0)
        self.assertSame("whole.h5", "out.h5")

    def test_signals(self):
        long = ("--steps", "100000000", "--save-every", "50", "--quiet")
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
            self.path("a.ckpt.h5").unlink(missing_ok=True)
            process = self.start_program(*BLOCK, *long, "-o", "a.h5", "--force")
            self.wait_for(process, "a.ckpt.h5")
            process.send_signal(number)
            _, err = process.communicate(timeout=PATIENCE)
            self.assertEqual(process.returncode, 4)
            self.assertIn("; 'rockdda resume a.ckpt.h5' continues\n", err.decode())
            step = self.good("info", "a.ckpt.h5", "--json").json["files"][0]["step"]
            self.good("resume", "a.ckpt.h5", "--steps", "13", "--quiet")
            with h5py.File(self.path("a.h5")) as file:
                self.assertEqual(file["history/step"][()].tolist(), list(range(1, step + 14)))
                times = np.cumsum(file["history/dt"][()])
                self.assertTrue(np.array_equal(file["history/time"][()], times))

    def wait_for(self, process, name):
        deadline = time.monotonic() + PATIENCE
        while not self.path(name).exists() and time.monotonic() < deadline:
            self.assertIsNone(process.poll())
            time.sleep(0.005)
        self.assertTrue(self.path(name).exists())

    def test_two_at_a_time(self):
        self.good(*BLOCK, *self.options[:-2], "-o", "a.h5")
        process = self.start_program("resume", "a.ckpt.h5", "--steps", "100000000", "--quiet")
        deadline = time.monotonic() + PATIENCE
        while "resumed" not in self.path("a.log").read_text() and time.monotonic() < deadline:
            time.sleep(0.01)
        outcome = self.run_program("resume", "a.ckpt.h5", "--steps", "5", "--quiet")
        self.assertEqual((outcome.code, outcome.err), (2, "a.h5: error: another run is writing this file\n"))
        outcome = self.run_program(*BLOCK, "-o", "a.h5", "--force", "--quiet")
        self.assertEqual(outcome.code, 2)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 4)

    def test_new_target_survives_a_kill(self):
        self.good(*BLOCK, "-o", "out.h5", "--steps", "5", "--quiet")
        process = self.start_program("resume", "out.ckpt.h5", "--steps", "100000000", "--quiet")
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            facts = self.good("info", "out.ckpt.h5", "--json").json["files"][0]
            if facts["last_step_of_run"] == 100000005:
                break
            time.sleep(0.01)
        process.kill()
        process.communicate()
        self.assertEqual(self.good("info", "out.ckpt.h5", "--json").json["files"][0]["last_step_of_run"], 100000005)

    def test_checkpoint_that_cannot_be_written(self):
        # a folder in its place: the run goes on and says so, the end of it fails
        process = self.start_program(*BLOCK, "--steps", "100000000", "-o", "a.h5", "--checkpoint-every", "0.02")
        self.wait_for(process, "a.ckpt.h5")
        # stopped, so that no checkpoint comes in between
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        self.path("a.ckpt.h5").rename(self.path("kept"))
        self.path("a.ckpt.h5").mkdir()
        process.send_signal(signal.SIGCONT)
        warning = process.stderr.readline().decode()
        self.assertRegex(warning, r"rockdda: warning: no checkpoint of step \d+: a\.ckpt\.h5: .*; the run goes on")
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 5)
        self.path("a.ckpt.h5").rmdir()
        # the older one is still good for something
        self.path("kept").rename(self.path("a.ckpt.h5"))
        self.good("resume", "a.ckpt.h5", "--steps", "3", "--quiet")


@unittest.skipIf(h5py is None or shutil.which("cc") is None, "h5py or a C compiler is missing")
class FaultsOfTheDisk(ResumeTest):
    """A fault at chosen calls that change files: nothing is lost, and the run can go on."""

    def setUp(self):
        super().setUp()
        self.case = Case(PROGRAM, [os.fspath(self.path("block.dc")), os.fspath(self.path("block.df"))], 9)
        self.addCleanup(self.case.remove)
        self.faults = Faults(self.folder)
        if self.case.run("run", env=self.faults.environment(-1, "kill")).returncode != 0:
            self.skipTest("nothing can be preloaded into this build")

    def check(self, kind, codes, tries):
        calls = self.faults.count(self.case, "run", EVERY_STEP)
        generator = random.Random(kind)
        for at in sorted(generator.sample(range(1, calls), tries)):
            with self.subTest(kind=kind, call=at):
                self.case.clear()
                outcome = self.case.run("run", more=EVERY_STEP, env=self.faults.environment(at, kind))
                self.assertIn(outcome.returncode, codes, outcome.stderr)
                self.assertEqual(self.case.recover(), "")

    def test_kill(self):
        self.check("kill", (-signal.SIGKILL,), 8)

    def test_kill_in_the_midst_of_a_write(self):
        self.check("tear", (-signal.SIGKILL,), 4)

    def test_full_disk(self):
        self.check("full", (5,), 5)

    def test_one_write_that_fails(self):
        self.check("once", (0, 5), 5)

    def test_kill_of_a_run_that_was_resumed(self):
        self.assertEqual(self.case.run("run", steps=4, more=EVERY_STEP).returncode, 0)
        calls = self.faults.count(self.case, "resume", ("--steps", "5"))
        generator = random.Random(9)
        for at in sorted(generator.sample(range(1, calls), 6)):
            with self.subTest(call=at):
                self.case.clear()
                self.case.run("run", steps=4, more=EVERY_STEP)
                self.case.run("resume", more=("--steps", "5"), env=self.faults.environment(at, "kill"))
                # killed before it had noted that it is to go further: then it is done
                facts = self.good("info", self.case.folder / "out.ckpt.h5", "--json").json["files"][0]
                if facts["last_step_of_run"] == 4:
                    self.assertEqual(self.case.run("resume").returncode, 0)
                    self.assertEqual(self.case.run("resume", more=("--steps", "5")).returncode, 0)
                self.assertEqual(self.case.recover(), "")


@unittest.skipIf(h5py is None, "h5py is missing")
class KilledAtRandom(ResumeTest):
    def test_shipped_models(self):
        generator = random.Random(7)
        models = {path.name: path for path in shipped_models()}
        for name in ("incline", "stack", "released_block"):
            case = Case(PROGRAM, [os.fspath(models[name])], 40)
            self.addCleanup(case.remove)
            for _ in range(3):
                with self.subTest(model=name):
                    case.clear()
                    case.run_and_kill("run", 0.25 * generator.random(), ("--checkpoint-every", "0.01"))
                    if (case.folder / "out.ckpt.h5").exists() and generator.random() < 0.5:
                        case.run_and_kill("resume", 0.2 * generator.random())
                    self.assertEqual(case.recover(), "")


if __name__ == "__main__":
    unittest.main()
