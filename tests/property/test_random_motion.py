# SPDX-License-Identifier: MIT
"""Random models with contact by length: three of each family; `scripts/campaign` runs hundreds.

`ROCKDDA_CAMPAIGN` sets the number of models of each family.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("shapely")

import random_motion as motion

COUNT = int(os.environ.get("ROCKDDA_CAMPAIGN", "3"))

pytestmark = pytest.mark.skipif(motion.find_program() is None, reason="the program is not built")


@pytest.mark.parametrize("family", motion.FAMILIES)
def test_random_models_keep_energy_momentum_and_shape(family: str, tmp_path: Path) -> None:
    for seed in range(COUNT):
        folder = tmp_path / str(seed)
        folder.mkdir()
        sample = motion.make(seed, folder, family)
        assert not motion.faults(sample, folder, threads=seed == 0), sample


def test_false_motion_is_found(tmp_path: Path) -> None:
    """A balance to which energy was added, blocks that were pushed together, and one whose momentum was changed."""
    import h5py

    sample = motion.make(1, tmp_path, "pairs")
    assert not motion.faults(sample, tmp_path)
    with h5py.File(tmp_path / "o.h5", "r+") as results:
        energy = results["history/energy"]
        names = [str(name) for name in energy.attrs["columns"].astype(str)]
        kinetic = energy[0, names.index("kinetic")]
        energy[-1, names.index("geometry")] += 0.1 * kinetic
        energy[-1, names.index("residual")] += 0.1 * kinetic
        energy[-1, names.index("kinetic")] += kinetic
        velocity, vertices = results["frames/velocity"], results["frames/vertices"]
        velocity[-1, 0, 0] *= 1.01
        moved = vertices[-1]
        offset = results["model/vertex_offset"][:]
        first, second = moved[offset[0] : offset[1]], moved[offset[1] : offset[2]]
        moved[offset[1] : offset[2]] += first.mean(0) - second.mean(0)
        vertices[-1] = moved
        found = " ".join(motion.faults_of(sample, results))
    for what in ("residual", "geometry gives", "energy grows", "momentum", "overlap"):
        assert what in found, found
