#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Say in a few lines what happened in a run.

tell_results.py RESULTS.h5
"""

import sys

import h5py
import numpy as np


def tell(path):
    with h5py.File(path, "r") as file:
        history, frames = file["history"], file["frames"]
        moved = np.linalg.norm(frames["centroid"][-1] - frames["centroid"][0], axis=1)
        furthest = int(np.argmax(moved))
        opened, sliding, locked = history["contacts"][-1]
        energy = history["energy"]
        names = [name.decode() if isinstance(name, bytes) else str(name) for name in energy.attrs["columns"]]
        last = dict(zip(names, energy[-1], strict=True))
        rounds = history["open_close_iterations"][:]
        print(f"{len(moved)} blocks, {len(rounds)} steps to time {history['time'][-1]:g}")
        print(f"{np.count_nonzero(moved > 1e-3 * moved.max())} blocks moved (more than a thousandth of the furthest)")
        rotation = frames["rotation"][-1][furthest]
        print(f"furthest: block {furthest + 1} by {moved[furthest]:.4g}, turned by {rotation:.3g} rad")
        print(f"contacts at the end: {opened} open, {sliding} sliding, {locked} locked")
        print(f"open-close rounds per step: {rounds.mean():.1f} on average, {rounds.max()} at most")
        print("energies at the end: " + ", ".join(f"{name} {value:.4g}" for name, value in last.items()))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    tell(sys.argv[1])
