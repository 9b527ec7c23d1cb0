# SPDX-License-Identifier: MIT
"""What §4.4.1 of the thesis asks for: a dashpot beside the contact spring (Voigt), where it does something.

A block without weight flies against a base and comes off again. While the contacts are closed it is a mass on a spring
and a dashpot, and the ratio of the speeds has a closed form.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from rockdda.model import Model

from ..case import Case, Record

SIDE, DENSITY = 1.0, 2500.0
BASE = (10.0, 5.0)  # of the base: width, height
STIFFNESS = 1e7  # small beside E, so that the block is as good as rigid
MODULUS = 1e12
SPEED = 0.1
MASS = DENSITY * SIDE**2
OMEGA = float(np.sqrt(2.0 * STIFFNESS / MASS))  # of the block on its contacts


def dashpot(record: Record) -> None:
    """Coefficient of restitution against damping ratio and time step."""
    record.text(
        f"A block of {SIDE:g} m × {SIDE:g} m without weight meets a heavy fixed base with {SPEED:g} m/s, on two "
        f"contacts of k = {STIFFNESS:.0e} N/m with dashpots of damping ratio ζ (theory manual §5). Half a period later "
        "it comes off. For a mass m on 2 k and 2 c the speeds have the ratio exp(-π D/√(1 - D²)), D = ζ the "
        "damping ratio of the block; the time integration adds Ω/4 to D."
    )
    rows = []
    for ratio in (0.0, 0.05, 0.2, 0.4) if record.full else (0.0, 0.2):
        for dt in (1e-3, 2.5e-4, 1e-4) if record.full else (2.5e-4,):
            here = _rebound(record, ratio, dt)
            truth, numerical = restitution(ratio, 0.0), restitution(ratio, dt)
            rows.append([ratio, dt, here, truth, numerical])
            record.compare(
                f"speed after over speed before, ζ = {ratio:g}, Δt = {dt:g} s", here, "",
                truth=numerical, truth_source="mass on spring and dashpot, with Ω/4",
                allowed=2.0 * damping_ratio(ratio, dt) * OMEGA * dt,
                explanation=f"without the damping of the time integration {truth:.4f}; the contact opens at a whole "
                "step, and a step of the dashpot before it does is 2 D Ω of the speed",
            )  # fmt: skip
    columns = ["ζ", "Δt [s]", "RockDDA", "exp(-π D/√(1 - D²))", "with Ω/4"]
    record.table(pd.DataFrame(rows, columns=columns), "restitution", "Speed after the impact over that before it.")
    record.text(
        "The dashpots take out of an impact what they should. A block that slides without lifting never loads them "
        "(shaking table); blocks that bounce or rock do."
    )
    record.energy_closes()


def damping_ratio(ratio: float, dt: float) -> float:
    """Of the block on its two contacts, with the damping of the time integration (dt = 0: without)."""
    return float(ratio + 0.25 * OMEGA * dt)


def restitution(ratio: float, dt: float) -> float:
    """Speed after over speed before the impact."""
    damping = damping_ratio(ratio, dt)
    return float(np.exp(-np.pi * damping / np.sqrt(1.0 - damping**2)))


def _rebound(record: Record, ratio: float, dt: float) -> float:
    model = Model("impact", e0=1e-3, dt_max=dt, displacement_ratio=0.01, stiffness=STIFFNESS, steps=round(0.1 / dt))
    width, height = BASE
    left = 0.5 * (width - SIDE)
    model.add_polygon([(0, -height), (width, -height), (width, 0), (0, 0)])
    model.add_polygon([(left, 0), (left + SIDE, 0), (left + SIDE, SIDE), (left, SIDE)])
    model.add_fixed((0.1, -0.5 * height))
    model.add_fixed((width - 0.1, -0.5 * height))
    common = {"density": DENSITY, "weight": 0.0, "youngs_modulus": MODULUS, "poisson_ratio": 0.0}
    model.add_block_material(**common)
    moving = model.add_block_material(**common, velocity=(0.0, -SPEED, 0.0))
    model.add_material_line((left + 0.2, 0.5), (left + 0.4, 0.5), material=moving)
    model.add_joint_material(friction_angle=0.0)
    model.add_measured((0.5 * width, 0.5 * SIDE))
    model.options = {
        "joint_law": {"material": 1, "damping_ratio": ratio},
        "contact": {"fixed_stiffness_factor": 1e5},
        "run": {"save_every": 10**6},
    }
    with record.run(model, f"ratio{ratio:g}-dt{dt:g}") as results:
        rise = results["history/measured_displacement"][:, 0, 1]
        time = results["history/time"]
        return float((rise[-1] - rise[-3]) / (time[-1] - time[-3]) / SPEED)


CASES = [Case("4.4-dashpot", "Impact with a dashpot at the contacts", "Chapter 4", dashpot)]
