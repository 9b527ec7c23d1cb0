# SPDX-License-Identifier: MIT
"""What conversions produce: the numbers of a geometry and an analysis file, and their text.

The order of the numbers is that of docs/file-formats.md. Numbers are written with as many digits as it takes to read
back exactly the same value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

Point = tuple[float, float]
Segment = tuple[float, float, float, float]
TimeRow = tuple[float, float, float]
Ring = list[Point]

REGION_KINDS = ("area", "opening")
POINT_KINDS = ("loading", "measured", "hole")
KINDS = ("joint", "boundary", "material", *REGION_KINDS, "fixed", *POINT_KINDS, "bolt", "skip")
LARGEST_MATERIAL = 10_000


def number(value: float) -> str:
    """The shortest text that reads back as the same number."""
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))


def row(*values: float) -> str:
    """One record."""
    return "  ".join(number(value) for value in values)


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
    fixed: list[Segment] = field(default_factory=list)  # both ends equal: a point
    loading: list[Point] = field(default_factory=list)
    measured: list[Point] = field(default_factory=list)
    holes: list[Point] = field(default_factory=list)
    # areas and openings, before lines are clipped: kind, joint material, outer ring and holes
    regions: list[tuple[str, int, list[Ring]]] = field(default_factory=list)
    chains: list[tuple[str, int, Ring]] = field(default_factory=list)  # pieces of their outlines

    @property
    def lines(self) -> list[tuple[Segment, int]]:
        """Boundary lines, then the others: the order of the file."""
        return self.boundary + self.joints

    @property
    def ranges(self) -> tuple[Point, Point]:
        """Smallest and largest x and y of the areas, or of all lines where there are none [length]."""
        outlines = [(kind, ring) for kind, _, rings in self.regions for ring in rings]
        outlines += [(kind, chain) for kind, _, chain in self.chains]
        points = [corner for kind, ring in outlines if kind == "area" for corner in ring]
        if not points:
            points = [point for segment, _ in self.lines for point in (segment[:2], segment[2:])]
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
        """Take in all of another geometry."""
        for name in ("boundary", "joints", "material_lines", "bolts", "fixed", *_POINTS, "regions", "chains"):
            getattr(self, name).extend(getattr(other, name))

    def move(self, change: Callable[[Point], Point]) -> None:
        """Apply a map of points to everything."""

        def segment(old: Segment) -> Segment:
            return (*change(old[:2]), *change(old[2:]))

        for name in ("boundary", "joints", "material_lines"):
            setattr(self, name, [(segment(line), material) for line, material in getattr(self, name)])
        for name in ("bolts", "fixed"):
            setattr(self, name, [segment(line) for line in getattr(self, name)])
        for name in _POINTS:
            setattr(self, name, [change(point) for point in getattr(self, name)])
        self.regions = [(k, m, [[change(p) for p in ring] for ring in rings]) for k, m, rings in self.regions]
        self.chains = [(k, m, [change(p) for p in chain]) for k, m, chain in self.chains]

    def text(self, title: str = "") -> str:
        """The geometry file."""
        out = [f"# {title}"] if title else []
        out += [f"{number(self.e0)}   # smallest distance between a node and an edge (e0)"]
        out += [f"{len(self.lines)} {len(self.boundary)}   # lines, of which boundary lines"]
        counts: tuple[Sequence[Any], ...] = (
            self.material_lines,
            self.bolts,
            self.fixed,
            self.loading,
            self.measured,
            self.holes,
        )
        names = ("material lines", "bolts", "fixed lines", "loading points", "measured points", "hole points")
        out += [f"{len(rows)}   # {name}" for rows, name in zip(counts, names, strict=True)]
        for name, lines in (
            ("boundary lines: x1 y1 x2 y2 joint material", self.boundary),
            ("lines: x1 y1 x2 y2 joint material", self.joints),
            ("material lines: x1 y1 x2 y2 block material", self.material_lines),
        ):
            if lines:
                out += [f"# {name}", *(f"{row(*segment)}  {material}" for segment, material in lines)]
        if self.bolts:
            values = self.bolt_values or ()
            out += ["# bolts: x1 y1 x2 y2" + (" stiffness pretension strength" if values else "")]
            out += [row(*bolt, *values) for bolt in self.bolts]
        if self.fixed:
            out += ["# fixed lines: x1 y1 x2 y2", *(row(*segment) for segment in self.fixed)]
        for name, points in (("loading", self.loading), ("measured", self.measured), ("hole", self.holes)):
            if points:
                out += [f"# {name} points: x y", *(row(*point) for point in points)]
        return "\n".join(out) + "\n"


@dataclass
class BlockMaterial:
    """The thirteen numbers of a block material."""

    density: float
    weight: float
    youngs_modulus: float
    poisson_ratio: float
    stress: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stress_gradient: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass
class Analysis:
    """Run control and materials."""

    k01: float
    steps: int
    g2: float  # largest displacement of a step over w0
    g1: float  # largest time step
    blocks: list[BlockMaterial]
    joints: list[tuple[float, float, float]]  # friction angle [deg], cohesion, tensile strength
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
        """Are there time-dependent values? They need the dialect with g0."""
        return any(self.loads)

    @property
    def names_points(self) -> bool:
        """Is the analysis file in dialect g0, which counts the fixed points?"""
        return self.has_tables or self.has_stiffness

    def text(self, title: str = "") -> str:
        """The analysis file, in dialect g0 when there are tables or a stiffness to write, else in dialect peer."""
        out = [f"# {title}"] if title else []
        out += [f"{number(self.k01)}   # k01: 0 static to 1 dynamic", f"{self.steps}   # time steps"]
        out += [f"{len(self.blocks)}   # block materials", f"{len(self.joints)}   # joint materials"]
        out += [f"{number(self.g2)}   # g2: largest displacement of a step over w0"]
        out += [f"{number(self.g1)}   # g1: largest time step"]
        counts = ["0"] * self.fixed_count + [str(len(table)) for table in self.loads]
        if self.names_points:
            out += [f"{number(self.stiffness)}   # g0: stiffness of contact springs, 0 automatic"]
        if self.names_points and counts:
            out += ["# numbers of time-dependent values: fixed points, then loading points"]
            out += ["  ".join(counts)]
            for i, table in enumerate(self.loads, start=1):
                if table:
                    out += [f"# loading point {i}: t fx fy", *(row(*values) for values in table)]
        for i, block in enumerate(self.blocks, start=1):
            out += [f"# block material {i}: density weight E nu / s11 s22 s12 / t11 t22 t12 / vx vy vr"]
            out += [row(block.density, block.weight, block.youngs_modulus, block.poisson_ratio)]
            out += [row(*block.stress), row(*block.stress_gradient), row(*block.velocity)]
        out += ["# joint materials: friction angle, cohesion, tensile strength"]
        out += [row(*joint) for joint in self.joints]
        if self.names_points and not counts:  # without points only this tells the dialects apart
            out += ["1.4   # SOR factor"]
        return "\n".join(out) + "\n"

    def options_text(self) -> str:
        """The options file; empty when there is nothing to say."""
        options = {group: list(entries) for group, entries in self.options.items()}
        if self.stiffness > 0 and not self.names_points:  # dialect peer cannot say it
            options.setdefault("contact", []).insert(0, ("stiffness", number(self.stiffness)))
        out: list[str] = []
        for group, entries in options.items():
            out += [f"&{group}", *(f"   {name} = {value}" for name, value in entries), "/"]
        return "\n".join(out) + "\n" if out else ""
