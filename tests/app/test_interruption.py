# SPDX-License-Identifier: MIT
"""Runs that do not come to their end: signals, time limits, kills, lost or full disks, steps without a solution."""

import contextlib
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from support import ANALYSIS, ProgramTest, h5py

if h5py is not None:
    import numpy as np

LONG = ("--steps", "100000000")  # more than any of these tests waits for
BLOCK = ("run", "block.dc", "block.df")
PATIENCE = 120  # seconds after which a test gives up, many times what a busy machine needs


@unittest.skipIf(h5py is None, "h5py is missing")
class InterruptionTest(ProgramTest):
    def open(self, name="block.h5"):
        return h5py.File(self.path(name), "r", locking=False)

    def start(self, *more):
        """A run that would never end, when it has flushed its first steps."""
        self.path("block.h5").unlink(missing_ok=True)
        process = self.start_program(*BLOCK, *LONG, "--save-every", "50", "--checkpoint-every", "0.02", *more)
        self.wait_for_steps(process, 1)
        return process

    def wait_for_steps(self, process, number, name="block.h5"):
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            self.assertIsNone(process.poll(), "still running")
            if self.path(name).exists() and self.steps_in(name) >= number:
                return
            time.sleep(0.02)
        self.fail("no steps in the file")

    def steps_in(self, name):
        """Whole rows that a reader sees, also in the midst of a flush; while the file is being created there may be
        none, or no file that opens."""
        try:
            with self.open(name) as file:
                return min(map(len, file["history"].values()))
        except (OSError, KeyError, ValueError):
            return 0

    def finish(self, process, code):
        out, err = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, code, err)
        return out.decode(), err.decode()

    @contextlib.contextmanager
    def paused(self, process):
        """While this lasts the process does nothing: what happens to its files happens at once for it."""
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        yield
        process.send_signal(signal.SIGCONT)

    @contextlib.contextmanager
    def hangups(self, handler):
        """What programs that are started meanwhile inherit for SIGHUP."""
        before = signal.signal(signal.SIGHUP, handler)
        yield
        signal.signal(signal.SIGHUP, before)

    def check_ended(self, reason, name="block.h5"):
        """An orderly end before time: nothing is missing, and the last frame is the last step."""
        with self.open(name) as file:
            self.assertEqual((file.attrs["complete"], file.attrs["exit_reason"]), (0, reason))
            steps = file["history/step"][()]
            self.assertEqual(steps.tolist(), list(range(1, len(steps) + 1)))
            frames = file["frames/step"][()]
            last = int(steps[-1]) if len(steps) else 0
            self.assertEqual(frames[-1], last)
            lengths = {len(table) for table in file["history"].values()}
            self.assertEqual(lengths, {last})
        log = self.path(Path(name).with_suffix(".log")).read_text().splitlines()
        self.assertTrue(log[-1].startswith(f"end: {reason} after {last} steps"), log[-1])
        return last

    def check_prefix(self, least, name="block.h5"):
        """What a file holds after a sudden end: whole rows up to some step, the same as in a run that ends well."""
        with self.open(name) as file:
            history = {key: table[()] for key, table in file["history"].items()}
            frames = {key: table[()] for key, table in file["frames"].items() if not key.startswith("contact")}
            offset = file["frames/contact_offset"][()]
            force = file["frames/contact_force"][()]
        # a kill in the midst of a flush leaves some tables longer than others
        steps = min(map(len, history.values()))
        self.assertGreaterEqual(steps, least)
        self.assertEqual(history["step"][:least].tolist(), list(range(1, least + 1)))
        self.assertTrue((history["dt"][:least] > 0).all())
        # sums in the same order
        self.assertTrue(np.array_equal(history["time"][:least], np.cumsum(history["dt"][:least])))
        rows = history["energy"][:least]
        # the ledger closes to the solver's tolerance, 1e-10 of the energies that went through it
        self.assertLess(np.abs(rows[:, -1]).max(initial=0), 1e-6 * (1 + np.abs(rows).max(initial=0)))
        whole = least // 50 + 1
        self.assertEqual(frames["step"][:whole].tolist(), list(range(0, 50 * whole, 50)))
        self.assertTrue(all(len(table) >= whole for table in frames.values()))
        self.assertTrue((frames["vertices"][:whole].max(axis=(1, 2)) > 1).all(), "no frame of zeros")
        self.assertGreaterEqual(len(force), offset[whole])
        return steps


