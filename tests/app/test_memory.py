# SPDX-License-Identifier: MIT
"""Memory that is refused: said in one line, exit code 3, nothing hangs, the results so far are kept."""

import os
import resource
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from support import PROGRAM, Outcome, ProgramTest, h5py

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from works import write_wall

if h5py is not None:
    from faults import Refusals, lost_rows

PATIENCE = 120  # seconds after which a test gives up, many times what a busy machine needs
ONE_THREAD = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
NETWORK = "&boundary window = 0,0,5e4,10 /\n&joint_set inclination = 90, spacing = 1, trace = 4, bridge = 1 /\n"
CANNOT_START = 127  # of the loader: not even the libraries fit


class ScarceTest(ProgramTest):
    def setUp(self):
        super().setUp()
        if "-fsanitize" in self.run_program("--version").out:
            self.skipTest("the sanitizers have an allocator of their own")

    def run_with(self, arguments, environment, limit=None):
        def restrict():
            if limit:
                resource.setrlimit(resource.RLIMIT_AS, (limit, limit))

        process = subprocess.run(
            [PROGRAM, *arguments],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            timeout=PATIENCE,
            preexec_fn=restrict,
        )
        return Outcome(process)

    def check_told(self, outcome):
        self.assertEqual(outcome.code, 3, outcome.err)
        self.assertIn("out of memory", outcome.err)
        for word in ("internal error", "Error allocating", "Backtrace"):
            self.assertNotIn(word, outcome.err)


class LimitTest(ScarceTest):
    """A limit of the address space."""

    def grow_until_done(self, arguments):
        """Give the command more and more address space; what it said when it was too little."""
        told = []
        limit = 12 << 20
        while True:
            outcome = self.run_with(arguments, ONE_THREAD, limit)
            if outcome.code == 0:
                return told
            if outcome.code != CANNOT_START and self.starts_within(limit):
                self.check_told(outcome)
                told.append(outcome.err)
            self.assertLess(limit, 64 << 30)
            limit += limit // 16

    def starts_within(self, limit):
        """False where what libraries request before the program begins (libgomp) is refused."""
        return self.run_with(["--version"], ONE_THREAD, limit).code == 0

    def test_lines(self):
        self.write("network.dl", NETWORK)
        told = self.grow_until_done(["lines", "network.dl", "-o", "network.dc"])
        # which request is refused depends on the layout of memory; those of libraries come without their size
        self.assertRegex(
            told[-1], r"^\nrockdda: out of memory(: \d+ bytes more are refused)?; give the program more \(ul"
        )

    def test_blas_without_room_is_not_waited_for(self):
        # OpenBLAS asks for its work space for ever
        told = self.grow_until_done(["run", "block.dc", "block.df", "--solver", "dense", "--quiet", "--force"])
        self.assertTrue(any("the solver dense needs 210 MB of address space" in text for text in told), told)


class SizeTest(ScarceTest):
    """Memory for a block."""

    def test_a_block_of_a_wall_takes_its_share(self):
        # two sizes, so that what the program itself takes drops out: 14.0 kB, the same within 0.3 % from run to run;
        # 5 % for other libraries. A column of reals of the nine contact points of a block takes 72 bytes
        peaks, blocks = [], (4001, 15940)
        for count in blocks:
            files = write_wall(Path(self.path(f"wall{count}")), count, 1.0)
            arguments = [*files, "--dialect", "g0", "--steps", "3", "--save-every", "3", "--force"]
            process = subprocess.Popen(
                [PROGRAM, "run", *arguments], cwd=self.folder, env=ONE_THREAD, stderr=subprocess.DEVNULL
            )
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(process.returncode, 0)
            peaks.append(1024 * usage.ru_maxrss)
        per_block = (peaks[1] - peaks[0]) / (blocks[1] - blocks[0])
        self.assertLess(per_block, 14_700)
        self.assertGreater(per_block, 5_000)


@unittest.skipIf(h5py is None or shutil.which("cc") is None, "h5py or the compiler is missing")
class RefusedRequestTest(ScarceTest):
    """No memory from some request on, in the program and in its libraries."""

    def setUp(self):
        super().setUp()
        try:
            self.refusals = Refusals(self.folder)
        except subprocess.CalledProcessError:
            self.skipTest("this C library cannot be stood in for")

    def refuse(self, arguments, shares=(0.1, 0.3, 0.5, 0.7, 0.9)):
        """Once without a refusal, then with one in each of these parts of the requests."""
        outcome = self.run_with(arguments, self.refusals.environment(0))
        self.assertEqual(outcome.code, 0, outcome.err)
        total = self.refusals.count()
        for share in shares:
            self.check_told(self.run_with(arguments, self.refusals.environment(int(share * total))))
            yield share

    def test_commands(self):
        self.write("network.dl", NETWORK.replace("5e4", "20"))
        for arguments in (
            ["lines", "network.dl", "-o", "network.dc", "--force"],
            ["cut", "block.dc", "-o", "block.blk", "--force"],
            ["check", "block.dc", "block.df"],
            ["info", "block.dc"],
        ):
            for share in self.refuse(arguments):
                self.assertTrue(0 < share < 1)

    def test_scripts_get_a_summary(self):
        arguments = ["check", "block.dc", "block.df", "--json"]
        self.assertEqual(self.run_with(arguments, self.refusals.environment(0)).code, 0)
        outcome = self.run_with(arguments, self.refusals.environment(self.refusals.count() // 2))
        self.check_told(outcome)
        self.assertEqual(outcome.json["command"], "check")
        self.assertEqual(outcome.json["status"], "error")
        self.assertEqual(outcome.json["exit_code"], 3)
        self.assertEqual(outcome.json["exit_reason"], "out of memory")
        self.assertEqual(outcome.json["messages"], [{"severity": "error", "message": "out of memory"}])

    def test_results_so_far_are_kept(self):
        arguments = ["run", "block.dc", "block.df", "--save-every", "2", "--checkpoint-every", "1e-9", "--force"]
        self.assertEqual(self.run_with(arguments, ONE_THREAD).code, 0)
        whole = shutil.copy(self.path("block.h5"), self.path("whole.h5"))
        steps = []
        for _ in self.refuse(arguments, (0.3, 0.5, 0.7, 0.9)):
            self.assertEqual(lost_rows(self.path("block.h5"), whole), [])
            with h5py.File(self.path("block.h5"), "r", locking=False) as file:
                steps.append(len(file["history/step"]))
        self.assertGreater(steps[-1], 0)
        # and go on from there
        outcome = self.run_with(["resume", "block.ckpt.h5", "--quiet"], ONE_THREAD)
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(lost_rows(self.path("block.h5"), whole), [])


if __name__ == "__main__":
    unittest.main()
