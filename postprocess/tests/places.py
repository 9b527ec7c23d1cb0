# SPDX-License-Identifier: MIT
"""Where things are, and what several tests share."""

import os
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
INPUTS = ROOT / "inputs"
# The extension of the build tree, for a package that is not installed.
EXTENSION = Path(os.environ.get("ROCKDDA_EXTENSION", ROOT / "build/python"))


def assert_same_results(one, other, except_for=("created",), texts=True):
    """Bit for bit, all datasets and attributes except times of the run, with or without the input files."""
    with h5py.File(one) as a, h5py.File(other) as b:
        names = []
        a.visit(names.append)
        others = []
        b.visit(others.append)
        assert names == others
        for name in names:
            if isinstance(a[name], h5py.Dataset) and (texts or not name.startswith("input/")):
                assert np.array_equal(a[name][()], b[name][()]), name
            for key, value in a[name].attrs.items():
                assert np.array_equal(value, b[name].attrs[key]), (name, key)
        for key, value in a.attrs.items():
            assert key in except_for or np.array_equal(value, b.attrs[key]), key
