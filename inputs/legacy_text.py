# SPDX-License-Identifier: MIT
"""Write geometry (.dc) and analysis (.df) files as text: the small language the models are described in."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

Point = tuple[float, float]
Segment = tuple[float, float, float, float]


def number(value: float) -> str:
    """Twelve digits: more than the cutter needs, fewer than differ between machines."""
    rounded = float(f"{value:.12g}")
    if abs(rounded) < 1e-12:
        rounded = 0.0
    return f"{rounded:.12g}"


def row(*values: float) -> str:
    """One record on one line."""
    return "  " + "  ".join(number(v) for v in values)


@dataclass
class Rock:
    """The 13 numbers of a block material; gravity 9.81 unless a weight is given."""

    density: float = 2500.0
    youngs_modulus: float = 5.0e9
    poisson_ratio: float = 0.25
    weight: float | None = None
    stress: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stress_gradient: tuple[float, float, float] = (0.0, 0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def rows(self) -> list[str]:
        weight = 9.81 * self.density if self.weight is None else self.weight
        return [
            row(self.density, weight, self.youngs_modulus, self.poisson_ratio),
            row(*self.stress, *self.stress_gradient),
            row(*self.velocity),
        ]


@dataclass
class Model:
    """One folder of inputs/: what it is called, its lines and points, and how it is run."""

    name: str
    title: str
    edge_node_distance: float
    # the analysis file
    k01: float
    steps: int
    dt: float
    displacement_ratio: float
    rocks: list[Rock]
    joints: list[tuple[float, float, float]]
    stiffness: float | None = None
    sor_factor: float | None = None
    fixed_tables: dict[int, list[tuple[float, float, float]]] = field(default_factory=dict)
    loading_tables: dict[int, list[tuple[float, float, float]]] = field(default_factory=dict)
    # beside the two files
    options: str = ""
    tables: dict[str, str] = field(default_factory=dict)
    # a labelled file in place of the analysis file
    labelled: str = ""
    # labelled files in place of the analysis file, by name
    labelled_files: dict[str, str] = field(default_factory=dict)
    # the geometry file
    boundary: list[tuple[Segment, int]] = field(default_factory=list)
    lines: list[tuple[Segment, int]] = field(default_factory=list)
    material_lines: list[tuple[Segment, int]] = field(default_factory=list)
    bolts: list[tuple[float, ...]] = field(default_factory=list)
    fixed: list[Point] = field(default_factory=list)
    loading: list[Point] = field(default_factory=list)
    measured: list[Point] = field(default_factory=list)
    holes: list[Point] = field(default_factory=list)

    @classmethod
    def without_analysis_file(
        cls, name: str, title: str, labelled: str = "", edge_node_distance: float = 0.001
    ) -> Model:
        """A model whose materials and steps stand in labelled files."""
        return cls(
            name,
            title,
            edge_node_distance,
            k01=0,
            steps=0,
            dt=0,
            displacement_ratio=0,
            rocks=[],
            joints=[],
            labelled=labelled,
        )

    def add_boundary(self, points: list[Point], joint: int = 1, closed: bool = True) -> None:
        """A polygon of boundary lines."""
        self.boundary += [(segment, joint) for segment in chain(points, closed)]

    def add_lines(self, points: list[Point], joint: int = 1, closed: bool = False) -> None:
        """A polyline of joints."""
        self.lines += [(segment, joint) for segment in chain(points, closed)]

    def geometry_text(self) -> str:
        out = [f"# {self.title}"]
        out += [f"{number(self.edge_node_distance)}   # smallest distance between a node and an edge"]
        out += [f"{len(self.boundary) + len(self.lines)} {len(self.boundary)}   # lines, of which boundary lines"]
        for rows, what in (
            (self.material_lines, "material lines"),
            (self.bolts, "bolts"),
            (self.fixed, "fixed points"),
            (self.loading, "loading points"),
            (self.measured, "measured points"),
            (self.holes, "hole points"),
        ):
            out += [f"{len(rows)}   # {what}"]
        for label, lines in (("boundary", self.boundary), ("joints", self.lines), ("materials", self.material_lines)):
            if lines:
                out += [f"# {label}: x1 y1 x2 y2 material"]
                out += [f"{row(*segment)}  {material}" for segment, material in lines]
        if self.bolts:
            out += ["# bolts: x1 y1 x2 y2 stiffness pretension strength"]
            out += [row(*bolt) for bolt in self.bolts]
        if self.fixed:
            out += ["# fixed points: x y x y"]
            out += [row(x, y, x, y) for x, y in self.fixed]
        for label, points in (("loading", self.loading), ("measured", self.measured), ("hole", self.holes)):
            if points:
                out += [f"# {label} points: x y"]
                out += [row(x, y) for x, y in points]
        return "\n".join(out) + "\n"

    def analysis_text(self) -> str:
        """The dialect with contact stiffness when one is given, else the one without."""
        out = [f"# {self.title}"]
        out += [f"{number(self.k01)}   # k01: share of the velocity that goes into the next step"]
        out += [f"{self.steps}   # steps", f"{len(self.rocks)}   # block materials", f"{len(self.joints)}   # joints"]
        out += [f"{number(self.displacement_ratio)}   # g2: allowed displacement per step over w0"]
        out += [f"{number(self.dt)}   # g1: largest time step"]
        if self.stiffness is not None:
            out += [f"{number(self.stiffness)}   # g0: contact stiffness"]
            tables = [self.fixed_tables.get(i, []) for i in range(len(self.fixed))]
            tables += [self.loading_tables.get(i, []) for i in range(len(self.loading))]
            if tables:
                out += ["# time-dependent values of each fixed point, then of each loading point"]
                out += ["  " + " ".join(str(len(table)) for table in tables)]
            for table in tables:
                if table:
                    out += ["# t x y"]
                    out += [row(*values) for values in table]
        for rock in self.rocks:
            out += ["# density weight E nu / s11 s22 s12 t11 t22 t12 / vx vy vr", *rock.rows()]
        out += ["# friction angle, cohesion, tensile strength"]
        out += [row(*joint) for joint in self.joints]
        if self.sor_factor is not None:
            out += [f"{number(self.sor_factor)}   # SOR factor"]
        return "\n".join(out) + "\n"

    def files(self) -> dict[str, str]:
        """Name and text of every file this model consists of."""
        if self.labelled:
            return {f"{self.name}.dc": self.geometry_text(), f"{self.name}.nml": self.labelled, **self.tables}
        if self.labelled_files:
            return {f"{self.name}.dc": self.geometry_text(), **self.labelled_files}
        files = {f"{self.name}.dc": self.geometry_text(), f"{self.name}.df": self.analysis_text()}
        if self.options:
            files[f"{self.name}.nml"] = self.options
        files.update(self.tables)
        return files

    def write(self, folder: Path) -> None:
        """Write the files of this model into folder/name."""
        target = folder / self.name
        target.mkdir(parents=True, exist_ok=True)
        for name, text in self.files().items():
            (target / name).parent.mkdir(exist_ok=True)
            (target / name).write_text(text, encoding="utf-8", newline="\n")


def chain(points: list[Point], closed: bool) -> list[Segment]:
    """Segments of a polyline."""
    pairs = list(zip(points, points[1:] + points[:1] if closed else points[1:], strict=False))
    return [(*a, *b) for a, b in pairs]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> list[Point]:
    """Corners, counter-clockwise."""
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def along_slope(angle_degrees: float, origin: Point = (0.0, 0.0)):
    """A map (s, n) -> (x, y): s up the slope, n out of it."""
    c, s = math.cos(math.radians(angle_degrees)), math.sin(math.radians(angle_degrees))
    return lambda a, n: (origin[0] + a * c - n * s, origin[1] + a * s + n * c)


def clip(segment: Segment, polygon: list[Point]) -> tuple[float, float] | None:
    """Parameters between which a segment lies inside a convex counter-clockwise polygon."""
    x1, y1, x2, y2 = segment
    low, high = 0.0, 1.0
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        start = (bx - ax) * (y1 - ay) - (by - ay) * (x1 - ax)
        change = (bx - ax) * (y2 - y1) - (by - ay) * (x2 - x1)
        if abs(change) < 1e-12:
            if start < 0:
                return None
        elif change > 0:
            low = max(low, -start / change)
        else:
            high = min(high, -start / change)
    return (low, high) if high - low > 1e-9 else None


def part(segment: Segment, t0: float, t1: float) -> Segment:
    """The segment between two parameters."""
    x1, y1, x2, y2 = segment
    return (x1 + t0 * (x2 - x1), y1 + t0 * (y2 - y1), x1 + t1 * (x2 - x1), y1 + t1 * (y2 - y1))


def length(segment: Segment) -> float:
    """Length of a segment."""
    return math.hypot(segment[2] - segment[0], segment[3] - segment[1])
