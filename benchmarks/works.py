# SPDX-License-Identifier: MIT
"""Whole runs of the program by name, for scripts/bench --compare: models as files, and the arguments of a run."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from programs import start_up_model
from slide import write_slide

ROOT = Path(__file__).resolve().parents[1]
NAMES = "start_up, frames, wall-BLOCKS, wall-BLOCKS-ratio-R, slide-BLOCKS, or a folder or labelled file of inputs/"
DEFAULTS = ["start_up", "frames", "wall-2000", "jointed_slope", "layered_roof"]


@dataclass(frozen=True)
class Work:
    """A run of the program; `arguments` follow `rockdda run`."""

    name: str
    arguments: tuple[str, ...]


def make_work(name: str, folder: Path, steps: int | None = None) -> Work:
    """The run of a name; files that it needs are written to `folder`. ValueError for a name of no run."""
    number_of_steps: tuple[str, ...] = () if steps is None else ("--steps", str(steps))
    if name == "start_up":
        model = folder / "start_up"
        model.mkdir(exist_ok=True)
        return Work(name, (str(start_up_model(model)), *(number_of_steps or ("--steps", "1"))))
    if name == "frames":
        return Work(name, (str(ROOT / "inputs/jointed_slope"), "--steps", str(steps or 100), "--save-every", "1"))
    wall = re.fullmatch(r"wall-(\d+)(?:-ratio-([\d.]+))?", name)
    if wall:
        files = write_wall(folder / name, int(wall[1]), float(wall[2] or 1))
        return Work(name, (*files, "--dialect", "g0", *(number_of_steps or ("--steps", "10"))))
    slide = re.fullmatch(r"slide-(\d+)", name)
    if slide:
        return Work(name, (*write_slide(folder / name, int(slide[1]), steps or 100), "--dialect", "g0"))
    found = ROOT / "inputs" / name
    if found.is_dir():
        return Work(name, (str(found), *number_of_steps))
    if found.with_suffix(".nml").is_file():
        return Work(name, (str(found.with_suffix(".nml")), *number_of_steps))
    raise ValueError(f"unknown run '{name}', expected {NAMES}")


def write_wall(stem: Path, blocks: int, ratio: float) -> tuple[str, str]:
    """Block and analysis file of the wall of bench_models.f90: bricks of 1 m x 0.5 m in running bond on a fixed base
    block, static, contact stiffness 1 GN/m, whose ratio to twice the mass over the square of the step is given."""
    length, height, density, stiffness = 1.0, 0.5, 2500.0, 1e9
    courses = max(2, round((0.5 * blocks * length / height) ** 0.5))
    columns = max(2, round((blocks - 1 - courses // 2) / courses))
    boxes = [(-1.0, -1.0, columns * length + 1, 0.0)]
    for j in range(courses):
        odd = j % 2
        for i in range(columns + odd):
            left = max(0.0, (i - 0.5 * odd) * length)
            boxes.append((left, j * height, min((i + 1 - 0.5 * odd) * length, columns * length), (j + 1) * height))
    lines = ["rockdda-blocks 1", "e0 0.001", f"blocks {len(boxes)}", f"vertices {4 * len(boxes)}"]
    lines += ["fixed 4", "loading 0", "measured 0", "bolts 0"]
    corners = [((a, b), (c, b), (c, d), (a, d)) for a, b, c, d in boxes]
    for number, block in enumerate(corners, start=1):
        lines += [f"block {number} 1 4", *(f"{x:.9g} {y:.9g} 1" for x, y in block)]
    lines += ["fixed_points", *(f"{x:.9g} {y:.9g} 1" for x, y in corners[0])]
    lines += ["loading_points", "measured_points", "bolt_list", "end"]
    block_file, analysis_file = Path(f"{stem}.blk"), Path(f"{stem}.df")
    block_file.write_text("\n".join(lines) + "\n")
    step = (ratio * 2 * density * length * height / stiffness) ** 0.5
    rock = f"{density:g} {density * 9.81:.9g} 1e10 0.25 0 0 0 0 0 0 0 0 0"
    analysis_file.write_text(f"0\n100\n1\n1\n0.01\n{step:.9g}\n{stiffness:g}\n0 0 0 0\n{rock}\n35 0 0\n1.4\n")
    return str(block_file), str(analysis_file)
