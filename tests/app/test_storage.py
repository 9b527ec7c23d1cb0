# SPDX-License-Identifier: MIT
"""Results and checkpoints that somebody has prepared, links that lie in the way, kills in the first moments."""

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

from support import PROGRAM, ProgramTest, h5py

if h5py is not None:
    import numpy as np

    sys.path.insert(0, os.fspath(Path(__file__).parents[1] / "fuzz"))
    import checkpoints
    from faults import preloaded

RUN = ("run", "block.dc", "block.df")
PRECIOUS = b"a precious file of the user\n" * 20


@unittest.skipIf(h5py is None, "h5py is missing")
class StructureTest(ProgramTest):
    """HDF5 can keep data outside of the file, and names can lead there."""

    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_program(*RUN, "--quiet").code, 0)
        self.write("victim.txt", PRECIOUS)

    def check_refused(self, words):
        """By all commands that open results; nothing is written."""
        content = {path: self.path(path).read_bytes() for path in self.files()}
        for command in (("resume", "block.ckpt.h5", "--steps", "2"), ("info", "block.h5"), ("check", "block.h5")):
            outcome = self.run_program(*command, "--quiet", timeout=20)
            self.assertEqual(outcome.code, 2, outcome.err)
            self.assertIn("block.h5: error: the file is not as RockDDA writes it: " + words, outcome.err)
        self.assertEqual(content, {path: self.path(path).read_bytes() for path in self.files()})

    def replace(self, name, make):
        with h5py.File(self.path("block.h5"), "r+") as file:
            shape, maxshape = file[name].shape, file[name].maxshape
            del file[name]
            make(file, shape, maxshape)

    def test_external_storage(self):
        def external(file, shape, _):
            creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            creation.set_external(os.fsencode(self.path("victim.txt")), 0, h5py.h5f.UNLIMITED)
            space = h5py.h5s.create_simple((0,), (h5py.h5s.UNLIMITED,))
            h5py.h5d.create(file["history"].id, b"time", h5py.h5t.IEEE_F64LE, space, creation)

        self.replace("history/time", external)
        self.check_refused("history/time keeps its values in another file")

    def test_links(self):
        with h5py.File(self.path("block.h5"), "r+") as file, h5py.File(self.path("other.h5"), "w") as other:
            file.copy("history", other)
            del file["history"]
            file["history"] = h5py.ExternalLink("other.h5", "/history")
        self.check_refused("history is a link into another file")
        with h5py.File(self.path("block.h5"), "r+") as file:
            del file["history"]
            file["history"] = h5py.SoftLink("/frames")
        self.check_refused("history is a soft link")

    def test_groups_that_hold_each_other_and_second_names(self):
        with h5py.File(self.path("block.h5"), "r+") as file:
            file["frames/again"] = file["/"]
        self.check_refused("frames/again is another name of an object that is there already")
        with h5py.File(self.path("block.h5"), "r+") as file:
            del file["frames/again"]
            file["model/x"] = file["model/vertices"]
        self.check_refused("model/x is another name")

    def test_virtual_datasets(self):
        def virtual(file, shape, _):
            layout = h5py.VirtualLayout(shape, "f8")
            layout[...] = h5py.VirtualSource("other.h5", "x", shape)
            file.create_virtual_dataset("history/time", layout)

        self.replace("history/time", virtual)
        self.check_refused("history/time is a virtual dataset")

    def test_unknown_filters(self):
        def packed(file, shape, maxshape):
            file.create_dataset("history/time", shape, "f8", maxshape=maxshape, chunks=True, scaleoffset=3)

        self.replace("history/time", packed)
        self.check_refused("history/time is packed with an unknown filter")

    def test_sizes_that_the_file_cannot_hold(self):
        def large(file, shape, _):
            file.create_dataset("history/time", (10**9,), "f8", chunks=(1024,))

        self.replace("history/time", large)
        self.check_refused("history/time is larger than the file can hold")

    def test_other_kinds_of_objects_and_values(self):
        with h5py.File(self.path("block.h5"), "r+") as file:
            file["frames/type"] = np.dtype("f8")
        self.check_refused("frames/type is neither a group nor a dataset")
        with h5py.File(self.path("block.h5"), "r+") as file:
            del file["frames/type"]
            file["frames/pair"] = np.zeros(3, dtype=[("a", "f8"), ("b", "i4")])
        self.check_refused("frames/pair is neither of numbers nor of texts")

    def test_arrays_that_do_not_fit_each_other(self):
        def change(name, values, words):
            good = self.path("block.h5").read_bytes()
            with h5py.File(self.path("block.h5"), "r+") as file:
                del file[name]
                if values is not None:
                    file[name] = values
            outcome = self.run_program("info", "block.h5")
            self.write("block.h5", good)
            self.assertFails(outcome, 2, f"block.h5: error: the file is damaged: {words}")

        change("frames/stress", None, "frames/stress is missing")
        change("frames/stress", np.zeros((3, 5, 3)), "frames/stress has an unexpected shape")
        change("model/vertices", np.zeros(8), "model/vertices has an unexpected shape")
        offsets = np.array([0, 4, 10**9], dtype="i4")
        change("model/vertex_offset", offsets, "model/vertex_offset holds an impossible number")
        area = np.array([4.0, np.nan])
        change("model/block_area", area, "model/block_area holds a number that is not finite")
        change("model/block_area", np.array([4.0, -1e300]), "model/block_area holds a number above 1e+30 in size")

    def test_rows_with_numbers_that_cannot_be(self):
        for name in ("history/time", "frames/time"):
            for value, words in ((1e31, "above 1e+30 in size"), (np.nan, "that is not finite")):
                good = self.path("block.h5").read_bytes()
                with h5py.File(self.path("block.h5"), "r+") as file:
                    file[name][-1] = value
                told = f"block.h5: error: the file is damaged: {name} holds a number {words}"
                self.assertFails(self.run_program("info", "block.h5"), 2, told)
                self.write("block.h5", good)

    def test_a_checkpoint_that_leads_out_of_itself(self):
        path = self.path("block.ckpt.h5")
        checkpoints.unsign(path)
        with h5py.File(path, "r+") as file:
            del file["input"]
            file["input"] = h5py.ExternalLink("victim.h5", "/")
        checkpoints.sign(path)
        words = "block.ckpt.h5: error: the file is not as RockDDA writes it: input is a link into another file"
        self.assertFails(self.run_program("resume", "block.ckpt.h5"), 2, words)
        self.assertFails(self.run_program("info", "block.ckpt.h5"), 2, words)


