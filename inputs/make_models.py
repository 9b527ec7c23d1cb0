#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Write the files of the models in this folder: coordinates, materials, loads.

    python3 inputs/make_models.py             write all models
    python3 inputs/make_models.py NAME ...    write some
    python3 inputs/make_models.py --check     compare with the files that are there, write nothing

Units: m, kg, s, N, per metre of thickness. Standard library only.
"""

from __future__ import annotations

import itertools
import math
import sys
from pathlib import Path

from legacy_text import Model, Rock, Segment, along_slope, clip, length, number, part, rectangle

FOLDER = Path(__file__).resolve().parent
DENSITY = 2500.0
G = 9.81

# many blocks that all begin to bear at once need more than six rounds to agree on who touches whom
MORE_ROUNDS = "&time\n   max_open_close = 40\n/\n"


def centre(points):
    """Mean of the corners."""
    return (sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points))


def incline() -> Model:
    """Two blocks on a slope of 30 degrees: one slides, one stays."""
    at = along_slope(30.0)
    model = Model(
        "incline",
        "two blocks on an incline of 30 degrees: friction 20 degrees slides, 35 degrees holds (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=200,
        dt=0.005,
        displacement_ratio=0.02,
        rocks=[Rock(youngs_modulus=1e9)],
        joints=[(20, 0, 0), (35, 0, 0)],
    )
    foot, change, top = at(0, 0), at(5, 0), at(10, 0)
    model.add_boundary([top, (top[0], 0), foot], closed=False)
    model.add_lines([foot, change], joint=1)
    model.add_lines([change, top], joint=2)
    for start, joint in ((2.0, 1), (6.5, 2)):
        block = [at(start, 0), at(start + 2, 0), at(start + 2, 1), at(start, 1)]
        model.add_lines([block[1], block[2], block[3], block[0]], joint=joint)
        model.measured.append(centre(block))
    model.fixed = [foot, (top[0], 0), top]
    return model


def stack() -> Model:
    """A column of five blocks on a base, static."""
    model = Model(
        "stack",
        "column of five blocks under its own weight, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=60,
        dt=0.01,
        displacement_ratio=0.01,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(35, 0, 0)],
        stiffness=1e10,
    )
    model.add_boundary(rectangle(-1.5, -1, 2.5, 0))
    for i in range(5):
        model.add_lines([(1, i), (1, i + 1), (0, i + 1), (0, i)])
        model.measured.append((0.5, i + 0.5))
    model.fixed = [(-1.5, -1), (2.5, -1), (-1.5, 0), (2.5, 0)]
    return model


def free_fall() -> Model:
    """A block thrown over fixed ground."""
    model = Model(
        "free_fall",
        "a block thrown up and sideways, without contact (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=60,
        dt=0.02,
        displacement_ratio=0.1,
        rocks=[Rock(), Rock(velocity=(4, 6, 0))],
        joints=[(30, 0, 0)],
    )
    model.add_boundary(rectangle(-1, -1, 8, 0))
    model.add_lines(rectangle(0, 1, 1, 2), closed=True)
    model.material_lines = [((0.2, 1.5, 0.8, 1.5), 2)]
    model.fixed = [(-1, -1), (8, -1), (-1, 0), (8, 0)]
    model.measured = [(0.5, 1.5)]
    return model


def toppling_column() -> Model:
    """A slender and a squat block on a slope of 20 degrees."""
    at = along_slope(20.0)
    model = Model(
        "toppling_column",
        "on a slope of 20 degrees a slender block (1 x 4) topples, a squat one (2 x 2) stays (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=1000,
        dt=0.001,
        displacement_ratio=0.02,
        rocks=[Rock()],
        joints=[(40, 0, 0)],
        stiffness=5e10,
    )
    foot, top = at(0, 0), at(12, 0)
    model.add_boundary([top, (top[0], 0), foot], closed=False)
    model.add_lines([foot, top])
    for start, width, height in ((5.0, 1.0, 4.0), (8.0, 2.0, 2.0)):
        block = [at(start, 0), at(start + width, 0), at(start + width, height), at(start, height)]
        model.add_lines([block[1], block[2], block[3], block[0]])
        model.measured.append(centre(block))
    model.fixed = [foot, (top[0], 0), top]
    return model


def flat_arch() -> Model:
    """Seven voussoirs between two abutments."""
    model = Model(
        "flat_arch",
        "flat arch of seven voussoirs between abutments, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=100,
        dt=0.01,
        displacement_ratio=0.01,
        rocks=[Rock()],
        joints=[(35, 0, 0)],
        stiffness=1e10,
    )
    below = [-2.1 + 0.6 * k for k in range(8)]
    above = [x * 4.6 / 3.6 for x in below]  # joints meet 3.6 m under the arch
    model.add_boundary([(below[0], 0), (below[0], -1.5), (-5, -1.5), (-5, 1), (above[0], 1)], closed=False)
    model.add_boundary([(above[7], 1), (5, 1), (5, -1.5), (below[7], -1.5), (below[7], 0)], closed=False)
    model.add_boundary([(below[0], 0), (below[7], 0)], closed=False)
    model.add_boundary([(above[0], 1), (above[7], 1)], closed=False)
    for low, high in zip(below, above, strict=True):
        model.add_lines([(low, 0), (high, 1)])
    model.fixed = [(-5, -1.5), (below[0], -1.5), (-5, 1), (5, -1.5), (below[7], -1.5), (5, 1)]
    model.measured = [(0, 0.5)]
    return model


def six_block_beam() -> Model:
    """Six blocks that carry themselves as a three-hinged arch between abutments."""
    model = Model(
        "six_block_beam",
        "beam of six blocks between abutments: it stands as a three-hinged arch, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=100,
        dt=0.02,
        displacement_ratio=0.01,
        rocks=[Rock()],
        joints=[(40, 0, 0)],
        stiffness=1e10,
    )
    model.add_boundary([(-3, 0), (-3, -1), (-5, -1), (-5, 2), (-3, 2), (-3, 1)], closed=False)
    model.add_boundary([(3, 1), (3, 2), (5, 2), (5, -1), (3, -1), (3, 0)], closed=False)
    model.add_boundary([(-3, 0), (3, 0)], closed=False)
    model.add_boundary([(-3, 1), (3, 1)], closed=False)
    for x in range(-3, 4):
        model.add_lines([(x, 0), (x, 1)])
    model.fixed = [(-5, -1), (-3, -1), (-3, 2), (-5, 2), (5, -1), (3, -1), (3, 2), (5, 2)]
    model.measured = [(-0.5, 0.5), (0.5, 0.5)]
    return model


def layered_roof() -> Model:
    """Eight layers of half-metre blocks over an opening of 10 m."""
    model = Model(
        "layered_roof",
        "roof of eight layers in bond, 10 m span, under horizontal stress, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=80,
        dt=0.02,
        displacement_ratio=0.01,
        rocks=[Rock(stress=(-4e5, 0, 0)), Rock()],
        joints=[(40, 0, 0), (30, 0, 0)],
        stiffness=1e10,
        options=MORE_ROUNDS,
    )
    for side in (-1, 1):
        model.add_boundary(
            [(5 * side, 0), (5 * side, -1), (7 * side, -1), (7 * side, 4.5), (5 * side, 4.5), (5 * side, 4)],
            closed=False,
        )
        model.add_lines([(5 * side, 0), (5 * side, 4)])
        model.material_lines.append(((5.5 * side, 1, 6.5 * side, 1), 2))
        model.fixed += [(5 * side, -1), (7 * side, -1), (7 * side, 4.5), (5 * side, 4.5)]
    model.add_boundary([(-5, 0), (5, 0)], closed=False)
    model.add_boundary([(-5, 4), (5, 4)], closed=False)
    for layer in range(8):
        low, high = 0.5 * layer, 0.5 * layer + 0.5
        if layer:
            model.add_lines([(-5, low), (5, low)], joint=2)
        shift = 0.25 * (layer % 2)
        for k in range(0 if layer % 2 else 1, 20):
            model.add_lines([(-5 + 0.5 * k + shift, low), (-5 + 0.5 * k + shift, high)])
    model.measured = [(0.1, 0.1), (0.1, 3.9)]
    return model


def jointed_slope() -> Model:
    """A jointed rock mass on a weak plane that daylights in the slope face."""
    dip, face, height = 30.0, 60.0, 12.0
    toe = (0.0, 0.0)
    crest = (height / math.tan(math.radians(face)), height)
    back = (height / math.tan(math.radians(dip)), height)
    at = along_slope(dip)
    model = Model(
        "jointed_slope",
        "jointed slope that slides on a weak plane of 30 degrees with 20 degrees of friction (m, kg, s, N)",
        edge_node_distance=0.01,
        k01=1,
        steps=200,
        dt=0.005,
        displacement_ratio=0.01,
        rocks=[Rock()],
        joints=[(40, 0, 0), (20, 0, 0)],
        stiffness=1e9,
        options="&run\n   t_end = 1\n/\n" + MORE_ROUNDS,
    )
    wall = (-3 / math.tan(math.radians(face)), -3.0)
    model.add_boundary([toe, wall, (-7, -3), (-7, -5), (26, -5), (26, height), back, crest, toe], closed=False)
    model.add_lines([toe, back], joint=2)
    mass = [toe, back, crest]
    thickness = (crest[1] * math.cos(math.radians(dip))) - crest[0] * math.sin(math.radians(dip))
    rows, spacing = 10, 1.0
    row_height = thickness / rows
    for j in range(rows):
        low, high = j * row_height, (j + 1) * row_height
        if j:
            bedding = (*at(-5, low), *at(40, low))
            model.add_lines(points_of(part(bedding, *clip(bedding, mass))))
        for i in range(60):
            s = (i + 0.5 * (j % 2)) * spacing
            cross = (*at(s, low), *at(s, high))
            inside = clip(cross, mass)
            # a joint that leaves through face or ground would cut off a sliver: only whole ones
            if inside and length(part(cross, *inside)) > 0.999 * row_height and clear_of_ends(s, low, high, mass, at):
                model.add_lines(points_of(cross))
    model.fixed = [(-7, -5), (26, -5), (26, height), (9, -5), (-7, -3)]
    model.measured = [at(6.3, 0.4), at(10.0, 3.5), at(14.0, 0.4)]
    return model


def points_of(segment):
    """The two ends of a segment."""
    return [segment[0:2], segment[2:4]]


def clear_of_ends(s, low, high, mass, at) -> bool:
    """Is a cross joint at least 0.35 m away from where its row leaves the mass?"""
    for n in (low + 1e-6, high - 1e-6):
        line = (*at(s - 0.35, n), *at(s + 0.35, n))
        inside = clip(line, mass)
        if inside is None or inside[1] - inside[0] < 0.999:
            return False
    return True


def bolted_beam() -> Model:
    """Six blocks held together by one tendon, on two knife edges."""
    model = Model(
        "bolted_beam",
        "beam of six blocks with a prestressed bolt through it, on two knife edges, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=100,
        dt=0.01,
        displacement_ratio=0.01,
        rocks=[Rock()],
        joints=[(40, 0, 0), (0, 0, 0)],
        stiffness=1e10,
    )
    model.add_boundary([(-3, 0), (2, 0)], joint=1, closed=False)
    model.add_boundary([(2, 0), (3, 0)], joint=2, closed=False)
    model.add_boundary([(-3, 1), (3, 1)], closed=False)
    for x in range(-3, 4):
        model.add_lines([(x, 0), (x, 1)])
    for x, joint in ((-2.8, 1), (2.8, 2)):
        model.add_lines([(x - 0.4, -1), (x + 0.4, -1), (x, 0)], joint=joint, closed=True)
        model.fixed += [(x - 0.4, -1), (x + 0.4, -1), (x, -0.05)]
    model.bolts = [(-2.5, 0.3, 2.5, 0.3, 1e7, 2e5, 0)]
    model.measured = [(-2.5, 0.3), (2.5, 0.3), (-0.5, 0.5), (0.5, 0.5)]
    return model


def pushed_block() -> Model:
    """A block on level ground, pushed by a force that grows and then stays."""
    model = Model(
        "pushed_block",
        "block on level ground pushed by a force that grows to 40 kN in 1 s and stays (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=1500,
        dt=0.001,
        displacement_ratio=0.01,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(30, 0, 0)],
        stiffness=1e10,
        sor_factor=1.5,
    )
    model.add_boundary(rectangle(-1, -1, 6, 0))
    model.add_lines([(2, 0), (2, 1), (0, 1), (0, 0)])
    model.fixed = [(-1, -1), (6, -1), (6, 0), (-1, 0)]
    model.loading = [(0, 0.5)]
    model.loading_tables = {0: [(0, 0, 0), (1, 40e3, 0), (10, 40e3, 0)]}
    model.measured = [(1, 0.5)]
    return model


def shaking_block() -> Model:
    """A block on a base that is shaken by one rectangular pulse."""
    model = Model(
        "shaking_block",
        "block on level ground, base accelerated by one pulse of 6 m/s2 for 0.4 s (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=500,
        dt=0.002,
        displacement_ratio=0.01,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(20, 0, 0)],
        stiffness=1e10,
        options="&load\n   base_acceleration = 'pulse.csv'\n/\n",
        tables={"pulse.csv": "t,ax,ay\n0,0,0\n0.1,0,0\n0.1001,6,0\n0.5,6,0\n0.5001,0,0\n2,0,0\n"},
    )
    model.add_boundary(rectangle(-3, -1, 4, 0))
    model.add_lines([(2, 0), (2, 1), (0, 1), (0, 0)])
    model.fixed = [(-3, -1), (4, -1), (4, 0), (-3, 0)]
    model.measured = [(1, 0.5)]
    return model


def gravity_dam() -> Model:
    """A dam of three lifts under water pressure."""
    depth, water = 6.0, 9810.0
    model = Model(
        "gravity_dam",
        "gravity dam of three lifts on rock, 6 m of water on its upright face, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=100,
        dt=0.01,
        displacement_ratio=0.01,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(45, 0, 0)],
        stiffness=1e10,
    )
    slope = (5.0 - 1.5) / depth  # from 5 m at the base to 1.5 m at the crest
    back = [5.0 - slope * y for y in (0, 2, 4, 6)]
    model.add_boundary(rectangle(-4, -2, 9, 0))
    model.add_boundary([(back[0], 0), (back[3], 6), (0, 6), (0, 0)], closed=False)
    for i in (1, 2):
        model.add_lines([(0, 2.0 * i), (back[i], 2.0 * i)])
    model.fixed = [(-4, -2), (9, -2), (9, 0), (-4, 0)]
    model.measured = [(0.75, 5.9)]
    options = []
    for i in range(3):
        low, high = 2.0 * i, 2.0 * i + 2
        options += [
            "&line_load",
            f"   ends = 0, {low:g}, 0, {high:g}",
            f"   force_start = {water * (depth - low):g}, 0",
            f"   force_end = {water * (depth - high):g}, 0",
            "/",
        ]
    model.options = "\n".join(options) + "\n"
    return model


def released_block() -> Model:
    """A block held on an incline by a prop that is taken away."""
    at = along_slope(35.0)
    model = Model(
        "released_block",
        "block on a smooth incline of 35 degrees, held until 0.2 s by a fixed point, then released (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=1,
        steps=400,
        dt=0.0025,
        displacement_ratio=0.02,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(10, 0, 0)],
        stiffness=1e10,
        options="&run\n   t_end = 1.0\n/\n&stage\n   until_time = 0.2\n   k01 = 0\n   release = 4\n/\n",
    )
    foot, top = at(0, 0), at(10, 0)
    model.add_boundary([top, (top[0], 0), foot], closed=False)
    model.add_lines([foot, top])
    block = [at(6, 0), at(8, 0), at(8, 1), at(6, 1)]
    model.add_lines([block[1], block[2], block[3], block[0]])
    model.fixed = [foot, (top[0], 0), top, centre(block)]
    model.measured = [centre(block)]
    return model


def tunnel_in_rock(name: str, title: str, joints: list[Segment], options: str) -> Model:
    """A horseshoe tunnel, 5 m wide, in rock with given joints, held by a fixed frame, under its in-situ stress."""
    top, weight = 12.0, DENSITY * G
    model = Model(
        name,
        title,
        edge_node_distance=0.005,
        k01=0,
        steps=40,
        dt=0.02,
        displacement_ratio=0.01,
        rocks=[
            Rock(stress=(-0.5 * weight * top, -weight * top, 0), stress_gradient=(0.5 * weight, weight, 0)),
            Rock(),
        ],
        joints=[(40, 0, 0)],
        stiffness=1e10,
        options=options,
    )
    box = rectangle(-10, -6, 10, top)
    model.add_boundary([(-10, top), (-11, top), (-11, -7), (11, -7), (11, top), (10, top), (10, -6), (-10, -6)])
    model.add_boundary([(-10, top), (10, top)], closed=False)
    model.material_lines = [((-9, -6.5, 9, -6.5), 2)]
    opening = [(2.5, 2.0)] + [
        (2.5 * math.cos(math.radians(a)), 2.0 + 2.5 * math.sin(math.radians(a))) for a in range(20, 180, 20)
    ]
    opening += [(-2.5, 2.0), (-2.5, 0.0), (2.5, 0.0)]
    model.add_boundary(opening)
    for segment in joints:
        inside = clip(segment, box)
        if inside is None:
            continue
        line = part(segment, *inside)
        cut = clip(line, opening)
        pieces = [line] if cut is None else [part(line, 0, cut[0]), part(line, cut[1], 1)]
        for piece in pieces:
            if length(piece) > 0.5:
                model.add_lines(points_of(piece))
    model.holes = [(0.0, 1.0)]
    model.fixed = [(x, -7) for x in (-11, 0, 11)] + [(x, y) for x in (-11, 11) for y in (2.5, top)]
    model.measured = [(0.0, 4.6)]
    return model


def tunnel() -> Model:
    """A horseshoe tunnel in bedded rock with cross joints, held by a fixed frame."""
    at = along_slope(10.0, origin=(0.0, 3.0))
    layer, spacing = 1.7, 2.3
    joints = []
    for j in range(-9, 9):
        low, high = (j + 0.4) * layer, (j + 1.4) * layer
        joints.append((*at(-40, low), *at(40, low)))
        for i in range(-9, 10):
            s = (i + 0.5 * (j % 2)) * spacing
            joints.append((*at(s, low), *at(s, high)))
    title = "horseshoe tunnel, 5 m wide, in bedded rock with cross joints, static (m, kg, s, N)"
    return tunnel_in_rock("tunnel", title, joints, MORE_ROUNDS)


def crossed_joints() -> Model:
    """The same tunnel where both joint sets are continuous: four blocks meet at every crossing."""
    at = along_slope(10.0, origin=(0.0, 3.0))
    layer, spacing = 1.7, 2.3
    joints = [(*at(-40, (j + 0.4) * layer), *at(40, (j + 0.4) * layer)) for j in range(-9, 9)]
    joints += [(*at((i + 0.25) * spacing, -40), *at((i + 0.25) * spacing, 40)) for i in range(-9, 10)]
    title = "horseshoe tunnel, 5 m wide, in rock with two continuous joint sets, static (m, kg, s, N)"
    return tunnel_in_rock("crossed_joints", title, joints, "")


def island() -> Model:
    """A block inside a block."""
    model = Model(
        "island",
        "a square block inside a block: cut as an island, resting in its hole, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=60,
        dt=0.01,
        displacement_ratio=0.01,
        rocks=[Rock(), Rock(density=3000)],
        joints=[(35, 0, 0)],
        stiffness=1e10,
    )
    model.add_boundary(rectangle(-3, -3, 3, 3))
    model.add_lines(rectangle(-1, -1, 1, 1), closed=True)
    model.material_lines = [((-0.5, 0, 0.5, 0), 2)]
    model.fixed = [(-3, -3), (3, -3)]
    model.measured = [(0, 0)]
    return model


def cantilever() -> Model:
    """A beam of tied cells that bends under its own weight, held by a wall."""
    model = Model(
        "cantilever",
        "cantilever of tied cells under its own weight, static (m, kg, s, N)",
        edge_node_distance=0.001,
        k01=0,
        steps=3,
        dt=1,
        displacement_ratio=0.01,
        rocks=[Rock(youngs_modulus=1e10)],
        joints=[(35, 0, 0)],
        options=(
            "&contact\n   formulation = 'length'\n/\n"
            "&joint_material\n   number = 2\n   name = 'intact rock'\n   friction = 35\n   tie = .true.\n/\n"
            "&region\n   name = 'beam'\n   box = 0, 0, 5, 1\n/\n"
            "&subdivide\n   region = 'beam'\n   size = 0.25\n   joint_material = 'intact rock'\n/\n"
        ),
    )
    model.add_boundary([(0, 1), (-1, 1), (-1, 0), (0, 0)], closed=False)
    model.add_boundary([(0, 0), (5, 0), (5, 1), (0, 1)], closed=False)
    model.add_lines([(0, 0), (0, 1)], joint=2)
    model.fixed = [(-1, 0), (-1, 1), (0, 0), (0, 1)]
    model.measured = [(5, 0.5)]
    return model


def bedding_slab() -> Model:
    """A slab of limestone on a clay seam, in one labelled file."""
    at = along_slope(30.0)
    title = "slab of limestone that slides on a clay seam of 30 degrees (m, kg, s, N)"
    model = Model.without_analysis_file(
        "bedding_slab",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'bedding_slab.dc', title = 'Slab on a clay seam' /\n"
            "&block_material  number = 1, name = 'limestone', density = 2600, young = 20e9, poisson = 0.25 /\n"
            "&block_material  number = 2, name = 'marl', density = 2400, young = 5e9, poisson = 0.3 /\n"
            "&joint_material  number = 1, name = 'cross joint', friction = 40 /\n"
            "&joint_material  number = 2, name = 'clay seam', friction = 22 /\n"
            "&load            gravity = 9.81 /\n"
            "&run             t_end = 1 /\n"
        ),
    )
    foot, top = at(0, 0), at(20, 0)
    model.add_boundary([top, (top[0], 0), foot], closed=False)
    model.add_lines([foot, top], joint=2)
    model.add_lines([at(15, 1.5), at(6, 1.5)])
    for s in (6, 9, 12, 15):
        model.add_lines([at(s, 0), at(s, 1.5)])
    model.material_lines.append(((12.0, 2.0, 14.0, 3.0), 2))
    model.fixed = [foot, (top[0], 0), top]
    model.measured = [at(7.5, 0.75), at(13.5, 0.75)]
    return model


def arch_on_centring() -> Model:
    """A masonry arch of 15 voussoirs, put on a centring that is then taken away, in one labelled file."""
    title = "masonry arch on a centring that is removed (m, kg, s, N)"
    held = [polar(3.9, 15 + 10 * k) for k in range(16)]
    along = ", ".join(f"{x:.10g},{y:.10g}" for x, y in held)
    model = Model.without_analysis_file(
        "arch_on_centring",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'arch_on_centring.dc', title = 'Arch on a centring' /\n"
            "&block_material  number = 1, name = 'abutment', density = 2500, young = 20e9, poisson = 0.2 /\n"
            "&block_material  number = 2, name = 'voussoir', density = 2400, young = 10e9, poisson = 0.2 /\n"
            "&block_material  number = 3, name = 'timber', density = 600, young = 10e9, poisson = 0.2 /\n"
            "&joint_material  number = 1, name = 'bed', friction = 35,\n"
            "                 normal_stiffness = 20e9, shear_stiffness = 8e9 /\n"
            "&load            gravity = 9.81 /\n"
            "&boundary        along = -7,0, -4.3466663,0, kind = 'fixed' /\n"
            "&boundary        along = 4.3466663,0, 7,0, kind = 'fixed' /\n"
            f"&boundary        along = {along}, kind = 'fixed' /\n"
            "&region          name = 'arch', material = 'voussoir' /\n"
            "&region          name = 'centring', material = 'timber' /\n"
            "&stage           name = 'centring', until = 'equilibrium' /\n"
            "&stage           name = 'arch', until = 'equilibrium', place = 'arch', reset_displacement = .true. /\n"
            "&stage           name = 'striking', until = 'equilibrium', excavate = 'centring',\n"
            "                 reset_displacement = .true. /\n"
        ),
    )
    intrados = [polar(4.5, 15 + 10 * k) for k in range(16)]
    extrados = [polar(5.5, 15 + 10 * k) for k in range(16)]
    right, left = intrados[0], intrados[-1]
    foot = [(right[0], 0.0), (7.0, 0.0), (7.0, extrados[0][1])]
    mirrored = [(-x, y) for x, y in reversed(foot)]
    model.add_boundary([*reversed(held), right, *foot, *extrados, *mirrored, left])
    model.add_lines(intrados)
    for k in range(16):
        model.add_lines([held[k], intrados[k], extrados[k]])
    for k in range(15):
        model.material_lines.append(((*polar(4.6, 19 + 10 * k), *polar(5.4, 21 + 10 * k)), 2))
        model.material_lines.append(((*polar(4.0, 19 + 10 * k), *polar(4.4, 21 + 10 * k)), 3))
    model.measured = [polar(5.0, 90)]
    return model


def arch_bridge() -> Model:
    """A masonry arch under its fill, with the axle of a lorry on it; a template moves the axle along."""
    span, rise, thickness, cover, n = 10.0, 2.5, 0.6, 0.4, 29
    masonry, fill = 22e3, 18e3
    inner = (span**2 / 4 + rise**2) / (2 * rise)
    outer, road = inner + thickness, inner + thickness + cover
    half = math.degrees(math.asin(span / 2 / inner))
    angles = [90 - half + 2 * half * k / n for k in range(n + 1)]
    intrados, extrados = ([polar(radius, a) for a in angles] for radius in (inner, outer))
    loads = []
    for (x, y), (u, v) in itertools.pairwise(extrados):
        share = fill * abs(u - x) / math.hypot(u - x, v - y)
        loads.append(
            f"&line_load       ends = {number(x)},{number(y)}, {number(u)},{number(v)},\n"
            f"                 force_start = 0,{number(-share * (road - y))},\n"
            f"                 force_end = 0,{number(-share * (road - v))} /\n"
        )

    def labelled(x: str, y: str) -> str:
        return (
            f"! {title}\n"
            "&model           geometry = 'arch_bridge.dc', title = 'Arch bridge' /\n"
            f"&block_material  number = 1, name = 'masonry', density = {number(masonry / 9.81)},\n"
            "                 young = 15e9, poisson = 0.2 /\n"
            "&joint_material  number = 1, name = 'mortar', friction = 35 /\n"
            "&load            gravity = 9.81 /\n"
            "! weight of the fill on the back of each voussoir\n"
            f"{''.join(loads)}"
            "! 1 kN of an axle, per metre of width, just below the back of the arch\n"
            f"&loading_point   name = 'axle', at = {x}, {y}, force = 0,-1000 /\n"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
        )

    title = "masonry arch under its fill and an axle (m, kg, s, N)"
    at = -2.5
    text = labelled(number(at), number(math.sqrt((outer - 0.01) ** 2 - at**2)))
    model = Model.without_analysis_file("arch_bridge", title, labelled=text)
    right = intrados[0]
    foot = [(right[0], right[1] - 1.0), (extrados[0][0] + 1.5, right[1] - 1.0), (extrados[0][0] + 1.5, extrados[0][1])]
    mirrored = [(-x, y) for x, y in reversed(foot)]
    model.add_boundary([*reversed(intrados), *foot, *extrados, *mirrored])
    for low, high in zip(intrados, extrados, strict=True):
        model.add_lines([low, high])
    model.fixed = [*foot, *mirrored]
    model.measured = [polar(inner, 90), polar(inner, 90 + half / 2)]
    model.tables = {
        "template/arch_bridge.dc": model.geometry_text(),
        "template/arch_bridge.nml": labelled("{{x}}", f"{{{{sqrt({number(outer - 0.01)}**2 - x**2)}}}}"),
    }
    return model


def polar(radius: float, degrees: float) -> tuple[float, float]:
    """A point of a circle around the origin."""
    return radius * math.cos(math.radians(degrees)), radius * math.sin(math.radians(degrees))


SLOPE, FACE, PLANE, BEHIND = 60.0, math.radians(50), math.radians(35), 15.336


def plane_slope(name: str, title: str) -> Model:
    """The lines of a slope above a plane with a tension crack, without labelled files."""
    crest = SLOPE / math.tan(FACE)
    crack = crest + BEHIND
    foot = crack * math.tan(PLANE)  # y of the crack's lower end
    model = Model.without_analysis_file(name, title)
    # the plane daylights above the ground: on level ground at its foot the block could not slide
    model.add_boundary(
        [(0, 0), (0, -12), (-20, -12), (-20, -20), (crack + 20, -20), (crack + 20, SLOPE), (crack, SLOPE)], 3, False
    )
    model.add_boundary([(crack, SLOPE), (crest, SLOPE), (0, 0)], 3, False)
    model.add_lines([(0, 0), (crack, foot)], joint=1)
    model.add_lines([(crack, foot), (crack, SLOPE)], joint=2)
    model.fixed = [
        (-20, -20),
        (crack + 20, -20),
        (crack + 20, SLOPE),
        (-20, -12),
        (0, 0),
        (crack, foot),
        (crack, SLOPE),
    ]
    model.measured = [(crest, SLOPE)]
    return model


def plane_slope_text(model: Model, short: str, state: str, share: float, more: str = "") -> str:
    """A labelled file of such a slope, whose crack is filled with water to a share of its depth."""
    crack = SLOPE / math.tan(FACE) + BEHIND
    foot = crack * math.tan(PLANE)
    water = (
        f"&water           name = 'crack {state}', table = 0, 0, {number(crack)}, "
        f"{number(foot + share * (SLOPE - foot))},\n"
        "                 unit_weight = 10e3, joints = 'plane, crack', surfaces = .false. /\n"
    )
    return (
        f"! {model.title}\n"
        f"&model           geometry = '{model.name}.dc', title = '{short}' /\n"
        "&block_material  number = 1, name = 'granite', density = 2600, young = 20e9, poisson = 0.25 /\n"
        "&joint_material  number = 1, name = 'plane', friction = 35, cohesion = 100e3 /\n"
        "&joint_material  number = 2, name = 'crack', friction = 0 /\n"
        "&joint_material  number = 3, name = 'outline', friction = 35 /\n"
        "&load            gravity = 10 /\n"
        "&contact         formulation = 'length' /\n"
        "&time            k01 = 0 /\n"
        "&run             steps = 300 /\n" + (water if share > 0 else "") + more
    )


def sau_mau_ping() -> Model:
    """A slope above a plane with a tension crack, dry, half full of water and full: one labelled file each."""
    title = "Sau Mau Ping: slope of 60 m above a plane of 35 degrees with a tension crack (m, kg, s, N)"
    model = plane_slope("sau_mau_ping", title)
    for name, share in (("dry", 0.0), ("half_full", 0.5), ("full", 1.0)):
        state = name.replace("_", " ")
        model.labelled_files[f"{name}.nml"] = plane_slope_text(model, f"Sau Mau Ping, crack {state}", state, share)
    return model


def bolted_slope() -> Model:
    """Sau Mau Ping with ten rows of anchors or of grouted bars that carry 2 MN in every metre."""
    title = "Sau Mau Ping with ten rows of bolts, 2 MN in every metre of the slope (m, kg, s, N)"
    model = plane_slope("bolted_slope", title)
    along = 55.0  # of 78 m of the face
    place = (
        f"along = 0,0, {number(along * math.cos(FACE))},{number(along * math.sin(FACE))},\n"
        "                 spacing = 5.5, length = 32, angle = 40, spacing_out_of_plane = 4,"
    )
    bolts = {
        "anchors": (
            f"&bolt            name = 'anchor', kind = 'end_anchored', {place}\n"
            "                 area = 560e-6, young = 195e9, pretension = 640e3, yield_force = 800e3 /\n"
        ),
        "bars": (
            f"&bolt            name = 'bar', kind = 'grouted', {place}\n"
            "                 diameter = 0.05, young = 200e9, yield_force = 800e3, plate_strength = 1e6,\n"
            "                 grout_stiffness = 1e9, grout_strength = 500e3, element = 1 /\n"
        ),
    }
    for kind, group in bolts.items():
        for name, share in (("dry", 0.0), ("full", 1.0)):
            short = f"Sau Mau Ping with {kind}, crack {name}"
            model.labelled_files[f"{kind}_{name}.nml"] = plane_slope_text(model, short, name, share, group)
    return model


def rocking_wall() -> Model:
    """A free-standing wall that rocks under one pulse of the ground, in one labelled file."""
    title = "free-standing wall, 1 m x 4 m, that rocks under a half sine of 5 m/s2 in 0.5 s (m, kg, s, N)"
    model = Model.without_analysis_file(
        "rocking_wall",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'rocking_wall.dc', title = 'Rocking wall' /\n"
            "&block_material  number = 1, name = 'stone', density = 2500, young = 20e9, poisson = 0.2 /\n"
            "&joint_material  number = 1, name = 'bed', friction = 45, normal_stiffness = 1e11,\n"
            "                 shear_stiffness = 1e11, damping_ratio = 0.1 /\n"
            "&load            gravity = 9.81 /\n"
            "&time            dt_max = 0.001, integrator = 'generalized_alpha' /\n"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
            "&stage           name = 'pulse', kind = 'dynamic', duration = 1, reset_displacement = .true. /\n"
            "! the ground moves to the left, the wall turns to the right\n"
            "&quake           record = 'pulse.csv', scale = -1 /\n"
        ),
    )
    model.add_boundary(rectangle(-2, -1, 3, 0))
    model.add_lines([(1, 0), (1, 4), (0, 4), (0, 0)])
    model.fixed = [(-2, -1), (3, -1), (-2, 0), (3, 0)]
    model.measured = [(0.5, 2)]
    pulse = ["t,a"] + [f"{number(0.5 * i / 100)},{number(5 * math.sin(math.pi * i / 100))}" for i in range(101)]
    model.tables["pulse.csv"] = "\n".join(pulse) + "\n"
    return model


def shaken_slope() -> Model:
    """A slab on a bedding plane of 20 degrees under a synthetic earthquake, in one labelled file."""
    at = along_slope(20.0)
    title = "slab on a bedding plane of 20 degrees under a synthetic record (m, kg, s, N)"
    model = Model.without_analysis_file(
        "shaken_slope",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'shaken_slope.dc', title = 'Slope under an earthquake' /\n"
            "&block_material  number = 1, name = 'rock', density = 2500, young = 20e9, poisson = 0.2 /\n"
            "&joint_material  number = 1, name = 'cross joint', friction = 40, normal_stiffness = 1e11,\n"
            "                 shear_stiffness = 1e11, damping_ratio = 0.1 /\n"
            "&joint_material  number = 2, name = 'bedding', friction = 30, normal_stiffness = 1e11,\n"
            "                 shear_stiffness = 1e11, damping_ratio = 0.1 /\n"
            "&load            gravity = 9.81 /\n"
            "&time            dt_max = 0.005, integrator = 'generalized_alpha' /\n"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
            "&stage           name = 'shaking', kind = 'dynamic', duration = 8.5, reset_displacement = .true. /\n"
            "&quake           record = 'record.csv' /\n"
        ),
    )
    foot, top = at(0, 0), at(20, 0)
    model.add_boundary([top, (top[0], 0), foot], closed=False)
    model.add_lines([foot, top], joint=2)
    model.add_lines([at(15, 1.5), at(6, 1.5)])
    for s in (6, 9, 12, 15):
        model.add_lines([at(s, 0), at(s, 1.5)])
    model.fixed = [foot, (top[0], 0), top]
    model.measured = [at(7.5, 0.75), at(13.5, 0.75)]
    model.tables["record.csv"] = synthetic_record(8.0, 0.02, 4.0)
    return model


def shaken_hillside() -> Model:
    """A hillside of tied cells on a viscous base between free fields, and a slab on its face, under a record."""
    title = "hillside on a viscous base between free fields, a slab on its face, under a record (m, kg, s, N)"
    model = Model(
        "shaken_hillside",
        title,
        edge_node_distance=0.01,
        k01=1,
        steps=0,
        dt=0,
        displacement_ratio=0,
        rocks=[],
        joints=[],
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'shaken_hillside.dc', title = 'Hillside under an earthquake' /\n"
            "&block_material  number = 1, name = 'ground', density = 2000, young = 1e9, poisson = 0.25 /\n"
            "&joint_material  number = 1, name = 'cell', tie = .true. /\n"
            "&joint_material  number = 2, name = 'bedding', friction = 38, normal_stiffness = 1e10,\n"
            "                 shear_stiffness = 1e10, damping_ratio = 0.1 /\n"
            "&region          name = 'hill', polygon = 0,0, 140,0, 140,20, 90,20, 65,35, 0,35 /\n"
            "&subdivide       region = 'hill', size = 5, joint_material = 'cell' /\n"
            "&load            gravity = 9.81 /\n"
            "&boundary        along = 0,0, 140,0, kind = 'viscous' /\n"
            "&boundary        along = 0,0, 0,35, kind = 'free_field' /\n"
            "&boundary        along = 140,0, 140,20, kind = 'free_field' /\n"
            "&time            dt_max = 0.005, integrator = 'generalized_alpha', rho_infinity = 0.5 /\n"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
            "&stage           name = 'quake', kind = 'dynamic', duration = 7, reset_displacement = .true. /\n"
            "! the wave that comes up; ground that is level moves by twice as much\n"
            "&quake           record = 'record.csv', apply = 'viscous_base' /\n"
        ),
    )
    toe, crest = (90.0, 20.0), (65.0, 35.0)
    model.add_boundary([(0, 35), (0, 0), (140, 0), (140, 20), toe], closed=False)
    model.add_boundary([crest, (0, 35)], closed=False)
    model.add_lines([toe, crest], joint=2)
    run = math.hypot(toe[0] - crest[0], crest[1] - toe[1])
    c, s = (toe[0] - crest[0]) / run, (crest[1] - toe[1]) / run

    def on_face(along: float, above: float) -> tuple[float, float]:
        """Up the face from the toe, and above it."""
        return toe[0] - along * c + above * s, toe[1] + along * s + above * c

    model.add_lines([on_face(8, 0), on_face(8, 2), on_face(20, 2), on_face(20, 0)], joint=2)
    model.add_lines([on_face(14, 0), on_face(14, 2)], joint=2)
    model.measured = [(2.5, 34.9), (137.5, 19.9), on_face(11, 1), on_face(17, 1), on_face(14, -0.5)]
    model.tables["record.csv"] = record_at_rest(6.0, 0.02, 2.0)
    return model


def record_at_rest(duration: float, step: float, peak: float) -> str:
    """Rows t, a [s, m/s2] by a formula: second differences of a displacement of cosines of 0.5 to 5 Hz.

    It is zero at both ends, so that the ground ends at rest where it began.
    """
    count, lines = round(duration / step), 40

    def displacement(t: float) -> float:
        total = 0.0
        for k in range(lines):
            omega = 2 * math.pi * (0.5 + 4.5 * k / (lines - 1))
            total += math.cos(omega * t + 2 * math.pi * (k * k * (math.sqrt(5) - 1) / 2 % 1)) / omega**2
        return math.sin(math.pi * t / duration) ** 4 * total if 0 < t < duration else 0.0

    u = [displacement((i - 1) * step) for i in range(count + 3)]
    values = [u[i] - 2 * u[i + 1] + u[i + 2] for i in range(count + 1)]
    largest = max(abs(a) for a in values)
    rows = [f"{number(round(i * step, 6))},{number(round(peak * a / largest, 6))}" for i, a in enumerate(values)]
    return "\n".join(["t,a", *rows]) + "\n"


def synthetic_record(duration: float, step: float, peak: float) -> str:
    """Rows t, a [s, m/s2] like those of an earthquake, by a formula: cosines of 0.3 to 8 Hz, strongest at 2.5 Hz."""
    count, lines = round(duration / step), 60
    values = []
    for i in range(count + 1):
        t = i * step
        swell = math.sin(math.pi * t / duration) ** 2
        total = 0.0
        for k in range(lines):
            frequency = 0.3 + 7.7 * k / (lines - 1)
            phase = 2 * math.pi * (k * k * (math.sqrt(5) - 1) / 2 % 1)
            total += math.cos(2 * math.pi * frequency * t + phase) / (1 + (frequency / 2.5 - 1) ** 2)
        values.append(swell * total)
    largest = max(abs(a) for a in values)
    # rounded, so that the file is the same on every machine
    rows = [f"{number(round(i * step, 6))},{number(round(peak * a / largest, 6))}" for i, a in enumerate(values)]
    return "\n".join(["t,a", *rows]) + "\n"


def dam_on_joints() -> Model:
    """A gravity dam on a jointed foundation, with uplift in the joints, in one labelled file."""
    height, crest, base, water = 30.0, 5.0, 24.0, 28.0
    layer, spacing = 4.0, 6.0
    front, back, low, deep = -2 * spacing, base + 2 * spacing, -1.0, -8.0
    far, end = front - layer, back + layer
    title = "gravity dam on a jointed foundation with uplift (m, kg, s, N)"
    model = Model.without_analysis_file(
        "dam_on_joints",
        title,
        edge_node_distance=0.003,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'dam_on_joints.dc', title = 'Gravity dam with uplift' /\n"
            "&block_material  number = 1, name = 'concrete', unit_weight = 24e3, density = 2446.5,\n"
            "                 young = 20e9, poisson = 0.2 /\n"
            "&joint_material  number = 1, name = 'base', friction = 45 /\n"
            "&joint_material  number = 2, name = 'rock joint', friction = 60 /\n"
            "&joint_material  number = 3, name = 'outline', friction = 60 /\n"
            "&load            gravity = 9.81 /\n"
            "! the reservoir: its table is level into the dam, which so has the same water wherever it slides to\n"
            f"&water           name = 'reservoir', table = {far:g},{water:g}, 3,{water:g}, 3.001,{deep:g},\n"
            "                 unit_weight = 9810, joints = 'none' /\n"
            "! uplift: from the reservoir at the heel to nothing at the toe\n"
            f"&water           name = 'uplift', table = {far:g},{water:g}, 0,{water:g}, {base:g},0,\n"
            "                 unit_weight = 9810, joints = 'base, rock joint', surfaces = .false. /\n"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
        ),
    )
    model.add_boundary([(far, 0), (far, deep), (end, deep), (end, low), (back, low)], 2, False)
    model.add_boundary([(base, 0), (base, low), (back, low)], 3, False)
    model.add_boundary([(far, 0), (0, 0)], 3, False)
    model.add_boundary([(base, 0), (crest, height), (0, height), (0, 0)], 3, False)
    model.add_lines([(0, 0), (base, 0)], joint=1)
    model.add_lines([(front, 0), (front, -layer), (back, -layer), (back, low)], joint=2)
    for k in range(round((back - front) / spacing) - 1):
        x = front + (k + 1) * spacing
        model.add_lines([(x, -layer), (x, 0 if x < base else low)], joint=2)
    model.fixed = [(far, 0), (far, deep), (end, deep), (end, low), (front, -layer), (back, -layer)]
    model.measured = [(0, height)]
    return model


def dowelled_roof() -> Model:
    """A roof of two layers over 6 m that dowels tie to one another, in one labelled file."""
    title = "roof of two layers over an opening of 6 m with six dowels (m, kg, s, N)"
    dowels = "".join(
        f"&bolt            name = 'dowel {k + 1}', kind = 'end_anchored',\n"
        f"                 from = {number(x)}, 0, to = {number(x)}, 0.5,\n"
        "                 diameter = 0.025, young = 200e9, yield_force = 250e3,\n"
        "                 shear_stiffness = 'auto', bedding_stiffness = 5e9, shear_strength = 'auto' /\n"
        for k, x in enumerate((0.51, 1.51, 2.51, 3.51, 4.51, 5.49))
    )
    model = Model.without_analysis_file(
        "dowelled_roof",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'dowelled_roof.dc', title = 'Dowelled roof' /\n"
            "&block_material  number = 1, name = 'sandstone', density = 2500, young = 10e9, poisson = 0 /\n"
            "&joint_material  number = 1, name = 'bedding', friction = 0,\n"
            "                 normal_stiffness = 1e11, shear_stiffness = 1e10 /\n"
            "&joint_material  number = 2, name = 'intact', friction = 30, tie = .true.,\n"
            "                 normal_stiffness = 1e13, shear_stiffness = 1e13 /\n"
            "&load            gravity = 10 /\n"
            "&subdivide       size = 0.125, joint_material = 'intact' /\n"
            f"{dowels}"
            "&stage           until = 'equilibrium' /\n"
        ),
    )
    for y in (0.0, 0.25):
        model.add_boundary(rectangle(0, y, 6, y + 0.25))
        model.fixed += [(x, y + 0.125) for x in (0, 6)]
    model.measured = [(3, 0.1)]
    return model


def hung_block() -> Model:
    """A block of 100 kN on three bolts, of which the middle one breaks when the weight grows by a quarter."""
    title = "block of 100 kN on three bolts, of which the middle one breaks (m, kg, s, N)"
    bolts = "".join(
        f"&bolt            name = '{name}', kind = 'end_anchored', from = {x}, 0, to = {x}, 4,\n"
        f"                 diameter = 0.02, young = 200e9, yield_force = {strength}, rupture_strain = {rupture} /\n"
        for name, x, strength, rupture in (
            ("left", -1, "100e3", 0.05),
            ("rusted", 0, "40e3", 1e-5),
            ("right", 1, "100e3", 0.05),
        )
    )
    model = Model.without_analysis_file(
        "hung_block",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'hung_block.dc', title = 'Block on three bolts' /\n"
            "&block_material  number = 1, name = 'rock', density = 2500, young = 20e9, poisson = 0.25 /\n"
            "&joint_material  number = 1, name = 'joint', friction = 30 /\n"
            "&load            gravity = 10 /\n"
            "&boundary        along = -2,4, 2,4, kind = 'fixed' /\n"
            f"{bolts}"
            "&stage           name = 'weight', until = 'equilibrium' /\n"
            "&stage           name = 'a quarter more', until = 'equilibrium', gravity = 1.25 /\n"
        ),
    )
    model.add_boundary(rectangle(-2, 3, 2, 4))
    model.add_boundary(rectangle(-1.05, 0, 1.45, 1.6))
    model.measured = [(0.2, 0.8)]
    return model


def falling_wedge() -> Model:
    """A wedge that a burst throws out of a roof, stopped by two yielding bolts, in one labelled file."""
    title = "wedge of a roof thrown down at 3 m/s on two yielding bolts (m, kg, s, N)"
    bolts = "".join(
        f"&bolt            name = '{name}', kind = 'yielding', from = {x}, 0, to = {x}, 3,\n"
        "                 diameter = 0.02, young = 200e9, plateau_force = 100e3, stroke = 0.3 /\n"
        for name, x in (("left", -0.5), ("right", 0.5))
    )
    model = Model.without_analysis_file(
        "falling_wedge",
        title,
        labelled=(
            f"! {title}\n"
            "&model           geometry = 'falling_wedge.dc', title = 'Wedge on yielding bolts' /\n"
            "&block_material  number = 1, name = 'rock', density = 2700, young = 50e9, poisson = 0.25 /\n"
            "&block_material  number = 2, name = 'wedge', density = 2700, young = 50e9, poisson = 0.25,\n"
            "                 velocity = 0, -3, 0 /\n"
            "&joint_material  number = 1, name = 'joint', friction = 30 /\n"
            "&load            gravity = 9.81 /\n"
            "&boundary        along = -4,4, 4,4, kind = 'fixed' /\n"
            f"{bolts}"
            "&time            dt_max = 1e-3 /\n"
            "&stage           kind = 'dynamic', until_time = 0.3 /\n"
            "&run             save_every = 5 /\n"
        ),
    )
    model.add_boundary([(-1, 0), (-4, 0), (-4, 4), (4, 4), (4, 0), (1, 0)], closed=False)
    model.add_boundary([(-1, 0), (1, 0)], closed=False)
    model.add_lines([(-1, 0), (0, 1.5), (1, 0)])
    model.material_lines = [((-0.2, 0.5, 0.2, 0.5), 2)]
    model.measured = [(0, 0.5)]
    return model


MODELS = [
    incline,
    stack,
    free_fall,
    toppling_column,
    flat_arch,
    six_block_beam,
    layered_roof,
    jointed_slope,
    bolted_beam,
    pushed_block,
    shaking_block,
    rocking_wall,
    shaken_slope,
    shaken_hillside,
    gravity_dam,
    released_block,
    tunnel,
    crossed_joints,
    island,
    cantilever,
    bedding_slab,
    arch_on_centring,
    arch_bridge,
    dam_on_joints,
    dowelled_roof,
    hung_block,
    falling_wedge,
]

# folders with several labelled files, each of which is a model
SETS = [sau_mau_ping, bolted_slope]


def main(arguments: list[str]) -> int:
    """Write or compare."""
    check = "--check" in arguments
    names = [a for a in arguments if not a.startswith("-")]
    known = {make.__name__: make for make in MODELS + SETS}
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"unknown model: {', '.join(unknown)}; known: {', '.join(known)}", file=sys.stderr)
        return 2
    differs = []
    for name in names or known:
        model = known[name]()
        if not check:
            model.write(FOLDER)
            continue
        for file, text in model.files().items():
            path = FOLDER / name / file
            if not path.is_file() or path.read_text(encoding="utf-8") != text:
                differs.append(f"{name}/{file}")
    for file in differs:
        print(f"{file} is not what make_models.py writes", file=sys.stderr)
    return 1 if differs else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
