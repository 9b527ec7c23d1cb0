# SPDX-License-Identifier: MIT
"""Runs the benchmark programs, gathers their figures in one JSON file, prints a table and draws a plot.

Called by scripts/bench. Every run is repeated; repeats of all runs are interleaved, so that a machine that is busy for
a while spoils one repeat of many runs rather than all repeats of one. Times are minima over the repeats: of processor
time with one thread (other programs on the machine do not count), of the wall clock with more.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from figures import as_columns, fit_exponent, rounded, summarize
from machine import describe_machine, load_average
from programs import Programs, Run, start_up_model
from report import compare_with, draw, print_report
from targets import judge_targets

SIZES = (100, 1000, 2000, 10_000, 100_000)
LARGE = 1_000_000
STEPS = {100: 40, 1000: 20, 2000: 20, 10_000: 10, 100_000: 6, LARGE: 3}
TUNNEL_STEPS = 2500
MODELS = ("wall", "roof", "tunnel", "slope", "slide")


def plan_runs(options: argparse.Namespace) -> list[Run]:
    """List the runs, each with a name of its own."""
    runs: list[Run] = []
    sizes = list(options.sizes)
    if "wall" in options.models:
        for size in sizes:
            steps = options.steps or STEPS.get(size, max(3, min(40, 100_000 // size)))
            if options.quick:
                steps = min(steps, 6)
            passes = 0 if options.quick else 5
            runs.append(Run("wall", size, ratio=1, steps=steps, passes=passes, solver=options.solver, kind="scaling"))
        if not options.quick:
            cases = [
                (2000, 10, 30),
                (2000, 40, 90),
                (2000, 100, 20),
                (10_000, 10, 10),
                (10_000, 40, 4),
                (10_000, 100, 4),
            ]
            for size, ratio, steps in cases:
                if size <= max(sizes):
                    runs.append(Run("wall", size, ratio=ratio, steps=steps, solver=options.solver, kind="ratio"))
            # soft blocks: a contact stiffness of 50 E
            if max(sizes) >= 2000:
                runs.append(Run("wall", 2000, ratio=40, softness=50, steps=8, solver=options.solver, kind="soft"))
    for model, size, steps in (("roof", 1000, 8), ("slope", 1000, 12), ("tunnel", 1100, 100), ("slide", 1, 200)):
        if model not in options.models:
            continue
        if model == "tunnel" and options.full_tunnel:
            steps = TUNNEL_STEPS
        if options.quick:
            steps = min(steps, 3)
        runs.append(Run(model, size, steps=steps, solver=options.solver, kind="model"))
    # runs that differ in the number of threads alone, one of them with output to a results file
    if "wall" in options.models:
        size = min(max(sizes), 10_000)
        steps = 2 if options.quick else 5
        for threads in sorted({1, *options.threads}):
            runs.append(Run("wall", size, ratio=1, steps=steps, threads=threads, solver="pcg", kind="threads"))
            if 1 < threads <= (os.cpu_count() or 1):
                runs.append(replace(runs[-1], passive=True))
        runs.append(Run("wall", size, ratio=1, steps=steps, output=True, kind="output"))
    return runs


def run_all(programs: Programs, runs: list[Run], repeats: int, say) -> list[dict]:
    """Figures of all runs. Deterministic results (counts, checksums) must agree between the repeats."""
    collected: dict[str, list[dict]] = {run.name: [] for run in runs}
    for repeat in range(repeats):
        for run in runs:
            if repeat > 0 and run.kind == "threads" and run.threads > (os.cpu_count() or 1):
                continue  # only there to compare results
            begun = time.monotonic()
            collected[run.name].append(programs.steps(run))
            say(f"repeat {repeat + 1}/{repeats}: {run.name} ({time.monotonic() - begun:.1f} s)")
    return [summarize(run, collected[run.name]) for run in runs]


def measure_direct(programs: Programs, sizes: list[int], folder: Path, say) -> list[dict]:
    """SciPy's sparse direct solver on the matrices of real steps."""
    from direct import solve_with_scipy

    rows = []
    for size in sizes:
        for ratio in (1,) if size < 2000 else (1, 40):
            path = folder / f"wall_{size}_{ratio}.bin"
            programs.steps(Run("wall", size, ratio=ratio, steps=1, matrix=path))
            rows.append({"size": size, "ratio": ratio, **solve_with_scipy(path)})
            path.unlink()
            say(f"SciPy, {size} blocks, ratio {ratio}: {rows[-1]['seconds']:.2f} s")
    return rows


