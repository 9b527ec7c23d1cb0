# SPDX-License-Identifier: MIT
"""Records of ground acceleration: read, cut, scale, resample, filter and correct them; what they do to simple systems.

>>> from rockdda import records
>>> quake = records.read("station.at2")  # doctest: +SKIP
>>> quake = records.correct_baseline(records.cut(quake, 2.0, 22.0))  # doctest: +SKIP
>>> records.write(quake, "quake.csv")  # for &quake record = 'quake.csv' # doctest: +SKIP

Between its samples a record is linear, for the program and for every number here: velocity, displacement, Arias
intensity, response spectra and the sliding block are the exact results for these straight lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .arrays import FloatArray
from .errors import InputError, need
from .native import Session
from .text import PathLike
from .writing import write_file

__all__ = [
    "Record", "Spectrum", "arias_intensity", "correct_baseline", "cut", "filtered", "husid", "newmark_displacement",
    "read", "resample", "response_spectrum", "scale", "significant_duration", "write",
]  # fmt: skip

GRAVITY = 9.81  # m/s²
LARGEST = 1e60  # number of a record, as the program has it
MOST_STEPS = 2_000_000  # of a record, and of the oscillators of its spectrum
HIGHEST_DEGREE = 20
POINTS_A_PERIOD = 40  # at least, of the oscillator: a peak between two of them is missed by less than 0.3 %


@dataclass(frozen=True, repr=False)
class Record:
    """Acceleration of the ground in one direction, (n,) times and values, linear in between."""

    time: FloatArray
    acceleration: FloatArray
    name: str = ""
    is_si: bool = False  # s and m/s², because the file named its unit; False: the units are not known

    def __post_init__(self) -> None:
        time = np.array(self.time, dtype=float)
        acceleration = np.array(self.acceleration, dtype=float)
        if time.ndim != 1 or time.shape != acceleration.shape or len(time) < 2:
            raise ValueError("a record needs as many times as accelerations, and at least two")
        if not (np.isfinite(time).all() and np.isfinite(acceleration).all()):
            raise ValueError("times and accelerations must be finite")
        if (np.diff(time) < 0).any():
            raise ValueError("times must not decrease")
        time.setflags(write=False)
        acceleration.setflags(write=False)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "acceleration", acceleration)

    def __repr__(self) -> str:
        name = f"{self.name!r}, " if self.name else ""
        return (
            f"Record({name}{len(self.time)} samples, t = {self.time[0]:g} to {self.time[-1]:g}, peak {self.peak:.4g})"
        )

    @property
    def step(self) -> float:
        """Largest step in time."""
        return float(np.diff(self.time).max())

    @property
    def duration(self) -> float:
        """Time from the first to the last sample."""
        return float(self.time[-1] - self.time[0])

    @property
    def velocity(self) -> FloatArray:
        """Velocity at the samples, zero at the first one."""
        dt = np.diff(self.time)
        return np.concatenate([[0.0], np.cumsum(0.5 * dt * (self.acceleration[1:] + self.acceleration[:-1]))])

    @property
    def displacement(self) -> FloatArray:
        """Displacement at the samples, zero at the first one."""
        dt, a, v = np.diff(self.time), self.acceleration, self.velocity
        return np.concatenate([[0.0], np.cumsum(dt * (v[:-1] + dt * (2 * a[:-1] + a[1:]) / 6))])

    @property
    def peak(self) -> float:
        """Largest acceleration of either sign."""
        return float(np.abs(self.acceleration).max())


@dataclass(frozen=True, repr=False)
class Spectrum:
    """Largest responses of damped oscillators to a record, one for each period."""

    period: FloatArray
    damping: float
    displacement: FloatArray  # relative to the ground

    def __repr__(self) -> str:
        periods = f"{len(self.period)} periods" + (f" to {self.period.max():g}" if len(self.period) else "")
        return f"Spectrum({periods}, damping {self.damping:g})"

    @property
    def velocity(self) -> FloatArray:
        """Pseudo-velocity, ω times the displacement."""
        return 2 * math.pi / self.period * self.displacement

    @property
    def acceleration(self) -> FloatArray:
        """Pseudo-acceleration, ω² times the displacement."""
        return (2 * math.pi / self.period) ** 2 * self.displacement


def read(
    path: PathLike, format: str | None = None, *, column: str | int | None = None, scale: float | None = None
) -> Record:
    """The record in a file, as the program reads it.

    `format` is 'csv' (the time in the first column; `column` names or numbers that of the acceleration, by default the
    second) or 'at2' (PEER); by default by the ending. `scale` multiplies the values: by default it brings them from the
    unit that the file names to m/s² (from g: 9.81), and is 1 where it names none; `is_si` of the record says which.
    `InputError` names line and column of what cannot be read."""
    path = Path(path)
    form = (format or "").lower()
    if form not in ("", "csv", "at2"):
        raise InputError(f"format {format!r} is not known; the formats are 'csv' and 'at2'", path)
    if column is not None and (form or path.suffix.lower().lstrip(".")) == "at2":
        raise InputError("column belongs to format 'csv': a file of PEER has one component", path)
    if scale is not None and not (math.isfinite(scale) and abs(scale) <= LARGEST):
        raise InputError(f"scale: expected a finite number, found {scale!r}", path)
    session = Session()
    (time, values), unit = session.read_motion(
        path, form, "" if column is None else str(column).strip(), scale is not None
    )
    session.warn()
    factor = scale if scale is not None else unit or 1.0
    if np.abs(factor * values).max() > LARGEST:
        raise InputError(f"accelerations times {factor:g} must not be larger than {LARGEST:g}", path)
    return Record(time, factor * values, path.stem, is_si=scale is None and unit > 0)


def write(record: Record, path: PathLike) -> Path:
    """The record as a CSV file that `&quake record = 'PATH'` and `read` read back exactly.

    Its header names the units m/s² where the record is known to be in them (`is_si`)."""
    path = Path(path)
    rows = "".join(f"{t!r},{a!r}\n" for t, a in zip(record.time.tolist(), record.acceleration.tolist(), strict=True))
    write_file(path, ("t [s],a [m/s2]\n" if record.is_si else "t,a\n") + rows)
    return path


def cut(record: Record, start: float | None = None, end: float | None = None, *, keep_time: bool = False) -> Record:
    """The part between two times, which begins at time 0 unless `keep_time`."""
    first = record.time[0] if start is None else max(start, record.time[0])
    last = record.time[-1] if end is None else min(end, record.time[-1])
    if not last > first:
        raise ValueError(f"nothing is left between {start} and {end}: the record lasts from {record.time[0]} to {last}")
    inside = (record.time > first) & (record.time < last)
    time = np.concatenate([[first], record.time[inside], [last]])
    ends = np.interp([first, last], record.time, record.acceleration)
    acceleration = np.concatenate([ends[:1], record.acceleration[inside], ends[1:]])
    return replace(record, time=time - (0.0 if keep_time else first), acceleration=acceleration)


def scale(record: Record, factor: float | None = None, *, peak: float | None = None) -> Record:
    """The record times a factor, or such that its largest acceleration is `peak`."""
    if (factor is None) == (peak is None):
        raise ValueError("give one of factor and peak")
    if factor is None:
        if not record.peak > 0:
            raise ValueError("a record of zeros has no peak to scale")
        assert peak is not None
        factor = peak / record.peak
    return replace(record, acceleration=factor * record.acceleration)


def resample(record: Record, step: float) -> Record:
    """The record at equal steps in time.

    Shorter steps keep its straight lines. For longer ones what the new steps cannot show, above 0.8 of half their rate,
    is filtered out first (needs SciPy: `pip install scipy`)."""
    if not step > 0:
        raise ValueError("the step must be greater than 0")
    if not record.duration / step < MOST_STEPS:
        raise ValueError(f"{record.duration:g} in steps of {step:g} are more than {MOST_STEPS} samples")
    n = math.floor(record.duration / step * (1 + 1e-12)) + 1
    if n < 2:
        raise ValueError(f"the record is shorter than one step of {step}")
    smooth = filtered(record, high=0.4 / step) if step > record.step * (1 + 1e-9) else record
    time = record.time[0] + step * np.arange(n)
    return replace(record, time=time, acceleration=np.interp(time, smooth.time, smooth.acceleration))


def filtered(record: Record, low: float | None = None, high: float | None = None, order: int = 4) -> Record:
    """The record between two frequencies [1/time]: Butterworth, forwards and backwards, so without a shift in phase.

    Needs SciPy: `pip install scipy`."""
    signal: Any = need("scipy.signal", "records", "filtering a record")
    time, acceleration = _equal_steps(record, record.step)
    nyquist = 0.5 / (time[1] - time[0])
    if low is None and high is None:
        raise ValueError("give low, high or both")
    for limit in (low, high):
        if limit is not None and not 0 < limit < nyquist:
            raise ValueError(f"the frequency {limit:g} is not between 0 and {nyquist:g}, half the rate of the record")
    kind = "bandpass" if low is not None and high is not None else "highpass" if low is not None else "lowpass"
    limits = [limit for limit in (low, high) if limit is not None]
    sections = signal.butter(order, limits if len(limits) == 2 else limits[0], kind, fs=2 * nyquist, output="sos")
    return replace(record, time=time, acceleration=signal.sosfiltfilt(sections, acceleration))


def correct_baseline(record: Record, degree: int = 1) -> Record:
    """The record less a polynomial in time, so that it ends at rest where it began.

    Degree 0: the velocity at the end becomes zero. Degree 1: the displacement, too. Higher ones also bring the velocity
    as near to zero throughout as they can (least squares with these two conditions)."""
    if not 0 <= degree <= HIGHEST_DEGREE:
        raise ValueError(f"the degree must be from 0 to {HIGHEST_DEGREE}")
    s = (record.time - record.time[0]) / record.duration
    # what the monomials s^k, linear between the samples as everything here is, make of velocity and displacement
    parts = [Record(record.time, s**k) for k in range(degree + 1)]
    velocities = np.column_stack([part.velocity for part in parts])
    conditions = [velocities[-1]]
    wanted = [record.velocity[-1]]
    if degree > 0:
        conditions.append(np.array([part.displacement[-1] for part in parts]))
        wanted.append(record.displacement[-1])
    a, b = np.array(conditions), np.array(wanted)
    coefficients, *_ = np.linalg.lstsq(a, b, rcond=None)
    if degree > 1:
        free = np.linalg.svd(a)[2][len(b) :].T  # directions that keep the conditions
        weight = np.sqrt(np.gradient(record.time))[:, None]
        rest = (record.velocity - velocities @ coefficients)[:, None]
        move, *_ = np.linalg.lstsq(weight * (velocities @ free), weight * rest, rcond=None)
        coefficients = coefficients + (free @ move)[:, 0]
    correction = sum(c * part.acceleration for c, part in zip(coefficients, parts, strict=True))
    return replace(record, acceleration=record.acceleration - correction)


def husid(record: Record, gravity: float = GRAVITY) -> FloatArray:
    """Arias intensity up to each sample, π/(2 g) ∫ a² dt [length/time]."""
    a, dt = record.acceleration, np.diff(record.time)
    parts = dt * (a[:-1] ** 2 + a[:-1] * a[1:] + a[1:] ** 2) / 3
    return math.pi / (2 * gravity) * np.concatenate([[0.0], np.cumsum(parts)])


def arias_intensity(record: Record, gravity: float = GRAVITY) -> float:
    """Arias intensity, π/(2 g) ∫ a² dt [length/time]."""
    return float(husid(record, gravity)[-1])


def significant_duration(record: Record, start: float = 0.05, end: float = 0.95) -> tuple[float, float]:
    """The times between which the Arias intensity grows from one share to another."""
    share = husid(record)
    if not share[-1] > 0:
        raise ValueError("a record of zeros has no significant duration")
    first, last = np.interp([start, end], share / share[-1], record.time)
    return float(first), float(last)


def _equal_steps(record: Record, step: float) -> tuple[FloatArray, FloatArray]:
    """Times and accelerations at equal steps of at most this length."""
    n = max(1, math.ceil(record.duration / step * (1 - 1e-9)))
    time = np.linspace(record.time[0], record.time[-1], n + 1)
    return time, np.interp(time, record.time, record.acceleration)


def response_spectrum(
    record: Record, periods: npt.ArrayLike | None = None, damping: float = 0.05, rest: float = 1.0
) -> Spectrum:
    """Largest displacement of damped oscillators on the ground (default: 100 periods from 0.05 to 5).

    `damping` is the share of critical damping, below 1. The motion is free for `rest` periods after the record.
    Each step is the exact solution for a straight line of acceleration (Nigam and Jennings 1969), between the samples
    and parts of these of at most 1/40 of the period, so that peaks between them are missed by less than 0.3 %."""
    period = np.geomspace(0.05, 5.0, 100) if periods is None else np.atleast_1d(np.asarray(periods, dtype=float))
    if not ((period > 0) & (period < LARGEST)).all():
        raise ValueError("periods must be greater than 0, and numbers")
    if not 0 <= damping < 1:
        raise ValueError("the damping must be at least 0 and less than 1")
    longest = float(np.diff(record.time).max())
    # oscillators whose steps differ by less than 2 are computed together
    steps = np.minimum(2.0 ** np.floor(np.log2(period / POINTS_A_PERIOD)), longest)
    largest = np.empty(len(period))
    for step in np.unique(steps):
        members = np.flatnonzero(steps == step)
        after = math.ceil(rest * POINTS_A_PERIOD * float(period[members].max() / period[members].min()))
        if not record.duration / step + len(record.time) + after < MOST_STEPS:
            raise ValueError(
                f"a record that lasts {record.duration:g} needs too many steps at a period of {period.min():g}"
            )
        dt, start, end = _parts(record, float(step))
        tail = np.full(after, float(period[members].min()) / POINTS_A_PERIOD)
        pieces = (np.append(dt, tail), np.append(start, 0 * tail), np.append(end, 0 * tail))
        largest[members] = _largest_displacement(pieces, period[members], damping)
    return Spectrum(period, damping, largest)


def _parts(record: Record, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The straight lines of a record in parts of at most this length: durations, values at their starts and ends."""
    gaps, a = np.diff(record.time), record.acceleration
    count = np.maximum(np.ceil(gaps / step * (1 - 1e-9)), 1).astype(int)
    line = np.repeat(np.arange(len(gaps)), count)
    part = np.arange(len(line)) - np.repeat(np.cumsum(count) - count, count)
    slope = (np.diff(a) / count)[line]
    return (gaps / count)[line], a[line] + part * slope, a[line] + (part + 1) * slope


