# SPDX-License-Identifier: MIT
"""Stresses, opening and slip along the joints of a frame, point by point and joint by joint.

A joint is where two blocks face each other. The solver gives its points with the lengths that they represent:

    first block      ----------- edge ---------->       points of an interval of length L with the weights
    joint               x1 l x2 |   l   | l             L/6, 2L/3, L/6: drawn as three pieces end to end
    second block     <---------- edge -----------

Stresses are positive in tension, as all stresses of results; openings are negative where the edges overlap. Shear
stress keeps its sign when the blocks are exchanged, forces do not; slip is summed up without its direction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import AnyArray, FloatArray, IntArray
from .columns import Columns
from .errors import InputError
from .fields import JOINT_FIELDS, JointField
from .frames import Frame, FrameTables
from .rings import after_on_block

if TYPE_CHECKING:
    import pandas

__all__ = ["JOINT_FIELDS", "JointField", "joint_points", "joint_summary", "need_contacts", "summary_columns"]


def need_contacts(results: FrameTables) -> None:
    """InputError where the run saved no contacts."""
    if not results.has_contacts:
        raise InputError("there are no contacts in it: they were not saved (&output contacts = .false.)", results.path)


def joint_points(frame: Frame) -> Columns:
    """A row for each point; `Results.joints` describes the columns."""
    contacts = frame.contacts
    if contacts.length is None or contacts.opening is None or contacts.slip is None:
        raise InputError("the file holds no stresses along joints: its version is older", frame.results.path)
    assert contacts.normal_stress is not None and contacts.shear_stress is not None
    swapped = contacts.blocks[:, 0] > contacts.blocks[:, 1]
    pair = np.sort(contacts.blocks.astype(np.int64), axis=1)
    edge, facing = _edges(frame, contacts.point, pair)
    start, along = _directions(frame, edge)
    place = np.einsum("ij,ij->i", contacts.point - start, along)
    order = np.lexsort((place, facing, edge, pair[:, 1], pair[:, 0]))
    pair, edge, facing, place, along = pair[order], edge[order], facing[order], place[order], along[order]
    point, length = contacts.point[order], contacts.length[order]
    of_edges = np.column_stack([pair, edge, facing])
    begin = _begins(place, length, _numbers(of_edges)) - place
    ends = np.hstack([point + begin[:, None] * along, point + (begin + length)[:, None] * along])
    material = frame.results.edge_joint[edge].astype(np.int64)
    material = np.where(material > 0, material, frame.results.edge_joint[facing])
    normal, shear = contacts.normal_stress[order], contacts.shear_stress[order]
    force = np.where(swapped[:, None], -contacts.force, contacts.force)[order]
    share = np.full(len(point), np.nan) if contacts.strength is None else contacts.strength[order]
    columns: dict[str, Any] = {
        "joint": _numbers(pair), "first": pair[:, 0], "second": pair[:, 1], "edge": edge, "material": material,
        "x": point[:, 0], "y": point[:, 1],
    }  # fmt: skip
    columns |= {name: ends[:, i] for i, name in enumerate(("x1", "y1", "x2", "y2"))}
    columns |= {
        "length": length, "state": contacts.state[order], "opening": contacts.opening[order],
        "slip": contacts.slip[order], "normal_stress": normal, "shear_stress": shear,
        "mobilised": share,
        "force_x": force[:, 0], "force_y": force[:, 1],
    }  # fmt: skip
    return Columns(columns)


def joint_summary(points: pandas.DataFrame) -> pandas.DataFrame:
    """One row for each joint of a table of points: first, second, material (of its first point), length, points, those
    that are open, means of the stresses and of the slip over the length, largest opening, largest mobilised share of
    the strength, and the force on the first block."""
    found = summary_columns(Columns({str(name): points[name].to_numpy() for name in points.columns}))
    return found.to_pandas("a summary of joints", "joint")


def summary_columns(points: Columns) -> Columns:
    """`joint_summary` as columns; the points of a joint need not stand together."""
    order = np.argsort(points["joint"], kind="stable")
    points = points.rows(order)
    joint = points["joint"]
    begin = np.flatnonzero(np.concatenate([[True], joint[1:] != joint[:-1]])) if len(joint) else np.zeros(0, dtype=int)
    row = np.repeat(np.arange(len(begin)), np.diff(np.append(begin, len(joint))))

    def total(values: AnyArray) -> AnyArray:
        return np.bincount(row, values, len(begin))

    def largest(values: FloatArray) -> FloatArray:
        found = np.full(len(begin), np.nan)
        np.fmax.at(found, row, values)
        return found

    table = Columns({name: points[name][begin] for name in ("joint", "first", "second", "material")})
    table["length"] = total(points["length"])
    table["points"] = np.bincount(row, minlength=len(begin))
    table["open_points"] = np.bincount(row[points["state"] == 0], minlength=len(begin))
    with np.errstate(divide="ignore", invalid="ignore"):
        for name in ("normal_stress", "shear_stress", "slip"):
            mean = total(points[name] * points["length"]) / table["length"]
            table[name] = np.where(table["length"] > 0, mean, np.nan)
    table["largest_opening"], table["largest_mobilised"] = (largest(points[name]) for name in ("opening", "mobilised"))
    for name in ("force_x", "force_y"):
        table[name] = total(points[name])
    return table


def _numbers(rows: IntArray) -> IntArray:
    """(n,) numbers from 0 of rows that are ordered: another one where a row differs from the one before."""
    new = np.any(rows[1:] != rows[:-1], axis=1) if len(rows) else np.zeros(0, dtype=bool)
    return np.concatenate([np.zeros(min(len(rows), 1), dtype=np.int64), np.cumsum(new)])


def _begins(place: FloatArray, length: FloatArray, group: IntArray) -> FloatArray:
    """Where the pieces of points begin along their edge, end to end around the centre of each group."""
    n = int(group[-1]) + 1 if len(group) else 0
    total = np.bincount(group, length, n)
    centre = np.bincount(group, length * place, n) / np.where(total > 0, total, 1.0)
    before = np.cumsum(length) - length
    first = np.searchsorted(group, np.arange(n))
    begin = (centre - total / 2)[group] + before - before[first][group]
    return np.where(length > 0, begin, place)


# -- edges -----------------------------------------------------------------------------------------------------------


def _directions(frame: Frame, edge: IntArray) -> tuple[FloatArray, FloatArray]:
    """Starts of edges and unit vectors along them."""
    vertices, after = frame.vertices, after_on_block(frame.results.vertex_offset)
    along = vertices[after[edge]] - vertices[edge]
    length = np.hypot(*along.T)
    return vertices[edge], along / np.where(length > 0, length, 1.0)[:, None]


def _edges(frame: Frame, point: FloatArray, pair: IntArray) -> tuple[IntArray, IntArray]:
    """For each point between two blocks the edges of both between which it lies.

    At a corner several edges are as near: those that run in opposite directions face each other."""
    offset = frame.results.vertex_offset.astype(np.int64)
    counts = offset[pair + 1] - offset[pair]  # (n, 2)
    sizes = counts[:, 0] * counts[:, 1]
    owner = np.repeat(np.arange(len(pair)), sizes)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    edges = [offset[pair[owner, 0]] + number // counts[owner, 1], offset[pair[owner, 1]] + number % counts[owner, 1]]
    vertices, after = frame.vertices, after_on_block(offset)
    distance = np.zeros(len(owner))
    for edge in edges:
        start, along = vertices[edge], vertices[after[edge]] - vertices[edge]
        square = np.einsum("ij,ij->i", along, along)
        share = np.einsum("ij,ij->i", point[owner] - start, along) / np.where(square > 0, square, 1.0)
        distance += np.hypot(*(point[owner] - start - np.clip(share, 0.0, 1.0)[:, None] * along).T)
    (_, one), (_, other) = (_directions(frame, edge) for edge in edges)
    size = np.sqrt(frame.results.block_area[pair].min(axis=1))
    miss = distance + size[owner] * (1.0 + np.einsum("ij,ij->i", one, other))
    best = np.lexsort((miss, owner))[np.cumsum(sizes) - sizes] if len(pair) else np.zeros(0, dtype=np.int64)
    return edges[0][best], edges[1][best]