class Stop(InterruptionTest):
    def test_signals(self):
        # schedulers other than Slurm say with SIGUSR2 and SIGXCPU that the time is up; SIGHUP: the terminal was closed
        for number in (
            signal.SIGTERM,
            signal.SIGINT,
            signal.SIGUSR1,
            signal.SIGUSR2,
            signal.SIGXCPU,
            signal.SIGHUP,
        ):
            with self.subTest(signal=number.name):
                with self.hangups(signal.SIG_DFL):  # these tests may run under nohup
                    process = self.start()
                process.send_signal(number)
                out, err = self.finish(process, 4)
                last = self.check_ended(f"signal {number.name}")
                self.assertTrue(out.startswith(f"stopped: {last} steps to time "), out)
                self.assertIn(
                    f"rockdda: stopped (signal {number.name}) after step {last}; 'rockdda resume block.ckpt.h5'", err
                )

    def test_how_to_go_on_is_said(self):
        process = self.start()
        process.send_signal(signal.SIGTERM)
        _, err = self.finish(process, 4)
        self.assertIn("; 'rockdda resume block.ckpt.h5' continues", err)

    def test_json_of_a_stopped_run(self):
        process = self.start("--json")
        process.send_signal(signal.SIGTERM)
        out, _ = self.finish(process, 4)
        self.assertRegex(out, r'"status": "stopped", "exit_code": 4, "exit_reason": "signal SIGTERM"')

    def test_closed_terminal_under_nohup(self):
        with self.hangups(signal.SIG_IGN):
            process = self.start("--quiet")
        process.send_signal(signal.SIGHUP)
        self.wait_for_steps(process, self.steps_in("block.h5") + 1)
        process.send_signal(signal.SIGTERM)
        self.finish(process, 4)
        self.check_ended("signal SIGTERM")

    def test_second_interrupt_ends_at_once(self):
        err = self.interrupt_twice()[1]
        self.assertIn("stopped at once", err)
        with self.open("wall.h5") as file:
            self.assertEqual((file.attrs["complete"], file.attrs["exit_reason"]), (0, "running"))
            self.assertEqual(file["frames/step"][0], 0)

    def test_summary_after_a_second_interrupt(self):
        out, _ = self.interrupt_twice()
        self.assertEqual(out, "stopped at once\nresults: wall.h5, log: wall.log\n")
        summary = json.loads(self.interrupt_twice("--json")[0])
        self.assertEqual((summary["command"], summary["status"], summary["exit_code"]), ("run", "stopped", 4))
        self.assertEqual((summary["exit_reason"], summary["checkpoint"]), ("second SIGINT", "wall.ckpt.h5"))
        self.assertTrue(self.path(summary["checkpoint"]).exists())

    def interrupt_twice(self, *more):
        # a step of this wall of 2601 blocks takes long enough for both signals to come within one
        n = 51
        lines = [f"{x} 0 {x} {n} 1" for x in range(n + 1)] + [f"0 {y} {n} {y} 1" for y in range(n + 1)]
        counts = [0.01, f"{len(lines)} 0", 0, 0, 1, 0, 0, 0]
        self.write("wall.dc", "\n".join(map(str, [*counts, *lines, "0.5 0.5 0.5 0.5"])) + "\n")
        self.write("wall.df", "1 100000 1 1 0.01 0.001\n1000 9810 1e8 0.2 0 0 0 0 0 0 0 0 0\n30 0 0\n")
        # when the first one came at the end of a step, the run was over in order before the second: then once more
        for _ in range(10):
            self.path("wall.ckpt.h5").unlink(missing_ok=True)
            process = self.start_program("run", "wall.dc", "wall.df", "--solver", "sor", "--force", *more)
            deadline = time.monotonic() + PATIENCE
            while not self.path("wall.ckpt.h5").exists() and time.monotonic() < deadline:
                time.sleep(0.01)
            while process.poll() is None and time.monotonic() < deadline:
                process.send_signal(signal.SIGINT)
                time.sleep(0.002)
            out, err = self.finish(process, 4)
            if "stopped at once" in err:
                break
        return out, err

    def test_wall_clock_limit(self):
        for limit in ("0.3", "3", "30"):  # where a busy machine needs as long for the start, there are no steps
            outcome = self.run_program(*BLOCK, *LONG, "--max-wall", limit, "--quiet", "--force")
            self.assertEqual(outcome.code, 4)
            steps = self.check_ended("max-wall")
            if steps > 0:
                break
        self.assertGreater(steps, 0)
        self.write("run.nml", "&run max_wall = 0.2 /\n")
        outcome = self.run_program(*BLOCK, *LONG, "--config", "run.nml", "--force")
        self.assertEqual(outcome.code, 4)
        self.check_ended("max-wall")


