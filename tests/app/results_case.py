# SPDX-License-Identifier: MIT
"""Tests that run a model and look into its results."""

import unittest
from pathlib import Path

from support import ProgramTest, h5py

if h5py is not None:
    import numpy as np

INPUTS = Path(__file__).resolve().parents[2] / "inputs"

ENERGY_COLUMNS = [
    "kinetic",
    "strain",
    "gravity",
    "springs",
    "external_work",
    "friction",
    "numerical_dissipation",
    "discarded",
    "geometry",
    "residual",
]


def read(path):
    """All datasets and attributes of a file."""
    data, attributes = {}, {}

    def visit(name, item):
        attributes[name] = dict(item.attrs)
        if isinstance(item, h5py.Dataset):
            data[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(visit)
        attributes["/"] = dict(file.attrs)
    return data, attributes


@unittest.skipIf(h5py is None, "h5py is missing")
class ResultsTest(ProgramTest):
    def run_model(self, *arguments, code=0):
        """Run to out.h5; datasets and attributes."""
        outcome = self.run_program("run", *arguments, "-o", "out.h5", "--force", "--quiet")
        self.assertEqual(outcome.code, code, outcome.err)
        return read(self.path("out.h5"))

    def assertSameData(self, one, other, but=()):
        self.assertEqual(sorted(one), sorted(other))
        for name in one:
            if name not in but:
                self.assertTrue(np.array_equal(one[name], other[name]), name)
