# SPDX-License-Identifier: MIT
"""Labelled files: the groups of a whole model as text, and its materials and tables from the groups."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from typing import Any

import numpy as np

from .arrays import FloatArray
from .deck import BlockMaterial, JointMaterial
from .groups import as_list
from .namelist import entry_texts

#: Groups in the order of the file: what there is, what acts, what happens; then those that are not named here, and
#: how it is computed.
FIRST = (
    "model", "block_material", "joint_material", "joint_law", "region", "subdivide", "load", "in_situ", "boundary",
    "water", "fixed_point", "loading_point", "line_load", "stage", "change",
)  # fmt: skip
LAST = ("material", "contact", "block_damping", "time", "solver", "run", "output")
WIDTH = 110  # letters of a line
#: Group and name of each option that is a field of `Model`, and the name of the field.
OPTION_FIELDS = (
    ("load", "gravity", "gravity"), ("run", "steps", "steps"), ("time", "k01", "k01"), ("time", "dt_max", "dt_max"),
    ("time", "displacement_ratio", "displacement_ratio"), ("contact", "stiffness", "stiffness"),
    ("solver", "omega", "sor_factor"),
)  # fmt: skip


def labelled_text(groups: Mapping[str, Any]) -> str:
    """The file of some groups, one after the other in the order that readers expect."""
    names = [name for name in FIRST if name in groups]
    names += sorted(name for name in groups if name not in (*FIRST, *LAST))
    names += [name for name in LAST if name in groups]
    filled = [(name, entries) for name in names for entries in as_list(groups[name]) if entries]
    indent = max((len(name) for name, _ in filled), default=0) + 2
    return "".join(_wrapped(f"&{name}".ljust(indent), entry_texts(entries), indent) for name, entries in filled)


def _wrapped(line: str, words: list[str], indent: int) -> str:
    """A group in as few lines as its words take."""
    lines = []
    for number, word in enumerate(words):
        if number and len(line) + 1 + len(word) > WIDTH:
            lines.append(line)
            line = " " * indent + word
        else:
            line = f"{line} {word}" if number else line + word
    return "\n".join([*lines, line]) + " /\n"


def merged_groups(groups: Mapping[str, Any], repeated: Container[str], adding: Container[str]) -> dict[str, Any]:
    """Groups with one dictionary for each that may not be repeated: the last value of a name counts, or, of the names
    in `adding`, all of them."""
    merged: dict[str, Any] = {}
    for name, given in groups.items():
        if name in repeated or not isinstance(given, list):
            merged[name] = given
            continue
        values: dict[str, Any] = {}
        for entries in given:
            more = {
                key: as_list(values[key]) + as_list(entries[key]) for key in entries if key in adding and key in values
            }
            values |= {**entries, **more}
        merged[name] = values
    return merged


def describes_itself(groups: Mapping[str, Any]) -> bool:
    """Are the materials 1, 2, … described by one group each, and no analysis file is named?"""
    if "analysis" in groups["model"]:
        return False
    numbers = [
        [group.get("number") for group in as_list(groups.get(f"{kind}_material", []))] for kind in ("block", "joint")
    ]
    return all(sorted(found, key=str) == sorted(range(1, len(found) + 1), key=str) for found in numbers)


def block_groups(materials: Sequence[BlockMaterial]) -> list[dict[str, Any]]:
    """The groups of block materials; what is the default is left out."""
    groups = []
    for i, m in enumerate(materials, start=1):
        entries = {"number": i, "name": m.name, "density": m.density, "young": m.youngs_modulus}
        entries |= {"poisson": m.poisson_ratio, "unit_weight": m.weight}
        entries |= {"stress": m.stress, "stress_gradient": m.stress_gradient, "velocity": m.velocity}
        groups.append({key: value for key, value in entries.items() if _is_told(value)})
    return groups


def joint_groups(materials: Sequence[JointMaterial]) -> list[dict[str, Any]]:
    """The groups of joint materials."""
    groups = []
    for i, m in enumerate(materials, start=1):
        strength = {"friction": m.friction_angle} | ({"cohesion": m.cohesion} if m.cohesion else {})
        strength |= {"tension": m.tension} if m.tension else {}
        groups.append({"number": i, **({"name": m.name} if m.name else {}), **strength, **m.values})
    return groups


def _is_told(value: Any) -> bool:
    """Does a value of a material say more than its default: an empty name, NaN, zeros of a triple?"""
    if isinstance(value, list | tuple):
        return any(value)
    return value != "" and not (isinstance(value, float) and math.isnan(value))


def block_materials(groups: Any) -> list[BlockMaterial]:
    """Block materials of their groups, by number."""
    materials = []
    for group in sorted(as_list(groups), key=lambda group: int(group["number"])):
        names = ("density", "unit_weight", "young", "poisson")
        density, weight, young, poisson = (float(group.get(name, math.nan)) for name in names)
        parts = ("stress", "stress_gradient", "velocity")
        stress, gradient, velocity = (_triple(group.get(name, (0.0, 0.0, 0.0))) for name in parts)
        name = str(group.get("name", ""))
        materials.append(BlockMaterial(density, weight, young, poisson, stress, gradient, velocity, name))
    return materials


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    first, second, third = map(float, values)
    return first, second, third


def joint_materials(groups: Any) -> list[JointMaterial]:
    """Joint materials of their groups, by number."""
    materials = []
    known = ("number", "name", "friction", "cohesion", "tension")
    for group in sorted(as_list(groups), key=lambda group: int(group["number"])):
        values = {name: value for name, value in group.items() if name not in known}
        friction, cohesion, tension = (float(group.get(name, 0.0)) for name in known[2:])
        materials.append(JointMaterial(friction, cohesion, tension, str(group.get("name", "")), values))
    return materials


def point_groups(name: str, tables: Sequence[FloatArray]) -> list[dict[str, Any]]:
    """Groups with the tables of points, of those that have rows."""
    return [{"points": i, name: table.ravel()} for i, table in enumerate(tables, start=1) if len(table)]


def take_point_tables(options: dict[str, Any], group: str, name: str, count: int) -> list[FloatArray]:
    """Tables of `count` points, from groups that are then taken out of the options; none where a point has
    several, or a group has a name or points of its own."""
    tables: list[FloatArray] = [np.zeros((0, 3)) for _ in range(count)]
    entries = as_list(options.get(group, []))
    if any("at" in entry or "name" in entry for entry in entries):
        return tables
    named = [int(i) for entry in entries for i in as_list(entry.get("points", list(range(1, count + 1))))]
    if len(set(named)) < len(named) or not all(1 <= i <= count for i in named):
        return tables
    options.pop(group, None)
    for entry in entries:
        for i in as_list(entry.get("points", list(range(1, count + 1)))):
            rows = np.ravel(np.asarray(entry[name], dtype=float))
            tables[int(i) - 1] = np.reshape([0.0, *rows] if len(rows) == 2 else rows, (-1, 3))
    return tables
