# SPDX-License-Identifier: MIT
"""The visible content of a drawing: its entities, and those of the blocks that it inserts.

Blocks may hold insertions of other blocks, so that a small file can stand for any number of entities. They are counted
before the first one is made.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..text import short
from .report import MOST_LINES, Report

DRAWN = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
DEEPEST = 50  # blocks within blocks


def drawn(document: Any, path: Path, report: Report) -> Iterator[Any]:
    """All lines, curves and points, also those within block references; the rest is counted in warnings.

    InputError when a block holds itself, or when there are more than a million entities.
    """
    _check_count(document, path)
    others: Counter[str] = Counter()

    def walk(entities: Any) -> Iterator[Any]:
        for entity in entities:
            kind = entity.dxftype()
            if kind in (*DRAWN, "POINT"):
                yield entity
            elif kind == "INSERT" and entity.block() is not None:
                for insert in entity.multi_insert() if entity.mcount > 1 else [entity]:
                    yield from walk(insert.virtual_entities(skipped_entity_callback=skipped))
            elif kind == "INSERT":
                others[f"INSERT (there is no block {short(entity.dxf.name)!r})"] += 1
            else:
                others[kind] += 1

    def skipped(entity: Any, _: str) -> None:
        others[entity.dxftype()] += 1

    yield from walk(document.modelspace())
    for kind, count in sorted(others.items()):
        report.warning(f"{count} entities of type {kind} are ignored")
        report.leave(f"entity of type {kind}", f"entities of type {kind}", count)


def _check_count(document: Any, path: Path) -> None:
    counts: dict[str, int] = {}
    open_blocks: list[str] = []

    def count(entities: Any) -> int:
        total = 0
        for entity in entities:
            total += 1
            if entity.dxftype() == "INSERT" and (block := entity.block()) is not None:
                total += abs(entity.mcount) * of_block(block)
            if total > MOST_LINES:
                raise InputError(f"the drawing shows more than {MOST_LINES} entities, with those of its blocks", path)
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

    count(document.modelspace())
