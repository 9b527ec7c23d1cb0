# SPDX-License-Identifier: MIT
"""The same model at half the time step: one case of convergence, for a run that is there."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConvergenceError, InputError, InputWarning
from ..groups import as_list
from ..namelist import format_groups, parse_groups
from ..results import Results
from ..simulation import run
from ..study import render
from .template import read_source
from .variants import HALF_STEP, ends_with_a_stage, template_of

#: Options that name files beside the input.
FILES = ("record", "pressure_file", "base_acceleration")


@dataclass(frozen=True)
class HalfStep:
    """What the run at half the step shows."""

    words: str
    displacement: float | None = None  #: largest difference at the end, share of the largest displacement
    stress: float | None = None  #: largest difference at the end, share of the largest stress
    failed: bool = False  #: the run at half the step did not come to its end


def run_half_step(results: Results) -> HalfStep:
    """Run the model of a results file again with half the largest time step, and compare the ends.

    Files that the input names beside the geometry (records, pressures) are looked for beside the results and in the
    current folder; `InputError` names one that is not there."""
    refused = _refusal(results)
    if refused:
        return HalfStep(f"not checked: {refused}")
    with tempfile.TemporaryDirectory(prefix="rockdda-") as folder:
        model = _write_half(results, Path(folder))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", InputWarning)  # the first run gave them
                half = run(model, output=Path(folder) / "half.h5")
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


def _write_half(results: Results, folder: Path) -> Path:
    """The model with half the largest time step, from the input texts of its results."""
    geometry, analysis, config = (str(results[f"input/{name}"]) for name in ("geometry", "analysis", "config"))
    groups = {name: as_list(entries) for name, entries in parse_groups(config).items()} if config.strip() else {}
    _find_files(groups, results.path.parent)
    if "model" in groups:
        groups["model"] = [{**groups["model"][0], "geometry": "model.dc"}]
        if analysis.strip():
            groups["model"][0]["analysis"] = "model.df"
    texts = {"model.dc": geometry, "model.df": analysis, "model.nml": format_groups(groups)}
    for name, text in texts.items():
        if text.strip():
            (folder / name).write_text(text, encoding="utf-8", errors="surrogateescape")
    labelled, options = folder / "model.nml", folder / "model.nml" if groups else None
    legacy = (folder / "model.dc", folder / "model.df", options)
    with read_source(*(legacy if "model" not in groups else (labelled, None, None))) as found:
        # an automatic time step is that of the first step of the run
        facts = {"formulation": found.facts.get("formulation"), "time_step": float(results["history/dt"][0])}
        source = replace(found, facts=facts)
        end = None if ends_with_a_stage(source) else float(results["history/time"][-1])
        (folder / "half.nml").write_text(template_of(source, end_time=end), encoding="utf-8")
    (folder / "half.nml").write_bytes(render(folder / "half.nml", HALF_STEP.values(0)))
    return folder / "half.nml"


def _find_files(groups: Mapping[str, list[dict[str, Any]]], beside: Path) -> None:
    """Make the paths of files that the options name absolute."""
    for entries in groups.values():
        for group in entries:
            for name in FILES:
                if name in group:
                    named = str(group[name])
                    found = path_of(named, beside)
                    if found is None:
                        raise InputError(f"{named}, which the input names, lies neither beside the results nor here")
                    group[name] = str(found)


def path_of(named: str, beside: Path) -> Path | None:
    """A file that the options name, beside the results or in the current folder; None where it is in neither."""
    places = (folder / named for folder in (beside, Path.cwd()))
    return next((place.resolve() for place in places if place.is_file()), None)


def compare_ends(results: Results, half: Results) -> HalfStep:
    """How far the ends of a run and of one of the same model at half the step differ.

    `InputError` where the blocks are others."""
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
