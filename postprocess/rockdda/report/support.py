# SPDX-License-Identifier: MIT
"""Tables of a report: forces of bolts and linings, and how much of their strength they use."""

from __future__ import annotations

import math

import numpy as np

from ..frames import both_sides
from ..results import Frame, Results
from ..text import number
from ..units import Units

MOST_BOLTS = 20  # of a table
MOST_SHARE = 10.0  # a share above it is that of a section which its crack has left without strength
Table = tuple[list[str], list[list[str]]]  # names of the columns, rows


def bolt_table(results: Results, units: Units) -> tuple[str, Table]:
    """How many bolts there are, where not all are shown, and those that use most of a strength: forces per bolt and per
    metre."""
    pieces, first = results.frames[-1].bolt_pieces, results.frames[0].bolt_pieces
    names = results.bolt_names or [str(k + 1) for k in range(len(results.bolt_ends))]
    spacing = results.bolt_spacing if results.bolt_names else np.ones(len(names))
    largest = float(np.abs(pieces["force"]).max())
    factor, unit = units.of_bolt(bool(results.bolt_names), largest)
    per_metre, unit_metre = units.of_section("N", largest / float(np.min(spacing)))
    rows = []
    for k in range(len(names)):
        own = pieces.rows(first["bolt"] == k)
        if not own["there"].any():
            continue
        force = own["force"][int(np.argmax(np.abs(own["force"])))]
        use = float(np.nanmax(own["use"])) if np.isfinite(own["use"]).any() else math.nan
        rows.append((names[k], force, force / spacing[k], use))
    rows.sort(key=lambda row: (-(row[3] if math.isfinite(row[3]) else 0.0), -abs(row[1])))
    head = ["bolt", f"largest axial force per bolt [{unit}]", f"per metre [{unit_metre}]", "share of a strength"]
    if not unit:
        head[1:3] = ["largest axial force per bolt", "per unit of thickness"]
    lead = f"{len(rows)} bolts, the first {MOST_BOLTS}:" if len(rows) > MOST_BOLTS else ""
    shown = [
        [name, number(factor * force), number(per_metre * metre), f"{100 * use:.0f} %" if use == use else "unlimited"]
        for name, force, metre, use in rows[:MOST_BOLTS]
    ]
    return lead, (head, shown)


def window(results: Results) -> list[float] | None:
    """The part of the model around bolts and linings; None where it is most of the model."""
    now = results.frames[-1]
    pieces = [now.moved_pieces(what) for what in ("bolt", "liner")]
    ends = np.concatenate([one.stack("x1", "y1", "x2", "y2").reshape(-1, 2) for one in pieces])
    low, high = ends.min(axis=0), ends.max(axis=0)
    margin = 0.4 * float((high - low).max())
    (left, bottom), (right, top) = results.vertices.min(axis=0), results.vertices.max(axis=0)
    x0, y0 = np.maximum(low - margin, (left, bottom))
    x1, y1 = np.minimum(high + margin, (right, top))
    return None if (x1 - x0) * (y1 - y0) > 0.5 * (right - left) * (top - bottom) else [x0, y0, x1, y1]


def liner_forces(frame: Frame, units: Units) -> str:
    """'N -860 kN/m, M -8.94 kNm/m': the largest values of a frame without regard to their sign."""
    nodes, parts = frame.liner_node_columns, []
    nodes = nodes.rows(nodes["state"] > 0)
    for name in "NM":
        value = float(nodes[name][int(np.argmax(np.abs(nodes[name])))])
        factor, unit = units.of_section(name, value)
        parts.append(f"{name} {number(factor * value)} {unit}".rstrip())
    return ", ".join(parts)


def liner_table(results: Results, units: Units) -> Table:
    """Of each lining that is there at the end: the largest N, M, Q of all frames, the largest share of its strength
    with its place and stage, and how many of its nodes are cracked or crushed at the end; where a back has slipped,
    how far."""
    frames = [results.frames[index] for index in range(results.n_frames)]
    nodes = [frame.liner_node_columns for frame in frames]
    largest = {name: max(float(np.abs(both_sides(one, name)).max(initial=0.0)) for one in nodes) for name in "NMQ"}
    shown = {name: units.of_section(name, value) for name, value in largest.items()}
    head = ["lining"]
    for name, words in (("N", "N, compression"), ("N", "N, tension"), ("M", "M"), ("Q", "Q")):
        unit = shown[name][1]
        head.append(f"{words} [{unit}]" if unit else words)
    head += ["largest share of the strength", "where, in which stage", "nodes cracked, crushed"]
    slipped = float(np.nan_to_num(nodes[-1]["slip"]).max(initial=0.0))
    of_slip, unit_of_slip = units.multiple("length", slipped) if units.length else (1.0, "")
    if slipped > 0:
        head.append(f"slip at its back [{unit_of_slip}]" if unit_of_slip else "slip at its back")
    rows = []
    for k, liner in enumerate(results.liner_names):
        own = [one.rows((one["liner"] == k) & (one["state"] > 0)) for one in nodes]
        there = [(frame, one) for frame, one in zip(frames, own, strict=True) if one.n_rows]
        if not own[-1].n_rows:
            continue
        force = {name: np.concatenate([shown[name][0] * both_sides(one, name) for _, one in there]) for name in "NMQ"}
        sizes = [-min(force["N"].min(), 0.0), max(force["N"].max(), 0.0), *(np.abs(force[name]).max() for name in "MQ")]
        use = [float(np.fmax.reduce(one["use"])) for _, one in there]
        share, where = "unlimited", ""
        if not np.isnan(use).all():
            frame, one = there[int(np.nanargmax(use))]
            at = int(np.nanargmax(one["use"]))
            share = f"{100 * one['use'][at]:.0f} %" if one["use"][at] < MOST_SHARE else "pulled apart at a crack"
            where = f"{one['x'][at]:.2f}, {one['y'][at]:.2f}; {frame.stage_name}"
        state = own[-1]["state"]
        counts = f"{np.count_nonzero(state == 2)}, {np.count_nonzero(state == 3)} of {len(state)}"
        rows.append([liner, *(number(float(size)) for size in sizes), share, where, counts])
        if slipped > 0:
            rows[-1].append(number(of_slip * float(own[-1]["slip"].max())))
    return head, rows
