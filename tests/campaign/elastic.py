# SPDX-License-Identifier: MIT
"""Tied cells: beams, plates, rings and columns against beam theory, finite elements and Lamé."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from .bench import Bench, Model, box, compare, joint, require, rock
from .drawing import Kind, Values, between, decades, values

TIED = joint(1, 30, ", tie=.true.")


def _column(length: float, thick: float, along: int, across: int) -> Model:
    """A vertical beam of cells on a held foot, its load at the middle of the top."""
    dx, dy = thick / across, length / along
    model = Model(e0=1e-4 * min(dx, dy))
    model.blocks = [box(-thick, -thick, 3 * thick, thick)]
    model.blocks += [box(i * dx, j * dy, dx, dy) for j in range(along) for i in range(across)]
    model.held = {0}
    top = 1 + (along - 1) * across + across // 2
    model.loading = [(thick / 2, length, top)]
    model.measured = [(thick / 2, length, top)]
    return model


def _bend(drawn: Values, bench: Bench, across: int, low: float, high: float) -> None:
    """A tip load on a cantilever: Bernoulli and the shear of a strip."""
    thick, young, poisson = drawn["thick"], 1e9, drawn["poisson"]
    length = thick * drawn["slender"]
    along = max(4, round(across * drawn["slender"] / drawn["shape"]))
    model = _column(length, thick, along, across)
    plane = young / (1 - poisson**2)
    force = 1e-4 * plane * thick**3 / length**2
    model.groups = [
        rock(young=young, poisson=poisson, more=", unit_weight=0.0"),
        TIED,
        f"&loading_point force=0,{force!r},0, 1e9,{force!r},0 /",
        f"&contact stiffness={2 * young!r} /",
        "&stage name='w', until='equilibrium', tolerance=1e-8, max_steps=20000 /",
    ]
    run = bench.run(model)
    found = float(run.get("history/measured_displacement")[-1][0][0])
    shear = young / (2 * (1 + poisson)) * 5 / 6
    truth = force * length**3 / (3 * plane * thick**3 / 12) + force * length / (shear * thick)
    compare(f"deflection of {along} x {across} cells", found, truth, low, high)


def thin_beam(drawn: Values, bench: Bench) -> None:
    _bend(drawn, bench, 1, 0.1, 0.1)


def thick_beam(drawn: Values, bench: Bench) -> None:
    # 5 % with 20 x 4 cells, from which on it converges from below
    _bend(drawn, bench, drawn["across"], 0.08, 0.05)


def plate(drawn: Values, bench: Bench) -> None:
    """A plate on a held foot under pressure and shear on its top: finite elements of the second order."""
    from skfem import (
        Basis,
        BilinearForm,
        ElementQuad2,
        ElementVector,
        FacetBasis,
        LinearForm,
        MeshQuad,
        condense,
        solve,
    )
    from skfem.helpers import ddot, sym_grad, trace

    wide, high, cells = drawn["wide"], 1.0, drawn["cells"]
    young, poisson = 1e9, drawn["poisson"]
    size = high / cells
    wide = size * max(1, round(wide / size))
    traction = (drawn["shear"] * 1e5, -1e5)
    lam, mu = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    mesh = MeshQuad.init_tensor(np.linspace(0, wide, 17), np.linspace(0, high, 17))
    element = ElementVector(ElementQuad2())
    basis = Basis(mesh, element)
    stiffness = BilinearForm(
        lambda u, v, _: lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * mu * ddot(sym_grad(u), sym_grad(v))
    ).assemble(basis)
    top = FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: np.isclose(x[1], high)))
    load = LinearForm(lambda v, _: traction[0] * v[0] + traction[1] * v[1]).assemble(top)
    foot = basis.get_dofs(lambda x: np.isclose(x[1], 0.0))
    solution = solve(*condense(stiffness, load, D=foot))
    nodal = solution[basis.nodal_dofs]
    truth = nodal[:, np.isclose(mesh.p[1], high)].mean(1)

    # tied to a held floor: cells with a held edge cannot bend
    model = Model(blocks=[box(-wide, -high, 3 * wide, high), box(0, 0, wide, high)], held={0}, e0=1e-4 * size)
    model.groups = [
        rock(young=young, poisson=poisson, more=", unit_weight=0.0"),
        TIED,
        f"&region name='plate', box=0,0,{wide!r},{high!r} /",
        f"&subdivide region='plate', size={size!r}, kind='rectangles', joint_material=1 /",
        f"&boundary along=0,{high!r}, {wide!r},{high!r}, kind='traction', traction={traction[0]!r},{traction[1]!r} /",
        "&stage name='w', until='equilibrium', tolerance=1e-8, max_steps=20000 /",
    ]
    run = bench.run(model)
    first, last = np.concatenate(run.outlines(0)), np.concatenate(run.outlines(-1))
    found = (last - first)[np.isclose(first[:, 1], high)].mean(0)
    scale = float(np.hypot(*truth))
    apart = float(np.hypot(*(found - truth))) / scale
    # first-order cells of a fourth of the height: some per cent too stiff
    require(apart <= 0.10, f"the top moves by {found}, finite elements say {truth}")


def ring(drawn: Values, bench: Bench) -> None:
    """A thick ring under inner pressure (a quarter of it): the displacement of its wall by Lamé, plane strain."""
    inner, outer = 1.0, drawn["outer"]
    around, through = drawn["around"], drawn["through"]
    young, poisson, pressure = 1e9, drawn["poisson"], 1e6
    radii = inner * (outer / inner) ** (np.arange(through + 1) / through)
    angles = np.linspace(0, math.pi / 2, around + 1)

    def at(r: float, a: float) -> list[float]:
        return [round(r * math.cos(a), 12), round(r * math.sin(a), 12)]

    model = Model(e0=1e-5)
    model.blocks = [
        np.array(
            [
                at(radii[j], angles[i]),
                at(radii[j + 1], angles[i]),
                at(radii[j + 1], angles[i + 1]),
                at(radii[j], angles[i + 1]),
            ]
        )
        for i in range(around)
        for j in range(through)
    ]
    wall = ", ".join(f"{x!r},{y!r}" for x, y in (at(inner, a) for a in angles))
    model.groups = [
        rock(young=young, poisson=poisson, more=", unit_weight=0.0"),
        TIED,
        f"&boundary kind='roller', along={inner},0,{outer!r},0 /",
        f"&boundary kind='roller', along=0,{inner},0,{outer!r} /",
        f"&boundary kind='traction', pressure={pressure!r}, along={wall} /",
        "&stage name='w', until='equilibrium', tolerance=1e-8 /",
    ]
    run = bench.run(model)
    first, last = np.concatenate(run.outlines(0)), np.concatenate(run.outlines(-1))
    on_wall = np.isclose(np.hypot(*first.T), inner, atol=1e-6)
    found = float(((last - first)[on_wall] * first[on_wall]).sum(1).mean() / inner)
    truth = (
        pressure * (1 + poisson) * inner / (young * (outer**2 - inner**2)) * ((1 - 2 * poisson) * inner**2 + outer**2)
    )
    # chords for arcs; cells of constant strain, four through the ring
    compare("displacement of the wall [m]", found, truth, 0.09)


def buckling_load(drawn: Values, bench: Bench) -> None:
    """A column under a share of its buckling load and a small side load: H/P (tan(k L)/k - L), k^2 = P/(E I)."""
    thick, young = drawn["thick"], 1e9
    length = thick * drawn["slender"]
    across, along = 2, drawn["along"]
    bending = young * thick**3 / 12
    load = drawn["share"] * math.pi**2 * bending / (4 * length**2)
    side = drawn["side"] * load
    tops = range((along - 1) * across + 1, along * across + 1)

    def deflection(down: float, name: str, more: str = "") -> float:
        model = _column(length, thick, along, across)
        model.loading = [((k + 0.5) * thick / across, length, block) for k, block in enumerate(tops)]
        force = f"{side / across!r},{-down / across!r}"
        model.groups = [
            rock(young=young, poisson=0.0, more=", unit_weight=0.0"),
            TIED,
            f"&loading_point force=0,{force}, 1e9,{force} /",
            f"&contact stiffness={2 * young!r} /",
            f"&stage name='w', until='equilibrium', max_steps=20000{more} /",
        ]
        return float(bench.run(model, name=name).get("history/measured_displacement")[-1][0][0])

    # cells of constant strain bend by a stiffness of their own, which the side load alone shows
    stiffness = side * length**3 / 3 / deflection(0.0, "side", ", tolerance=1e-9")
    k = math.sqrt(load / stiffness)
    truth = side / load * (math.tan(k * length) / k - length)
    # cells are straight: in second order they bend between themselves only
    compare("deflection at equilibrium [m]", deflection(load, "both"), truth, 0.02)


def oscillator(drawn: Values, bench: Bench) -> None:
    """A stiff block that is let go on its joint: its period, and twice the static settlement."""
    stiffness, mass, weight = drawn["stiffness"], 2500.0, 24525.0
    period = 2 * math.pi * math.sqrt(mass / stiffness)
    model = Model(blocks=[box(-1, -1, 3, 1), box(0, 0, 1, 1)], held={0})
    model.measured = [(0.5, 0.5, 1)]
    model.groups = [
        rock(young=1e4 * stiffness, poisson=0.0, more=f", unit_weight={weight!r}"),
        joint(1, 30, normal_stiffness=stiffness, shear_stiffness=stiffness),
        f"&time dt_max={period / drawn['steps']!r} /",
        f"&run t_end={4.7 * period!r}, save_every=1 /",
    ]
    run = bench.run(model)
    time, up = run.get("history/time"), run.get("history/measured_displacement")[:, 0, 1] + weight / stiffness
    cross = [
        time[k] + (time[k + 1] - time[k]) * -up[k] / (up[k + 1] - up[k])
        for k in range(len(up) - 1)
        if up[k] < 0 <= up[k + 1]
    ]
    require(len(cross) == 4 or len(cross) == 5, f"it swings {len(cross)} times in 4.7 periods")
    # second order in the step; supports are 400 times as stiff as the joint
    compare("period [s]", (cross[3] - cross[0]) / 3, period, 0.01 + (2 * math.pi / drawn["steps"]) ** 2 / 6)
    compare("largest settlement [m]", weight / stiffness - float(up.min()), 2 * weight / stiffness, 0.05)


def wave(drawn: Values, bench: Bench) -> None:
    """A push on the end of a row of blocks: speed of the wave and of the blocks behind its front."""
    count, young, density = 24, 1e9, 2500.0
    stiffness = drawn["joints"] * young
    # long waves: the block and its joint are springs in series
    speed = math.sqrt(1 / (1 / young + 1 / stiffness) / density)
    rise, pressure = 12 / speed, drawn["strain"] * young
    model = Model(blocks=[box(k, 0, 1, 1) for k in range(count)])
    model.loading = [(0.0, 0.5, 0)]
    model.measured = [(k + 0.5, 0.5, k) for k in (4, 12)]
    duration = (16 + 12) / speed
    # half a cosine in pieces: no step, no kink
    times = np.linspace(0, rise, 21)
    table = ", ".join(f"{t:.6g},{pressure / 2 * (1 - math.cos(math.pi * t / rise)):.6g},0" for t in times)
    model.groups = [
        rock(young=young, poisson=0.0, density=density, more=", unit_weight=0.0"),
        joint(1, 30, normal_stiffness=stiffness, shear_stiffness=stiffness / 2),
        f"&loading_point force={table}, 1e9,{pressure!r},0 /",
        f"&time dt_max={0.05 / speed!r} /",
        f"&run t_end={duration!r}, save_every=1 /",
    ]
    run = bench.run(model)
    time, moved = run.get("history/time"), run.get("history/measured_displacement")[:, :, 0]
    velocity = np.gradient(moved, time, axis=0)
    plateau = pressure / (density * speed)
    arrival = [
        float(np.interp(plateau / 2, velocity[: int(np.argmax(v)) + 1, k], time[: int(np.argmax(v)) + 1]))
        for k, v in enumerate(velocity.T)
    ]
    compare("speed of the wave [m/s]", 8 / (arrival[1] - arrival[0]), speed, 0.03)
    compare("speed of the blocks behind the front [m/s]", float(velocity[-1, 0]), plateau, 0.05)


KINDS = [
    Kind(
        "thin-beam",
        "elastic",
        "beam theory of a cantilever one cell thick",
        values(
            thick=between(0.5, 2, 6), slender=between(5, 20, 15), shape=between(0.5, 2, 6), poisson=between(0, 0.3, 3)
        ),
        thin_beam,
    ),
    Kind(
        "thick-beam",
        "elastic",
        "beam theory of a cantilever four or five cells thick",
        values(
            thick=between(0.5, 2, 6),
            slender=between(4, 8, 8),
            shape=between(0.8, 1.2, 4),
            poisson=between(0, 0.3, 3),
            across=st.integers(4, 5),
        ),
        thick_beam,
    ),
    Kind(
        "plate",
        "elastic",
        "a plate under pressure and shear, by finite elements of the second order (scikit-fem)",
        values(wide=between(0.5, 3, 10), cells=st.integers(3, 5), poisson=between(0, 0.3, 6), shear=between(-1, 1, 8)),
        plate,
        needs="skfem",
    ),
    Kind(
        "ring",
        "elastic",
        "Lamé: the wall of a thick ring under pressure, ν up to 0.3",
        values(
            outer=between(2, 3, 8), around=st.integers(8, 12), through=st.integers(4, 5), poisson=between(0, 0.3, 6)
        ),
        ring,
    ),
    Kind(
        "ring-incompressible",
        "elastic",
        "Lamé, ν from 0.45 to 0.49",
        values(
            outer=between(2, 3, 8), around=st.integers(8, 12), through=st.integers(4, 5), poisson=between(0.45, 0.49, 4)
        ),
        ring,
    ),
    Kind(
        "column-under-load",
        "elastic",
        "the deflection of a column under a share of its buckling load, beam theory of the second order",
        values(
            thick=between(0.2, 1, 8),
            slender=between(8, 24, 16),
            along=st.integers(8, 10),
            share=between(0.3, 0.5, 4),
            side=decades(1e-4, 2e-3, 12),
        ),
        buckling_load,
    ),
    Kind(
        "oscillator",
        "elastic",
        "the period of a block on its joint, 2π √(m/k)",
        values(steps=between(20, 100, 16), stiffness=decades(1e7, 1e10)),
        oscillator,
    ),
    Kind(
        "wave",
        "waves",
        "a wave in a row of blocks: its speed and that of the blocks, long waves in springs in series",
        values(joints=decades(0.3, 30), strain=decades(1e-6, 1e-4)),
        wave,
    ),
]
