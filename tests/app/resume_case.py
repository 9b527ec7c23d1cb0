# SPDX-License-Identifier: MIT
"""Tests that stop a run and go on with it."""

import unittest

from support import ProgramTest, h5py

if h5py is not None:
    from faults import MEMORY, differences

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

    def refused(self, message, *arguments):
        before = {name: self.path(name).read_bytes() for name in self.files()}
        outcome = self.run_program("resume", *arguments, "--quiet")
        self.assertEqual((outcome.code, outcome.err), (2, message + "\n"))
        self.assertEqual({name: self.path(name).read_bytes() for name in self.files()}, before, "nothing was changed")
