# SPDX-License-Identifier: MIT
"""Table, comparison with earlier figures, and plot."""

from __future__ import annotations

from pathlib import Path

from figures import fit_exponent

# phases as the time loop measures them, grouped as the report names them
GROUPS = {
    "search": ("search", "links", "graph"),
    "assembly": ("block_terms", "assembly"),
    "solve": ("solve",),
    "judge": ("judge",),
    "update": ("update", "other"),
    "output": ("output",),
}
COLOURS = ("#4477aa", "#ccbb44", "#ee6677", "#228833", "#aa3377", "#bbbbbb")


def grouped(phases: dict[str, float]) -> dict[str, float]:
    return {group: sum(phases.get(name, 0.0) for name in names) for group, names in GROUPS.items()}


def shares_of(run: dict) -> dict[str, float]:
    """Seconds of a settled step by group of phases."""
    # a frame is written in the last step only
    return grouped({**run["settled"]["phases"], "output": run["last_output"]})


def table(rows: list[list[str]]) -> str:
    """Format texts as columns: the first left-aligned, the others right-aligned; the first row is the head."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
        lines.append("  ".join(cells).rstrip())
    lines.insert(1, "-" * max(len(line) for line in lines))
    return "\n".join(lines)


def ms(seconds: float) -> str:
    """Milliseconds with three significant digits."""
    value = 1e3 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def print_report(results: dict) -> None:
    machine, derived = results["machine"], results["derived"]
    print(f"{machine['processor']}, {machine['processors']} processors, {', '.join(machine['caches'])}")
    load = f"load {results['load_at_start']} to {results['load_at_end']}"
    print(f"{machine['date']}, revision {machine['revision']}, {load}")
    for line in machine["build"]:
        print(line)

    head = ["run (ms, one thread: CPU)", "blocks", "contacts", "first", "rounds", "settled", "rounds", "a round"]
    rows = [[*head, "solves", "iterations", *GROUPS, "kB/block"]]
    for run in results["runs"]:
        first, late = run["first"], run["settled"]
        phases = shares_of(run)
        cells = [run["name"], str(run["blocks"]), str(first["contacts"]), ms(first["seconds"]), str(first["rounds"])]
        cells += [ms(late["seconds"]), f"{late['rounds']:g}", ms(run["seconds_per_round"])]
        cells += [f"{late['solves']:g}", f"{late['iterations']:g}"]
        cells += [ms(phases[group]) if phases[group] > 0 else "-" for group in GROUPS]
        rows.append([*cells, f"{run['bytes_per_block'] / 1e3:.1f}"])
    print("\nSettled: median of the last third of the steps; phases: their mean there; output: of the last step.\n")
    print(table(rows))

    if "memory" in results:
        print("\nMemory bandwidth, GB/s")
        rows = [["threads", "copy", "triad", "read"]]
        for count, row in results["memory"].items():
            rows.append([count, *(f"{row[name] / 1e9:.1f}" for name in ("copy", "triad", "read"))])
        print(table(rows))
    passes = [run for run in results["runs"] if "floor_seconds" in run.get("passes", {})]
    if passes:
        print(
            "\nOne pass over the matrix (one thread). Floor: stored upper half in double precision, at the triad's rate"
        )
        rows = [["blocks", "matrix MB", "floor ms", "K x ms", "of floor", "PCG iteration ms", "of floor"]]
        for run in passes:
            p = run["passes"]
            cells = [str(run["blocks"]), f"{p['matrix_bytes'] / 1e6:.1f}", ms(p["floor_seconds"])]
            cells += [ms(p["product_seconds"]), f"{100 * p['product_rate']:.0f} %"]
            rows.append([*cells, ms(p["pcg_iteration_seconds"]), f"{100 * p['iteration_rate']:.0f} %"])
        print(table(rows))
    if "scipy" in results:
        print("\nLast system of the first step: SciPy's sparse direct solver (SuperLU) against the program's solver")
        rows = [["size", "ratio", "SciPy ms", "entries/1e6", "ours ms", "solver", "difference"]]
        for row in results["scipy"]:
            ours = next((run for run in results["runs"] if matches(run, row)), None)
            step = ours["first"] if ours else None
            cells = [str(row["size"]), f"{row['ratio']:g}", ms(row["seconds"]), f"{row['entries'] / 1e6:.1f}"]
            cells.append(ms(step["phases"]["solve"] / step["solves"]) if step and step["phases"] else "-")
            rows.append(
                [*cells, ("pcg" if step["iterations"] else "direct") if step else "-", f"{row['difference']:.1e}"]
            )
        print(table(rows))
    print()
    if "exponent_of_work" in derived:
        work, seconds = derived["exponent_of_work"], derived["exponent_of_seconds"]
        print(f"exponent of cost, from 1,000 blocks, steps 2 to 6: counted work {work:.3f}, time {seconds:.3f}")
    for count, factor in derived.get("speed_up", {}).items():
        if count != "1":
            by_work = derived.get("speed_up_by_work", {}).get(count)
            bound = f" (by the first thread's share of the work: {by_work:.2f})" if by_work else ""
            print(f"speed-up with {count} threads: {factor:.2f}{bound}")
    for count, factor in results.get("separate", {}).items():
        print(f"{count} separate runs of one thread at a time: {factor:.2f} times the work of one alone")
    if "threads_agree" in derived:
        print("results of all numbers of threads: " + ("the same bits" if derived["threads_agree"] else "DIFFERENT"))
    if "tunnel_seconds" in derived:
        done, seconds = derived["tunnel_steps"], derived["tunnel_seconds"]
        how = "" if done >= 2500 else f", extrapolated from the first {done} steps"
        print(f"tunnel, 2,500 steps: {seconds:.1f} s on one thread{how}")
    if "start_up" in results:
        up = results["start_up"]
        print(f"start-up to the end of one step, whole process: {ms(up['wall'])} ms (CPU {ms(up['cpu'])} ms)")
    if results["targets"]:
        rows = [["target", "reached", "wanted", ""]]
        for row in results["targets"]:
            sign = "at least" if row["at_least"] else "at most"
            value, wanted = f"{row['value']:.3g} {row['unit']}", f"{sign} {row['limit']:g} {row['unit']}"
            rows.append([row["name"], value, wanted, "met" if row["met"] else "MISSED"])
        print("\n" + table(rows))


def matches(run: dict, row: dict) -> bool:
    """Is this the run from which the matrix of the row came?"""
    wanted = "scaling" if row["ratio"] == 1 else "ratio"
    return (
        run["kind"] == wanted
        and run["model"] == "wall"
        and run["size"] == row["size"]
        and run["name"].endswith(f"ratio {row['ratio']:g}")
    )


def compare_with(before: dict, after: dict) -> None:
    """Times of the same runs, before and after."""
    old = {run["name"]: run for run in before["runs"]}
    rows = [["run (ms)", "first before", "after", "settled before", "after", "factor", "iterations before", "after"]]
    for run in after["runs"]:
        if run["name"] not in old:
            continue
        other = old[run["name"]]
        a, b = other["settled"]["seconds"], run["settled"]["seconds"]
        first = [ms(each["first"]["seconds"]) for each in (other, run)]
        counts = [f"{each['settled']['iterations']:g}" for each in (other, run)]
        rows.append([run["name"], *first, ms(a), ms(b), f"{a / b:.1f}", *counts])
    print(f"\nCompared with revision {before['machine']['revision']}, {before['machine']['date']}\n")
    print(table(rows))


def draw(results: dict, before: dict | None, path: Path) -> None:
    """Cost against size, shares of the phases, speed-up."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (cost, shares, threads) = plt.subplots(
        1, 3, figsize=(15, 4.8), gridspec_kw={"width_ratios": [1.25, 1.35, 0.8]}, layout="constrained"
    )
    draw_cost(cost, results, before)
    draw_shares(shares, results)
    draw_threads(threads, results)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def draw_cost(axes, results: dict, before: dict | None) -> None:
    """Settled cost of a step against blocks, with the fitted exponent."""
    sets = [(results, "now", "#ee6677", "o-")]
    if before:
        sets.insert(0, (before, f"before ({before['machine']['revision']})", "#999999", "s--"))
    for source, label, colour, style in sets:
        runs = [run for run in source["runs"] if run["kind"] == "scaling"]
        points = [(run["blocks"], 1e3 * run["early"]["seconds"]) for run in runs]
        if not points:
            continue
        large = [point for point in points if point[0] >= 900]
        if len(large) > 1:
            label += f": exponent {fit_exponent(large):.2f} from 1,000 blocks"
        axes.loglog(*zip(*points, strict=True), style, color=colour, label=label)
    for ratio, colour, marker in ((10, "#4477aa", "^"), (40, "#228833", "v"), (100, "#aa3377", "D")):
        runs = [run for run in results["runs"] if run["kind"] == "ratio" and run["name"].endswith(f"ratio {ratio}")]
        if runs:
            points = [(run["blocks"], 1e3 * run["settled"]["seconds"]) for run in runs]
            axes.loglog(*zip(*points, strict=True), marker + ":", color=colour, label=f"ratio {ratio}, settled")
    axes.set_xlabel("blocks")
    axes.set_ylabel("ms per step, one thread")
    axes.set_title("brick wall, ratio 1, mean of steps 2 to 6")
    axes.grid(True, which="both", alpha=0.25)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8)


