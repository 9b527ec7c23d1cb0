# SPDX-License-Identifier: MIT
"""Searches of the critical factor in validation cases: the run, its record, its table and pictures."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas
from matplotlib.figure import Figure
from rockdda.critical import CriticalFactor, factor_of_safety
from rockdda.plot import draw_trials, mechanism

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from rockdda.analysis.limit_analysis import RigidBlocks
    from rockdda.model import Model

    from .case import Record

__all__ = [
    "ASSOCIATED",
    "LENGTH",
    "draw_mechanism",
    "draw_trial_values",
    "load_of_mechanism",
    "of_own_mechanism",
    "search",
    "trial_table",
    "within_bound",
]

LENGTH = "Contacts act by length, the default, whatever formulation the report is made for."
ASSOCIATED = (
    "The linear programme is that of an associated material, which dilates as it slides; Coulomb friction without "
    "dilation may fail earlier, not later"
)
ABOVE = 0.01  # how far above a limit analysis the factor may be: the search ends within 0.5 %
NEAR = 0.01  # of the load of its own mechanism: as above, and the geometry has changed by 0.5 % of a block


def search(record: Record, model: Model, name: str, **options: Any) -> CriticalFactor:
    """Search the critical factor of a model; input files and the failing trial are kept in `folder / name`.

    The search takes one process, so that times can be compared.
    """
    folder = record.folder / name
    folder.mkdir(parents=True, exist_ok=True)
    model.write(folder, force=True)
    started = clock.monotonic()
    try:
        found = factor_of_safety(
            folder / f"{model.name}.nml", output=folder / "failing.h5", force=True, **{"jobs": 1} | options
        )
    finally:
        record.run_seconds += clock.monotonic() - started
    record.runs += len(found.trials)
    record.steps += sum(trial.steps for trial in found.trials)
    return found


def within_bound(record: Record, quantity: str, found: float, bound: float, source: str, unit: str = "") -> None:
    """Tell the upper bound of a limit analysis, and promise that the factor is not more than 1 % above it."""
    record.compare(f"{quantity}, bound", found, unit, truth=bound, truth_source=source, explanation=ASSOCIATED)
    record.compare(
        f"{quantity}: share above the bound", max(0.0, found / bound - 1), truth=0.0, truth_source=source, scale=1,
        allowed=ABOVE,
    )  # fmt: skip


def load_of_mechanism(found: CriticalFactor, blocks: RigidBlocks) -> float:
    """The least push with which the mechanism of the failing trial is in equilibrium without dilation."""
    assert found.results is not None
    settled, last = found.results.frames[0], found.results.frames[-1]
    motion = np.column_stack([last.centroid - settled.centroid, last.rotation - settled.rotation])
    return blocks.push_of_mechanism(motion)


def of_own_mechanism(record: Record, quantity: str, found: CriticalFactor, blocks: RigidBlocks) -> None:
    """Promise that a push is the least with which its mechanism is in equilibrium without dilation."""
    record.compare(
        quantity, found.value, truth=load_of_mechanism(found, blocks),
        truth_source="statics of its mechanism without dilation (linear programme)", allowed=NEAR,
    )  # fmt: skip


def trial_table(record: Record, found: Sequence[tuple[str, CriticalFactor]], caption: str) -> None:
    """A table of searches: bracket, trials, steps, seconds."""
    rows = [
        {
            "case": name,
            "stable at": one.low if one.value >= 0 else one.high,
            "fails at": one.high if one.value >= 0 else one.low,
            "trials": len(one.trials),
            "steps": sum(trial.steps for trial in one.trials),
            "seconds": round(sum(trial.seconds for trial in one.trials), 2),
            "blocks that move": len(one.mechanism.blocks),
            "mechanism": one.mechanism.kind,
        }
        for name, one in found
    ]
    record.table(pandas.DataFrame(rows), "searches", caption)


def draw_mechanism(record: Record, found: CriticalFactor, name: str, caption: str) -> None:
    """The picture of a mechanism."""
    assert found.results is not None
    record.figure(_figure(mechanism(found.results, units="m,s,N")), name, caption)


def draw_trial_values(record: Record, found: CriticalFactor, name: str, caption: str) -> None:
    """The picture of a search."""
    record.figure(_figure(draw_trials(found, units="m,s,N")), name, caption)


def _figure(axes: Axes) -> Figure:
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return figure