class LongStep(InterruptionTest):
    """A wall whose first step has many rounds of many PCG iterations."""

    # With so many rows and contacts of 50 E the whole first step takes two threads of a fast machine 7 s.
    ROWS = 80
    # Reading, cutting and writing take a second; the rest is for a busy machine.
    SOON = 15

    def setUp(self):
        super().setUp()
        generator = random.Random(1)
        n = self.ROWS
        lines = [(0, i, n, i) for i in range(n + 1)] + [(0, 0, 0, n), (n, 0, n, n)]
        for i in range(n):
            positions = [k / 2 + 0.1 + 0.3 * generator.random() for k in range(2 * n)]
            lines += [(x, i, x, i + 1) for x in positions]
        rows = "".join(f"{a} {b} {c} {d} 1\n" for a, b, c, d in lines)
        self.write("wall.dc", f"0.005\n{len(lines)} 0\n0 0 1 0 0 0\n{rows}1 0.5 1 0.5\n")
        self.write("wall.df", "0 1 1 1 0.01 0.01\n2500 24525 5e9 .25\n0 0 0 0 0 0\n0 0 0\n30 0 0\n")
        self.write("wall.nml", "&contact stiffness = 2.5e11 /\n")

    def test_a_time_limit_ends_it_within_the_step(self):
        start = time.monotonic()
        wall = ("wall.dc", "wall.df", "--config", "wall.nml", "--solver", "pcg")
        outcome = self.run_program("run", *wall, "--max-wall", "2", "--json", "--quiet")
        self.assertLess(time.monotonic() - start, self.SOON)
        self.assertEqual((outcome.code, outcome.json["exit_reason"], outcome.json["steps"]), (4, "max-wall", 0))
        with self.open("wall.h5") as file:
            self.assertEqual(len(file["history/step"]), 0)
            self.assertEqual(len(file["frames/step"]), 1)
        outcome = self.run_program("resume", "wall.ckpt.h5", "--max-wall", "1", "--json", "--quiet")
        self.assertEqual((outcome.code, outcome.json["steps"]), (4, 0))

    def test_a_signal_ends_it_within_the_step(self):
        process = self.start_program("run", "wall.dc", "wall.df", "--config", "wall.nml", "--solver", "pcg", "--quiet")
        deadline = time.monotonic() + PATIENCE
        while not self.path("wall.ckpt.h5").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(1)
        process.send_signal(signal.SIGTERM)
        start = time.monotonic()
        self.finish(process, 4)
        self.assertLess(time.monotonic() - start, self.SOON)
        with self.open("wall.h5") as file:
            self.assertEqual(file.attrs["exit_reason"], "signal SIGTERM")
            self.assertEqual(len(file["history/step"]), 0)


class Kill(InterruptionTest):
    def test_kill_at_random_moments(self):
        generator = random.Random(1)
        for _ in range(10):
            process = self.start("--quiet")
            time.sleep(0.3 * generator.random())
            seen = self.steps_in("block.h5")
            process.kill()
            process.communicate()
            self.check_prefix(seen)
            with self.open() as file:
                self.assertEqual((file.attrs["complete"], file.attrs["exit_reason"]), (0, "running"))
        # nothing of a killed run is in the way of the next one
        self.assertEqual(self.run_program(*BLOCK, "--force").code, 0)

    def test_reader_while_running(self):
        process = self.start("--quiet")
        last, seen = 0, set()
        deadline = time.monotonic() + PATIENCE
        while len(seen) < 10 and time.monotonic() < deadline:
            # a reader that opens in the very moment in which the file grows may have to try again
            steps = self.steps_in("block.h5")
            if steps > 0:
                self.assertGreaterEqual(steps, last)
                last = steps
                seen.add(steps)
            time.sleep(0.05)
        self.assertEqual(len(seen), 10)
        self.assertIsNone(process.poll(), "readers do not disturb the run")
        process.send_signal(signal.SIGTERM)
        self.finish(process, 4)
        self.assertGreaterEqual(self.check_ended("signal SIGTERM"), last)

    def test_second_run_on_the_same_output(self):
        process = self.start("--quiet")
        message = "rockdda: error: block.h5: the file exists; use --force to overwrite it"
        self.assertFails(self.run_program(*BLOCK, "--quiet"), 2, message)
        message = "rockdda: error: block.h5: another run is writing this file"
        self.assertFails(self.run_program(*BLOCK, "--quiet", "--force"), 2, message)
        self.wait_for_steps(process, self.steps_in("block.h5") + 1)
        process.send_signal(signal.SIGTERM)
        self.finish(process, 4)
        self.check_ended("signal SIGTERM")


