# SPDX-License-Identifier: MIT
"""A model of blocks in memory, its files, its run, and a row of the table."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(os.environ.get("ROCKDDA_PROGRAM", ROOT / "build/bin/rockdda"))
G = 9.81
MOST_SECONDS = 600.0  # of a run, by the clock

Point = tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One line of the table: a case, what must be, and what is."""

    topic: str
    case: str
    truth: str
    result: str
    met: bool


class Failed(Exception):
    """A run that ended with an error."""


def material(
    density: float = 2500.0,
    gravity: float = G,
    modulus: float = 1e10,
    nu: float = 0.25,
    stress: Sequence[float] = (0, 0, 0),
    velocity: Sequence[float] = (0, 0, 0),
) -> list[float]:
    """Values of a block material in the order of the analysis file."""
    return [density, density * gravity, modulus, nu, *stress, 0, 0, 0, *velocity]


def turn(points: Sequence[Point], degrees: float, about: Point = (0.0, 0.0)) -> list[Point]:
    """Points turned counter-clockwise."""
    a = np.radians(degrees)
    moved = (np.asarray(points) - about) @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + about
    return [(float(x), float(y)) for x, y in moved]


def rectangle(x: float, y: float, width: float, height: float) -> list[Point]:
    """Corners counter-clockwise."""
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


def area(points: Sequence[Point]) -> float:
    """Area of a polygon."""
    x, y = np.asarray(points).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


@dataclass
class Results:
    """What the cases read of a run."""

    time: np.ndarray
    measured: np.ndarray
    rotation: np.ndarray
    energy: np.ndarray
    rounds: np.ndarray
    centroid: np.ndarray
    velocity: np.ndarray
    stress: np.ndarray
    frame_time: np.ndarray


@dataclass
class Model:
    """Blocks, points and numbers of a run."""

    dt: float = 0.01
    steps: int = 100
    g0: float = 1e10
    g2: float = 0.05
    k01: float = 1.0
    e0: float = 1e-3
    materials: list[list[float]] = field(default_factory=lambda: [material()])
    joints: list[list[float]] = field(default_factory=lambda: [[30.0, 0.0, 0.0]])
    blocks: list[tuple[list[Point], int]] = field(default_factory=list)
    edge_joints: dict[int, list[int]] = field(default_factory=dict)
    fixed: list[tuple[float, float, int]] = field(default_factory=list)
    prescribed: dict[int, list[Sequence[float]]] = field(default_factory=dict)
    loading: list[tuple[float, float, int, list[Sequence[float]]]] = field(default_factory=list)
    measured: list[tuple[float, float, int]] = field(default_factory=list)
    bolts: list[Sequence[float]] = field(default_factory=list)
    base: list[Sequence[float]] = field(default_factory=list)
    options: str = ""
    save_every: int = 1_000_000
    formulation: str = field(default_factory=lambda: os.environ.get("ROCKDDA_FORMULATION", "length"))

    def add(self, points: Sequence[Point], number: int = 1, held: bool = False) -> int:
        """Add a block, held near its corners or free; its number from 1."""
        self.blocks.append(([(float(x), float(y)) for x, y in points], number))
        n = len(self.blocks)
        if held:
            corners = np.asarray(points, dtype=float)
            middle = corners.mean(0)
            self.fixed += [(*map(float, middle + 0.8 * (p - middle)), n) for p in corners]
        return n

    def measure(self, x: float, y: float, block: int) -> None:
        """Record the motion of a point."""
        self.measured.append((float(x), float(y), block))

    def write(self, folder: Path) -> list[str]:
        """Files of the run; returns the arguments of the program."""
        vertices = sum(len(points) for points, _ in self.blocks)
        lines = ["rockdda-blocks 1", f"e0 {self.e0}", f"blocks {len(self.blocks)}", f"vertices {vertices}"]
        lines += [f"fixed {len(self.fixed)}", f"loading {len(self.loading)}", f"measured {len(self.measured)}"]
        lines += [f"bolts {len(self.bolts)}"]
        for number, (points, m) in enumerate(self.blocks, start=1):
            lines.append(f"block {number} {m} {len(points)}")
            joints = self.edge_joints.get(number, [1] * len(points))
            lines += [f"{x!r} {y!r} {j}" for (x, y), j in zip(points, joints, strict=True)]
        lines += ["fixed_points", *(f"{x!r} {y!r} {b}" for x, y, b in self.fixed)]
        lines += ["loading_points", *(f"{x!r} {y!r} {b}" for x, y, b, _ in self.loading)]
        lines += ["measured_points", *(f"{x!r} {y!r} {b}" for x, y, b in self.measured)]
        lines += ["bolt_list", *(" ".join(repr(v) for v in bolt) for bolt in self.bolts), "end"]
        (folder / "m.blk").write_text("\n".join(lines) + "\n", encoding="ascii")
        text = [f"{self.k01}", f"{self.steps} {len(self.materials)} {len(self.joints)}", f"{self.g2} {self.dt}"]
        tables = [self.prescribed.get(i, []) for i in range(len(self.fixed))] + [rows for *_, rows in self.loading]
        text += [f"{self.g0}", *(str(len(rows)) for rows in tables)]
        for rows in tables:
            text += [" ".join(repr(float(v)) for v in row) for row in rows]
        text += [" ".join(repr(float(v)) for v in values) for values in (*self.materials, *self.joints)]
        (folder / "m.df").write_text("\n".join([*text, "1.4"]) + "\n", encoding="ascii")
        options = self.options
        if "&contact" not in options:
            options += f"&contact formulation = '{self.formulation}' /\n"
        else:
            options = options.replace("&contact", f"&contact formulation = '{self.formulation}',")
        options += f"&run save_every = {self.save_every}, threads = 1 /\n"
        if self.base:
            (folder / "base.txt").write_text("\n".join(" ".join(map(str, row)) for row in self.base), encoding="ascii")
            options += "&load base_acceleration = 'base.txt' /\n"
        (folder / "m.nml").write_text(options, encoding="ascii")
        return [str(folder / "m.blk"), str(folder / "m.df"), "--config", str(folder / "m.nml")]

    def run(self) -> Results:
        """Run the program; raises Failed when it ends with an error, but not where a rising load is too much."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            command = [str(PROGRAM), "run", *self.write(folder), "-o", str(folder / "o.h5"), "--force"]
            try:
                done = subprocess.run(
                    command,
                    capture_output=True,
                    text=True,
                    check=False,
                    timeout=MOST_SECONDS,
                    env={**os.environ, "OMP_NUM_THREADS": "1"},
                )
            except subprocess.TimeoutExpired as error:
                raise Failed(f"longer than {MOST_SECONDS:.0f} s") from error
            if done.returncode != 0 and "lost equilibrium" not in done.stderr:
                raise Failed(f"exit {done.returncode}: {done.stderr.strip()[-300:]}")
            with h5py.File(folder / "o.h5") as f:
                history, frames = f["history"], f["frames"]
                return Results(
                    history["time"][:],
                    history["measured_displacement"][:],
                    history["measured_rotation"][:] if "measured_rotation" in history else np.zeros((0, 0)),
                    history["energy"][:],
                    history["open_close_iterations"][:],
                    frames["centroid"][:],
                    frames["velocity"][:],
                    frames["stress"][:],
                    frames["time"][:],
                )