def _largest_displacement(
    pieces: tuple[FloatArray, FloatArray, FloatArray], period: FloatArray, damping: float
) -> FloatArray:
    """Largest |u| of ü + 2 ζ ω u̇ + ω² u = -a(t), a linear in each piece: durations, values at starts and ends."""
    w = 2 * math.pi / period
    wd = w * math.sqrt(1 - damping**2)
    u, v, largest = np.zeros(len(w)), np.zeros(len(w)), np.zeros(len(w))
    free: dict[float, tuple[FloatArray, FloatArray, FloatArray]] = {}  # motion in a time
    for dt, first, last in zip(*(values.tolist() for values in pieces), strict=True):
        if dt <= 0:
            continue
        if dt not in free:
            if len(free) > 1000:
                free.clear()
            free[dt] = np.exp(-damping * w * dt), np.cos(wd * dt), np.sin(wd * dt)
        decay, c, s = free[dt]
        # particular solution p + q t of the straight line, and the free motion that meets the start
        q = (first - last) / dt / w**2
        p = (-first - 2 * damping * w * q) / w**2
        x, y = u - p, v - q
        z = (y + damping * w * x) / wd
        u = p + q * dt + decay * (x * c + z * s)
        v = q + decay * ((z * wd - damping * w * x) * c - (x * wd + damping * w * z) * s)
        np.maximum(largest, np.abs(u), out=largest)
    return largest


