# SPDX-License-Identifier: MIT
"""Figures from the output lines of repeated runs."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable

from programs import Run

COUNTS = ("rounds", "attempts", "solves", "assembled", "iterations", "contacts", "closed", "sliding", "stored")
BYTES_PER_STORED_BLOCK = 36 * 8 + 4  # values in double precision and a column number


def work_of(step: dict) -> int:
    """Counted work of a step: block products of the solver, block products and contacts of each solve."""
    return step["iterations"] * step["stored"] + step["solves"] * (step["stored"] + step["contacts"])


def summarize(run: Run, repeats: list[dict]) -> dict:
    """One run: counts as they are, seconds as minimum and median over the repeats."""
    first = repeats[0]
    for other in repeats[1:]:
        if other["end"]["checksum"] != first["end"]["checksum"]:
            raise SystemExit(f"{run.name}: two runs gave different results")
    end, model = first["end"], first["model"]
    blocks = model["blocks"]
    figures = {
        "name": run.name,
        "kind": run.kind,
        "model": run.model,
        "size": run.size,
        "blocks": blocks,
        "nominal_ratio": run.ratio,
        "ratio": model["ratio"],
        "dt": model["dt"],
        "k01": model["k01"],
        "threads": run.threads,
        "passive": run.passive,
        "solver": model["solver"],
        "repeats": len(repeats),
        "checksum": end["checksum"],
        "bytes_per_block": (end["peak_bytes"] - model["bytes_before_make"]) / blocks,
        "peak_bytes": end["peak_bytes"],
        "init_seconds": min(repeat["model"]["init_seconds"] for repeat in repeats),
    }
    steps = []
    for number, step in enumerate(first["steps"]):
        same = [repeat["steps"][number] for repeat in repeats]
        row = {name: step[name] for name in COUNTS}
        row["work"] = work_of(step)
        for clock in ("cpu", "wall", "first_thread", "output"):
            values = [other[clock] for other in same]
            row[clock] = min(values)
            row[clock + "_median"] = statistics.median(values)
        row["seconds"] = row["cpu"] if run.threads == 1 else row["wall"]
        # phases are measured on the wall clock: their shares of the best repeat, of the step's processor time
        best = min(same, key=lambda other: other["wall"])
        phases = {name: value for name, value in best.get("phases", {}).items() if value > 0}
        total = sum(phases.values())
        row["phases"] = {name: row["seconds"] * value / total for name, value in phases.items()} if total else {}
        steps.append(row)
    late = steps[-max(1, len(steps) // 3) :]
    figures["first"] = steps[0]
    figures["early"] = mean_of(steps[1:6] or steps)
    figures["settled"] = middle_of(late)
    figures["seconds_per_round"] = sum(step["seconds"] for step in late) / sum(
        step["rounds"] * step["attempts"] for step in late
    )
    figures["seconds_per_solve"] = sum(step["seconds"] for step in late) / sum(step["solves"] for step in late)
    figures["total_seconds"] = sum(step["seconds"] for step in steps)
    figures["n_steps"] = len(steps)
    figures["last_output"] = steps[-1]["output"]
    figures["steps"] = steps
    if "product_seconds" in end:
        names = ("product_seconds", "pcg_solve_seconds", "pcg_iterations", "pcg_iteration_seconds")
        figures["passes"] = {
            name: min(repeat["end"][name] for repeat in repeats) for name in names if name in first["end"]
        }
        figures["passes"]["matrix_bytes"] = steps[-1]["stored"] * BYTES_PER_STORED_BLOCK
    return figures


def mean_of(steps: list[dict]) -> dict:
    """Mean of each figure over steps 2 to 6, which runs of all sizes have; for exponents."""
    return _combine(steps, statistics.fmean)


def middle_of(steps: list[dict]) -> dict:
    """Settled figures: median of the last third of the steps; of phases the mean."""
    return _combine(steps, statistics.median)


def _combine(steps: list[dict], combine: Callable[[list[float]], float]) -> dict:
    row = {name: combine([step[name] for step in steps]) for name in steps[0] if name != "phases"}
    phases = sorted({name for step in steps for name in step["phases"]})
    row["phases"] = {name: statistics.fmean(step["phases"].get(name, 0.0) for step in steps) for name in phases}
    return row


def as_columns(steps: list[dict]) -> dict[str, list]:
    """Steps as one list for each figure, which makes a shorter file."""
    columns = {name: [step[name] for step in steps] for name in steps[0] if name != "phases"}
    for name in sorted({name for step in steps for name in step["phases"]}):
        columns["phase " + name] = [step["phases"].get(name, 0.0) for step in steps]
    return columns


def rounded(value):
    """Round all real numbers to five digits."""
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {name: rounded(each) for name, each in value.items()}
    if isinstance(value, list):
        return [rounded(each) for each in value]
    return value


def fit_exponent(points: list[tuple[float, float]]) -> float:
    """Slope of a straight line through the points in logarithms."""
    x = [math.log(a) for a, _ in points]
    y = [math.log(b) for _, b in points]
    mean_x, mean_y = statistics.fmean(x), statistics.fmean(y)
    above = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True))
    return above / sum((a - mean_x) ** 2 for a in x)
