# SPDX-License-Identifier: MIT
"""The model that a conversion makes: lines and points before cutting, run control and materials."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from ..deck import AnalysisDeck, GeometryDeck, Segment, number_text

Point = tuple[float, float]
TimeRow = tuple[float, float, float]
Ring = list[Point]

REGION_KINDS = ("area", "opening")
POINT_KINDS = ("loading", "measured", "hole")
#: Bolts that act along their length, by layer or property: groups &bolt of the labelled file.
STEEL_KINDS = ("bolt_grouted", "bolt_end_anchored", "bolt_yielding", "bolt_friction")
SUPPORT_KINDS = ("bolt", *STEEL_KINDS, "liner")
KINDS = ("joint", "boundary", "material", *REGION_KINDS, "block", "fixed", *POINT_KINDS, *SUPPORT_KINDS, "skip")
LARGEST_MATERIAL = 10_000


_POINTS = ("loading", "measured", "holes")


@dataclass
class Geometry(GeometryDeck):
    """Lines and points before cutting."""

    bolt_values: tuple[float, float, float] | None = None  # stiffness, pretension, strength of all bolts
    steel: list[tuple[Segment, str]] = field(default_factory=list)  # with a kind of &bolt; from the head to the toe
    liners: list[Ring] = field(
        default_factory=list
    )  # lines of linings, for groups &liner; closed ones end as they begin
    # areas and openings, before lines are clipped: kind, joint material, outer ring and holes
    regions: list[tuple[str, int, list[Ring]]] = field(default_factory=list)
    chains: list[tuple[str, int, Ring]] = field(default_factory=list)  # pieces of their outlines
    # not to be cut: block and joint material, outer ring and holes, not closed
    blocks: list[tuple[int, int, list[Ring]]] = field(default_factory=list)

    @property
    def lines(self) -> list[tuple[Segment, int]]:
        """Boundary lines, then the others: the order of the file."""
        return self.boundary + self.joints

    @property
    def is_empty(self) -> bool:
        """True without anything that makes blocks."""
        return not (self.lines or self.regions or self.chains or self.blocks)

    def summary(self) -> list[str]:
        """What the input files hold: kinds, counts, lengths and materials."""
        rows = []
        for name, lines in (
            ("boundary lines", self.boundary), ("joint lines", self.joints), ("material lines", self.material_lines)
        ):  # fmt: skip
            if lines:
                length = sum(math.hypot(x2 - x1, y2 - y1) for (x1, y1, x2, y2), _ in lines)
                counts = Counter(material for _, material in lines)
                materials = ", ".join(f"{material}: {count}" for material, count in sorted(counts.items()))
                rows.append(f"{len(lines)} {name}, {length:.6g} long in all (by material {materials})")
        if self.blocks:
            counts = Counter(material for material, _, _ in self.blocks)
            materials = ", ".join(f"{material}: {count}" for material, count in sorted(counts.items()))
            rows.append(f"{len(self.blocks)} blocks (by material {materials})")
        names = (
            "fixed points and lines", "loading points", "measured points", "hole points", "bolts", "bolts with a kind",
            "linings",
        )  # fmt: skip
        groups: tuple[list[Any], ...] = (
            self.fixed, self.loading, self.measured, self.holes, self.bolts, self.steel, self.liners
        )  # fmt: skip
        rows += [f"{len(group)} {name}" for name, group in zip(names, groups, strict=True) if group]
        return rows

    @property
    def ranges(self) -> tuple[Point, Point]:
        """Smallest and largest x and y of the areas, or of all lines where there are none [length]."""
        outlines = [(kind, ring) for kind, _, rings in self.regions for ring in rings]
        outlines += [(kind, chain) for kind, _, chain in self.chains]
        points = [corner for kind, ring in outlines if kind == "area" for corner in ring]
        if not points:
            points = [point for segment, _ in self.lines for point in (segment[:2], segment[2:])]
            points += [corner for _, _, rings in self.blocks for ring in rings for corner in ring]
            points += [corner for _, ring in outlines for corner in ring]
        if not points:
            return (0.0, 0.0), (0.0, 0.0)
        x, y = zip(*points, strict=True)
        return (min(x), max(x)), (min(y), max(y))

    @property
    def extent(self) -> float:
        """The larger extent of all lines [length]."""
        return max(high - low for low, high in self.ranges)

    def add(self, other: Geometry) -> None:
        """Add all of another geometry."""
        for name, own in vars(self).items():
            if isinstance(own, list):
                own.extend(getattr(other, name))

    def move(self, change: Callable[[Point], Point]) -> None:
        """Apply a map of points to everything."""

        def segment(old: Segment) -> Segment:
            return (*change(old[:2]), *change(old[2:]))

        for name in ("boundary", "joints", "material_lines", "steel"):
            setattr(self, name, [(segment(line), material) for line, material in getattr(self, name)])
        for name in ("bolts", "fixed"):
            setattr(self, name, [segment(line) for line in getattr(self, name)])
        for name in _POINTS:
            setattr(self, name, [change(point) for point in getattr(self, name)])
        self.regions = [(k, m, [[change(p) for p in ring] for ring in rings]) for k, m, rings in self.regions]
        self.chains = [(k, m, [change(p) for p in chain]) for k, m, chain in self.chains]
        self.liners = [[change(p) for p in line] for line in self.liners]
        self.blocks = [(m, j, [[change(p) for p in ring] for ring in rings]) for m, j, rings in self.blocks]

    def add_point(self, kind: str, place: Point) -> bool:
        """Add a point; False where its kind is none of points."""
        if kind == "fixed":
            self.fixed.append((*place, *place))
        elif kind in POINT_KINDS:
            {"loading": self.loading, "measured": self.measured, "hole": self.holes}[kind].append(place)
        return kind == "fixed" or kind in POINT_KINDS

    def add_corners(self, kind: str, material: int, corners: Ring) -> None:
        """Add a line through corners, of a kind that is drawn by lines; of bolts each piece is one."""
        pairs = [(*a, *b) for a, b in itertools.pairwise(corners) if a != b]
        if kind == "fixed":
            self.fixed += pairs
        elif kind == "bolt":
            self.bolts += pairs
        elif kind in STEEL_KINDS:
            self.steel += [(pair, kind.removeprefix("bolt_")) for pair in pairs]
        elif kind == "liner":
            self.liners += [corners] if pairs else []
        else:
            lines = {"joint": self.joints, "boundary": self.boundary, "material": self.material_lines}[kind]
            lines += [(pair, material) for pair in pairs]

    def text(self, title: str = "") -> str:
        """The geometry file."""
        bolts = [(*bolt, *(self.bolt_values or ())) for bolt in self.bolts]
        return GeometryDeck.text(replace(self, bolts=bolts), title)


@dataclass
class Analysis(AnalysisDeck):
    """Run control and materials; in dialect g0 where there are tables, else in that of DDA for Windows."""

    fixed_count: int = 0  # points, after cutting
    options: dict[str, list[tuple[str, str]]] = field(default_factory=dict)  # group -> (name, value)

    def set_option(self, group: str, name: str, value: str) -> None:
        """An entry of the options file."""
        self.options.setdefault(group, []).append((name, value))

    @property
    def has_tables(self) -> bool:
        """True with time-dependent values, which need the dialect with g0, and that all points are counted."""
        return any(self.loading_tables)

    def text(self, title: str = "") -> str:
        """The analysis file."""
        if not self.has_tables:
            return AnalysisDeck.text(replace(self, stiffness=None, loading_tables=[]), title)
        return AnalysisDeck.text(replace(self, fixed_tables=[[]] * self.fixed_count), title)

    def options_text(self) -> str:
        """The options file; empty without options."""
        options = {group: list(entries) for group, entries in self.options.items()}
        if self.stiffness and not self.has_tables:  # the dialect of DDA for Windows has no place for it
            options.setdefault("contact", []).insert(0, ("stiffness", number_text(self.stiffness)))
        out: list[str] = []
        for group, entries in options.items():
            out += [f"&{group}", *(f"   {name} = {value}" for name, value in entries), "/"]
        return "\n".join(out) + "\n" if out else ""
