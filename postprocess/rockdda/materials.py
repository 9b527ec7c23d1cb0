# SPDX-License-Identifier: MIT
"""Materials in the input texts that results hold, read without the compiled part."""

from __future__ import annotations

from typing import Any

from .namelist import groups_in
from .text import input_numbers

Rows = list[list[float]]


def material_rows(text: str) -> tuple[Rows, Rows]:
    """The 13 numbers of each block material and the 3 of each joint material in an analysis file; both empty where it
    cannot be read."""
    try:
        words = input_numbers(text)
        blocks, joints = int(words[2]), int(words[3])
        length = 13 * blocks + 3 * joints
        if not (blocks > 0 and joints >= 0 and length <= len(words) - 6):
            return [], []
        for start in (len(words) - length, len(words) - length - 1):  # without and with an SOR factor at the end
            rows = [words[start + 13 * i : start + 13 * (i + 1)] for i in range(blocks)]
            if all(row[0] > 0 and row[2] > max(row[0], abs(row[1])) and -1 < row[3] < 0.5 for row in rows):
                after = start + 13 * blocks
                return rows, [words[after + 3 * i : after + 3 * (i + 1)] for i in range(joints)]
    except (ValueError, IndexError, OverflowError):
        pass
    return [], []


def block_material_names(config: str) -> dict[int, str]:
    """Names of block materials by number, of those that the options name."""
    groups = groups_in(config).get("block_material", [])
    return {int(group["number"]): str(group["name"]) for group in groups if "number" in group and "name" in group}


def densities_and_weights(analysis: str, config: str) -> list[tuple[float, float]]:
    """Density and weight of each block material of an analysis file, or of a labelled file."""
    rows = material_rows(analysis)[0]
    found: dict[Any, tuple[float, Any]] = {i: (row[0], row[1]) for i, row in enumerate(rows, start=1)}
    groups = groups_in(config)
    gravity = 0.0
    for group in groups.get("load", []):
        gravity = float(group.get("gravity", gravity))
    for group in groups.get("block_material", []):
        number = group.get("number")
        density, weight = found.get(number, (0.0, None))
        density = float(group.get("density", density))
        weight = group.get("unit_weight", weight)
        found[number] = (density, gravity * density if weight is None else float(weight))
    return list(found.values())