def draw_shares(axes, results: dict) -> None:
    """Time of each phase, as share of the step."""
    runs = [run for run in results["runs"] if run["kind"] != "threads" and run["settled"]["phases"]]
    left = [0.0] * len(runs)
    for group, colour in zip(GROUPS, COLOURS, strict=True):
        widths = []
        for run in runs:
            phases = shares_of(run)
            widths.append(100 * phases[group] / sum(phases.values()))
        axes.barh(range(len(runs)), widths, left=left, color=colour, label=group)
        left = [a + b for a, b in zip(left, widths, strict=True)]
    axes.set_yticks(range(len(runs)), [run["name"] for run in runs], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of a settled step, %")
    axes.set_title("where the time goes", pad=24)
    axes.legend(fontsize=8, ncols=6, loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, columnspacing=0.8)


def draw_threads(axes, results: dict) -> None:
    """Speed-up against the number of threads, up to the number of processors."""
    processors = results["machine"]["processors"]
    points = [
        (int(count), factor)
        for count, factor in results["derived"].get("speed_up", {}).items()
        if int(count) <= processors
    ]
    runs = [run for run in results["runs"] if run["kind"] == "threads"]
    if len(points) > 1:
        x = [count for count, _ in points]
        axes.plot(x, x, "--", color="#999999", label="ideal")
        load = max(results["load_at_start"][0], results["load_at_end"][0])
        clock = "wall clock" + (f" (load {load:.0f})" if load > processors else "")
        axes.plot(x, [factor for _, factor in points], "o-", color="#4477aa", label=clock)
        by_work = {1: 1.0, **{int(n): factor for n, factor in results["derived"]["speed_up_by_work"].items()}}
        axes.plot(*zip(*by_work.items(), strict=True), "^-", color="#228833", label="first thread's CPU time")
        axes.set_xticks(x)
        axes.legend(fontsize=8)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("threads")
    axes.set_title(f"speed-up, {runs[0]['blocks']} blocks, PCG" if runs else "speed-up")
    axes.grid(True, alpha=0.25)
