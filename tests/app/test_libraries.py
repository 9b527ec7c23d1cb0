# SPDX-License-Identifier: MIT
"""HDF5 and CHOLMOD may fail where nothing is wrong with the input: a clear answer, and nothing written is lost.

library_fault.c is preloaded and makes a function of theirs fail.
"""

import itertools
import json
import os
import shutil
import unittest

from support import PROGRAM, ProgramTest, h5py

if h5py is not None:
    from faults import MEMORY, Case, LibraryFaults, differences

#: A status of CHOLMOD.
OUT_OF_MEMORY, INVALID = -2, -4
#: HDF5 crashes.
CRASH = -1
#: Functions of HDF5; of their calls every so many is tried.
FUNCTIONS = {
    "H5Fopen": 1,
    "H5Fcreate": 1,
    "H5Fflush": 7,
    "H5Dopen2": 131,
    "H5Dcreate2": 191,
    "H5Dset_extent": 41,
    "H5Dwrite": 191,
    "H5Dread": 61,
    "H5Acreate2": 31,
    "H5Awrite": 31,
    "H5Aread": 2,
    "H5Aiterate2": 1,
}


@unittest.skipIf(h5py is None, "h5py is missing")
@unittest.skipIf(shutil.which("cc") is None, "needs a compiler")
class LibraryTest(ProgramTest):
    parent = MEMORY if h5py is not None else None

    def setUp(self):
        super().setUp()
        if "-fsanitize" in self.run_program("--version").out:
            self.skipTest("the sanitizers want to be loaded first")
        faults = LibraryFaults(self.folder)
        self.fault, self.calls = faults.environment, faults.calls


class Cholmod(LibraryTest):
    command = ("run", "block.dc", "block.df", "--solver", "cholmod", "--steps", "6", "--quiet", "--force")

    def setUp(self):
        super().setUp()
        if "with_cholmod=on" not in self.run_program("--version").out.lower():
            self.skipTest("built without CHOLMOD")
        outcome = self.run_program(*self.command, env=self.fault("cholmod_l_start", 100))
        self.assertEqual(outcome.code, 0, outcome.err)
        if self.calls() == 0:
            self.skipTest("CHOLMOD is not a library of its own, or its header is missing")

    def test_it_fails(self):
        for function, what in (
            ("cholmod_l_start", "start"),
            ("cholmod_l_analyze", "analysis"),
            ("cholmod_l_analyze_p", "analysis"),
            ("cholmod_l_factorize", "factorisation"),
            ("cholmod_l_solve2", "solution"),
        ):
            with self.subTest(function=function):
                outcome = self.run_program(*self.command, env=self.fault(function, 1, OUT_OF_MEMORY))
                self.assertEqual(outcome.code, 3, outcome.err)
                self.assertIn(f"CHOLMOD {what}: out of memory; choose pcg", outcome.err)
                if what == "start":
                    continue
                outcome = self.run_program(*self.command, env=self.fault(function, 1, INVALID))
                self.assertEqual(outcome.code, 1, outcome.err)
                self.assertIn(f"step 1: CHOLMOD {what} failed with status {INVALID}", outcome.err)
                self.assertIn("this is a bug in RockDDA. Please report it", outcome.err)

    def test_it_fails_in_a_later_step(self):
        self.assertEqual(self.run_program(*self.command, "-o", "whole.h5").code, 0)
        every_step = ("--checkpoint-every", "1e-9")
        outcome = self.run_program(*self.command, *every_step, "--json", env=self.fault("cholmod_l_solve2", 4, INVALID))
        self.assertEqual((outcome.code, outcome.json["exit_code"]), (1, 1), outcome.err)
        steps = outcome.json["steps"]
        self.assertGreater(steps, 0)
        self.assertIn(f"the results up to step {steps} are kept in block.h5", outcome.err)
        with h5py.File(self.path("block.h5")) as some, h5py.File(self.path("whole.h5")) as whole:
            energy = some["history/energy"][()]
            self.assertEqual(energy.tobytes(), whole["history/energy"][:steps].tobytes())
        # and it goes on from its checkpoint when CHOLMOD does again
        outcome = self.run_program("resume", "block.ckpt.h5", "--quiet")
        self.assertEqual(outcome.code, 0, outcome.err)
        self.assertEqual(differences(self.path("whole.h5"), self.path("block.h5")), [])


