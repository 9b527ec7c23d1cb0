# SPDX-License-Identifier: MIT
"""A run that was interrupted, was killed, met a full disk or finds damaged results: it goes on, or says why not.

A few faults of each kind; scripts/torture tries many, on all shipped models.
"""

import os
import random
import resource
import shutil
import signal
import time
import unittest

from resume_case import BLOCK, ResumeTest
from support import PROGRAM, h5py

if h5py is not None:
    import numpy as np
    from faults import Case, Faults, lost_rows, shipped_models

#: Seconds after which a test gives up, many times what a busy machine needs.
PATIENCE = 120
#: A checkpoint after every step.
EVERY_STEP = ("--checkpoint-every", "1e-9")


def child_seconds():
    """Processor time of all children that have ended, and of theirs."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class DamagedResults(ResumeTest):
    """A good checkpoint beside results with wrong bytes: refused, or, where the byte means nothing, no harm done."""

    steps = 30
    refusal = (
        r"\Ablock\.h5: error: (these results are damaged: .+|the file is damaged: HDF5 cannot read it|"
        r"these results are not those of the checkpoint; .+|these results end before the checkpoint .+|"
        r"the file is not as RockDDA writes it: .+|cannot open the file .+)\n\Z"
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
            except (OSError, RuntimeError) as problem:
                # the length in a reference to a text, or of an attribute, or the place of a chunk in its index: HDF5
                # 1.10 does not look at it, later versions do
                known = "global heap object size|ran off end of input buffer|bad coordinate offset"
                self.assertRegex(str(problem), known)
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
        # some bytes mean nothing: room that is not used, addresses that nothing follows. How many is a matter of HDF5
        self.assertGreater(refused, 0)

    def test_one_bit_of_a_value(self):
        """A wrong bit in a stored number is always found."""
        generator = random.Random(12)
        changed = 0
        for name in ("history/energy", "history/dt", "frames/vertices", "frames/stress", "model/block_area"):
            with h5py.File(self.write("kept.h5", self.results), "r") as file:
                values = file[name][()]
                if file[name].chunks is None:
                    start, size = file[name].id.get_offset(), values.nbytes
                else:
                    chunk = file[name].id.get_chunk_info(0)
                    start, size = chunk.byte_offset, chunk.size
            for _ in range(6):
                damaged = bytearray(self.results)
                damaged[start + generator.randrange(size)] ^= 1 << generator.randrange(8)
                with h5py.File(self.write("changed.h5", bytes(damaged)), "r") as file:
                    # a chunk has room for rows to come
                    if file[name][()].tobytes() == values.tobytes():
                        continue
                changed += 1
                with self.subTest(name=name):
                    self.assertFalse(self.resume(bytes(damaged)))
        self.assertGreater(changed, 10)

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
            # between a checkpoint and its undo file a kill leaves that of the last one, of which nothing is needed
            checkpoint = self.path("block.ckpt.h5")
            digest = checkpoint.read_bytes()[-65:].decode(errors="replace").strip() if checkpoint.exists() else ""
            if saved and length > 200000 and content[16:48].hex() == digest:
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
        # the kill may have left an unfinished record, of which nothing is needed
        undo = undo[: len(undo) - (len(undo) - 72) % 4112]
        message = (
            "block.h5.undo: error: this file is damaged; without it the results cannot be returned to the checkpoint"
        )
        generator = random.Random(5)
        places = [0, 8, 16, 48, 56, 64, 72, 80, 88, len(undo) - 1, *(generator.randrange(len(undo)) for _ in range(10))]
        for place in places:
            with self.subTest(place=place):
                damaged = bytearray(undo)
                damaged[place] ^= 1 << generator.randrange(8)
                self.write("block.h5.undo", bytes(damaged))
                self.refused(message, "block.ckpt.h5", "--steps", "1")
        for length in (73, len(undo) - 4112, len(undo) - 1):
            self.write("block.h5.undo", undo[:length])
            self.refused(message, "block.ckpt.h5", "--steps", "1")
        self.write("block.h5.undo", b"something else" * 100)
        self.refused(message, "block.ckpt.h5", "--steps", "1")
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
        # a folder in its place: the run continues with a warning, and its end fails
        process = self.start_program(*BLOCK, "--steps", "100000000", "-o", "a.h5", "--checkpoint-every", "0.02")
        self.wait_for(process, "a.ckpt.h5")
        # stopped, so that no checkpoint comes in between
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        self.path("a.ckpt.h5").rename(self.path("kept"))
        self.path("a.ckpt.h5").mkdir()
        process.send_signal(signal.SIGCONT)
        warning = process.stderr.readline().decode()
        ending = "; the run continues, and the older checkpoint is unchanged"
        self.assertRegex(warning, r"rockdda: warning: no checkpoint of step \d+: a\.ckpt\.h5: .*" + ending)
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
class FaultsBesideTheComputation(ResumeTest):
    """Frames of so many blocks that they are written while the next step is computed: the same results, and the same
    ends when the disk fails."""

    def setUp(self):
        super().setUp()
        # single blocks that fall, 30 x 500: a frame has 2.8 MB, and is flushed while the next step is computed
        rows, columns = 30, 500
        blocks = rows * columns
        text = ["rockdda-blocks 1", "e0 0.001", f"blocks {blocks}", f"vertices {4 * blocks}"]
        text += ["fixed 0", "loading 0", "measured 0", "bolts 0"]
        for number in range(blocks):
            x, y = 2 * (number % columns), 2 * (number // columns)
            text += [f"block {number + 1} 1 4"]
            text += [f"{a} {b} 1" for a, b in ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1))]
        text += ["fixed_points", "loading_points", "measured_points", "bolt_list", "end"]
        self.write("many.blk", "\n".join(text) + "\n")
        self.write("many.df", "1 20 1 1 0.1 0.001 1e9\n2500 24525 1e10 0.25 0 0 0 0 0 0 0 0 0\n30 0 0\n1.4\n")
        self.case = Case(PROGRAM, [os.fspath(self.path("many.blk")), os.fspath(self.path("many.df"))], 24)
        self.addCleanup(self.case.remove)
        self.faults = Faults(self.folder)

    def test_kill_and_full_disk(self):
        calls = self.faults.count(self.case, "run")
        generator = random.Random(11)
        for kind, code in (("kill", -signal.SIGKILL), ("full", 5)):
            for at in sorted(generator.sample(range(calls // 4, calls), 2)):
                with self.subTest(kind=kind, call=at):
                    self.case.clear()
                    outcome = self.case.run("run", env=self.faults.environment(at, kind))
                    self.assertEqual(outcome.returncode, code, outcome.stderr)
                    self.assertEqual(self.case.recover(), "")


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