def newmark_displacement(
    record: Record, yield_acceleration: float | None = None, *, friction: float | None = None, slope: float = 0.0,
    gravity: float = GRAVITY, upslope: bool = False, history: bool = False,
) -> float | FloatArray:  # fmt: skip
    """How far a rigid block slides on moving ground (Newmark 1965), relative to the ground.

    With `yield_acceleration` the record is the acceleration along the plane, and the block slides with what it has
    beyond it, one way. With `friction` and `slope` [deg] the ground moves horizontally and a positive acceleration
    drives the block down the plane; the normal force follows the motion. `upslope` lets the block slide back, too.
    `history` gives the slip at the samples instead of the last value. Start and end of sliding within a straight piece
    of the record are found exactly."""
    if (yield_acceleration is None) == (friction is None):
        raise ValueError("give one of yield_acceleration and friction")
    a = record.acceleration
    if yield_acceleration is not None:
        if not yield_acceleration >= 0:
            raise ValueError("the yield acceleration must not be negative")
        down, up = a - yield_acceleration, -a - yield_acceleration
    else:
        assert friction is not None
        if not 0 <= friction < 90 or not -90 < slope < 90:
            raise ValueError("friction must be at least 0 and less than 90 degrees, the slope less than 90")
        angle = math.radians(slope)
        along = gravity * math.sin(angle) + a * math.cos(angle)
        normal = gravity * math.cos(angle) - a * math.sin(angle)
        if (normal <= 0).any():
            raise ValueError("the block would leave the plane")
        strength = math.tan(math.radians(friction)) * normal
        down, up = along - strength, -along - strength
    slip = _slide(record.time, down, up if upslope else np.full(len(a), -1.0))
    return slip if history else float(slip[-1])