class Output(InterruptionTest):
    def test_file_is_removed(self):
        process = self.start("--quiet")
        self.path("block.h5").unlink()
        out, err = self.finish(process, 5)
        self.assertTrue(out.startswith("error: "), out)
        self.assertIn("block.h5: the file was removed or replaced while it was being written", err)
        self.assertNotIn("are kept in block.h5", err)
        self.assertNotIn("continues", err)
        self.assertFalse(self.path("block.h5").exists())

    def test_file_is_replaced(self):
        process = self.start("--quiet")
        with self.paused(process):
            self.path("block.h5").unlink()
            self.write("block.h5", "something else")
        _, err = self.finish(process, 5)
        message = "rockdda: error: block.h5: the file was removed or replaced while it was being written\n"
        self.assertEqual(err, message)
        self.assertEqual(self.path("block.h5").read_text(), "something else")

    def test_folder_is_removed(self):
        self.path("out").mkdir()
        process = self.start_program(*BLOCK, *LONG, "--checkpoint-every", "0.02", "-o", "out/a.h5", "--quiet")
        self.wait_for_steps(process, 1, "out/a.h5")
        with self.paused(process):
            shutil.rmtree(self.path("out"))
        _, err = self.finish(process, 5)
        self.assertIn("out/a.h5: ", err)
        self.assertFalse(self.path("out").exists())

    def test_folder_without_permission(self):
        nobody = self.as_nobody()
        self.path("out").mkdir(mode=0o555)
        outcome = self.run_program(*BLOCK, "-o", "out/a.h5", **nobody)
        self.assertEqual(outcome.code, 5)
        self.assertIn("out/a.h5: Permission denied", outcome.err)
        self.assertEqual(list(self.path("out").iterdir()), [])

    def test_folder_that_becomes_read_only(self):
        # nothing is changed when no undo file can be kept
        nobody = self.as_nobody()
        self.path("out").mkdir()
        self.path("out").chmod(0o777)
        command = (*BLOCK, "-o", "out/a.h5", "--steps", "5", "--quiet")
        self.assertEqual(self.run_program(*command, **nobody).code, 0)
        before = {path.name: path.read_bytes() for path in self.path("out").iterdir()}
        self.path("out").chmod(0o555)
        outcome = self.run_program("resume", "out/a.ckpt.h5", "--steps", "5", "--quiet", **nobody)
        self.assertEqual(outcome.code, 5)
        self.assertIn("out/a.h5.undo: Permission denied", outcome.err)
        self.assertEqual({path.name: path.read_bytes() for path in self.path("out").iterdir()}, before)
        self.path("out").chmod(0o777)
        self.assertEqual(self.run_program("resume", "out/a.ckpt.h5", "--steps", "5", "--quiet", **nobody).code, 0)

    def test_read_only_disk(self):
        if not os.access("/proc/self", os.R_OK):
            self.skipTest("no /proc")
        outcome = self.run_program(*BLOCK, "-o", "/proc/self/a.h5")
        self.assertEqual(outcome.code, 5)
        self.assertIn("/proc/self/a.h5: ", outcome.err)

    def check_full(self, folder, outcome):
        self.assertEqual(outcome.code, 5, outcome.err)
        # whichever file asks for the last page is the one named
        self.assertRegex(outcome.err, r"a\.(h5|log|ckpt\.h5)\S*: ")
        self.assertIn("are kept in", outcome.err)
        with h5py.File(folder / "a.h5", "r", locking=False) as file:
            self.assertEqual(file.attrs["complete"], 0)
            steps = file["history/step"][()]
            self.assertGreater(len(steps), 0)
            self.assertEqual(steps.tolist(), list(range(1, len(steps) + 1)))
            lengths = {len(table[()]) for table in file["history"].values()}
            self.assertEqual(lengths, {len(steps)}, "every table ends at the same step")
            frames = file["frames/step"][()]
            self.assertEqual(len(file["frames/contact_offset"]), len(frames) + 1)
            self.assertTrue((file["frames/vertices"][()].max(axis=(1, 2)) > 1).all())

    def test_full_disk(self):
        if os.geteuid() != 0:
            self.skipTest("needs root to mount a small disk")
        disk = tempfile.mkdtemp()
        self.addCleanup(os.rmdir, disk)
        if subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=4m", "none", disk], stderr=subprocess.DEVNULL
        ).returncode:
            self.skipTest("cannot mount")
        self.addCleanup(subprocess.run, ["umount", disk])
        more = (*LONG, "--save-every", "1", "--checkpoint-every", "0.02", "-o", f"{disk}/a.h5", "--quiet")
        outcome = self.run_program(*BLOCK, *more)
        self.assertIn("No space left on device", outcome.err)
        self.check_full(Path(disk), outcome)

    def test_limit_of_the_file_size(self):
        more = (*LONG, "--save-every", "1", "--checkpoint-every", "0.02", "-o", "a.h5", "--quiet")
        limit = 4000000

        def restrict():
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        outcome = self.run_program(*BLOCK, *more, preexec_fn=restrict)
        self.assertIn("File too large", outcome.err)
        self.check_full(self.folder, outcome)