@unittest.skipIf(h5py is None, "h5py is missing")
class SignedCheckpointTest(unittest.TestCase):
    """The digest of a checkpoint is no proof that its values make sense."""

    def test_changed_values_that_were_signed_again(self):
        with tempfile.TemporaryDirectory() as folder:
            fuzzer = checkpoints.Fuzzer(PROGRAM, Path(folder), 7, ("released_block", "bolted_beam"))
            codes, wrong = checkpoints.run(fuzzer, 1, 60, 2)
        self.assertEqual(wrong, [])
        self.assertGreater(codes[2], 20, "most changes are noticed")

    def test_an_ending_that_leads_elsewhere(self):
        with tempfile.TemporaryDirectory() as folder:
            fuzzer = checkpoints.Fuzzer(PROGRAM, Path(folder), 1, ("free_fall",))
            path = Path(folder) / "free_fall.ckpt.h5"
            shutil.copy(Path(folder) / "free_fall.h5", Path(folder) / "other.h5")
            before = (Path(folder) / "other.h5").read_bytes()
            checkpoints.unsign(path)
            with h5py.File(path, "r+") as file:
                checkpoints.put(file, "results/ending", "/../other.h5")
            checkpoints.sign(path)
            code, _ = fuzzer.call(Path(folder), "resume", "free_fall.ckpt.h5", "--steps", "2")
            self.assertEqual(code, 2)
            self.assertEqual((Path(folder) / "other.h5").read_bytes(), before)


