# SPDX-License-Identifier: MIT
"""§5.3.4 of the thesis: the six-block beam from 1 g to 12 g."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd
from rockdda.analysis.voussoir import VoussoirBeam, solve_beam
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..block_row import GRAVITY, OPEN, BlockRow, State, centrifuge_beam
from ..case import Case, Record, published

FloatArray = npt.NDArray[np.float64]
DATA, RESULTS = published("chapter5")["centrifuge_beam"], published("chapter5")["results"]
LEVELS, PER_LEVEL = DATA["levels"], DATA["steps_per_level"]
BEFORE = 200  # steps of prestressing
MIDDLE = 5  # measured point left of mid-span
LOWER_AT_MIDDLE = 6  # contact of the joint at mid-span
TOLD = (1, 4, 7, 12)  # g
MICRO = 1e6
TRUTH = "uniformly strained blocks on springs with friction"
SECOND_ORDER = "second order: the arch sags by 1e-3 of its height, which the truth for small motions leaves out"


@dataclass(frozen=True)
class Run:
    """A run from 0 g to 12 g."""

    row: BlockRow
    results: Results

    def _rows(self) -> npt.NDArray[np.int64]:
        """History rows at the end of prestressing and of each level."""
        return BEFORE - 1 + PER_LEVEL * np.arange(LEVELS + 1)

    def deflection(self) -> FloatArray:
        """(levels + 1, 12) since gravity began."""
        y = self.results["history/measured_displacement"][:, :, 1][self._rows()]
        return y[0] - y

    def stress(self) -> FloatArray:
        """(levels + 1, 6, 3)."""
        return self.results["history/measured_stress"][:, ::2][self._rows()]

    def support(self) -> FloatArray:
        """(levels + 1, 2) all forces of the left and of the right abutment's fixed points, upwards."""
        force = self.results["history/fixed_force"][self._rows()][:, :, 1]
        return np.column_stack([force[:, :3].sum(axis=1), force[:, 3:].sum(axis=1)])


def angle(stress: FloatArray) -> FloatArray:
    """Of the principal direction nearest to the horizontal [deg], counter-clockwise."""
    return np.degrees(np.arctan(2 * stress[..., 2] / (stress[..., 0] - stress[..., 1])) / 2)


def gravity_levels(record: Record) -> None:
    """Table 5.1."""
    row = BlockRow()
    thrust = row.weight / row.friction
    states = row.path(row.push_for(thrust), LEVELS)
    record.text(
        f"The beam and its truth are those of §5.3.3, with the values of Table 5.1 and prestress T = W/tan φ = "
        f"{thrust:.4g} N/m (the tests' prestress is not published). Gravity goes from 1 g to {LEVELS} g. *Static*: "
        f"k01 = 0, in quarters of 1 g, {PER_LEVEL} steps per 1 g. *Published*: k01 = 1, by 1 g at once every "
        f"{PER_LEVEL} steps of {DATA['time_step']} s; this loading has a truth of its own, the same blocks in motion "
        "(small motions, same time integration), because the beam slides a little at its abutments while it swings and "
        "then stays lower than by static loading."
    )
    static = _run(record, row, thrust, k01=0.0, parts=4)
    moving = _run(record, row, thrust, k01=1.0, parts=1)
    _against_truth(record, static, moving, states, thrust)
    _equilibrium(record, static, moving)
    _draw(record, static, moving, states)
    _words(record, moving, states)
    if record.full:
        _prestress(record, row, thrust)
    record.energy_closes()


