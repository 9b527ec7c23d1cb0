# SPDX-License-Identifier: MIT
"""The page that plays frames in a browser, with its data in it or for the local viewer."""

from __future__ import annotations

import base64
import html
import json
import re
import zlib
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from ..arrays import AnyArray
from ..columns import Columns
from ..frames import FIELDS, Frame
from ..plot.style import (
    DIVERGING,
    MATERIALS,
    SEQUENTIAL,
    STATES,
    USE_MAP,
    colour_range,
    field_words,
    limits_of,
    usual_range,
)
from ..results import Results
from ..units import Units
from .overlays import Shown, boundary_rows, has_water, joint_entries, joint_ranges, joint_rows, shown_joints, water_of

SHOWN_FIELDS = (
    "displacement", "displacement_x", "displacement_y", "rotation", "speed", "stress_min", "stress_max", "stress_x",
    "stress_y", "stress_xy", "material",
)  # fmt: skip


def pack(array: AnyArray, kind: str) -> str:
    """Numbers as compressed base64, little endian."""
    data = np.ascontiguousarray(array, dtype=np.dtype(kind).newbyteorder("<")).tobytes()
    return base64.b64encode(zlib.compress(data, 9)).decode()


def colour_maps() -> dict[str, str]:
    """The colours of the scales, six hexadecimal digits each, one after the other."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    def colours(name: str) -> str:
        return "".join(to_hex(colormaps[name](i / 63))[1:] for i in range(64))

    return {
        "sequential": colours(SEQUENTIAL),
        "reversed": colours(f"{SEQUENTIAL}_r"),
        "diverging": colours(DIVERGING),
        "materials": "".join(colour[1:] for colour in MATERIALS),
        "states": "".join(colour[1:] for colour in STATES.values()),
        "use": colours(USE_MAP),
    }


def shown_fields(results: Results, fields: Sequence[str], units: Units, *, joints: bool = True) -> Shown:
    """Factor and unit in which each field is shown, by its largest value in the last frame; 'bolts' is that of forces,
    'N', 'M' and 'Q' those of linings, 'length' that of places."""
    now = results.frames[-1]
    found = shown_joints(results, units) if joints else {}
    for name in fields:
        values = np.abs(now.field(name)[now.active])
        found[name] = units.multiple(field_words(name)[1], float(values.max(initial=0.0)))
    found["bolts"] = units.of_bolt(bool(results.bolt_names), float(np.abs(now.bolt_pieces["force"]).max(initial=0.0)))
    pieces = now.liner_pieces
    for name in "NMQ":
        found[name] = units.of_section(name, float(np.abs(pieces[name]).max(initial=0.0)))
    found["length"] = units.multiple("length", float(np.abs(results.vertices).max()))
    return found


def describe(
    results: Results, fields: Sequence[str], units: Units, *, joints: bool = True, shown: Shown | None = None
) -> dict[str, Any]:
    """The data of the page beside the frames; `fields` without their values, and those of joints where wanted.

    The values come in the units of `shown`, those of `shown_fields`."""
    shown = shown_fields(results, fields, units, joints=joints) if shown is None else shown
    now, names = results.frames[-1].vertices, results.bolt_names
    place = units.multiple("length", 1.0)
    corners = np.concatenate([results.vertices, now])
    return {
        "blocks": results.n_blocks,
        "vertices": results.n_vertices,
        "offset": pack(results.vertex_offset, "i4"),
        "start": pack(results.vertices, "f4"),
        "box": [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()],
        "areas": [float(f"{area:.6g}") for area in results.block_area],
        "fixed": results.fixed_points.tolist(),
        "boundaries": boundary_rows(results),
        "stageNames": results.stage_names if results.has_stages else [],
        "hasWater": has_water(results),
        "bolts": results.frames[0].bolt_pieces.stack("x1", "y1", "x2", "y2").tolist(),
        "boltNames": [names[k] if names else f"bolt {k + 1}" for k in results.frames[0].bolt_pieces["bolt"].tolist()],
        "boltLabel": _with_unit("axial force", shown["bolts"][1]),
        "liners": results.frames[0].liner_pieces.stack("x1", "y1", "x2", "y2").tolist(),
        "linerNames": [results.liner_names[k] for k in results.frames[0].liner_pieces["liner"].tolist()],
        "linerUnits": [shown[name][1] for name in "NMQ"],
        "linerRanges": liner_ranges(results, shown),
        "maps": colour_maps(),
        "unit": f" {units.time}" if units.time else "",
        "place": {"factor": place[0], "unit": f" {place[1]}", "area": units.multiple("area", 1.0)}
        if units.length
        else None,
        "fields": [
            {"name": name, "label": _with_unit(FIELDS[name].label.split(" [")[0], shown[name][1])}
            | ({"map": "materials"} if name == "material" else {})
            for name in fields
        ]
        + (joint_entries(results, shown) if joints else []),
    }


def _with_unit(text: str, unit: str) -> str:
    """'text [unit]'."""
    return f"{text} [{unit}]" if unit else text


def liner_ranges(results: Results, shown: Shown) -> list[float]:
    """The largest N, M, Q of the linings at the ends of the stages, without regard to sign."""
    frames = {stage.frames[-1] for stage in results.stages if stage.frames} | {results.n_frames - 1}
    found = np.zeros(3)
    for index in sorted(frames) if results.liner_names else ():
        pieces = results.frames[index].moved_pieces("liner")
        found = np.maximum(found, [shown[name][0] * np.abs(pieces[name]).max(initial=0.0) for name in "NMQ"])
    return [float(f"{value:.6g}") for value in found]


def bolt_rows(frame: Frame, shown: Shown) -> AnyArray:
    """(n, 6) x1 y1 x2 y2, force and share of a strength of the pieces of bolts of a frame; -1: none is known.

    The places of what is not there are no numbers."""
    pieces = frame.bolt_pieces
    return np.column_stack([_places(pieces), shown["bolts"][0] * pieces["force"], _use(pieces)])


def liner_rows(frame: Frame, shown: Shown) -> AnyArray:
    """(n, 8) x1 y1 x2 y2, share of the strength, N, M, Q of the pieces of linings of a frame, as `bolt_rows`."""
    pieces = frame.liner_pieces
    forces = [shown[name][0] * pieces[name] for name in "NMQ"]
    return np.column_stack([_places(pieces), _use(pieces), *forces])


def _places(pieces: Columns) -> AnyArray:
    return np.where(pieces["there"][:, None], pieces.stack("x1", "y1", "x2", "y2"), np.nan)


def _use(pieces: Columns) -> AnyArray:
    """Shares of a strength, at most 10 (of a cracked section that is pulled: infinite); -1: none is known."""
    return np.where(np.isnan(pieces["use"]), -1.0, np.minimum(pieces["use"], 10.0))


def page(title: str, setup: dict[str, Any], name: str = "player") -> str:
    """The whole page, the player or that of a 'model': markup, style, program and data."""
    web = files("rockdda").joinpath("web")
    css, script, text = (web.joinpath(file).read_text("utf-8") for file in ("player.css", f"{name}.js", f"{name}.html"))
    data = json.dumps(setup, separators=(",", ":")).replace("<", "\\u003c")  # no end tag within
    return filled(text, {"title": html.escape(title), "css": css, "script": script, "setup": data})


def filled(text: str, parts: dict[str, str]) -> str:
    """A page with its parts; what stands in double braces within a part is text."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], text)