@unittest.skipIf(h5py is None, "h5py is missing")
class LinkTest(ProgramTest):
    """Nothing is written through a symbolic link that lies where a file is to be."""

    NAMES = ("block.h5", "block.h5.part", "block.h5.undo", "block.log", "block.ckpt.h5", "block.ckpt.h5.part")

    def plant(self, *names):
        for name in names:
            self.path(name).unlink(missing_ok=True)
            self.path(name).symlink_to("victim.txt")

    def check_untouched(self):
        self.assertEqual(self.path("victim.txt").read_bytes(), PRECIOUS)

    def test_a_new_run_replaces_links(self):
        self.write("victim.txt", PRECIOUS)
        self.plant(*self.NAMES)
        message = "rockdda: error: block.h5: the file exists; use --force to overwrite it"
        self.assertFails(self.run_program(*RUN, "--quiet"), 2, message)
        outcome = self.run_program(*RUN, "--quiet", "--force", "--checkpoint-every", "0.000001")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.check_untouched()
        for name in ("block.h5", "block.log", "block.ckpt.h5"):
            self.assertFalse(self.path(name).is_symlink(), name)

    def test_links_to_nothing(self):
        for name in self.NAMES[1:]:
            self.path(name).symlink_to("nothing")
        self.assertEqual(self.run_program(*RUN, "--quiet", "--checkpoint-every", "0.000001").code, 0)
        self.assertFalse(self.path("nothing").exists())

    def test_second_names_of_a_file(self):
        self.write("victim.txt", PRECIOUS)
        for name in self.NAMES[1:]:
            os.link(self.path("victim.txt"), self.path(name))
        outcome = self.run_program(*RUN, "--quiet", "--force", "--checkpoint-every", "0.000001")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.check_untouched()

    def test_a_run_that_goes_on(self):
        self.write("victim.txt", PRECIOUS)
        self.assertEqual(self.run_program(*RUN, "--quiet").code, 0)
        self.plant("block.ckpt.h5.part")
        self.assertEqual(self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet").code, 0)
        self.plant("block.log")
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet")
        self.assertIn("block.log: this is a symbolic link, and nothing is written through it", outcome.err)
        self.path("block.log").unlink()
        self.path("block.h5").rename(self.path("far.h5"))
        self.path("block.h5").symlink_to("far.h5")
        before = self.path("far.h5").read_bytes()
        outcome = self.run_program("resume", "block.ckpt.h5", "--steps", "1", "--quiet")
        message = "block.h5: error: this is a symbolic link: results are not written through it"
        self.assertFails(outcome, 2, message)
        self.assertEqual(self.path("far.h5").read_bytes(), before)
        self.check_untouched()

    def test_block_files(self):
        self.write("victim.txt", PRECIOUS)
        self.plant("block.blk", "block.blk.part")
        outcome = self.run_program("cut", "block.dc", "-o", "block.blk", "--force", "--quiet")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.check_untouched()

    def test_a_folder_behind_a_link(self):
        self.path("disk").mkdir()
        self.path("out").symlink_to("disk")
        self.assertEqual(self.run_program(*RUN, "-o", "out/a.h5", "--quiet").code, 0)
        self.assertEqual(self.run_program("resume", "out/a.ckpt.h5", "--steps", "1", "--quiet").code, 0)
        with h5py.File(self.path("disk/a.h5"), "r") as file:
            self.assertEqual(file["history/step"].shape, (21,))


@unittest.skipIf(h5py is None, "h5py is missing")
class FirstMomentsTest(ProgramTest):
    def test_results_have_their_name_only_when_they_can_be_read(self):
        """Killed before each of the first calls that change a file."""
        library = preloaded(self.folder, "fault")
        seen = set()
        for at in range(1, 40):
            environment = {**os.environ, "LD_PRELOAD": os.fspath(library), "FAULT_AT": str(at), "FAULT_KIND": "kill"}
            subprocess.run(
                [PROGRAM, *RUN, "--quiet"], cwd=self.folder, env=environment, capture_output=True, timeout=60
            )
            seen.add(self.path("block.h5").exists())
            if self.path("block.h5").exists():
                with h5py.File(self.path("block.h5"), "r") as file:
                    self.assertEqual(file.attrs["format"], "rockdda")
                    self.assertEqual(len(file["model/block_area"]), 2)
                self.path("block.h5").unlink()
        self.assertEqual(seen, {True, False})
        # what was left behind does not hinder, and goes
        self.write("block.h5.part", "left")
        self.assertEqual(self.run_program(*RUN, "--quiet").code, 0)
        self.assertEqual([name for name in self.files() if name.endswith(".part")], [])

    def test_older_results_stay_until_the_new_ones_can_be_read(self):
        self.assertEqual(self.run_program(*RUN, "--quiet").code, 0)
        library = preloaded(self.folder, "fault")
        for at in range(1, 12, 2):
            environment = {**os.environ, "LD_PRELOAD": os.fspath(library), "FAULT_AT": str(at), "FAULT_KIND": "kill"}
            subprocess.run(
                [PROGRAM, *RUN, "--quiet", "--force"], cwd=self.folder, env=environment, capture_output=True, timeout=60
            )
            with h5py.File(self.path("block.h5"), "r") as file:
                self.assertEqual(file.attrs["format"], "rockdda")

    def test_files_that_may_not_grow(self):
        """At any limit of their size: the older results stay, or new ones are there with the frame of the start at
        least, and the summary tells what they hold."""
        run = (*RUN, "--quiet", "--save-every", "1", "--steps", "400")
        self.assertEqual(self.run_program(*run).code, 0)
        older, seen = self.path("block.h5").read_bytes(), set()
        for limit in range(16_384, 180_000, 8192):
            self.write("block.h5", older)
            outcome = self.run_program(
                *run,
                "--force",
                "--json",
                preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
            )
            self.assertEqual(outcome.code, 5, outcome.err)
            if self.path("block.h5").read_bytes() == older:
                seen.add("older")
                continue
            with h5py.File(self.path("block.h5"), "r") as file:
                self.assertGreaterEqual(len(file["frames/step"]), 1)
                self.assertEqual(outcome.json["frames"], len(file["frames/step"]))
                self.assertEqual(outcome.json["steps"], len(file["history/step"]))
            seen.add("newer")
        self.assertEqual(seen, {"older", "newer"})

    def test_results_that_were_removed_are_not_counted(self):
        process = self.start_program(*RUN, "--quiet", "--save-every", "1", "--steps", "2000000", "--json")
        deadline = time.monotonic() + 60
        while not self.path("block.h5").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        self.path("block.h5").unlink()
        out, _ = process.communicate(timeout=120)
        summary = json.loads(out.splitlines()[0])
        self.assertEqual((process.returncode, summary["frames"], summary["steps"]), (5, 0, 0))
        self.assertIn("# the results hold 0 steps", self.path("block.log").read_text()[-200:])


if __name__ == "__main__":
    unittest.main()
