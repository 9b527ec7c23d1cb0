# SPDX-License-Identifier: MIT
"""Models whose factor of safety is known: plane failure, toppling, walls, arches, stacks, a dam.

Each is a labelled model that stands as it is, with one static stage, 'weight', to equilibrium. No number of contacts or
of time is given: all are automatic.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from rockdda.errors import InputError
from rockdda.model import Model

__all__ = [
    "BUTTRESS",
    "DOORWAY",
    "FIRST_WALL",
    "PIERCED_WALL",
    "TALL_WALL",
    "TOWER",
    "TWO_OPENINGS",
    "Dam",
    "PlaneFailure",
    "arch",
    "assemble",
    "courses",
    "random_plane_failures",
    "rectangle",
    "stack",
    "wall",
]

FloatArray = npt.NDArray[np.float64]

GRAVITY = 9.81
STONE = 2400.0  # kg/m³
YOUNG = 20e9  # Pa: the deformation of blocks and joints is small beside their sizes


def rectangle(x: float, y: float, width: float, height: float) -> FloatArray:
    """Corners (4, 2) of an upright rectangle from its lower left corner."""
    return np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])


def assemble(
    name: str,
    polygons: Sequence[npt.ArrayLike],
    fixed: Collection[int],
    *,
    friction: float,
    cohesion: float = 0.0,
    density: float = STONE,
    young: float = YOUNG,
    gravity: float = GRAVITY,
    e0: float | None = None,
) -> Model:
    """A labelled model of blocks that fill the plane edge to edge; `fixed` are the numbers of fixed blocks.

    Enclosed places that no block fills become openings.
    """
    outlines = [shapely.Polygon(np.asarray(one, dtype=float)) for one in polygons]
    size = float(np.ptp(shapely.get_coordinates(outlines), axis=0).max())
    edges = shapely.union_all([one.boundary for one in outlines], grid_size=1e-9 * size)
    model = _labelled(name, density=density, young=young, gravity=gravity)
    model.e0 = 1e-4 * size if e0 is None else e0
    for line in shapely.get_parts(edges):
        points = shapely.get_coordinates(line)
        for start, end in itertools.pairwise(points):
            model.add_line(start, end)
    faces = shapely.get_parts(shapely.polygonize([edges]))
    for face in faces:
        inside = face.representative_point()
        if not any(one.contains(inside) for one in outlines):
            model.add_hole((inside.x, inside.y))
    for i in sorted(fixed):
        middle = np.array(outlines[i].centroid.coords[0])
        for corner in np.asarray(polygons[i], dtype=float):
            place = corner + 0.02 * (middle - corner)  # not where other blocks have their corners
            if outlines[i].contains(shapely.Point(place)):
                model.add_fixed(place)
    model.add_joint_material(friction_angle=friction, cohesion=cohesion, name="joint")
    return model


def _labelled(name: str, *, density: float = STONE, young: float = YOUNG, gravity: float = GRAVITY) -> Model:
    """A labelled model without lines that settles in one static stage."""
    model = Model(name, labelled=True)
    model.add_block_material(density=density, youngs_modulus=young, poisson_ratio=0.2, name="rock")
    model.options = {"load": {"gravity": gravity}, "stage": [{"name": "weight", "until": "equilibrium"}]}
    return model


# -- walls, stacks and arches: outlines of blocks; the fixed ones come first


def courses(
    rows: Sequence[Sequence[float]], width: float, height: float, slab: float | None = None
) -> list[FloatArray]:
    """A wall on a fixed slab, its first polygon. Rows from below, widths of blocks in `width`, openings negative."""
    blocks = []
    for k, row in enumerate(rows):
        x = 0.0
        for share in row:
            if share > 0:
                blocks.append(rectangle(x, k * height, share * width, height))
            x += abs(share) * width
    across = sum(abs(share) for share in rows[0]) * width if slab is None else slab
    return [rectangle(0.0, -2 * height, across, 2 * height), *blocks]


#: Ferris and Tin-Loi's first wall: six courses, of which the lowest begins with a half
FIRST_WALL = [[0.5, 1, 1, 1, 1, 0.5], [1, 1, 1, 1, 1]] * 3
#: their third wall, eleven courses with an opening
PIERCED_WALL = [
    [1, 1, 1, 1], [0.5, 1, 1, 1, 0.5], [1, 1, 1, 1],
    [0.5, 1, -1, 1, 0.5], [1, 0.5, -1, 0.5, 1], [0.5, 1, -1, 1, 0.5], [1, 0.5, -1, 0.5, 1], [0.5, 1, -1, 1, 0.5],
    [1, 1, 1, 1], [0.5, 1, 1, 1, 0.5], [1, 1, 1, 1],
]  # fmt: skip
#: their second wall: the first one with ten courses
TALL_WALL = [[0.5, 1, 1, 1, 1, 0.5], [1, 1, 1, 1, 1]] * 5
#: their fourth wall, eleven courses with two openings side by side
TWO_OPENINGS = [
    [0.5, 1, 1, 1, 1, 0.5], [1, 1, 1, 1, 1], [0.5, 1, 1, 1, 1, 0.5],
    [1, -1, 1, -1, 1], [0.5, 0.5, -1, 0.5, 0.5, -1, 0.5, 0.5], [1, -1, 1, -1, 1],
    [0.5, 0.5, -1, 0.5, 0.5, -1, 0.5, 0.5], [1, -1, 1, -1, 1],
    [0.5, 1, 1, 1, 1, 0.5], [1, 1, 1, 1, 1], [0.5, 1, 1, 1, 1, 0.5],
]  # fmt: skip
#: their fifth wall, nineteen courses with two openings above each other
TOWER = [
    *[
        [0.5, 1, 1, 0.5], [1, 1, 1], [0.5, 1, 1, 0.5],
        [1, -1, 1], [0.5, 0.5, -1, 0.5, 0.5], [1, -1, 1], [0.5, 0.5, -1, 0.5, 0.5], [1, -1, 1],
    ] * 2,
    [0.5, 1, 1, 0.5], [1, 1, 1], [0.5, 1, 1, 0.5],
]  # fmt: skip
#: a slender pier of ten courses
BUTTRESS = [[1, 1], [0.5, 1, 0.5]] * 5
#: a low wall with a door under a lintel of one and a half blocks
DOORWAY = [
    [1, 1, -1, 1, 1], [0.5, 1, 0.5, -1, 0.5, 1, 0.5], [1, 1, -1, 1, 1], [0.5, 1, 0.5, -1, 0.5, 1, 0.5],
    [1, 0.75, 1.5, 0.75, 1], [0.5, 1, 1, 1, 1, 0.5],
]  # fmt: skip


def wall(name: str, rows: Sequence[Sequence[float]], *, tangent: float = 0.65, slab: float | None = None) -> Model:
    """A dry-stone wall of blocks of 0.4 × 0.175 m on a fixed slab (T4, T5)."""
    return assemble(name, courses(rows, 0.4, 0.175, slab), {0}, friction=math.degrees(math.atan(tangent)))


def stack(n: int, width: float = 1.0, height: float = 0.5, friction: float = 70.0) -> Model:
    """n blocks on one another on a fixed slab (T7)."""
    blocks = [rectangle(-1.5 * width, -height, 4 * width, height)]
    blocks += [rectangle(0.0, k * height, width, height) for k in range(n)]
    return assemble(f"stack_{n}", blocks, {0}, friction=friction)


def footing(
    dips: tuple[float, float], spacing: float, friction: float, *, width: float, depth: float, name: str = "footing"
) -> Model:
    """A rigid strip footing, 2 m wide, on rock with a through-going joint set 1 m apart and a staggered one.

    dips: angles of both sets, counter-clockwise from +x [deg]; spacing: of the staggered joints along the others
    [m]. The rock lies between fixed walls. The load on the footing is the `loading_point` named `column`, 1 kN/m down.
    """
    box = shapely.box(-width / 2, -depth, width / 2, 0.0)
    through, cross = (np.array([np.cos(a), np.sin(a)]) for a in np.radians(dips))
    normal = np.array([-through[1], through[0]])
    corner = np.array([0.013, 0.027])  # joints do not meet the corners of the footing
    reach = int(2 * np.hypot(width, depth) / min(spacing, 1.0))
    lines = [box.exterior]
    for i in range(-reach, reach + 1):
        start = corner + i * normal
        lines.append(shapely.LineString([start - 100 * through, start + 100 * through]))
        for j in range(-reach, reach + 1):
            foot = start + (j + 0.5 * (i % 2)) * spacing * through
            lines.append(shapely.LineString([foot, foot + cross / (cross @ normal)]))
    net = shapely.intersection(shapely.union_all(lines, grid_size=1e-9), box)
    rock = [np.array(face.exterior.coords)[:-1] for face in shapely.get_parts(shapely.polygonize([net]))]
    walls = [
        rectangle(-width / 2 - 1, -depth - 1, width + 2, 1),
        rectangle(-width / 2 - 1, -depth, 1, depth),
        rectangle(width / 2, -depth, 1, depth),
    ]
    model = assemble(name, [*walls, rectangle(-1, 0, 2, 0.5), *rock], {0, 1, 2}, friction=friction)
    model.options["loading_point"] = [{"name": "column", "at": [0.0, 0.5], "force": [0.0, -1000.0]}]
    return model


def arch_blocks(radius: float, thickness: float, span: float, n: int) -> list[FloatArray]:
    """n equal voussoirs with straight faces between two fixed springers, the first two polygons. span [deg]."""
    angles = np.radians(np.linspace(90 + span / 2, 90 - span / 2, n + 1))
    wide = (angles[0] - angles[-1]) / n  # of a springer
    angles = np.concatenate([[angles[0] + wide], angles, [angles[-1] - wide]])
    inner, outer = radius - thickness / 2, radius + thickness / 2

    def at(r: float, angle: float) -> tuple[float, float]:
        return r * math.cos(angle), r * math.sin(angle)

    blocks = [np.array([at(inner, a), at(inner, b), at(outer, b), at(outer, a)]) for a, b in itertools.pairwise(angles)]
    return [blocks[0], blocks[-1], *blocks[1:-1]]


def arch(n: int, *, radius: float = 10.0, thickness: float = 1.5, span: float = 157.5, friction: float = 75.0) -> Model:
    """A circular arch of n equal voussoirs (T6); with 75° no joint slides."""
    return assemble(f"arch_{n}", arch_blocks(radius, thickness, span, n), {0, 1}, friction=friction)


# -- slopes and a dam: one block on a fixed base


@dataclass(frozen=True)
class PlaneFailure:
    """A block above a plane that daylights at the toe, behind it a tension crack (Hoek & Bray 1981). SI units."""

    height: float = 60.0
    face: float = 50.0  # deg
    plane: float = 35.0  # deg
    behind: float = 15.336  # of the tension crack from the crest
    friction: float = 35.0  # deg
    cohesion: float = 0.10e6
    unit_weight: float = 26e3
    water: float = 0.0  # in the crack, as a share of its depth
    water_weight: float = 10e3

    @property
    def crack(self) -> float:
        """x of the tension crack; the toe is at 0."""
        return self.height / math.tan(math.radians(self.face)) + self.behind

    @property
    def foot(self) -> float:
        """y of the lower end of the crack."""
        return self.crack * math.tan(math.radians(self.plane))

    @property
    def depth(self) -> float:
        return self.height - self.foot

    @property
    def length(self) -> float:
        return self.crack / math.cos(math.radians(self.plane))

    @property
    def outline(self) -> FloatArray:
        """(4, 2) of the block: toe, foot and top of the crack, crest."""
        return np.array(
            [(0, 0), (self.crack, self.foot), (self.crack, self.height), (self.crack - self.behind, self.height)]
        )

    @property
    def weight(self) -> float:
        return self.unit_weight * shapely.Polygon(self.outline).area

    @property
    def uplift(self) -> float:
        """U: a triangle of pressure on the plane, zero at the toe."""
        return 0.5 * self.water_weight * self.water * self.depth * self.length

    @property
    def thrust(self) -> float:
        """V: a triangle of pressure on the crack."""
        return 0.5 * self.water_weight * (self.water * self.depth) ** 2

    @property
    def factor(self) -> float:
        """Hoek and Bray's factor of safety."""
        dip = math.radians(self.plane)
        normal = self.weight * math.cos(dip) - self.uplift - self.thrust * math.sin(dip)
        driving = self.weight * math.sin(dip) + self.thrust * math.cos(dip)
        return (self.cohesion * self.length + normal * math.tan(math.radians(self.friction))) / driving

    @property
    def place(self) -> float:
        """Where the effective normal force presses on the plane, as a share of its length from the toe.

        Between a third and two thirds a linear distribution of pressure has no tension: the whole plane is closed.
        """
        dip = math.radians(self.plane)
        middle = shapely.Polygon(self.outline).centroid
        wet = self.water * self.depth
        # moments about the toe, counter-clockwise: weight, V (pushes in -x), U (pushes off the plane)
        moment = -self.weight * middle.x + self.thrust * (self.foot + wet / 3) + self.uplift * self.length * 2 / 3
        normal = self.weight * math.cos(dip) - self.uplift - self.thrust * math.sin(dip)
        return -moment / normal / self.length

    def model(self, name: str = "plane_failure") -> Model:
        """The block on a fixed base; the crack carries no shear."""
        model = _labelled(name, density=self.unit_weight / 10.0, gravity=10.0)
        model.e0 = 1e-4 * self.height
        side = 0.4 * self.height
        # the plane daylights above the ground: on level ground at its foot the block would stand against it
        base = [
            (0, 0),
            (0, -0.5 * side),
            (-side, -0.5 * side),
            (-side, -side),
            (self.crack + side, -side),
            (self.crack + side, self.height),
        ]
        base.append((self.crack, self.height))
        crest = (self.crack - self.behind, self.height)
        model.add_joint_material(friction_angle=self.friction, cohesion=self.cohesion, name="plane")
        model.add_joint_material(friction_angle=0.0, name="crack")
        model.add_joint_material(friction_angle=self.friction, name="outline")
        for start, end in itertools.pairwise(base):
            model.add_line(start, end, joint="outline", boundary=True)
        for start, end in ((base[-1], crest), (crest, (0, 0))):
            model.add_line(start, end, joint="outline", boundary=True)
        model.add_line((0, 0), (self.crack, self.foot), joint="plane")
        model.add_line((self.crack, self.foot), base[-1], joint="crack")
        for point in [*base, (self.crack, self.foot)]:
            model.add_fixed(point)
        model.add_measured(crest)
        if self.water > 0:
            level = self.foot + self.water * self.depth
            model.options["water"] = [
                {
                    "name": "crack",
                    "table": [0.0, 0.0, self.crack, level],
                    "unit_weight": self.water_weight,
                    "joints": "plane, crack",
                    "surfaces": False,
                }
            ]
        return model