def _slide(time: FloatArray, down: FloatArray, up: FloatArray) -> FloatArray:
    """Slip of a block that accelerates by `down` while it slides down, by `up` while it slides up."""
    slip, speed, sense = 0.0, 0.0, 0
    result = np.zeros(len(time))
    for k in range(len(time) - 1):
        left = float(time[k + 1] - time[k])
        forces = {+1: (float(down[k]), float(down[k + 1])), -1: (float(up[k]), float(up[k + 1]))}
        rates = {side: (b - a) / left if left > 0 else 0.0 for side, (a, b) in forces.items()}
        at = 0.0
        while at < left:
            if speed <= 0:
                at, sense = _next_start(forces, rates, at, left)
                if not sense:
                    break
            force = forces[sense][0] + rates[sense] * at
            lasts = _time_to_rest(speed, force, rates[sense])
            span = min(lasts, left - at)
            slip += sense * span * (speed + span * (force / 2 + span * rates[sense] / 6))
            speed = 0.0 if lasts <= left - at else speed + span * (force + span * rates[sense] / 2)
            at = left if span >= left - at else at + span
        result[k + 1] = slip
    return result


def _next_start(
    forces: dict[int, tuple[float, float]], rates: dict[int, float], at: float, end: float
) -> tuple[float, int]:
    """When a block at rest begins to slide, and which way; (end, 0) when it does not."""
    found = (end, 0)
    for side in (+1, -1):
        force = forces[side][0] + rates[side] * at
        if force > 0 or (force == 0 and rates[side] > 0):
            return at, side
        if rates[side] > 0:
            start = -forces[side][0] / rates[side]
            if at < start < found[0]:
                found = (start, side)
    return found


def _time_to_rest(speed: float, force: float, rate: float) -> float:
    """Smallest positive root of speed + force t + rate t²/2, inf when there is none."""
    if speed <= 0:
        return -2 * force / rate if rate < 0 and force > 0 else math.inf
    if rate == 0:
        return -speed / force if force < 0 else math.inf
    root = force**2 - 2 * rate * speed
    if root < 0:
        return math.inf
    q = -(force + math.copysign(math.sqrt(root), force))
    roots = [r for r in (q / rate, 2 * speed / q if q else math.inf) if r > 0]
    return min(roots, default=math.inf)