def film_page(
    results: Results, frames: Sequence[int], fields: Sequence[str], units: Units, title: str,
    progress: Callable[[int, int], None] | None = None, joints: bool = False,
) -> str:  # fmt: skip
    """A page with the data of some frames in it, with `joints` those along the joints, too.

    Displacements keep 1/32,767 of the largest one, values of fields 1/65,535 of their range."""
    shown = shown_fields(results, fields, units, joints=joints)
    setup = describe(results, fields, units, joints=joints, shown=shown)
    moves = np.empty((len(frames), results.n_vertices, 2), dtype=np.float32)
    values = {name: np.empty((len(frames), results.n_blocks), dtype=np.float32) for name in fields}
    for k, index in enumerate(frames):
        now = results.frames[index]
        moves[k] = now.shown_displacement
        for name in fields:
            values[name][k] = shown[name][0] * now.field(name)
        if progress is not None:
            progress(k + 1, len(frames))
    unit = float(np.abs(moves).max()) / 32767 or 1.0
    for what, rows_of in (("bolt", bolt_rows), ("liner", liner_rows)):
        if setup[f"{what}s"]:
            setup[f"{what}Data"] = pack(np.array([rows_of(results.frames[index], shown) for index in frames]), "f4")
    setup |= {"live": False, "state": "", "moves": {"unit": unit, "data": pack(np.rint(moves / unit), "i2")}}
    corners = (results.vertices + moves).reshape(-1, 2)
    setup["box"] = [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
    active = results.active[frames]
    stages = results.frame_stages
    setup["frameStages"] = [int(stages[index]) for index in frames]
    if setup["hasWater"]:
        setup["water"] = [water_of(results, results.frames[index]) for index in frames]
    if joints and results.has_joints:
        rows = [joint_rows(results.frames[index], shown) for index in frames]
        setup["joints"] = {
            "offset": np.cumsum([0, *map(len, rows)]).tolist(),
            "data": pack(np.concatenate(rows), "f4"),
            "ranges": {
                entry["name"]: joint_ranges(rows, entry["name"]) for entry in setup["fields"] if "joint" in entry
            },
        }
    for entry in setup["fields"]:
        if "joint" in entry:
            continue
        found = values[entry["name"]].astype(float)
        there = found[active] if active.any() else np.zeros(1)
        low, high = float(there.min()), float(there.max())
        found = np.clip(found, low, high)  # of blocks that are not there
        usual = colour_range((low, high), usual_range(found, results.block_area, active))
        if entry["name"] != "material":
            low, high, _ = limits_of(entry["name"], found, None)
        span = high - low or 1.0
        entry |= {"usual": usual}
        entry |= {"low": low, "high": low + span, "data": pack(np.rint((found - low) / span * 65535), "u2")}
    setup["times"] = [float(results.times[index]) for index in frames]
    setup["steps"] = [int(results.steps[index]) for index in frames]
    return page(title, setup)
