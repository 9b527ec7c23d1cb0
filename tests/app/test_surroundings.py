# SPDX-License-Identifier: MIT
"""What is left: the terminal, a crash, and result files that are read again or are none."""

import fcntl
import json
import os
import pty
import re
import resource
import signal
import struct
import subprocess
import termios
import time
import unittest
from pathlib import Path

from support import GEOMETRY, PEER_ANALYSIS, PROGRAM, ProgramTest, h5py

PATIENCE = 120  # seconds after which a test gives up, many times what a busy machine needs
LONG_RUN = ["run", "block.dc", "block.df", "--steps", "100000000"]


class Surroundings(ProgramTest):
    def wait_for_log(self):
        deadline = time.monotonic() + PATIENCE
        while not self.path("block.log").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        self.assertTrue(self.path("block.log").exists())

    def test_crash_asks_for_a_report(self):
        if "-fsanitize" in self.run_program("--version").out:
            self.skipTest("the sanitizers catch the signal themselves")
        process = self.start_program(*LONG_RUN, "--json")
        self.wait_for_log()
        process.send_signal(signal.SIGSEGV)
        out, err = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        summary = json.loads(out)
        self.assertEqual((summary["exit_code"], summary["exit_reason"]), (1, "internal error"))
        self.assertIn("internal error: this is a bug in RockDDA. Please report it", err.decode())

    def test_small_stack(self):
        """`ulimit -s`: a limit that may be raised does not matter, one that may not is named."""
        arguments = ["run", "block.dc", "block.df", "--quiet", "--force"]
        for kilobytes in (16, 32, 64, 128, 512):
            for hard in (False, True):
                with self.subTest(kilobytes=kilobytes, hard=hard):
                    size = kilobytes * 1024
                    limits = (size, size if hard else resource.getrlimit(resource.RLIMIT_STACK)[1])
                    outcome = self.run_program(
                        *arguments, preexec_fn=lambda limits=limits: resource.setrlimit(resource.RLIMIT_STACK, limits)
                    )
                    if kilobytes == 16 and outcome.code == -signal.SIGSEGV:
                        continue  # where the system puts the stack, its loader itself may not find room in 16 kB
                    if hard and kilobytes < 512:
                        message = f"rockdda: error: the stack is limited to {kilobytes} kB (ulimit -s); "
                        self.assertFails(outcome, 3, message + "the program needs 512 kB, better 8192 kB")
                    else:
                        self.assertEqual((outcome.code, outcome.err), (0, ""))

    def test_closed_streams(self):
        """Messages do not go into the file that gets the number of a stream that is closed."""
        for closed in ((2,), (0, 1, 2)):
            with self.subTest(closed=closed):
                process = subprocess.Popen(
                    [PROGRAM, *LONG_RUN, "--max-wall", str(PATIENCE), "--force"],
                    cwd=self.folder,
                    stdout=subprocess.DEVNULL,
                    preexec_fn=lambda closed=closed: [os.close(stream) for stream in closed],
                )
                self.wait_for_log()
                streams = [str(Path(f"/proc/{process.pid}/fd/{stream}").readlink()) for stream in closed]
                process.send_signal(signal.SIGTERM)
                self.assertEqual(process.wait(PATIENCE), 4)
                self.assertEqual(streams, ["/dev/null"] * len(closed))
                self.path("block.log").unlink()

    def test_reader_of_messages_that_leaves(self):
        """No reason to end a run."""
        process = self.start_program(*LONG_RUN, "--max-wall", str(PATIENCE))
        process.stderr.close()
        process.stdout.close()
        self.wait_for_log()
        process.send_signal(signal.SIGTERM)  # which is told on standard error
        self.assertEqual(process.wait(PATIENCE), 4)
        self.assertRegex(self.path("block.log").read_text(), r"\nend: signal SIGTERM after [^\n]*\n\Z")

    def bar_of(self, language, updates):
        """What a long run shows on a terminal of 200 columns, until the time left has been shown so many times."""
        terminal, end = pty.openpty()
        self.addCleanup(os.close, terminal)
        fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 200, 0, 0))
        arguments = [PROGRAM, *LONG_RUN, "--max-wall", str(PATIENCE), "--force"]
        environment = {**os.environ, "LC_ALL": language}
        process = subprocess.Popen(arguments, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=end, env=environment)
        os.close(end)
        shown = b""
        try:
            while piece := os.read(terminal, 4096):
                shown += piece
                if shown.count(b" left") >= updates:
                    process.send_signal(signal.SIGTERM)
        except OSError:
            pass  # the other end was closed
        self.assertEqual(process.wait(PATIENCE), 4)
        return shown.decode()

    def test_bar_on_a_terminal(self):
        """The time left does not grow, though the run is held up; beside the unbalanced force stands its curve."""
        shown = self.bar_of("C.UTF-8", 8)
        bar = r"\r\[\.{20}\]   0 %  step \d+, time [\d.]+, unbalanced \S+ [▁▂▃▄▅▆▇█]+, "
        found = re.findall(bar + r"(?:(\d+) h )?(?:(\d+) min)?(?: ?(\d+) s)? left", shown)
        left = [
            3600 * int(hours or 0) + 60 * int(minutes or 0) + int(seconds or 0) for hours, minutes, seconds in found
        ]
        self.assertGreaterEqual(len(left), 8, shown)
        self.assertEqual(left, sorted(left, reverse=True))

    def test_terminal_without_unicode_has_no_curve(self):
        self.assertTrue(self.bar_of("C", 1).isascii())

    def test_watch_opens_the_viewer_of_the_results(self):
        """The program beside rockdda or on the PATH gets the results, which exist by then; it is waited for."""
        viewer = self.write("bin/rockdda-post", '#!/bin/sh\ntest -f "$2" && echo "$1 $2" >seen && echo opened\n')
        viewer.chmod(0o755)
        path = f"{viewer.parent}:{os.environ['PATH']}"
        program = self.path("rockdda")
        program.write_bytes(Path(PROGRAM).read_bytes())  # away from the rockdda-post of a build
        program.chmod(0o755)
        command = [program, "run", "block.dc", "block.df", "--steps", "5", "--watch", "--json"]
        done = subprocess.run(
            command, cwd=self.folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=PATIENCE
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["status"], "done")  # the viewer does not write into it
        self.assertIn("opened\n", done.stderr)
        self.assertEqual(self.path("seen").read_text(), "view block.h5\n")
        viewer.unlink()
        done = subprocess.run(
            [*command, "--force"], cwd=self.folder, env={**os.environ, "PATH": str(viewer.parent)}, capture_output=True,
            text=True, timeout=PATIENCE,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0)
        self.assertIn("warning: --watch: rockdda-post lies neither beside rockdda nor on the PATH", done.stderr)

    def test_lines_without_a_terminal(self):
        # one every ten seconds, which the run sleeps through
        process = self.start_program(*LONG_RUN, "--max-wall", str(PATIENCE))
        self.wait_for_log()
        process.send_signal(signal.SIGSTOP)
        time.sleep(10.5)
        process.send_signal(signal.SIGCONT)
        first = process.stderr.readline().decode()
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE)
        # no time left where it would be years, as after the first steps
        self.assertRegex(first, r"\A +0 %  step \d+, time [\d.]+, unbalanced [\d.e+-]+(, .* left)?\n\Z")


