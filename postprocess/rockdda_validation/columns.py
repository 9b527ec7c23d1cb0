# SPDX-License-Identifier: MIT
"""Columns of blocks that vibrate, or along which waves run; the exact motion of a column of blocks on linear joints."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from rockdda.model import Model
from rockdda.records import Record as Quake
from rockdda.records import write as write_record

from .vibration import block_mass, modes

if TYPE_CHECKING:
    from rockdda.results import Results

    from .case import Record

__all__ = [
    "BY_LENGTH", "SCHEMES", "STRONG", "Layer", "LinearColumn", "column", "run_quietly", "synthetic_record",
]  # fmt: skip

FloatArray = npt.NDArray[np.float64]
BY_LENGTH = "Contacts act by length, the default, whatever formulation the report is made for."
SCHEMES = {"shi": "Shi", "generalized_alpha": "generalised α, ρ∞ = 0.8"}
STRONG = 1e12  # Pa, cohesion and tensile strength of joints that stay linear
STATIONS = ((-0.5, 1 / 6), (0.0, 4 / 6), (0.5, 1 / 6))  # of an interval: place, share of its length
SUPPORT = 100.0  # fixed_stiffness_factor
LINES = 200  # frequencies of the synthetic record


@dataclass(frozen=True)
class Layer:
    """Equal blocks on top of each other."""

    count: int
    height: float
    density: float
    young: float
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stress: tuple[float, float, float] = (0.0, 0.0, 0.0)


def column(
    name: str, layers: Sequence[Layer], width: float, joints: Sequence[dict[str, Any]],
    joint_at: dict[int, int] | None = None, **options: Any,
) -> Model:  # fmt: skip
    """A column on y = 0, layers from below; interface i (1: between the first two blocks) has joint 1 or joint_at[i].

    Plane strain, Poisson's ratio 0, no gravity. joints: values of each joint material beside its friction.
    """
    model = Model(name, labelled=True, e0=1e-4 * min(layer.height for layer in layers), gravity=0.0)
    tops = [0.0]
    for number, layer in enumerate(layers, 1):
        model.add_block_material(
            density=layer.density, youngs_modulus=layer.young, poisson_ratio=0.0, velocity=layer.velocity,
            stress=layer.stress,
        )  # fmt: skip
        for _ in range(layer.count):
            y = tops[-1] + 0.5 * layer.height
            if number > 1:
                model.add_material_line((0.1 * width, y), (0.9 * width, y), material=number)
            tops.append(tops[-1] + layer.height)
    for values in joints:
        model.add_joint_material(friction_angle=45.0, **values)
    model.add_line((0, 0), (width, 0))
    for i, (below, above) in enumerate(itertools.pairwise(tops), 1):
        model.add_line((0, below), (0, above))
        model.add_line((width, below), (width, above))
        model.add_line((0, above), (width, above), joint=(joint_at or {}).get(i, 1))
    model.options = {"contact": {"formulation": "length"}, **options}
    return model


def run_quietly(record: Record, model: Model, name: str, quake: Quake | None = None) -> Results:
    """Run a model, its record of the ground beside it; only the first and the last frame are kept."""
    if quake is not None:
        (record.folder / name).mkdir(parents=True, exist_ok=True)
        write_record(quake, record.folder / name / "record.csv")
    model.options.setdefault("run", {})["save_every"] = 10**7
    return record.run(model, name)


def synthetic_record(duration: float = 10.0, step: float = 0.01, peak: float = 1.0) -> Quake:
    """A record like that of an earthquake on rock, made by a formula; no random numbers.

    A sum of cosines from 0.2 to 10 Hz, their amplitudes those of the spectrum of Kanai and Tajimi (2.5 Hz, damping
    0.6), their phases the parts behind the point of k² times the golden section; it grows for 15 % of the duration and
    dies away in the last 35 %. `peak` is in m/s².
    """
    n = round(duration / step)
    time = np.arange(n + 1) * step
    frequency = np.linspace(0.2, 10.0, LINES)
    ratio = (frequency / 2.5) ** 2
    spectrum = (1 + 1.44 * ratio) / ((1 - ratio) ** 2 + 1.44 * ratio)
    phase = 2 * math.pi * np.modf(np.arange(LINES) ** 2 * (math.sqrt(5) - 1) / 2)[0]
    motion = np.cos(2 * math.pi * np.outer(time, frequency) + phase) @ np.sqrt(spectrum)
    share = time / duration
    rising, falling = np.clip(share / 0.15, 0, 1), np.clip((1 - share) / 0.35, 0, 1)
    motion *= np.sin(0.5 * math.pi * rising) ** 2 * np.sin(0.5 * math.pi * falling) ** 2
    return Quake(time, peak * motion / np.abs(motion).max(), "synthetic")


class LinearColumn:
    """A column of blocks of uniform strain on linear joints, on a base that is held: its matrices and exact motion."""

    def __init__(
        self, layers: Sequence[Layer], width: float, normal: float, shear: float, support: float = SUPPORT
    ) -> None:
        self.heights = np.concatenate([np.full(layer.count, layer.height) for layer in layers])
        self.middle = np.cumsum(self.heights) - 0.5 * self.heights
        self.width, n = width, len(self.heights)
        self.mass, self.stiffness = np.zeros((6 * n, 6 * n)), np.zeros((6 * n, 6 * n))
        owners = [layer for layer in layers for _ in range(layer.count)]
        for i, layer in enumerate(owners):
            own = slice(6 * i, 6 * i + 6)
            self.mass[own, own] = block_mass(layer.density, width, layer.height)
            elastic = layer.young * np.diag([0, 0, 0, 1, 1, 0.5])
            self.stiffness[own, own] += elastic * width * layer.height
        for i in range(n - 1):
            y = self.middle[i] + 0.5 * self.heights[i]
            for place, share in STATIONS:
                jump = self.motion_at(i + 1, place * width, y) - self.motion_at(i, place * width, y)
                scale = np.sqrt([share * width * shear, share * width * normal])[:, None]
                self.stiffness += (scale * jump).T @ (scale * jump)
        for place in (-0.5, 0.5):  # a fixed boundary: springs at both ends of the edge
            held = self.motion_at(0, place * width, 0.0)
            self.stiffness += support * max(normal, shear) * width * held.T @ held
        self.frequencies, self.shapes = modes(self.stiffness, self.mass)

    def motion_at(self, block: int, x: float, y: float) -> FloatArray:
        """(2, n) that gives the displacement of a point from the unknowns; x from the axis of the column."""
        b = y - self.middle[block]
        move = np.zeros((2, len(self.mass)))
        move[:, 6 * block : 6 * block + 6] = [[1, 0, -b, x, 0, b / 2], [0, 1, x, 0, b, x / 2]]
        return move

    def free(self, speed: FloatArray, times: FloatArray, measure: FloatArray) -> FloatArray:
        """What `measure` (n,) reads after a start with these velocities (n,), from the position of rest."""
        parts = (self.shapes.T @ self.mass @ speed) * (measure @ self.shapes) / self.frequencies
        return np.asarray(np.sin(np.outer(times, self.frequencies)) @ parts)

    def shaken(self, quake: Quake, times: FloatArray, measure: FloatArray) -> FloatArray:
        """What `measure` reads, relative to the base, at equal steps that contain the samples of the record.

        Exact for straight lines between the samples: each mode is an oscillator under a load linear in a step.
        """
        a = np.interp(times, quake.time, quake.acceleration, right=0.0)
        push = np.zeros(len(self.mass))
        push[0::6] = 1.0
        factor = (self.shapes.T @ self.mass @ push) * (measure @ self.shapes)
        w, dt = self.frequencies, times[1] - times[0]
        cos, sin = np.cos(w * dt), np.sin(w * dt)
        x, v, out = np.zeros_like(w), np.zeros_like(w), np.zeros(len(times))
        for i in range(len(times) - 1):
            rest, slope = -a[i] / w**2, -(a[i + 1] - a[i]) / dt / w**2
            far, speed = x - rest, v - slope
            x = rest + slope * dt + far * cos + speed / w * sin
            v = slope - far * w * sin + speed * cos
            out[i + 1] = factor @ x
        return out