def random_plane_failures(n: int, seed: int = 1) -> list[PlaneFailure]:
    """Dry plane failures at random, with F between 1.1 and 2.5 and pressure on the whole plane."""
    draw = np.random.default_rng(seed)
    found: list[PlaneFailure] = []
    while len(found) < n:
        height = draw.uniform(20, 100)
        face = draw.uniform(45, 75)
        case = PlaneFailure(
            height=height,
            face=face,
            plane=draw.uniform(25, face - 10),
            behind=height * draw.uniform(0.05, 0.4),
            friction=draw.uniform(20, 45),
            cohesion=26e3 * height * draw.uniform(0.0, 0.15),
        )
        if case.depth > 0.05 * height and 1 / 3 < case.place < 2 / 3 and 1.1 < case.factor < 2.5:
            found.append(case)
    return found


@dataclass(frozen=True)
class Dam:
    """A gravity dam on a level or tilted joint in the foundation, with uplift. SI units, x = 0 at the heel."""

    height: float = 30.0
    crest: float = 5.0
    base: float = 24.0
    water: float = 28.0  # above the heel
    tail: float = 0.0  # water above the toe
    tilt: float = 0.0  # of the base, deg, up towards the toe
    friction: float = 45.0
    cohesion: float = 0.0
    closed: float = 1.0  # share of the base that is closed and carries cohesion
    unit_weight: float = 24e3
    water_weight: float = 9810.0

    @property
    def toe(self) -> tuple[float, float]:
        return self.base, self.base * math.tan(math.radians(self.tilt))

    @property
    def outline(self) -> FloatArray:
        return np.array([(0, 0), self.toe, (self.crest, self.height), (0, self.height)])

    @property
    def forces(self) -> tuple[float, float, float]:
        """Weight, thrust of the water, uplift (of a pressure that is linear along the base), each as a magnitude."""
        weight = self.unit_weight * shapely.Polygon(self.outline).area
        thrust = 0.5 * self.water_weight * self.water**2
        length = self.base / math.cos(math.radians(self.tilt))
        uplift = 0.5 * self.water_weight * (self.water + self.tail) * length
        return weight, thrust, uplift

    @property
    def factor(self) -> float:
        """Sliding factor of the base without tail water: (c L + N' tan φ) / T along it, on its closed length L."""
        if self.tail:
            raise InputError("the hand formula is for a dry toe")
        weight, thrust, uplift = self.forces
        dip = math.radians(self.tilt)
        length = self.closed * self.base / math.cos(dip)
        normal = weight * math.cos(dip) + thrust * math.sin(dip) - uplift
        driving = thrust * math.cos(dip) - weight * math.sin(dip)
        return (self.cohesion * length + normal * math.tan(math.radians(self.friction))) / driving

    @property
    def place(self) -> float:
        """Where the effective normal force presses on a level base, as a share of its width from the heel."""
        weight, thrust, uplift = self.forces
        arm = self.base * (self.water + 2 * self.tail) / (3 * (self.water + self.tail))  # of the uplift from the heel
        middle = shapely.Polygon(self.outline).centroid
        return (weight * middle.x + thrust * self.water / 3 - uplift * arm) / (weight - uplift) / self.base

    def model(self, name: str = "dam", *, layer: float = 4.0, spacing: float = 6.0) -> Model:
        """The dam on a layer of foundation blocks, which lie on fixed rock and between fixed abutments.

        Water stands in the joints under a table that falls in a straight line from the heel to the toe.
        """
        model = _labelled(name, density=self.unit_weight / GRAVITY)
        model.e0 = 1e-4 * self.height
        front, back = -2 * spacing, spacing * (2 + math.ceil(self.base / spacing))
        ground, deep = -layer, -2.0 * layer
        model.add_joint_material(friction_angle=self.friction, cohesion=self.cohesion, name="base")
        model.add_joint_material(friction_angle=60.0, name="rock joint")
        model.add_joint_material(friction_angle=60.0, name="outline")
        surface = [(front, 0.0), (0.0, 0.0), self.toe]
        low = min(0.0, self.toe[1]) - 0.25 * layer  # the ground behind the toe, which the base must not run into
        surface += [(self.base, low), (back, low)]
        model.add_line((self.base, ground), (self.base, low), joint="rock joint")
        outside = [(front - layer, 0.0), (front - layer, deep), (back + layer, deep), (back + layer, low), (back, low)]
        outside += [(back, ground), (front, ground), (front, 0.0)]
        for start, end in zip(outside, [*outside[1:], outside[0]], strict=True):
            model.add_line(start, end, joint="rock joint")
        for start, end in itertools.pairwise(surface):
            model.add_line(start, end, joint="base" if (start, end) == ((0.0, 0.0), self.toe) else "outline")
        for start, end in ((self.toe, (self.crest, self.height)), ((self.crest, self.height), (0.0, self.height))):
            model.add_line(start, end, joint="outline")
        model.add_line((0.0, self.height), (0.0, 0.0), joint="outline")
        for x in np.arange(front + spacing, back - 0.5 * spacing, spacing):
            if abs(x - self.base) < 0.1 * spacing:
                continue  # there is the step behind the toe
            top = x * math.tan(math.radians(self.tilt)) if 0 < x < self.base else low if x > self.base else 0.0
            model.add_line((x, ground), (x, top), joint="rock joint")
        for point in ((front - layer, 0.0), (front - layer, deep), (back + layer, deep), (back + layer, low)):
            model.add_fixed(point)
        model.add_fixed((front, ground))
        model.add_fixed((back, ground))
        model.add_measured((0.0, self.height))
        # The reservoir stands in front of the dam wherever it moves to: its table is level into the dam, whose base and
        # joints have a table of their own. One table that falls from the heel on would lower the thrust of a dam that
        # slides, until it stops.
        far = front - layer
        inside = 0.6 * self.crest
        model.options["water"] = [
            {
                "name": "reservoir",
                "table": [far, self.water, inside, self.water, inside + 1e-3, deep],
                "unit_weight": self.water_weight,
                "joints": "none",
            },
            {
                "name": "uplift",
                "table": [far, self.water, 0.0, self.water, self.base, self.toe[1] + self.tail],
                "unit_weight": self.water_weight,
                "joints": "base, rock joint",
                "surfaces": False,
            },
        ]
        return model