def measure_separate(programs: Programs, counts: list[int]) -> dict:
    """Throughput of several simultaneous runs of one thread each over that of one: the limit that the machine sets.

    Two processors of a shared or virtual machine may be one core; then no program can be twice as fast with both.
    """
    run = Run("wall", 1000, ratio=1, steps=60, solver="pcg")
    alone, together = [], {count: [] for count in counts}
    for _ in range(3):
        alone.append(programs.side_by_side(run, 1))
        for count in counts:
            together[count].append(programs.side_by_side(run, count))
    return {str(count): count * min(alone) / min(together[count]) for count in counts}


def derive(results: dict) -> dict:
    """Exponents, speed-ups, rates against memory bandwidth."""
    derived: dict = {}
    runs = results["runs"]
    scaling = [run for run in runs if run["kind"] == "scaling" and run["size"] >= 1000]
    for name in ("work", "seconds"):
        points = [(run["blocks"], run["early"][name]) for run in scaling]
        if len(points) > 1:
            derived[f"exponent_of_{name}"] = fit_exponent(points)
    all_threads = [run for run in runs if run["kind"] == "threads"]
    threads = {run["threads"]: run for run in all_threads if not run["passive"]}
    if threads:
        base = threads[1]["settled"]["wall"]
        derived["speed_up"] = {str(count): base / run["settled"]["wall"] for count, run in threads.items()}
        derived["speed_up_by_work"] = {
            str(run["threads"]): threads[1]["settled"]["cpu"] / run["settled"]["first_thread"]
            for run in all_threads
            if run["passive"]
        }
        sums = {run["checksum"] for run in all_threads}
        derived["threads_agree"] = len(sums) == 1
    for run in runs:
        if run["model"] == "tunnel":
            derived["tunnel_steps"] = run["n_steps"]
            derived["tunnel_seconds"] = run["total_seconds"] * TUNNEL_STEPS / run["n_steps"]
    bandwidth = results.get("memory", {}).get("1")
    if bandwidth:
        for run in scaling:
            passes = run.get("passes") or {}
            if "pcg_iteration_seconds" not in passes:
                continue
            floor = passes["matrix_bytes"] / bandwidth["triad"]
            run["passes"]["floor_seconds"] = floor
            run["passes"]["iteration_rate"] = floor / passes["pcg_iteration_seconds"]
            run["passes"]["product_rate"] = floor / passes["product_seconds"]
    return derived


