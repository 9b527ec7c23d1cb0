# SPDX-License-Identifier: MIT
"""The tables of a results file: kind of their numbers, what a row holds, its quantity, and which files have them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

#: Powers of length, time and force of the quantities.
POWERS = {
    "length": (1, 0, 0), "area": (2, 0, 0), "time": (0, 1, 0), "rate": (0, -1, 0), "stress": (-2, 0, 1),
    "weight": (-3, 0, 1), "force": (0, 0, 1), "section": (-1, 0, 1), "energy": (1, 0, 1), "speed": (1, -1, 0),
    "-": (0, 0, 0),
}  # fmt: skip
#: Numbers of a row; of the others the file has the size.
SIZES = {
    "xy": 2, "side": 2, "stress_component": 3, "velocity_component": 6, "energy_column": 10, "contact_count": 3,
    "property": 3, "nmq": 3, "section": 5, "of_beam": 6, "both_sides": 4,
}  # fmt: skip


class Table(NamedTuple):
    """A line of tables.txt, which says what its words mean."""

    kind: str
    rows: str
    row: tuple[str, ...]
    powers: list[tuple[int, int, int]]  # of all numbers, or of each column
    needs: str
    values: str


def _read(path: str, kind: str, rows: str, row: str, quantity: str, needs: str, values: str = "") -> tuple[str, Table]:
    powers = [POWERS[name] for name in quantity.split(",")]
    return path, Table(kind, rows, () if row == "-" else tuple(row.split(",")), powers, needs, values)


_LINES = Path(__file__).with_name("tables.txt").read_text("utf-8").splitlines()
TABLES = dict(_read(*line.split()) for line in _LINES if not line.startswith("#"))


def names_in(group: str, *needs: str) -> list[str]:
    """Names of the checked tables of a group (without its name) that need one of these."""
    begin = f"{group}/"
    return [
        path.removeprefix(begin)
        for path, table in TABLES.items()
        if path.startswith(begin) and table.needs.strip("-") in needs and table.kind != "-"
    ]