@unittest.skipIf(h5py is None, "needs h5py")
class Reading(ProgramTest):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_program("run", "block.dc", "block.df").code, 0)

    def test_info_on_results(self):
        facts = self.run_program("info", "block.h5", "--json").json["files"][0]
        self.assertEqual((facts["kind"], facts["blocks"], facts["steps"]), ("results file", 2, 20))
        self.assertEqual((facts["frames"], facts["complete"]), (21, True))

    def test_foreign_and_damaged_hdf5_files(self):
        with h5py.File(self.path("other.h5"), "w") as file:
            file["x"] = [1.0]
        outcome = self.run_program("info", "other.h5")
        self.assertFails(outcome, 2, "other.h5: error: this HDF5 file holds no results of RockDDA")
        data = self.path("block.h5").read_bytes()
        self.write("cut.h5", data[: len(data) // 2])
        outcome = self.run_program("info", "cut.h5")
        self.assertEqual(outcome.code, 2)
        self.assertTrue(outcome.err.startswith("cut.h5: error: "), outcome.err)

    def test_results_without_a_title(self):
        with h5py.File(self.path("block.h5"), "r+") as file:
            del file.attrs["title"]
        for command in ("info", "check"):
            err = self.run_program(command, "block.h5").err
            self.assertRegex(err, r"\Ablock\.h5: error: cannot read text attribute title.*\n\Z")

    def test_model_without_points(self):
        lines = GEOMETRY.splitlines()
        lines[4:7] = ["0", "0", "0"]
        self.write("block.dc", "\n".join(lines[:15]) + "\n")
        self.write("block.df", PEER_ANALYSIS)
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--steps", "3", "--force").code, 0)
        with h5py.File(self.path("block.h5"), "r") as file:
            self.assertEqual(file["model/fixed_points"].shape, (0, 2))
            self.assertEqual(len(file["model/fixed_points"].attrs["block"]), 0)
            self.assertEqual(file["history/measured_displacement"].shape, (3, 0, 2))
            self.assertEqual(file["history/fixed_force"].shape, (3, 0, 2))


if __name__ == "__main__":
    unittest.main()
