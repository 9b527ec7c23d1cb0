# SPDX-License-Identifier: MIT
"""Two programs on the same runs, in turn: ratios of their times pair by pair (scripts/bench --compare OLD NEW).

The speed of a shared machine drifts, so that times of different minutes cannot be compared. Here the programs
alternate, the one that begins too, and each pair gives one ratio; printed are the median of the ratios and the middle
half of them. Processor time does not contain what other programs take, but it grows where these share caches and
memory. Instructions of the user's code are counted by `perf` where the machine lets it, else on request by callgrind
(slow, one run each).
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from works import DEFAULTS, NAMES, Work, make_work

FIGURES = ("wall", "user", "cpu", "instructions")


@dataclass
class Outcome:
    """One run of one program."""

    figures: dict[str, float]
    summary: dict


def run_once(program: Path, work: Work, folder: Path, options: list[str], counter: list[str]) -> Outcome:
    """Run a program on an empty folder; its processor time is that of the process and its children."""
    for file in folder.iterdir():
        file.unlink()
    command = [*counter, str(program), "run", *work.arguments, *options, "--json", "--force", "--quiet"]
    command += ["-o", str(folder / "out.h5")]
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        begun = time.perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=err, cwd=folder)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begun
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        text, complaint = out.read().decode(), err.read().decode(errors="replace")
    if process.returncode not in (0, 3) or not text.startswith("{"):
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}:\n{complaint}")
    figures = {"wall": wall, "user": usage.ru_utime, "cpu": usage.ru_utime + usage.ru_stime}
    return Outcome(figures, json.loads(text.splitlines()[0]))


def perf_counts() -> bool:
    """Does `perf` count instructions on this machine?"""
    if not shutil.which("perf"):
        return False
    command = ["perf", "stat", "-x,", "-e", "instructions:u", "true"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode == 0 and done.stderr.split(",")[0].strip().isdigit()


def count_instructions(program: Path, work: Work, folder: Path, options: list[str], tool: str) -> float:
    """Instructions of the user's code in one run, by perf or callgrind."""
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "count"
        if tool == "perf":
            counter = ["perf", "stat", "-x,", "-e", "instructions:u", "-o", str(file), "--"]
        else:
            counter = ["valgrind", "--tool=callgrind", "--quiet", f"--callgrind-out-file={file}"]
        run_once(program, work, folder, options, counter)
        lines = file.read_text().splitlines()
    if tool == "perf":
        return float(next(line for line in lines if "instructions" in line).split(",")[0])
    return float(next(line for line in lines if line.startswith("totals:")).split()[1])


def middle(ratios: list[float]) -> tuple[float, float, float]:
    """Median, and the quarters below and above it."""
    if len(ratios) == 1:
        return ratios[0], ratios[0], ratios[0]
    low, half, high = statistics.quantiles(ratios, n=4, method="inclusive")
    return half, low, high


def compare(old: Path, new: Path, work: Work, pairs: int, options: list[str], tool: str) -> dict:
    """Figures of one run: medians of both programs and the ratios new/old."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        outcomes: dict[Path, list[Outcome]] = {old: [], new: []}
        for pair in range(-1, pairs):  # one pair to warm up
            for program in (old, new) if pair % 2 == 0 else (new, old):
                outcome = run_once(program, work, folder, options, [])
                if pair >= 0:
                    outcomes[program].append(outcome)
        row: dict = {"run": work.name, "pairs": pairs}
        for figure in FIGURES[:3]:
            before, after = ([each.figures[figure] for each in outcomes[program]] for program in (old, new))
            ratios = [b / a for a, b in zip(before, after, strict=True) if a > 0]
            row[figure] = [statistics.median(before), statistics.median(after), *(middle(ratios) if ratios else ())]
        if tool:
            counts = [count_instructions(program, work, folder, options, tool) for program in (old, new)]
            row["instructions"] = [*counts, counts[1] / counts[0]]
    for name in ("blocks", "steps", "unbalanced"):
        row[name] = [outcomes[program][-1].summary.get(name) for program in (old, new)]
    return row


def print_row(row: dict) -> None:
    blocks, steps = row["blocks"][0], row["steps"]
    count = f"{steps[0]} steps" if steps[0] == steps[1] else f"{steps[0]} -> {steps[1]} steps"
    print(f"{row['run']}: {blocks} blocks, {count}, {row['pairs']} pairs")
    for figure in FIGURES:
        values = row.get(figure)
        if not values or len(values) < 3:
            continue
        if figure == "instructions":
            print(f"  {figure:<13}{values[0] / 1e6:10.1f} -> {values[1] / 1e6:10.1f} M    ratio {values[2]:.3f}")
        else:
            a, b, ratio, low, high = values
            print(f"  {figure:<13}{1e3 * a:10.2f} -> {1e3 * b:10.2f} ms   ratio {ratio:.3f} ({low:.3f} ... {high:.3f})")
    sys.stdout.flush()


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        prog="scripts/bench --compare",
        description="Run two programs in turn and print the ratios NEW/OLD: median (middle half).",
    )
    parser.add_argument("old", type=Path, metavar="OLD", help="a rockdda program")
    parser.add_argument("new", type=Path, metavar="NEW", help="another one")
    parser.add_argument("--models", default=",".join(DEFAULTS), help=f"{NAMES}; default {','.join(DEFAULTS)}")
    parser.add_argument("--pairs", type=int, default=7, help="counted pairs of runs, default 7")
    parser.add_argument("--steps", type=int, help="steps of every run; default: those of each run")
    parser.add_argument("--threads", type=int, default=1, help="default 1; 0: the choice of the programs")
    parser.add_argument("--config", type=Path, action="append", default=[], help="options file for both programs")
    parser.add_argument("--callgrind", action="store_true", help="count instructions by callgrind where perf cannot")
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    options = parser.parse_args(arguments)
    for program in (options.old, options.new):
        if not os.access(program, os.X_OK) or program.is_dir():
            parser.error(f"{program} is not a program")
    if options.pairs < 1:
        parser.error("--pairs: expected a number above 0")
    tool = "perf" if perf_counts() else "callgrind" if options.callgrind else ""
    common = [] if options.threads == 0 else ["--threads", str(options.threads)]
    for file in options.config:
        common += ["--config", str(file.resolve())]
    rows = []
    print(f"ratios {options.new} / {options.old}; load {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory() as name:
        for model in options.models.split(","):
            try:
                work = make_work(model, Path(name), options.steps)
            except ValueError as problem:
                parser.error(str(problem))
            rows.append(compare(options.old.resolve(), options.new.resolve(), work, options.pairs, common, tool))
            print_row(rows[-1])
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