class Hdf5(LibraryTest):
    every_step = ("--checkpoint-every", "1e-9")

    def setUp(self):
        super().setUp()
        model = [os.fspath(self.path(name)) for name in ("block.dc", "block.df")]
        self.case = Case(PROGRAM, model, 5)
        self.addCleanup(self.case.remove)

    def kept(self):
        return {path: path.read_bytes() for path in self.case.folder.glob("out.*")}

    def test_it_fails_while_a_run_goes_on(self):
        for function, stride in FUNCTIONS.items():
            self.case.clear()
            env = self.fault(function, 10**9)
            self.assertEqual(self.case.run("run", more=self.every_step, env=env).returncode, 0)
            for at in range(1, self.calls() + 1, stride):
                with self.subTest(function=function, at=at):
                    self.case.clear()
                    env = self.fault(function, at)
                    outcome = self.case.run("run", more=self.every_step, env=env)
                    # a checkpoint that cannot be written is told, the run goes on
                    self.assertIn(outcome.returncode, (0, 5), outcome.stderr)
                    self.assertEqual(self.case.recover(), "")

    def test_it_fails_while_a_run_is_resumed(self):
        self.case.run("run", steps=3, more=self.every_step)
        before = self.kept()
        more = ("--steps", "2")
        for function, stride in FUNCTIONS.items():
            if function == "H5Fcreate":
                continue
            # the calls of the process that looks at the results first are those of its parent at the same place
            for at in (1, 2 + stride // 3):
                with self.subTest(function=function, at=at):
                    self.case.clear()
                    for path, content in before.items():
                        path.write_bytes(content)
                    outcome = self.case.run("resume", more=more, env=self.fault(function, at))
                    self.assertIn(outcome.returncode, (0, 2, 5), outcome.stderr)
                    if outcome.returncode == 2:
                        self.assertEqual(self.kept(), before, "nothing was changed")
                    if outcome.returncode != 0:
                        self.assertIn(b"error: ", outcome.stderr)
                        facts = self.run_program("info", self.case.folder / "out.ckpt.h5", "--json").out
                        left = 5 - json.loads(facts)["files"][0]["step"]
                        outcome = self.case.run("resume", more=("--steps", str(left)))
                        self.assertEqual(outcome.returncode, 0, outcome.stderr)
                    self.assertEqual(differences(self.case.whole, self.case.folder / "out.h5"), [])

    def test_attributes_that_cannot_be_listed(self):
        self.case.run("run", steps=3)
        before = self.kept()
        words = b"error: the file is not as RockDDA writes it: / has attributes that cannot be read"
        outcome = self.case.run("resume", more=("--steps", "2"), env=self.fault("H5Aiterate2", 1))
        self.assertEqual(outcome.returncode, 2)
        self.assertIn(b"out.ckpt.h5: " + words, outcome.stderr)
        outcome = self.run_program("info", self.case.folder / "out.h5", env=self.fault("H5Aiterate2", 1))
        self.assertEqual(outcome.code, 2)
        self.assertIn("out.h5: " + words.decode(), outcome.err)
        self.assertEqual(self.kept(), before)

    def test_a_crash_of_hdf5_while_a_file_is_read(self):
        """What HDF5 does with a damaged file depends on the memory: the child may read what crashes its parent."""
        self.case.run("run", steps=3)
        for name, functions in (("out.h5", ("H5Fopen", "H5Dread")), ("out.ckpt.h5", ("H5Fopen",))):
            path = self.case.folder / name
            for command, function in itertools.product(("info", "check"), functions):
                with self.subTest(name=name, command=command, function=function):
                    outcome = self.run_program(command, path, "--json", env=self.fault(function, 1, CRASH))
                    self.assertEqual(outcome.code, 2, outcome.err)
                    self.assertIn(f"{path}: error: the file is damaged: HDF5 cannot read it", outcome.err)
                    self.assertEqual(json.loads(outcome.out)["exit_code"], 2)

    def test_results_that_cannot_be_opened_once_more(self):
        """First comes the checkpoint, then the trial in memory, what the trial has left, and the file to go on with."""
        self.case.run("run", steps=3)
        before = self.kept()
        for at in (2, 3):
            outcome = self.case.run("resume", more=("--steps", "2"), env=self.fault("H5Fopen", at))
            self.assertIn((outcome.returncode, self.kept() == before), ((2, True), (5, True)), outcome.stderr)
            self.assertIn(b"out.h5: ", outcome.stderr)
            self.assertIn(b"cannot open the file", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
