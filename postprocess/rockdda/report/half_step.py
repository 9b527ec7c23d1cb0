# SPDX-License-Identifier: MIT
"""The same model at half the time step: whether the results depend on the step."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ConvergenceError, InputError, InputWarning
from ..groups import as_list
from ..namelist import format_groups, parse_groups
from ..text import input_numbers
from . import facts
from .facts import HalfStep

if TYPE_CHECKING:
    from ..results import Results

__all__ = ["HalfStep", "compare_ends", "run_half_step"]

MANY = 1_000_000_000  # steps: the time ends the run
ENDS = ("until", "until_step", "until_time", "duration")  # of a stage
MOST_STEPS = 5000  # of a stage until equilibrium that names no other number


def run_half_step(results: Results) -> HalfStep:
    """Run the model of a results file again with half the largest time step, and compare the ends.

    Files that the input names beside the geometry (records, pressures) are looked for beside the results and in the
    current folder; `InputError` names one that is not there.
    """
    refused = _refusal(results)
    if refused:
        return HalfStep(f"not checked: {refused}")
    from ..simulation import run

    with tempfile.TemporaryDirectory(prefix="rockdda-") as folder:
        inputs = _write_inputs(results, Path(folder))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", InputWarning)  # the first run gave them
                half = run(**inputs, output=Path(folder) / "half.h5")
        except ConvergenceError as error:
            return HalfStep(f"the run at half the step failed: {error}", failed=True)
        with half:
            return compare_ends(results, half)


def _refusal(results: Results) -> str:
    """Why the run cannot be repeated; '' where it can."""
    if "search/factor" in results:
        return "this is a trial of a search; search again with half of dt_max"
    if not results.complete:
        return "the run did not come to its end"
    if not results.n_steps:
        return "the run has no steps"
    return ""


def _write_inputs(results: Results, folder: Path) -> dict[str, Any]:
    """The input texts with half the largest time step, as arguments of `run`."""
    geometry, analysis, config = (str(results[f"input/{name}"]) for name in ("geometry", "analysis", "config"))
    groups = {name: as_list(entries) for name, entries in parse_groups(config).items()} if config.strip() else {}
    _find_files(groups, results.path.parent)
    largest = facts.chosen(groups, "time", "dt_max") or _dt_max(analysis) or float(results["history/dt"][0])
    groups["time"] = [*groups.get("time", []), {"dt_max": 0.5 * float(largest)}]
    until_now = float(results["history/time"][-1])
    stages = groups.get("stage", [])
    for stage in stages:
        if "until_step" in stage:
            stage["until_step"] = 2 * int(stage["until_step"])
        if stage.get("until") == "equilibrium":
            stage["max_steps"] = 2 * int(stage.get("max_steps", MOST_STEPS))
    if not stages or not any(name in stages[-1] for name in ENDS):
        groups["run"] = [*groups.get("run", []), {"steps": MANY, "t_end": until_now}]
    for name, text in (("model.dc", geometry), ("model.df", analysis)):
        (folder / name).write_text(text, encoding="utf-8", errors="surrogateescape")
    if "model" in groups:
        groups["model"] = [{**groups["model"][0], "geometry": "model.dc"}]
        if analysis.strip():
            groups["model"][0]["analysis"] = "model.df"
    options = folder / "model.nml"
    options.write_text(format_groups(groups), encoding="utf-8")
    if "model" in groups:
        return {"geometry": options}
    return {"geometry": folder / "model.dc", "analysis": folder / "model.df", "config": options}


def _find_files(groups: dict[str, list[dict[str, Any]]], beside: Path) -> None:
    """Make the paths of files that the options name absolute."""
    for entries in groups.values():
        for group in entries:
            for name in facts.FILES:
                if name in group:
                    named = str(group[name])
                    found = facts.path_of(named, beside)
                    if found is None:
                        raise InputError(f"{named}, which the input names, lies neither beside the results nor here")
                    group[name] = str(found)


def _dt_max(analysis: str) -> float | None:
    """The largest time step (g1) of an analysis file."""
    numbers = input_numbers(analysis)  # k01, steps, number of block and joint materials, g2, g1
    return numbers[5] or None if len(numbers) > 5 else None


def compare_ends(results: Results, half: Results) -> HalfStep:
    """How far the ends of a run and of one of the same model at half the step differ.

    `InputError` where the blocks are others.
    """
    if not (
        np.array_equal(results.vertex_offset, half.vertex_offset) and np.array_equal(results.vertices, half.vertices)
    ):
        raise InputError("is no run of the same model: its blocks are others", half.path)
    if not half.complete:
        return HalfStep(f"the run at half the step ended early: {half.exit_reason}", failed=True)
    ends = [one.frames[-1] for one in (results, half)]
    there = ends[0].active & ends[1].active
    moved, stress = ([getattr(end, name)[there] for end in ends] for name in ("displacement", "stress"))
    largest = float(np.hypot(*moved[0].T).max(initial=0.0))
    apart = float(np.hypot(*(moved[1] - moved[0]).T).max(initial=0.0))
    steps = [float(np.mean(one["history/dt"])) if one.n_steps else 0.0 for one in (results, half)]
    return HalfStep(
        f"{half.n_steps} steps of {steps[1]:.2g} on average in place of {results.n_steps} of {steps[0]:.2g}",
        _share(apart, largest),
        _share(float(np.abs(stress[1] - stress[0]).max(initial=0.0)), float(np.abs(stress[0]).max(initial=0.0))),
    )


def _share(apart: float, largest: float) -> float:
    return apart / largest if largest else float(apart > 0)
