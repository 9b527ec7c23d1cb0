# SPDX-License-Identifier: MIT
"""Starts the benchmark programs and reads what they print."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Run:
    """One run of bench_steps."""

    model: str
    size: int
    ratio: float | None = None
    softness: float | None = None
    steps: int = 5
    threads: int = 1
    solver: str = "auto"
    passes: int = 0
    output: bool = False
    passive: bool = False  # threads that wait do not spin
    matrix: Path | None = None
    kind: str = "model"
    name: str = field(init=False)

    def __post_init__(self) -> None:
        parts = [self.model, str(self.size)]
        if self.ratio is not None:
            parts.append(f"ratio {self.ratio:g}")
        if self.softness is not None:
            parts.append(f"g0 = {self.softness:g} E")
        if self.kind in ("threads", "output"):
            parts.append(f"{self.threads} thread(s), {self.solver}" if self.kind == "threads" else "with output")
        if self.passive:
            parts.append("passive")
        self.name = ", ".join(parts)


class Programs:
    """The programs of one build."""

    def __init__(self, folder: Path) -> None:
        self.bin = folder
        self.folder = Path()  # for files that come and go
        # a pool of idle BLAS threads would count as processor time of the run
        self.environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        for name in ("OMP_NUM_THREADS", "OMP_PLACES", "OMP_PROC_BIND"):
            if name in os.environ:
                print(f"{name}={os.environ[name]} is in effect", file=sys.stderr)

    def _lines(self, *command: str, passive: bool = False) -> list[dict]:
        environment = dict(self.environment)
        if passive:
            environment["OMP_WAIT_POLICY"] = "passive"
        done = subprocess.run(
            [str(self.bin / command[0]), *command[1:]], capture_output=True, text=True, env=environment, check=False
        )
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stderr}")
        return [json.loads(line) for line in done.stdout.splitlines()]

    def steps(self, run: Run) -> dict:
        """Model, steps, end of one run."""
        words = [run.model, f"blocks={run.size}", f"steps={run.steps}", f"threads={run.threads}"]
        words += [f"solver={run.solver}", f"passes={run.passes}"]
        if run.ratio is not None:
            words.append(f"ratio={run.ratio}")
        if run.softness is not None:
            words.append(f"softness={run.softness}")
        if run.matrix is not None:
            words.append(f"matrix={run.matrix}")
        if run.output:
            words.append(f"output={self.folder / 'output.h5'}")
        lines = self._lines("bench_steps", *words, passive=run.passive or run.threads > (os.cpu_count() or 1))
        return {"model": lines[0], "steps": lines[1:-1], "end": lines[-1]}

    def side_by_side(self, run: Run, count: int) -> float:
        """Mean wall-clock seconds of `count` equal runs that execute at the same time."""
        with ThreadPoolExecutor(count) as pool:
            outcomes = list(pool.map(self.steps, [run] * count))
        return sum(step["wall"] for outcome in outcomes for step in outcome["steps"]) / count

    def memory(self, threads: int) -> dict:
        """Bandwidth in bytes per second: copy, triad, read."""
        return self._lines("bench_memory", str(threads))[0]

    def start_up(self, model: Path, repeats: int) -> dict:
        """Seconds of the whole program for one step of a model of two blocks, results file included."""
        words = [str(self.bin / "rockdda"), "run", str(model), "--steps", "1", "--force", "--quiet"]
        words += ["-o", str(model / "out.h5")]
        wall, cpu = [], []
        for _ in range(repeats):
            before = os.times()
            begun = time.perf_counter()
            subprocess.run(words, check=True, capture_output=True, env=self.environment, cwd=model)
            wall.append(time.perf_counter() - begun)
            after = os.times()
            cpu.append(after.children_user - before.children_user + after.children_system - before.children_system)
        return {"wall": min(wall), "wall_median": sorted(wall)[len(wall) // 2], "cpu": min(cpu)}


def start_up_model(folder: Path) -> Path:
    """A block on an incline of 30 degrees, as a folder of input files."""
    model = folder / "slide"
    model.mkdir()
    c, s = math.cos(math.pi / 6), 0.5
    corners = [(6 * c, 6 * s), (6 * c - s, 6 * s + c), (8 * c - s, 8 * s + c), (8 * c, 8 * s)]
    base = [(0.0, 0.0), (10 * c, 5.0), (10 * c, 0.0)]
    lines = [(*base[i], *base[(i + 1) % 3]) for i in range(3)]
    lines += [(*corners[i], *corners[i + 1]) for i in range(3)]
    fixed = [(0.5, 0.05), (8.5, 0.05), (8.5, 4.5)]
    text = [f"0.001\n{len(lines)} 3\n0 0 {len(fixed)} 0 0 0"]
    text += [" ".join(f"{value:.12g}" for value in line) + " 1" for line in lines]
    text += [f"{x} {y} {x} {y}" for x, y in fixed]
    (model / "slide.dc").write_text("\n".join(text) + "\n")
    rock = "2500 24525 1e10 0.25  0 0 0 0 0 0  0 0 0"
    (model / "slide.df").write_text(f"1\n10\n1\n1\n0.01\n0.005\n1e9\n0 0 0\n{rock}\n20 0 0\n1.4\n")
    return model
