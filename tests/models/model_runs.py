# SPDX-License-Identifier: MIT
"""Where the models are, and the results of a run as plain arrays."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
INPUTS = ROOT / "inputs"
G = 9.81


def find_program() -> Path | None:
    """The program: named by the environment, or of the build tree."""
    named = os.environ.get("ROCKDDA_PROGRAM") or os.environ.get("ROCKDDA")
    program = Path(named) if named else ROOT / "build" / "bin" / "rockdda"
    return program if program.is_file() else None


class Run:
    """Results of one run as plain arrays."""

    def __init__(self, path: Path):
        import h5py

        with h5py.File(path, "r") as file:
            self.complete = int(file.attrs["complete"])
            self.data = {}
            file.visititems(lambda name, item: self.data.update({name: item[()]}) if hasattr(item, "shape") else None)
            columns = file["history/energy"].attrs["columns"]
        self.columns = [name.decode() if isinstance(name, bytes) else str(name) for name in columns]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.data[name]

    @property
    def time(self) -> np.ndarray:
        return self["history/time"]

    def support_forces(self) -> np.ndarray:
        """(nf, 2) of the last step, on the blocks."""
        return self["history/fixed_force"][-1]

    def displacement(self, point: int) -> np.ndarray:
        """(ns, 2) of a measured point since the start."""
        return self["history/measured_displacement"][:, point]

    def contacts(self) -> list[tuple[tuple[int, int], np.ndarray, np.ndarray]]:
        """Closed contacts of the last frame: blocks, place, force on the first block."""
        first, last = self["frames/contact_offset"][-2:]
        rows = range(first, last)
        return [
            (tuple(self["frames/contact_blocks"][c]), self["frames/contact_point"][c], self["frames/contact_force"][c])
            for c in rows
            if self["frames/contact_state"][c] > 0
        ]

    def block_at(self, x: float, y: float) -> int:
        """The block whose centroid was nearest to a place at the start."""
        return int(np.argmin(np.hypot(*(self["model/block_centroid"] - [x, y]).T)))

    def weight(self) -> float:
        """Of all blocks, when all have 2500 kg per area."""
        return 2500.0 * G * float(self["model/block_area"].sum())

    def mean_edge(self) -> float:
        """Mean length of all edges at the start: a joint of this length has the stiffness g0."""
        offset, corners = self["model/vertex_offset"], self["frames/vertices"][0]
        outlines = (corners[first:last] for first, last in itertools.pairwise(offset))
        return float(np.concatenate([np.hypot(*(np.roll(one, -1, axis=0) - one).T) for one in outlines]).mean())

    def joint_stiffness(self, g0: float) -> float:
        """Normal stiffness of joints per area that g0 stands for; 2/5 of it in shear."""
        return g0 / self.mean_edge()

    def relative_residual(self) -> float:
        """Largest residual of the energy ledger over the largest energy in it."""
        energy = np.abs(self["history/energy"])
        residual = self.columns.index("residual")
        return energy[:, residual].max() / np.delete(energy, residual, axis=1).max()


def copy_with(name: str, options: str, folder: Path) -> Path:
    """A copy of a model with further options."""
    copy = folder / name
    shutil.copytree(INPUTS / name, copy)
    with (copy / f"{name}.nml").open("a", encoding="utf-8") as file:
        file.write(f"\n{options}\n")
    return copy


def run_program(program: Path, arguments: list[str], folder: Path) -> subprocess.CompletedProcess:
    """The program in a folder of its own."""
    return subprocess.run(
        [str(program), *arguments], capture_output=True, text=True, timeout=120, check=False, cwd=folder
    )