def _run(record: Record, row: BlockRow, thrust: float, k01: float, parts: int) -> Run:
    stages = [{"until_step": BEFORE, "gravity": 0, "k01": 0}]
    for i in range(LEVELS * parts):
        stages.append({"until_step": BEFORE + (i + 1) * PER_LEVEL // parts, "gravity": (i + 1) / parts, "k01": k01})
    model = centrifuge_beam(row, push=row.push_for(thrust), stages=stages)
    results = record.run(model, f"k01_{k01:g}_T_{thrust:.4g}", save_every=BEFORE + LEVELS * PER_LEVEL)
    return Run(row, results)


def _against_truth(record: Record, static: Run, moving: Run, states: list[State], thrust: float) -> None:
    row = static.row
    deflection = np.array([(row.points(states[0]) - row.points(state))[:, 1] for state in states])
    stress = np.array([row.stresses(state) for state in states])
    computed = static.stress()
    for level in TOLD:
        record.compare(
            f"mid-span deflection, static, {level} g",
            static.deflection()[level, MIDDLE] * MICRO,
            "µm",
            truth=deflection[level, MIDDLE] * MICRO,
            truth_source=TRUTH,
            allowed=2e-3,
            explanation=SECOND_ORDER,
        )
    told = TOLD if record.full else TOLD[:1]
    swung = row.motion(row.push_for(thrust), BEFORE, PER_LEVEL, told[-1], DATA["time_step"])
    for level in told:
        record.compare(
            f"mid-span deflection, published loading, {level} g",
            moving.deflection()[level, MIDDLE] * MICRO,
            "µm",
            truth=(row.points(swung[0]) - row.points(swung[level]))[MIDDLE, 1] * MICRO,
            truth_source="the same blocks in motion, integrated independently",
            allowed=2e-3,
            explanation=SECOND_ORDER,
        )
    for level in TOLD:
        record.compare(
            f"σx of a middle block, published loading, {level} g",
            moving.stress()[level, 2, 0] / 1e3,
            "kPa",
            truth=stress[level, 2, 0] / 1e3,
            truth_source=TRUTH,
            allowed=2e-3,
            explanation=SECOND_ORDER,
        )
    for level in TOLD:
        for block in (0, 2):
            record.compare(
                f"angle to principal stress, block {block + 1}, static, {level} g",
                angle(computed)[level, block],
                "°",
                truth=angle(stress)[level, block],
                truth_source=TRUTH,
                allowed=2e-3,
                explanation="",
            )
    for name, run in (("static", static), ("published loading", moving)):
        found, y = angle(run.stress())[1:], run.deflection()
        record.compare(
            f"asymmetry of the angle, {name}, the largest",
            np.abs(found + found[:, ::-1]).max(),
            "°",
            truth=0.0,
            truth_source="symmetry",
            scale=float(np.abs(found).max()),
            allowed=1e-3,
            explanation="which of two blocks is the edge's owner in a contact is of second order",
        )
        record.compare(
            f"asymmetry of deflections, {name}, the largest",
            np.abs(y - y[:, ::-1]).max() * MICRO,
            "µm",
            truth=0.0,
            truth_source="symmetry",
            scale=float(y.max() * MICRO),
            allowed=1e-3,
            explanation="which of two blocks is the edge's owner in a contact is of second order",
        )


def _equilibrium(record: Record, static: Run, moving: Run) -> None:
    """Balance of forces and moments at 12 g, from what the results hold."""
    row, results = moving.row, moving.results
    weight = LEVELS * row.density * GRAVITY * row.areas
    source = f"equilibrium at {LEVELS} g"
    alternating = "fixed points are so stiff (Ω above 4) that the last jump of gravity still alternates in them"
    for name, run, allowed in (("static", static, 1e-6), ("published loading", moving, 2e-4)):
        record.compare(
            f"supports, vertical, {name}",
            run.support()[-1].sum(),
            "N",
            truth=weight.sum(),
            truth_source=source,
            allowed=allowed,
            explanation=alternating if run is moving else "",
        )
        left, right = run.support()[-1]
        record.compare(
            f"left over right support, {name}", left / right, truth=1.0, truth_source="symmetry", allowed=1e-6
        )
    points, forces = _on_left_half(results)
    crown = points[:, 0] > -row.size
    frame = results.frames[-1]
    half = np.argsort(results.block_centroid[:, 0])[1:4]  # blocks of the left half
    own = LEVELS * row.density * GRAVITY * row.size**2
    scale = LEVELS * row.weight
    left_over = forces.sum(axis=0) - [0.0, 3 * own]
    moment = (points[:, 0] * forces[:, 1] - points[:, 1] * forces[:, 0]).sum() - own * frame.centroid[half, 0].sum()
    record.compare(
        "left half: forces left over, the larger of x and y",
        np.abs(left_over).max(),
        "N",
        truth=0.0,
        truth_source=source,
        scale=scale,
        allowed=1e-5,
        explanation="rest of the motion",
    )
    record.compare(
        "left half: moment left over",
        moment,
        "N m",
        truth=0.0,
        truth_source=source,
        scale=scale * row.half / 4,
        allowed=1e-5,
        explanation="rest of the motion",
    )
    heights = [np.average(points[part, 1], weights=np.abs(forces[part, 0])) for part in (crown, ~crown)]
    record.compare(
        "thrust times arm",
        -forces[crown, 0].sum() * (heights[0] - heights[1]),
        "N m",
        truth=scale * 2 * row.half / 8,
        truth_source="W S/8",
        allowed=1e-3,
        explanation="at rest the span is shorter, and the crown carries a little shear",
    )


def _on_left_half(results: Results) -> tuple[FloatArray, FloatArray]:
    """(n, 2) points and forces of the closed contacts between the left half of the beam and the rest."""
    contacts = results.frames[-1].contacts
    half = np.argsort(results.block_centroid[:, 0])[1:4]
    inside = np.isin(contacts.blocks, half)
    chosen = (inside.sum(axis=1) == 1) & (contacts.state != OPEN)
    sign = np.where(inside[chosen, 0], 1.0, -1.0)
    return contacts.point[chosen], sign[:, None] * contacts.force[chosen]


def _draw(record: Record, static: Run, moving: Run, states: list[State]) -> None:
    import matplotlib.pyplot as plt

    row = static.row
    levels = np.arange(LEVELS + 1)
    truth = np.array([(row.points(states[0]) - row.points(state))[:, 1] for state in states]) * MICRO
    stress = np.array([row.stresses(state) for state in states])
    x = np.array([place[1] for place in row.measured()]) * 1e3
    with record.style():
        figure, ((profile, sag), (push, turn)) = plt.subplots(2, 2, figsize=(PAPER_WIDTH, 5.0))
        blocks = np.arange(1, 7)
        for colour, level in zip(PALETTE, (1, 2, 4, 7, 12), strict=False):
            profile.plot(x, moving.deflection()[level] * MICRO, "o-", color=colour, ms=2.5, lw=0.9, label=f"{level} g")
            profile.plot(x, truth[level], ":", color=colour, lw=1.2)
            turn.plot(blocks, angle(moving.stress())[level], "o-", color=colour, ms=3, lw=0.9, label=f"{level} g")
            turn.plot(blocks, angle(stress)[level], ":", color=colour, lw=1.2)
        loaded = "RockDDA, published loading"
        profile.invert_yaxis()
        profile.set(xlabel="x [mm]", ylabel="deflection [µm]")
        profile.legend(fontsize=7, loc="lower left", handlelength=1.2)
        sag.plot(
            levels,
            moving.deflection()[:, MIDDLE] * MICRO,
            "o",
            color=PALETTE[1],
            ms=5,
            label="RockDDA, published loading",
        )
        sag.plot(levels, static.deflection()[:, MIDDLE] * MICRO, "x", color=PALETTE[2], ms=5, label="RockDDA, static")
        sag.plot(levels, truth[:, MIDDLE], color="black", lw=0.9, label="truth, static")
        sag.set(xlabel="level [g]", ylabel="mid-span deflection [µm]")
        sag.legend(fontsize=7)
        push.plot(levels, -moving.stress()[:, 2, 0] / 1e3, "o", color=PALETTE[1], ms=5, label=loaded)
        push.plot(levels, -stress[:, 2, 0] / 1e3, color="black", lw=0.9, label="truth, static")
        hinged = row.weight * levels * 2 * row.half / (8 * row.size) / row.size / 1e3
        push.plot(levels, hinged, ":", color=PALETTE[3], label="three-hinged arch, W S/(8 t²)")
        push.set(xlabel="level [g]", ylabel="compression σx, middle block [kPa]")
        push.set_ylim(top=1.25 * push.get_ylim()[1])
        push.legend(fontsize=7, loc="upper left")
        turn.axhline(0, color="0.6", lw=0.6)
        turn.set(xlabel="block, from the left", ylabel="angle θ [°]")
        turn.legend(fontsize=7)
        figure.tight_layout()
    record.figure(
        figure,
        "levels",
        "As Figs. 5.7 and 5.8: deflections, horizontal stress and angle to principal stress (dotted: static truth)",
    )


def _voussoir(level: float) -> VoussoirBeam:
    return VoussoirBeam(
        DATA["span"],
        DATA["block_edge"],
        DATA["density"] * GRAVITY * level,
        DATA["youngs_modulus"],
        friction_angle=DATA["friction_angle"],
    )


def _words(record: Record, moving: Run, states: list[State]) -> None:
    y, found = moving.deflection()[:, MIDDLE], angle(moving.stress())
    opened = next(int(state.level) for state in states if state.contact[LOWER_AT_MIDDLE] == OPEN)
    record.text(
        "**What agrees with the thesis.** Most of the deflection is at mid-span and dies out towards the abutments; "
        "horizontal stress grows with the level; everything is symmetric about mid-span; principal stresses are turned "
        f"counter-clockwise left of mid-span (block 1: {found[LEVELS, 0]:.1f}° at {LEVELS} g) and clockwise right of "
        f"it "
        f"({found[LEVELS, 5]:.1f}°), more at higher levels ({', '.join(f'{found[g, 0]:.1f}° at {g} g' for g in TOLD)})."
    )
    record.text(
        f"**What does not.** The thesis finds displacements 'very similar' above "
        f"{RESULTS['similar_displacements_above']} g. Ours grow in "
        f"proportion to the level once the joints have opened (mid-span from {opened} g on): {y[LEVELS] / y[4]:.2f} "
        f"times as much at {LEVELS} g as at 4 g. "
        "An arch of linear blocks on linear springs whose sag is small against its height can do nothing else; the "
        "published finding is unexplained. Measured deflections and stresses are in figures only, so that the "
        "published "
        "error of 30 to 60 % in stress cannot be checked."
    )
    low, high = 1.0, 1e5
    while high / low > 1.01:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if solve_beam(_voussoir(middle)).snaps_through else (middle, high)
    stiff = BlockRow(40 * DATA["contact_stiffness"])
    path = stiff.path(stiff.push_for(stiff.weight / stiff.friction), LEVELS)
    rigid = float((stiff.points(path[0]) - stiff.points(path[-1]))[MIDDLE, 1])
    rows = []
    for level in (1, 4, 12):
        solution = solve_beam(_voussoir(level))
        rows.append(
            {
                "level [g]": level,
                "voussoir thrust [N/m]": solution.thrust,
                "three-hinged arch [N/m]": level * moving.row.weight * 2 * moving.row.half / (8 * moving.row.size),
                "RockDDA [N/m]": -moving.stress()[level, 2, 0] * moving.row.size,
                "voussoir deflection [µm]": solution.deflection * MICRO,
                "RockDDA [µm]": y[level] * MICRO,
                "safety against sliding": solution.safety_shear,
            }
        )
    record.table(pd.DataFrame(rows), "voussoir", "The classic voussoir beam beside RockDDA's (loading as published)")
    record.text(
        f"**The voussoir beam** is said to fail at {RESULTS['voussoir_fails_at']} g. With the published data (span "
        f"0.288 m, "
        "thickness 0.048 m, E = 3.2 GPa) it does not: span over thickness is 6, the stress at 1 g is 11 kPa or 3.5e-6 "
        "of E, and "
        f"the beam snaps through only at about {low:.0f} g. The statement does not follow from the data given. "
        "Its compressed triangles leave an arm of t/2, where uniformly strained blocks on corner springs have t, and "
        "its "
        "thrust is twice that of the three-hinged arch. Ours sinks further because of the contact springs, the only "
        "joints that a "
        f"penalty method has: with springs 40 times as stiff it would sink by {rigid * MICRO:.3g} µm at {LEVELS} g."
    )


def _prestress(record: Record, row: BlockRow, thrust: float) -> None:
    rows = []
    for share in (0.5, 1.0, 2.0, 5.0):
        push = row.push_for(share * thrust)
        states = row.path(push, LEVELS)
        run = _run(record, row, share * thrust, k01=0.0, parts=4)
        y, turned = run.deflection()[:, MIDDLE] * MICRO, angle(run.stress())[:, 0]
        truth = (row.points(states[0]) - row.points(states[-1]))[MIDDLE, 1] * MICRO
        opened = [int(state.level) for state in states if (state.contact == OPEN).any()]
        entry = {"prestress / T": share, "σx at 0 g [kPa]": run.stress()[0, 2, 0] / 1e3}
        entry["a joint opens at [g]"] = opened[0] if opened else math.nan
        entry |= {f"mid-span, {level} g [µm]": y[level] for level in TOLD}
        entry[f"truth, {LEVELS} g [µm]"] = truth
        entry |= {f"θ block 1, {level} g [°]": turned[level] for level in TOLD}
        rows.append(entry)
    record.table(pd.DataFrame(rows), "prestress", "Other prestress, static (k01 = 0, in quarters of 1 g)")
    record.text(
        "With more prestress joints open at a higher level, and the angle keeps growing for longer. Distinct arching "
        f"above {RESULTS['arching_above']} g, as published, would fit the largest prestress tried, but then the "
        f"deflections of "
        "higher levels differ even more from each other. The prestress of the tests is not known, so that this stays "
        "open."
    )


CASES = [Case("5.3.4-centrifuge-levels", "Six-block beam from 1 g to 12 g", "Chapter 5", gravity_levels)]
