# SPDX-License-Identifier: MIT
"""A column of blocks under its own weight: stresses, contact forces and settlements, block by block."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..case import Case, Record

FloatArray = npt.NDArray[np.float64]
N, WIDTH, HEIGHT = 10, 2.0, 1.0  # blocks, m
UNIT_WEIGHT, MODULUS, POISSON = 25e3, 1e9, 0.25  # N/m3, Pa


def column(stiffness: float) -> Model:
    """The column on a fixed block, computed statically."""
    model = Model("column", e0=0.001, steps=400, dt_max=1.0, displacement_ratio=0.01, k01=0.0)
    model.add_polygon([(-1, -1), (WIDTH + 1, -1), (WIDTH + 1, 0), (-1, 0)])
    for block in range(N):
        low = block * HEIGHT
        model.add_polygon([(0, low), (WIDTH, low), (WIDTH, low + HEIGHT), (0, low + HEIGHT)])
        model.add_measured((WIDTH / 2, low + HEIGHT / 2))
    model.add_fixed((-1.0, -1.0))
    model.add_fixed((WIDTH + 1, -1.0))
    model.add_block_material(
        density=UNIT_WEIGHT / 9.81, weight=UNIT_WEIGHT, youngs_modulus=MODULUS, poisson_ratio=POISSON
    )
    model.add_joint_material(friction_angle=0.0)
    model.options = {"contact": {"stiffness": stiffness}}
    return model


def truth(stiffness: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Stress in each block, force on each face (the lowest first), settlement of each centre above the base.

    A face carries the weight above it, on two springs. A block has one stress: the mean of what its two faces carry,
    which is that at its middle. Its sides are free: the logarithm of its stretch is stress over modulus, and that of
    its width -ν times that.
    """
    weight = UNIT_WEIGHT * WIDTH * HEIGHT
    above = weight * (N - np.arange(N))
    stress = -(above - weight / 2) / WIDTH
    for _ in range(5):
        stress = -(above - weight / 2) / (WIDTH * np.exp(-POISSON * stress / MODULUS))
    shortening = -np.expm1(stress / MODULUS) * HEIGHT
    springs = above / (2 * stiffness)
    settlement = np.cumsum(springs) + np.cumsum(shortening) - shortening / 2
    return stress, above, settlement


def found(results: Results) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The same of a run; the base gives way under the column, evenly as it is symmetric."""
    frame = results.frames[-1]
    start = results.vertices
    top = np.flatnonzero((np.abs(start[:, 1]) < 1e-9) & ((start[:, 0] < -0.5) | (start[:, 0] > WIDTH + 0.5)))
    base = frame.vertex_displacement[top, 1].mean()
    settlement = base - results["history/measured_displacement"][-1, :, 1]
    contacts = frame.contacts
    face = np.rint(contacts.point[:, 1] / HEIGHT).astype(int)
    force = np.array([np.abs(contacts.force[face == k, 1]).sum() for k in range(N)])
    return results["history/measured_stress"][-1, :, 1], force, settlement


def self_weight(record: Record) -> None:
    """Springs from soft to stiff."""
    record.text(
        f"""
{N} blocks of {WIDTH:g} m × {HEIGHT:g} m ({UNIT_WEIGHT / 1e3:g} kN/m³, E = {MODULUS / 1e9:g} GPa, ν = {POISSON:g},
plane stress, no friction) stand on a fixed block. Statics gives everything: a face carries the weight above it on its
two springs, F/2k each; a block has a single stress, the mean of its faces, and free sides:

    σ(i) = -(weight above + ½ own weight)/(w exp(ν |σ(i)|/E)),  the width of the block being what it then is
    settlement of centre i = Σ F(j)/2k (faces below) + Σ s(j) (blocks below) + ½ s(i),  s = h (1 - exp(-|σ|/E))

What is left is of the second order in the strains, which reach {UNIT_WEIGHT * N * HEIGHT / MODULUS:.1e}.
"""
    )
    rows, shown = [], None
    for stiffness in (1e8, 1e9, 1e10, 1e11, 1e12) if record.full else (1e9, 1e11):
        results = record.run(column(stiffness), f"k-{stiffness:g}")
        errors = [np.abs(a / b - 1).max() for a, b in zip(found(results), truth(stiffness), strict=True)]
        rows.append([stiffness, found(results)[2][-1], truth(stiffness)[2][-1], *errors])
        if stiffness == 1e9:
            shown = found(results), truth(stiffness)
    names = ["stiffness [N/m]", "settlement at the top [m]", "closed form [m]"]
    names += [f"worst error of {what}" for what in ("a stress", "a force", "a settlement")]
    record.table(pandas.DataFrame(rows, columns=names), "stiffness", "The column on springs of several stiffnesses.")
    assert shown is not None
    draw(record, *shown)
    for column_number, what in ((3, "stress in a block"), (4, "force on a face"), (5, "settlement of a block")):
        worst = max(rows, key=lambda row: row[column_number])
        record.compare(
            f"{what}, RockDDA over closed form, the worst of all blocks and stiffnesses ({worst[0]:g} N/m)",
            1 + worst[column_number],
            truth=1.0,
            truth_source="statics",
            allowed=1e-6,  # second order: strains are 2e-4, their squares 6e-8
        )
    record.energy_closes()


def draw(record: Record, computed: tuple[FloatArray, ...], expected: tuple[FloatArray, ...]) -> None:
    """Stress and settlement over the height."""
    from matplotlib import pyplot as plt

    height = (np.arange(N) + 0.5) * HEIGHT
    with record.style():
        fig, (left, right) = plt.subplots(1, 2, figsize=(PAPER_WIDTH, 2.8), sharey=True)
        exact = np.linspace(0, N * HEIGHT, 50)
        left.plot(-UNIT_WEIGHT * (N * HEIGHT - exact) / 1e3, exact, color=PALETTE[0], lw=1, label="continuous column")
        left.plot(computed[0] / 1e3, height, "o", ms=4, color=PALETTE[1], label="RockDDA")
        left.set(xlabel="vertical stress [kPa]", ylabel="height [m]")
        left.legend()
        right.plot(1e3 * expected[2], height, "s", ms=7, mfc="none", color=PALETTE[0], label="springs and strains")
        right.plot(1e3 * computed[2], height, "o", ms=4, color=PALETTE[1], label="RockDDA")
        right.set(xlabel="settlement [mm]")
        right.legend()
        fig.tight_layout()
        record.figure(fig, "profile", "Stress and settlement over the height, springs of 1e9 N/m.")


CASES = [Case("closed-column", "Column of blocks under its own weight", "Closed forms", self_weight)]