class NoSolution(InterruptionTest):
    def test_step_that_does_not_converge(self):
        # the block falls onto its base: when it arrives its contacts must change, which one round does not allow
        self.write("block.df", ANALYSIS.replace("0 1000 0\n", "0 0 0\n"))
        self.write("run.nml", "&time max_open_close = 1, dt_min = 0.01 /\n")
        text = self.path("block.dc").read_text()
        for old, new in (("1 1 1 2", "1 1.05 1 2"), ("3 2 3 1", "3 2 3 1.05"), ("7 4", "8 4")):
            text = text.replace(old, new)
        self.write("block.dc", text.replace("0.5 0.5 0.5 0.5", "1 1.05 3 1.05 1\n0.5 0.5 0.5 0.5", 1))
        outcome = self.run_program(*BLOCK, "--config", "run.nml", "--quiet", "--steps", "50")
        self.assertEqual(outcome.code, 3, outcome.err)
        with self.open() as file:
            last = int(file["history/step"][-1])
            self.assertEqual((file.attrs["complete"], file["frames/step"][-1]), (0, last))
            reason = file.attrs["exit_reason"]
        self.assertTrue(reason.startswith(f"failed: step {last + 1} at time 0."), reason)
        self.assertTrue(reason.endswith("contacts still change state after 1 open-close rounds"), reason)
        # free fall through 0.05: at step 10 of 0.01
        self.assertGreater(last, 5)
        self.assertIn(f"error: step {last + 1} at time ", outcome.err)
        self.assertRegex(
            outcome.err,
            r"\n  block [12] against block [12] at \([123][.0-9]*, 1\.[0-9]+\): 1 changes, now locked, gap -[^\n]*\n",
        )
        self.assertIn("are kept in block.h5", outcome.err)
        self.assertTrue(outcome.out.startswith(f"error: {last} steps"), outcome.out)

    def test_first_step_fails(self):
        # a load that lifts the block at once: its contacts must open
        self.write("block.df", ANALYSIS.replace("0 0 0\n1 1000 0\n", "0 0 1e6\n1 0 1e6\n"))
        self.write("run.nml", "&time max_open_close = 1, dt_min = 0.01 /\n")
        outcome = self.run_program(*BLOCK, "--config", "run.nml", "--quiet")
        self.assertEqual(outcome.code, 3, outcome.err)
        with self.open() as file:
            self.assertEqual((len(file["history/step"]), file["frames/step"][()].tolist()), (0, [0]))


if __name__ == "__main__":
    unittest.main()
