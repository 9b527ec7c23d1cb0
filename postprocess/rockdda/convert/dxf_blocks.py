# SPDX-License-Identifier: MIT
"""The visible content of a drawing: its entities, and those of the blocks that it inserts.

Blocks may hold insertions of other blocks, so that a small file can represent any number of entities. They are counted
before the first one is made. What is on layer 0 of a block is on the layer of its insertion; names of layers that
differ in upper and lower case are one. Layers that are off or frozen, and invisible entities, are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..text import short
from .report import Report

DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
UNSEEN = ("VIEWPORT",)  # of each layout
MOST_ENTITIES = 150_000  # of a drawing: some 14 s and 300 MB
MOST_COUNTED = 1_000_000  # counting ends there
DEEPEST = 50  # blocks within blocks


@dataclass(frozen=True)
class Clip:
    """The clipping path (XCLIP) of an insertion."""

    corners: tuple[Any, ...]  # in space
    keeps_outside: bool


@dataclass(frozen=True)
class Shown:
    """A line, curve or point with its layer, and the clipping paths of the insertions around it."""

    entity: Any
    layer: str
    clips: tuple[Clip, ...] = ()


def drawn(document: Any, path: Path, report: Report) -> Iterator[Shown]:
    """All lines, curves and points with their layers, also those within block references; the rest is listed.

    InputError when a block holds itself, or when there are more than 150,000 entities."""
    _check_count(document, path)
    layers = _Layers(document)
    others: Counter[tuple[str, str]] = Counter()  # kind of entity, layer and reason

    def leave(entity: Any, layer: str, reason: str = "", kind: str = "") -> None:
        others[kind or entity.dxftype(), f"on layer {short(layer)!r}{reason}"] += 1

    def walk(entities: Any, outer: str | None, clips: tuple[Clip, ...] = ()) -> Iterator[Shown]:
        for entity in entities:
            kind = entity.dxftype()
            layer = layers.of(entity, outer)
            reason = layers.hides(entity, layer)
            if reason:
                leave(entity, layer, reason)
            elif kind == "POLYLINE" and (entity.is_poly_face_mesh or entity.is_polygon_mesh):
                leave(entity, layer, kind="POLYLINE (mesh)")
            elif kind in (*DRAWN, "POINT"):
                yield Shown(entity, layer, clips)
            elif kind != "INSERT":
                leave(entity, layer)
            elif (block := entity.block()) is None:
                leave(entity, layer, kind=f"INSERT (there is no block {short(entity.dxf.name)!r})")
            elif block.block.dxf.flags & 4:
                leave(entity, layer, kind=f"INSERT (of the drawing {short(block.block.dxf.xref_path)!r}, outside)")
            else:
                inner_clips = clips
                if (clip := _clip(entity)) is not None:
                    inner_clips = (*clips, clip)
                    name = f"an INSERT of block {short(entity.dxf.name)!r} on layer {short(layer)!r}"
                    report.note(f"{name} has a clipping path (XCLIP): what that hides is left out")
                    if entity.mcount > 1:
                        report.error(f"{name} has rows or columns, and a clipping path (XCLIP): explode it")
                for attribute in entity.attribs:
                    leave(attribute, layers.of(attribute, layer))

                def skipped(inner: Any, _: str, layer: str = layer) -> None:
                    leave(inner, layers.of(inner, layer), ", which the scales of its insertion distort")

                for insert in entity.multi_insert() if entity.mcount > 1 else [entity]:
                    yield from walk(insert.virtual_entities(skipped_entity_callback=skipped), layer, inner_clips)

    yield from walk(document.modelspace(), None)
    for layout in document.layouts:
        if not layout.is_modelspace:
            for entity in layout:
                if entity.dxftype() not in UNSEEN:
                    others[entity.dxftype(), f"in paper space {short(layout.name)!r}"] += 1
    for (kind, place), count in sorted(others.items()):
        report.warning(f"{count} entities of type {kind} are ignored: {place}")
        report.leave(f"entity of type {kind} {place}", f"entities of type {kind} {place}", count)


class _Layers:
    """The layers of a drawing: their spelling, and what they hide."""

    def __init__(self, document: Any) -> None:
        self._names: dict[str, str] = {}
        self._hidden: dict[str, str] = {}
        for layer in document.layers:
            name = str(layer.dxf.name)
            self._names.setdefault(name.lower(), name)
            if layer.is_frozen():
                self._hidden[name.lower()] = ", which is frozen"
            elif layer.is_off():
                self._hidden[name.lower()] = ", which is off"

    def of(self, entity: Any, outer: str | None) -> str:
        """The layer of an entity, in one spelling; `outer` is that of the insertion around it."""
        name = str(entity.dxf.layer)
        if name == "0" and outer is not None:
            return outer
        return self._names.setdefault(name.lower(), name)

    def hides(self, entity: Any, layer: str) -> str:
        """Why an entity is not shown; empty for one that is."""
        reason = self._hidden.get(layer.lower(), "")
        if entity.dxftype() == "INSERT" and reason == ", which is off":
            reason = ""  # what is on layers of its own shows
        return ", invisible" if entity.dxf.get("invisible", 0) else reason


def _clip(insert: Any) -> Clip | None:
    """The clipping path of an insertion; None without one that is on."""
    from ezdxf.math import Vec3
    from ezdxf.xclip import XClip

    # an insertion within a block is seen as a copy, which has no filter
    clip = XClip(insert.origin_of_copy or insert)
    if not (clip.has_clipping_path and clip.is_clipping_enabled):
        return None
    path = clip.get_block_clipping_path()
    corners = [(p.x, p.y) for p in path.inner_polygon()]
    if len(corners) == 2:
        (x1, y1), (x2, y2) = corners
        corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]
    places = insert.matrix44().transform_vertices(Vec3(corner) for corner in corners)
    return Clip(tuple(places), path.is_inverted_clip)


def _check_count(document: Any, path: Path) -> None:
    counts: dict[str, int] = {}
    open_blocks: list[str] = []

    def count(entities: Any) -> int:
        total = 0
        for entity in entities:
            total += 1
            if entity.dxftype() == "INSERT" and (block := entity.block()) is not None:
                total += abs(entity.mcount) * of_block(block)
            if total > MOST_COUNTED:
                raise InputError(f"the drawing shows more than {MOST_COUNTED} entities, with those of its blocks", path)
        return total

    def of_block(block: Any) -> int:
        name = block.name.lower()
        if name in open_blocks:
            raise InputError(f"block {short(block.name)!r} of the drawing holds itself", path)
        if name not in counts:
            if len(open_blocks) == DEEPEST:
                raise InputError(f"blocks of the drawing are nested more than {DEEPEST} times", path)
            open_blocks.append(name)
            counts[name] = count(block)
            open_blocks.pop()
        return counts[name]

    total = count(document.modelspace())
    if total > MOST_ENTITIES:
        text = f"the drawing shows {total} entities, with those of its blocks; at most {MOST_ENTITIES} are converted"
        raise InputError(f"{text}: leave out layers that are not needed, or parts of the drawing", path)
