# SPDX-License-Identifier: MIT
"""The model that a conversion makes: lines and points before cutting, run control and materials."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..deck import AnalysisDeck, BlockMaterial, GeometryDeck, JointMaterial, number_text

Point = tuple[float, float]
Segment = tuple[float, float, float, float]
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
class Geometry:
    """Lines and points before cutting."""

    e0: float = 0.0
    boundary: list[tuple[Segment, int]] = field(default_factory=list)  # with joint materials
    joints: list[tuple[Segment, int]] = field(default_factory=list)
    material_lines: list[tuple[Segment, int]] = field(default_factory=list)  # with block materials
    bolts: list[Segment] = field(default_factory=list)
    bolt_values: tuple[float, float, float] | None = None  # stiffness, pretension, strength of all bolts
    steel: list[tuple[Segment, str]] = field(default_factory=list)  # with a kind of &bolt; from the head to the toe
    liners: list[Ring] = field(
        default_factory=list
    )  # lines of linings, for groups &liner; closed ones end as they begin
    fixed: list[Segment] = field(default_factory=list)  # both ends equal: a point
    loading: list[Point] = field(default_factory=list)
    measured: list[Point] = field(default_factory=list)
    holes: list[Point] = field(default_factory=list)
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

    def text(self, title: str = "") -> str:
        """The geometry file."""
        values = self.bolt_values or ()
        return GeometryDeck(
            self.e0, boundary=self.boundary, joints=self.joints, material_lines=self.material_lines,
            bolts=[(*bolt, *values) for bolt in self.bolts], fixed=self.fixed, loading=self.loading,
            measured=self.measured, holes=self.holes,
        ).text(title)  # fmt: skip


@dataclass
class Analysis:
    """Run control and materials."""

    k01: float
    steps: int
    g2: float  # largest displacement of a step over w0
    g1: float  # largest time step
    blocks: list[BlockMaterial]
    joints: list[JointMaterial]
    stiffness: float = 0.0  # of contact springs; 0: automatic
    fixed_count: int = 0  # points, after cutting
    loads: list[list[TimeRow]] = field(default_factory=list)  # t fx fy of each loading point
    options: dict[str, list[tuple[str, str]]] = field(default_factory=dict)  # group -> (name, value)
    has_stiffness: bool = False  # write it into the analysis file, in dialect g0, also without tables

    def set_option(self, group: str, name: str, value: str) -> None:
        """An entry of the options file."""
        self.options.setdefault(group, []).append((name, value))

    @property
    def has_tables(self) -> bool:
        """True with time-dependent values, which need the dialect with g0."""
        return any(self.loads)

    @property
    def names_points(self) -> bool:
        """True for an analysis file in dialect g0, which counts the fixed points."""
        return self.has_tables or self.has_stiffness

    def text(self, title: str = "") -> str:
        """The analysis file: in dialect g0 where there are tables or a stiffness, else in that of DDA for Windows."""
        has_points = self.fixed_count > 0 or len(self.loads) > 0
        return AnalysisDeck(
            self.k01,
            self.steps,
            self.g2,
            self.g1,
            self.blocks,
            self.joints,
            stiffness=self.stiffness if self.names_points else None,
            fixed_tables=[[]] * self.fixed_count if self.names_points else [],
            loading_tables=self.loads if self.names_points else [],
            # without points, only the SOR factor distinguishes the two dialects
            sor_factor=1.4 if self.names_points and not has_points else None,
        ).text(title)

    def options_text(self) -> str:
        """The options file; empty without options."""
        options = {group: list(entries) for group, entries in self.options.items()}
        if self.stiffness > 0 and not self.names_points:  # the dialect of DDA for Windows has no place for it
            options.setdefault("contact", []).insert(0, ("stiffness", number_text(self.stiffness)))
        out: list[str] = []
        for group, entries in options.items():
            out += [f"&{group}", *(f"   {name} = {value}" for name, value in entries), "/"]
        return "\n".join(out) + "\n" if out else ""
