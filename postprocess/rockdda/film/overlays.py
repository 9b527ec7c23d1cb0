# SPDX-License-Identifier: MIT
"""What the page draws over the blocks: boundaries, joints and water, as numbers that move with the vertices."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import BoolArray, FloatArray
from ..joints import JOINT_FIELDS, joint_points
from ..plot.boundary_marks import boundary_tables, edge_arrows
from ..plot.water_levels import water_tables, wetted_stretches
from ..results import Frame, Results
from ..rings import after_on_block
from ..units import Units

Shown = dict[str, tuple[float, str]]  # factor and unit of fields
PREFIX = "joint_"  # of the names that joint fields have in the page
STATE = "joint_state"
#: Columns of the rows of joints: edge (its first vertex), both ends as shares of the edge, then these.
COLUMNS = ("state", *JOINT_FIELDS)
ENOUGH = 1e-6  # of the largest pressure: points off a straight line by less are left out


def shown_joints(results: Results, units: Units) -> Shown:
    """Factor and unit of each field of joints, by its largest value in the last frame."""
    if not results.has_joints:
        return {}
    points = joint_points(results.frames[-1])
    found = {}
    for name, field in JOINT_FIELDS.items():
        values = np.abs(points[name].astype(float))
        found[PREFIX + name] = units.multiple(field.dimension, float(np.nanmax(values, initial=0.0)))
    return found


def joint_entries(results: Results, shown: Shown) -> list[dict[str, Any]]:
    """The fields of joints that the page offers; none for files of version 1."""
    if not results.has_joints:
        return []
    entries = [{"name": STATE, "label": "state of joints", "map": "states", "joint": 0}]
    for column, (name, field) in enumerate(JOINT_FIELDS.items(), start=1):
        unit = shown[PREFIX + name][1]
        label = f"{field.label} [{unit}]" if unit else field.label
        entries.append({"name": PREFIX + name, "label": label, "joint": column})
    return entries


def joint_rows(frame: Frame, shown: Shown | None = None) -> FloatArray:
    """(n, 9) edge, share of its begin, share of its end, and the COLUMNS of every point along the joints, times the
    factors of `shown`."""
    results = frame.results
    points = joint_points(frame)
    edge = points["edge"]
    after = after_on_block(results.vertex_offset)[edge]
    start, along = frame.vertices[edge], frame.vertices[after] - frame.vertices[edge]
    square = np.maximum(np.einsum("ij,ij->i", along, along), np.finfo(float).tiny)
    shares = [np.einsum("ij,ij->i", points.stack(f"x{end}", f"y{end}") - start, along) / square for end in (1, 2)]
    factors = [1.0 if shown is None or PREFIX + name not in shown else shown[PREFIX + name][0] for name in COLUMNS]
    return np.column_stack([edge, *shares, points.stack(*COLUMNS) * factors])


def joint_range(rows: FloatArray, name: str) -> tuple[float, float, float, float]:
    """Smallest and largest value of a joint field in rows of a frame, then the range without the outermost 2 % of the
    points. Open joints count for the opening only; NaN without any value."""
    column = 3 + COLUMNS.index(name.removeprefix(PREFIX))
    values = rows[:, column]
    values = values[np.isfinite(values) & ((rows[:, 3] > 0) | (name == PREFIX + "opening"))]
    if not len(values):
        return (np.nan,) * 4
    usual = np.percentile(values, [2, 98])
    return float(values.min()), float(values.max()), float(usual[0]), float(usual[1])


def joint_ranges(rows: list[FloatArray], name: str) -> tuple[float, float, float, float]:
    """The range of a joint field in some frames."""
    return widest([joint_range(of_frame, name) for of_frame in rows], name)


def widest(ranges: list[tuple[float, float, float, float]], name: str) -> tuple[float, float, float, float]:
    """The widest of the ranges of some frames; 0 to 1 where there is no value."""
    found = np.array(ranges).reshape(-1, 4)
    found = found[np.isfinite(found).all(axis=1)]
    if not len(found):
        return 0.0, 1.0, 0.0, 1.0
    low, high, usual_low, usual_high = (
        *(float(found[:, 0].min()), float(found[:, 1].max())),
        *(float(found[:, 2].min()), float(found[:, 3].max())),
    )
    if name == PREFIX + "mobilised":  # a share of the strength
        usual_low, usual_high = 0.0, max(1.0, usual_high) if usual_high > 1.05 else 1.0
    return low, high, usual_low, usual_high


def boundary_rows(results: Results) -> dict[str, Any]:
    """Edges of boundaries as [vertex, vertex, boundary, arrow, dx, dy], and of each boundary its kind and the
    table t, factor, … of its arrows."""
    if not len(results.boundary_edges):
        return {"kinds": [], "edges": [], "tables": []}
    rows = np.column_stack([results.boundary_ends, results.boundary_edges[:, 0], edge_arrows(results)])
    edges = [[*map(int, row[:4]), *(float(f"{x:.4g}") for x in row[4:])] for row in rows.tolist()]
    return {"kinds": results.boundary_kinds, "edges": edges, "tables": boundary_tables(results)}


def has_water(results: Results) -> bool:
    return "model/water_names" in results


def water_of(results: Results, frame: Frame) -> dict[str, Any]:
    """Tables of a frame as points x y, and its stretches: vertices, free or not, shares and pressures in turn."""
    stretches = wetted_stretches(results, frame.index)
    largest = max((float(stretch.pressure.max()) for stretch in stretches), default=0.0)
    bands = []
    for stretch in stretches:
        keep = _corners(stretch.share, stretch.pressure, ENOUGH * largest)
        pairs = np.column_stack([stretch.share, stretch.pressure])[keep].ravel()
        bands.append([stretch.first, stretch.second, int(stretch.free), *(float(f"{x:.6g}") for x in pairs)])
    tables = [[float(f"{x:.6g}") for x in table.ravel()] for table in water_tables(results, frame)]
    return {"tables": tables, "bands": bands, "largest": largest}


def _corners(x: FloatArray, y: FloatArray, tolerance: float) -> BoolArray:
    """The points of a line that bends there, and its ends."""
    keep = np.ones(len(x), dtype=bool)
    span = x[2:] - x[:-2]
    share = (x[1:-1] - x[:-2]) / np.where(span > 0, span, 1.0)
    keep[1:-1] = np.abs(y[1:-1] - (y[:-2] + share * (y[2:] - y[:-2]))) > tolerance
    return keep
