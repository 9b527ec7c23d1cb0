# SPDX-License-Identifier: MIT
"""Tunnels of chapter 7 of the thesis: their runs, and what several cases of the validation share.

The runs are the studies of `inputs/fifty_tunnels` and `inputs/random_tunnels`. They take half an hour and more, so they
are kept in $ROCKDDA_STUDIES, if that is set, and continue where they were stopped; otherwise in the folder of the case.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rockdda.analysis.loosening import GRADIENT_LIMIT, WINDOW, Loosening, height_label, loosening
from rockdda.errors import RockddaError
from rockdda.plot.block_maps import add_blocks
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results
from rockdda.results import open as open_results
from rockdda.study.definition import Study, read_study
from rockdda.study.runner import collect, run_study

from .case import Record, published

FloatArray = npt.NDArray[np.float64]
PUBLISHED = published("chapter7")
FRICTION: list[int] = PUBLISHED["matrix"]["friction"]
SPACING: dict[int, list[float]] = {span: PUBLISHED["matrix"][f"spacing_{span}"] for span in (10, 15)}
TUNNEL: float = PUBLISHED["matrix"]["tunnel_height"]
ARCH = 5.0
DENSITY, MODULUS = PUBLISHED["parameters"]["density"], PUBLISHED["parameters"]["modulus"]
STIFFNESS, TIME_STEP = PUBLISHED["parameters"]["stiffness"], PUBLISHED["parameters"]["dt"][1]
GRAVITY = 9.81
WIDTH, BOTTOM, TOP = 40, -16.5, 33.5  # of the rock; the crown is at 0
LOOSE = 0.5  # m: what has moved further has fallen into the opening


@dataclass(frozen=True)
class Cell:
    """One run and its results."""

    values: dict[str, Any]
    profile: Loosening
    blocks: int
    iterations: float
    end: float
    seconds: float
    file: Path

    @property
    def mean(self) -> FloatArray:
        """Displacement about which the points oscillate: mean over the last half of the run."""
        return mean_displacement(open_results(self.file))


def mean_displacement(results: Results) -> FloatArray:
    """(points,) vertical, over the last half of the time."""
    times = np.asarray(results["history/time"])
    moved = np.asarray(results["history/measured_displacement"])[:, :, 1]
    late = times >= times[-1] / 2
    return np.trapezoid(moved[late], times[late], axis=0) / (times[late][-1] - times[late][0])


def cells(
    record: Record,
    file: str,
    numbers: Callable[[dict[str, Any]], bool] = lambda values: True,
    changes: Mapping[str, Any] | None = None,
    label: str = "",
) -> list[Cell]:
    """The cases of a study that are wanted; those that are not done are run.

    changes: values in place of those of the study, which are kept in a folder of their own, named by `label`.
    """
    study = _study(record, file, changes, label)
    wanted = tuple(case for case in study.cases if numbers(dict(case.values)))
    study = dataclasses.replace(study, cases=wanted)
    run_study(study, workers=record.workers)
    found = []
    for case, (_, row) in zip(study.cases, collect(study).iterrows(), strict=True):
        if row["status"] != "done":
            raise RockddaError(f"{study.title}, case {case.number}: {row['status']}. {row['message']}")
        found.append(_cell(dict(case.values), Path(row["results_file"]), float(row["seconds"])))
        record.runs += 1
        record.steps += open_results(found[-1].file).n_steps
        record.run_seconds += found[-1].seconds
    return found


def profile_of(results: Results, window: float = WINDOW) -> Loosening:
    """Above the crown, over the time that the run covers: rock that is thrown apart moves in short steps.

    `loosening_of` refuses such a run, because it covers less than was planned.
    """
    moved = results["history/measured_displacement"][:, :, 1]
    return loosening(results["history/time"], moved, results.measured_points[:, 1], window=window)


def energy_made(cell: Cell) -> float:
    """Energy that the springs of contacts have had for nothing by the end, over the largest work of gravity so far."""
    with open_results(cell.file) as results:
        made, fallen = made_and_fallen(results)
    return float(made[-1] / fallen.max())


def made_and_fallen(results: Results) -> tuple[FloatArray, FloatArray]:
    """(steps,) energy that closing contacts made, and the work of gravity [J]."""
    energy = np.asarray(results["history/energy"])
    names = results.energy_names
    return -energy[:, names.index("discarded")], -energy[:, names.index("gravity")]


def done(record: Record, file: str) -> list[dict[str, Any]]:
    """The parameters of the cases of a study that are done already."""
    study = _study(record, file)
    states = collect(study)["status"]
    return [dict(case.values) for case, state in zip(study.cases, states, strict=True) if state == "done"]


def _cell(values: dict[str, Any], file: Path, seconds: float) -> Cell:
    with open_results(file) as results:
        rounds = float(np.mean(results["history/open_close_iterations"]))
        return Cell(values, profile_of(results), results.n_blocks, rounds, results["history/time"][-1], seconds, file)


def with_formulation(rules: str, formulation: str) -> str:
    """Options of a tunnel that name a formulation, unless they name one or a preset."""
    if not formulation or "preset" in rules or "formulation" in rules:
        return rules
    if not rules.strip():
        return f"  &contact formulation = '{formulation}' /"
    return rules.replace("&contact", f"&contact formulation = '{formulation}',", 1)


def _study(record: Record, file: str, changes: Mapping[str, Any] | None = None, label: str = "") -> Study:
    source = Path(__file__).parents[2] / "inputs" / file
    if not source.is_file():
        raise RockddaError(f"{source} is missing: the studies are part of the source, not of the installed package")
    study = read_study(source)
    kept = Path(os.environ.get("ROCKDDA_STUDIES", record.folder))
    changed = []
    for case in study.cases:
        values = {**case.values, **(changes or {})}
        values["rules"] = with_formulation(str(values.get("rules", "")), record.formulation)
        changed.append(dataclasses.replace(case, values=values))
    name = "-".join(filter(None, (source.stem, record.formulation, label)))
    return dataclasses.replace(study, cases=tuple(changed), output=kept.absolute() / name)


def chain(width: FloatArray, spacing: float, stiffness: float) -> tuple[float, FloatArray]:
    """Truth for the settlement: layers of 1 m that rest on each other, as masses on springs, without any friction.

    `width`: of each layer over the whole width, from the bottom; two contact springs a block and interface, half a
    layer of rock on each side. Returns the longest period and the static displacement of the layers' middles.
    """
    half = 0.5 / (MODULUS * width)
    flexibility = spacing / (2 * stiffness * np.minimum(width, np.r_[width[0], width[:-1]]))
    flexibility += half + np.r_[0.0, half[:-1]]
    springs = 1 / flexibility
    matrix = np.diag(springs + np.r_[springs[1:], 0.0])
    matrix -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    mass = DENSITY * width
    squares = np.linalg.eigvalsh(matrix / np.sqrt(np.outer(mass, mass)))
    return 2 * math.pi / math.sqrt(squares[0]), -np.linalg.solve(matrix, mass * GRAVITY)


def rock_width(span: float) -> FloatArray:
    """(50,) share of the width that is rock, of layers of 1 m from the bottom, beside the horseshoe."""
    radius = (span**2 / 4 + ARCH**2) / (2 * ARCH)
    middles = np.arange(BOTTOM + 0.5, TOP)
    arch = 2 * np.sqrt(np.maximum(radius**2 - (middles + radius) ** 2, 0))
    gone = np.where(middles > 0, 0, np.where(middles > -ARCH, arch, np.where(middles > -TUNNEL, span, 0)))
    return 1 - gone / WIDTH


def fitted_period(times: FloatArray, column: FloatArray) -> float:
    """Period of the sine that, with a straight line, fits best in the last three quarters of the run."""
    late = times >= times[-1] / 4
    t, y = times[late], column[late]
    trials = np.geomspace(times[-1] / 20, times[-1], 1200)

    def misfit(period: float) -> float:
        phase = 2 * math.pi * t / period
        columns = np.stack([np.ones_like(t), t, np.cos(phase), np.sin(phase)], axis=1)
        rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
        return float(rest @ rest)

    return float(trials[int(np.argmin([misfit(float(p)) for p in trials]))])


def draw_deformed(axes: Any, results: Results, scale: float) -> Any:
    """Blocks at the end, displacements enlarged; coloured by the downward displacement, loose pieces grey."""
    frame = results.frames[-1]
    corners = results.vertices + scale * frame.vertex_displacement
    offset = results.vertex_offset
    low = np.minimum.reduceat(corners[:, 1], offset[:-1])
    down = -frame.displacement[:, 1]
    loose = np.abs(frame.displacement).max(axis=1) > LOOSE
    keep = ~loose | (low > -TUNNEL)
    polygons = [corners[offset[i] : offset[i + 1]] for i in np.flatnonzero(keep)]
    count = np.r_[0, np.cumsum([len(polygon) for polygon in polygons])]
    blocks = add_blocks(axes, np.concatenate(polygons), count, linewidths=0.25, edgecolors="#555555")
    blocks.set_array(np.where(loose, np.nan, down)[keep])
    blocks.set_cmap("viridis_r")
    blocks.cmap.set_bad("#D9D9D9")
    blocks.set_clim(0, 0.1)
    axes.set_xlim(-WIDTH / 2 - 1, WIDTH / 2 + 1)
    axes.set_ylim(BOTTOM - 1, TOP + 1)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    return blocks


def draw_profiles(record: Record, name: str, caption: str, curves: Mapping[str, Sequence[Cell]]) -> None:
    """Displacements and gradients above the crown: a panel for each group, a line for each friction angle."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import MaxNLocator

    with record.style():
        # in thousandths: short numbers do not run into those of the next panel
        for kind, axis in (("displacement", "δ [mm]"), ("gradient", "1000 Δδ/Δy")):
            figure, grid = plt.subplots(1, len(curves), figsize=(PAPER_WIDTH, 2.5), sharey=True, sharex=True)
            for axes, (title, line) in zip(grid, curves.items(), strict=True):
                for colour, cell in zip(PALETTE, line, strict=False):
                    heights = cell.profile.heights
                    middles = (heights[1:] + heights[:-1]) / 2
                    values = getattr(cell.profile, kind)
                    where = heights if kind == "displacement" else middles
                    axes.plot(1e3 * values, where, ".-", color=colour, label=f"{cell.values['phi']}°")
                if kind == "gradient":
                    for limit in (-GRADIENT_LIMIT, GRADIENT_LIMIT):
                        axes.axvline(1e3 * limit, color="#9A9A9A", linestyle=":", linewidth=0.8)
                axes.set_title(title, fontsize=8)
                axes.xaxis.set_major_locator(MaxNLocator(2, steps=[1, 2, 5, 10]))
                axes.margins(x=0.12)
                axes.set_xlabel(axis)
            grid[0].set_ylabel("y above the crown [m]")
            grid[-1].legend(title="friction", fontsize=7, title_fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
            record.figure(figure, f"{name}-{kind}", caption.format(what=axis))


def by_spacing(found: Sequence[Cell], span: int) -> dict[str, list[Cell]]:
    """Cells of one span, a list of friction angles for each spacing."""
    groups: dict[str, list[Cell]] = {}
    for cell in found:
        if cell.values["span"] == span:
            groups.setdefault(f"S_j = {cell.values['spacing']:g} m", []).append(cell)
    return groups


def label(height: float) -> str:
    """Of a table: height over the tunnel's height."""
    return height_label(height, TUNNEL)