def main(arguments: list[str]) -> int:
    options = read_options(arguments)
    quiet = options.quiet

    def say(text: str) -> None:
        if not quiet:
            print(text, file=sys.stderr, flush=True)

    programs = Programs(options.bin.resolve())
    results: dict = {"format": 1, "machine": describe_machine(options.bin), "load_at_start": load_average()}
    results["options"] = {
        name: getattr(options, name)
        for name in ("sizes", "models", "threads", "repeats", "solver", "quick", "full_tunnel")
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        programs.folder = folder
        if not options.quick:
            counts = sorted({1, *(count for count in options.threads if count <= (os.cpu_count() or 1))})
            results["memory"] = {str(count): programs.memory(count) for count in counts}
            if "wall" in options.models:
                results["separate"] = measure_separate(programs, [count for count in counts if count > 1])
        results["runs"] = run_all(programs, plan_runs(options), options.repeats, say)
        if "slide" in options.models:
            results["start_up"] = programs.start_up(start_up_model(folder), 3 if options.quick else 15)
        if not options.quick and not options.no_scipy and "wall" in options.models:
            sizes = [size for size in options.sizes if 1000 <= size <= 10_000]
            results["scipy"] = measure_direct(programs, sizes, folder, say)
    results["load_at_end"] = load_average()
    results["derived"] = derive(results)
    results["targets"] = judge_targets(results)

    options.output.mkdir(parents=True, exist_ok=True)
    json_path = options.output / "bench.json"
    steps = {run["name"]: rounded(as_columns(run.pop("steps"))) for run in results["runs"]}
    write_json(options.output / "steps.json", {"machine": results["machine"], "runs": steps})
    write_json(json_path, rounded(results))
    before = json.loads(options.compare.read_text()) if options.compare else None
    print_report(results)
    if before:
        compare_with(before, results)
    if not options.no_plot:
        draw(results, before, options.output / "bench.png")
    print(f"\nfigures: {json_path} (every step: steps.json)")
    if not options.no_plot:
        print(f"plot: {options.output / 'bench.png'}")
    if not results["derived"].get("threads_agree", True):
        print("results differ between numbers of threads", file=sys.stderr)
        return 1
    return 0


def write_json(path: Path, value: dict) -> None:
    """Format one line for each run, which keeps the file short and readable."""
    parts = []
    for name, each in value.items():
        if isinstance(each, list) and each and isinstance(each[0], dict):
            text = "[\n" + ",\n".join(json.dumps(row) for row in each) + "\n]"
        else:
            text = json.dumps(each)
        parts.append(f"{json.dumps(name)}: {text}")
    path.write_text("{\n" + ",\n".join(parts) + "\n}\n")


def read_options(arguments: list[str]) -> argparse.Namespace:
    def whole_numbers(text: str) -> list[int]:
        values = [int(float(part)) for part in text.split(",")]
        if not values or min(values) < 1:
            raise argparse.ArgumentTypeError("expected numbers above 0, separated by commas")
        return values

    def names(text: str) -> list[str]:
        unknown = set(text.split(",")) - set(MODELS)
        if unknown:
            raise argparse.ArgumentTypeError(f"unknown {', '.join(unknown)}; expected some of {', '.join(MODELS)}")
        return text.split(",")

    parser = argparse.ArgumentParser(prog="scripts/bench", description="Measure RockDDA on this machine.")
    parser.add_argument("--sizes", type=whole_numbers, help="blocks of the wall, default 100,1000,2000,10000,100000")
    parser.add_argument("--models", type=names, default=list(MODELS), help=f"some of {','.join(MODELS)}; default all")
    parser.add_argument("--threads", type=whole_numbers, default=[1, 2, 3, 4], help="numbers of threads to compare")
    parser.add_argument("--repeats", type=int, help="default 3, with --quick 1")
    parser.add_argument("--steps", type=int, help="steps of the wall of ratio 1; default: by size")
    parser.add_argument("--solver", default="auto", help="default auto")
    parser.add_argument("--large", action="store_true", help="also a wall of a million blocks (about 12 GB, minutes)")
    parser.add_argument("--quick", action="store_true", help="seconds instead of minutes: small sizes, one repeat")
    parser.add_argument("--full-tunnel", action="store_true", help="all 2,500 steps of the tunnel instead of 100")
    parser.add_argument("--no-scipy", action="store_true", help="without the comparison with SciPy's direct solver")
    parser.add_argument("--no-plot", action="store_true", help="without the plot")
    parser.add_argument("--compare", type=Path, metavar="JSON", help="figures of an earlier run to compare with")
    parser.add_argument("--output", type=Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--bin", type=Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--quiet", action="store_true", help="no progress on standard error")
    options = parser.parse_args(arguments)
    if options.sizes is None:
        options.sizes = [1000, 10_000] if options.quick else list(SIZES)
    if options.large:
        options.sizes.append(LARGE)
    options.sizes = sorted(set(options.sizes))
    if options.repeats is None:
        options.repeats = 1 if options.quick else 3
    if options.repeats < 1:
        parser.error("--repeats: expected a number above 0")
    return options


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
