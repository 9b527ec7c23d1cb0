# SPDX-License-Identifier: MIT
"""Tests that stop a run and go on with it."""

import os
import sys
import unittest
from pathlib import Path

from support import ProgramTest, h5py

if h5py is not None:
    from faults import MEMORY, differences

    sys.path.insert(0, os.fspath(Path(__file__).parents[1] / "fuzz"))
    import checkpoints

BLOCK = ("run", "block.dc", "block.df")


@unittest.skipIf(h5py is None, "h5py is missing")
class ResumeTest(ProgramTest):
    parent = MEMORY if h5py is not None else None

    def good(self, *arguments):
        outcome = self.run_program(*arguments)
        self.assertEqual(outcome.code, 0, outcome.err)
        return outcome

    def assertSame(self, one, other):
        self.assertEqual(differences(self.path(one), self.path(other)), [])

    def in_checkpoint(self, name, item):
        with h5py.File(self.path(name)) as file:
            return checkpoints.value(file, item)

    def refused(self, message, *arguments):
        before = {name: self.path(name).read_bytes() for name in self.files()}
        outcome = self.run_program("resume", *arguments, "--quiet")
        self.assertEqual((outcome.code, outcome.err), (2, message + "\n"))
        self.assertEqual({name: self.path(name).read_bytes() for name in self.files()}, before, "nothing was changed")
