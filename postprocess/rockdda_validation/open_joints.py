# SPDX-License-Identifier: MIT
"""Joints that are open: the blocks of a block file with all their edges moved inwards."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from rockdda.errors import InputError

__all__ = ["open_joints", "shrunk"]

FloatArray = npt.NDArray[np.float64]


def shrunk(corners: FloatArray, inset: float) -> FloatArray:
    """(n, 2) corners, counter-clockwise, of a polygon whose edges lie `inset` further inside."""
    edges = np.roll(corners, -1, axis=0) - corners
    edges /= np.linalg.norm(edges, axis=1)[:, None]
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1)
    before = np.roll(inward, 1, axis=0)
    # the point that lies `inset` inside both lines; on a straight line both are the same
    moved = corners + inset * (inward + before) / (1 + (inward * before).sum(axis=1))[:, None]
    if (((np.roll(moved, -1, axis=0) - moved) * edges).sum(axis=1) <= 0).any():
        raise InputError(f"an edge of a block is too short for joints that are {2 * inset:g} wide")
    return moved


def open_joints(blocks: str, play: float, lift: float = 0.0) -> str:
    """The text of a block file with every joint `play` wide; measured points are moved up by `lift`."""
    lines = blocks.splitlines()
    at = 0
    while at < len(lines):
        words = lines[at].split()
        at += 1
        if words[:1] == ["block"]:
            rows = slice(at, at + int(words[3]))
            table = [line.split() for line in lines[rows]]
            corners = shrunk(np.array([[float(x), float(y)] for x, y, _ in table]), play / 2)
            lines[rows] = [f"{x:.17g} {y:.17g} {row[2]}" for (x, y), row in zip(corners.tolist(), table, strict=True)]
            at = rows.stop
        elif words[:1] == ["measured_points"]:
            while lines[at].split()[0] != "bolt_list":
                x, y, block = lines[at].split()
                lines[at] = f"{x} {float(y) + lift:.17g} {block}"
                at += 1
    return "\n".join(lines) + "\n"
