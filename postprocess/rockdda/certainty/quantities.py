# SPDX-License-Identifier: MIT
"""Numbers of a run whose certainty is asked for: displacements of measured points at the ends of stages, and others."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..results import Results
from ..study.definition import TAKE
from ..text import shown

#: Component of a point's displacement, over its length, below which it is no quantity of its own.
SMALL = 0.1
AT_REST = 1e-10  #: displacement over the extent of the model
_DATASET = re.compile(r"(?:(\w+)\()?([\w/]+)(?:\[([\d, ]+)\])?\)?")
_POINT = re.compile(r"(point \d+ [xy]|largest displacement)(, .+)?$")


@dataclass(frozen=True)
class Quantity:
    """One number of a run."""

    name: str  #: "point 1 y"
    stage: str  #: '' where the run has one stage without a name
    dimension: str  #: of its unit
    #: at a time of the end: value, and what changes are shares of
    read: Callable[[Results, float], tuple[float, float]]


def check_names(names: Sequence[str]) -> None:
    """InputError for what can be no quantity of any run."""
    for name in names:
        if not _POINT.match(name.lower()):
            _parsed(name)


def quantities_of(results: Results, names: Sequence[str] = ()) -> list[Quantity]:
    """The quantities of these names, or the displacements of all measured points at the end of every stage.

    A model without measured points has the largest displacement of a block. Points at rest, and components that are
    small beside the other one, are left out, but where they are named."""
    every = [
        one for stage in range(len(results.stages)) if results.stages[stage].n_steps for one in _of(results, stage)
    ]
    if not names:
        return [one for one in every if not _is_small(one, results)]
    found = []
    for name in names:
        named = [one for one in every if name.lower() in (one.name, f"{one.name}, {one.stage}".lower())]
        found += named or [_dataset(name, results)]
    return found


def _of(results: Results, stage: int) -> list[Quantity]:
    """Quantities at the end of a stage."""
    shown_stage = results.stages[stage].name if results.has_stages else ""
    count = results["history/measured_displacement"].shape[1]
    if not count:
        return [Quantity("largest displacement", shown_stage, "length", _largest(stage))]
    return [
        Quantity(f"point {number} {axis}", shown_stage, "length", _of_point(stage, i, k))
        for i, number in enumerate(results.point_numbers("measured").tolist())
        for k, axis in enumerate("xy")
    ]


def _of_point(stage: int, point: int, axis: int) -> Callable[[Results, float], tuple[float, float]]:
    def read(results: Results, end: float) -> tuple[float, float]:
        moved = results["history/measured_displacement"][:, point]
        at = _at_end(results, stage, end, moved)
        return float(at[axis]), float(np.hypot(*at))

    return read


def _largest(stage: int) -> Callable[[Results, float], tuple[float, float]]:
    def read(results: Results, end: float) -> tuple[float, float]:
        frame = results.at_stage(stage)
        moved = np.hypot(*frame.displacement[frame.active].T)
        most = float(moved.max(initial=0.0))
        return most, most

    return read


def _at_end(results: Results, stage: int, end: float, values: Any) -> Any:
    """Values at the last step of a stage, of the last one at a time that all runs have reached."""
    rows = np.flatnonzero(results.step_stages == stage)
    time = results["history/time"][rows]
    if rows[-1] < results.n_steps - 1 or time[-1] <= end:
        return values[rows[-1]]
    if time[0] >= end:
        return values[rows[0]]
    return np.array([np.interp(end, time, values[rows, k]) for k in range(values.shape[1])])


def _dataset(name: str, results: Results) -> Quantity:
    """A quantity such as max(history/energy[0]): an array with a row a step, indices behind the step, how to reduce."""
    take, path, at = _parsed(name)

    def read(results: Results, end: float) -> tuple[float, float]:
        try:
            places: Any = (slice(None), *at)
            series = np.asarray(results[path], dtype=float)[places]
        except (KeyError, IndexError) as problem:
            raise InputError(f"quantity {shown(name)}: {str(problem).strip(chr(34))}") from None
        if series.ndim != 1 or not series.size:
            raise InputError(f"quantity {shown(name)}: the indices must leave one number a step")
        value = float(TAKE[take](series))
        return value, abs(value)

    read(results, float("inf"))
    return Quantity(name.strip(), "", "", read)


def _parsed(name: str) -> tuple[str, str, tuple[int, ...]]:
    """How to reduce, the array, and indices behind the step."""
    found = _DATASET.fullmatch(name.strip())
    take, path, places = found.groups() if found else (None, "", None)
    take = take or "last"
    if not found or take not in TAKE or "/" not in path:
        known = "point 1 y, factor, or TAKE(DATASET[I, J]) with TAKE of " + ", ".join(TAKE)
        raise InputError(f"quantity: expected a name such as {known}; found {shown(name)}")
    return take, path, tuple(int(place) for place in places.split(",")) if places else ()


def _is_small(quantity: Quantity, results: Results) -> bool:
    value, scale = quantity.read(results, float("inf"))
    return abs(value) < SMALL * scale or scale <= AT_REST * extent_of(results)


def extent_of(results: Results) -> float:
    """The larger side of the box around a model."""
    return float(np.ptp(results.vertices, axis=0).max())


def measure(quantity: Quantity, results: Results, end: float) -> tuple[float, float] | None:
    """The number of a run, and what its changes are shares of; None where the run has not come so far."""
    try:
        return quantity.read(results, end)
    except (InputError, IndexError, KeyError):
        return None
