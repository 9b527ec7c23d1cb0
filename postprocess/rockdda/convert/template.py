# SPDX-License-Identifier: MIT
"""A labelled file to begin with, for a geometry that comes from a drawing or map."""

from __future__ import annotations

from ..namelist import short_real
from .geometry import Geometry

TEMPLATE_JOINT_STIFFNESS = 2.0e9  # Pa/m, of a rough, somewhat weathered joint
Segment = tuple[float, float, float, float]
Support = tuple[str, str]  # kind, and the places it lies along


#: Typical numbers of a bolt of 25 mm, by kind.
STEEL = {
    "grouted": "diameter = 0.025, young = 200e9, yield_force = 245e3, grout_stiffness = 1e9, grout_strength = 200e3",
    "end_anchored": "diameter = 0.025, young = 200e9, yield_force = 245e3, pretension = 50e3",
    "yielding": "diameter = 0.025, young = 200e9, plateau_force = 150e3, stroke = 0.2",
    "friction": "area = 250e-6, young = 200e9, grout_stiffness = 1e8, grout_strength = 40e3",
}


#: Typical numbers of sprayed concrete of some days.
SHOTCRETE = (
    "thickness = 0.15, young = 10e9, poisson = 0.2, density = 2400, compressive_strength = 25e6, tensile_strength = 2e6"
)


def template_text(geometry: Geometry, name: str, ending: str, title: str) -> str:
    """The labelled file NAME.nml of the geometry NAME + ending, with comments and typical values of rock."""
    blocks = max([material for _, material in geometry.material_lines] + [m for m, _, _ in geometry.blocks], default=1)
    joints = max([material for _, material in geometry.lines] + [j for _, j, _ in geometry.blocks], default=1)
    supports = supports_of(geometry)
    rows = [
        f"! A model to begin with, {title}. Units: m, kg, s, N. The values are typical of rock: change them to yours.",
        "!",
        f"!   rockdda check {name}.nml       what the model holds, and everything that seems wrong",
        f"!   rockdda run {name}.nml         the results: {name}.h5",
        f"!   rockdda-post view {name}.h5    the results in a browser",
        "!",
        "! `rockdda help` names all groups, `rockdda help stage` what one of them takes.",
        f"&model           geometry = {_quoted(name + ending)}, title = {_quoted(name)}, units = 'SI' /",
        "",
        "! Materials, by number in the geometry file; density [kg/m3], young [N/m2]",
        *(
            f"&block_material  number = {k}, name = 'rock {k}', density = 2500, young = 5e9, poisson = 0.25 /"
            for k in range(1, max(blocks, 1) + 1)
        ),
        "! friction [degrees], stiffness of the joints [N/m3]; further: cohesion, tension [N/m2]",
        *(
            f"&joint_material  number = {k}, name = 'joint {k}', friction = 35, "
            f"normal_stiffness = {TEMPLATE_JOINT_STIFFNESS:g}, shear_stiffness = {TEMPLATE_JOINT_STIFFNESS / 2.5:g} /"
            for k in range(1, max(joints, 1) + 1)
        ),
        "",
        "! Gravity [m/s2] acts in -y",
        "&load            gravity = 9.81 /",
        "",
    ]
    if geometry.steel:
        rows += [
            "! Bolts: steel of 25 mm [m, N/m2, N], grout [N/m2, N/m]; forces are those of one bolt",
            *(
                f"&bolt            name = 'bolt {k}', kind = '{kind}', from = {x1:.10g},{y1:.10g}, "
                f"to = {x2:.10g},{y2:.10g},\n                 {STEEL[kind]}, spacing_out_of_plane = 1 /"
                for k, ((x1, y1, x2, y2), kind) in enumerate(geometry.steel, 1)
            ),
            "",
        ]
    if geometry.liners:
        rows += [
            "! Linings: young shotcrete [m, N/m2, kg/m3]; a stage places them with install = 'lining 1'",
            *(
                f"&liner           name = 'lining {k}', along = {_places(*line)},\n                 {SHOTCRETE} /"
                for k, line in enumerate(geometry.liners, 1)
            ),
            "",
        ]
    if geometry.loading:
        rows += [
            "! Forces on the loading points of the geometry: t, fx, fy, ... [s, N]",
            "! &loading_point   points = 1, force = 0,0,0, 1,0,-1e5 /",
            "",
        ]
    if geometry.fixed:
        rows += ["! The fixed points of the geometry hold the model."]
    elif supports:
        rows += [
            "! What holds the model: the base is fixed" + ", upright sides slide up and down" * (len(supports) > 1)
        ]
        rows += [f"&boundary        along = {places}, kind = '{kind}' /" for kind, places in supports]
    else:
        rows += [
            "! Nothing holds the model yet: name fixed points in the drawing, or edges here",
            "! &boundary        along = x1,y1, x2,y2, kind = 'fixed' /",
        ]
    rows += ["", "! Stages, in their order"]
    if geometry.fixed or supports:
        rows += [
            "! This one ends when all forces are in balance, or with a warning where there is no balance",
            "&stage           name = 'weight', until = 'equilibrium', on_failure = 'continue' /",
        ]
    else:
        rows += ["&stage           name = 'fall', kind = 'dynamic', duration = 0.1 /"]
    return "\n".join(rows) + "\n"


def supports_of(geometry: Geometry) -> list[Support]:
    """Boundaries along the level base and the upright sides of the outermost lines; none where points are fixed.

    The sides of blocks that are not cut, as of a wall, are free: nothing is beside them."""
    if geometry.fixed:
        return []
    edges: list[Segment] = [segment for segment, _ in geometry.lines]
    for _, _, rings in geometry.blocks:
        edges += [(*a, *b) for ring in rings for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)]
    (left, right), (low, _) = geometry.ranges
    near = geometry.e0
    base = [x for x1, y1, x2, y2 in edges if max(y1, y2) <= low + near and abs(x2 - x1) > near for x in (x1, x2)]
    if not base:
        return []
    found = [("fixed", _places((min(base), low), (max(base), low)))]
    for x in () if geometry.blocks else (left, right):
        side = [
            y
            for x1, y1, x2, y2 in edges
            if max(abs(x1 - x), abs(x2 - x)) <= near and abs(y2 - y1) > near
            for y in (y1, y2)
        ]
        if side:
            found.append(("roller", _places((x, min(side)), (x, max(side)))))
    return found


def _places(*points: tuple[float, float]) -> str:
    return ", ".join(f"{short_real(x)},{short_real(y)}" for x, y in points)


def _quoted(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"
