# SPDX-License-Identifier: MIT
"""Targets for one thread on a current machine, and the figures that were reached."""

from __future__ import annotations


def judge_targets(results: dict) -> list[dict]:
    """One row for each target that these runs measure: name, value, limit, whether it is met."""
    runs = {(run["kind"], run["model"], run["size"], run.get("nominal_ratio")): run for run in results["runs"]}
    derived = results["derived"]
    rows: list[dict] = []

    def add(name: str, value: float | None, limit: float, unit: str, at_least: bool = False) -> None:
        if value is not None:
            met = value >= limit if at_least else value <= limit
            rows.append({"name": name, "value": value, "limit": limit, "unit": unit, "at_least": at_least, "met": met})

    def wall(size: int, ratio: int = 1) -> dict | None:
        return runs.get(("scaling" if ratio == 1 else "ratio", "wall", size, ratio))

    def settled(run: dict | None) -> float | None:
        return 1e3 * run["settled"]["seconds"] if run else None

    add("100 blocks, settled step", settled(wall(100)), 0.5, "ms")
    if run := wall(2000):
        add("2,000 blocks, ratio 1, settled round", 1e3 * run["seconds_per_round"], 8, "ms")
    if run := wall(2000, 40):
        add("2,000 blocks, ratio 40, first step", 1e3 * run["first"]["seconds"], 80, "ms")
        add("2,000 blocks, ratio 40, settled step", settled(run), 20, "ms")
    add("10,000 blocks, settled step", settled(wall(10_000)), 60, "ms")
    add("10,000 blocks, ratio 10, settled step", settled(wall(10_000, 10)), 150, "ms")
    if run := wall(100_000):
        add("100,000 blocks, settled step", settled(run), 800, "ms")
        add("100,000 blocks, memory", run["peak_bytes"] / 1e9, 4, "GB")
        add("exponent of counted work from 1,000 blocks", derived.get("exponent_of_work"), 1.05, "")
        add("exponent of time from 1,000 blocks", derived.get("exponent_of_seconds"), 1.15, "")
        passes = run.get("passes", {})
        for name, key in (("K x", "product_rate"), ("PCG iteration", "iteration_rate")):
            if key in passes:
                add(f"100,000 blocks, {name}, of memory-bound rate", 100 * passes[key], 50, "%", at_least=True)
    speed_up = derived.get("speed_up", {}).get("2")
    if any(run["kind"] == "threads" and run["size"] == 10_000 for run in results["runs"]):
        add("10,000 blocks, PCG, 2 threads", speed_up, 1.6, "times", at_least=True)
    add("tunnel, 2,500 steps", derived.get("tunnel_seconds"), 60, "s")
    if "start_up" in results:
        add("start-up to the end of the first step", 1e3 * results["start_up"]["wall"], 50, "ms")
    return rows
