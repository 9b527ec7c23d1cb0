# SPDX-License-Identifier: MIT
"""Stiffness and strength of the grout around a bolt, from a pull test: force over displacement of its head.

A bar of the stiffness EA in L of grout obeys EA u'' = k u where the grout is elastic and EA u'' = s where it slips;
the slip goes in from the head. With lambda^2 = k/EA, a the length that slips and F_e the force at its end

    F_e = EA lambda (s/k) tanh(lambda (L - a)),   F = F_e + s a,   d = s/k + F_e a/EA + s a^2/2EA,   0 <= a <= L

before it d = F/(EA lambda tanh(lambda L)), after it F = s L. `read_pull_test` reads the curve, `calibrate_bolt` finds
k and s by least squares on the displacements' curve and says how well the curve determines them. A parameter that it
does not determine is an error: k of a curve on the plateau alone, s of one that has not begun to slip.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arrays import BoolArray, FloatArray
from ..errors import InputError, need
from ..text import PathLike, read_text
from ..units import FORCES, LENGTHS

__all__ = ["BoltFit", "PullTest", "calibrate_bolt", "pull_curve", "read_pull_test"]


#: A parameter is determined when the half of its 95 % interval is at most this share of it.
DETERMINED = 0.25
#: Grout weakens where the force ends below the first share of its largest value; points behind the first fall below the
#: second share are left out. Each force is the median of five neighbours, so that noise does not count as a fall.
FALLEN, FALLS = 0.9, 0.96
#: Steel yields: points from this share of the yield force on are no points of the grout.
BEFORE_YIELD = 0.98
#: No curve is measured better than to this share of its largest force.
LEAST_SCATTER = 1e-3
#: Values that bolts have, by option, and other units: what lies outside in SI and inside in one of them is refused.
POSSIBLE = {
    "length": (0.05, 500.0, "m", {"mm": 1e-3, "cm": 1e-2}),
    "free_length": (0.0, 500.0, "m", {"mm": 1e-3, "cm": 1e-2}),
    "diameter": (1e-3, 0.5, "m", {"mm": 1e-3, "cm": 1e-2}),
    "area": (1e-7, 0.2, "m²", {"mm²": 1e-6, "cm²": 1e-4}),
    "young": (1e9, 1.3e12, "Pa", {"GPa": 1e9, "MPa": 1e6}),
    "yield_force": (1e3, 1e9, "N", {"kN": 1e3, "MN": 1e6}),
}
#: No head moves by this share of the bolt.
MOST_MOVED = 0.3
#: Grout has such numbers; others are reported.
USUAL = {"grout_stiffness": (1e7, 1e11, "N/m²"), "grout_strength": (1e4, 1e7, "N/m")}
_FRONTS = 2000  # lengths of slip at which the curve is computed; linear between them


@dataclass(frozen=True)
class PullTest:
    """A measured curve [m, N]; of a file with the line and column where the head of the displacements stands."""

    displacement: FloatArray
    force: FloatArray
    name: str = ""
    line: int | None = None
    column: int | None = None


@dataclass(frozen=True, repr=False)
class BoltFit:
    """What a pull test says of the grout. Errors are half of the 95 % interval."""

    test: PullTest
    used: BoolArray  #: (n,) points of the fit
    length: float  #: in grout [m]
    axial: float  #: EA [N]
    free_length: float  #: between the place of measurement and the grout [m]
    grout_stiffness: float  #: [N/m²]
    grout_stiffness_error: float
    grout_strength: float  #: [N/m]
    grout_strength_error: float
    scatter: float  #: standard deviation of the force from the fit [N]
    notes: tuple[str, ...] = ()

    @property
    def onset(self) -> tuple[float, float]:
        """Displacement [m] and force [N] at which the head begins to slip."""
        wave = math.sqrt(self.grout_stiffness / self.axial)
        force = self.axial * wave * self.grout_strength / self.grout_stiffness * math.tanh(wave * self.length)
        return self.grout_strength / self.grout_stiffness + force * self.free_length / self.axial, force

    @property
    def plateau(self) -> float:
        """Force with which all of the bolt slips [N]."""
        return self.grout_strength * self.length

    @property
    def option_text(self) -> str:
        """The numbers as options of `&bolt`, in SI units."""
        return f"grout_stiffness = {self.grout_stiffness:.4g}, grout_strength = {self.grout_strength:.4g}"

    def force_at(self, displacement: npt.ArrayLike) -> FloatArray:
        """Force of the fit at displacements."""
        return pull_curve(
            displacement, self.length, self.axial, self.grout_stiffness, self.grout_strength, self.free_length
        )

    def plot(self, **options: Any) -> Any:
        """The measured points and the fit; the axes."""
        from ..plot.records import pull_test

        return pull_test(self, **options)

    def __repr__(self) -> str:
        return f"BoltFit({self.option_text}, {int(self.used.sum())} points)"


def pull_curve(
    displacement: npt.ArrayLike, length: float, axial: float, stiffness: float, strength: float,
    free_length: float = 0.0,
) -> FloatArray:  # fmt: skip
    """Force at displacements of the head of a bolt, which has a free length before the grout."""
    wave = math.sqrt(stiffness / axial)
    a = np.linspace(0.0, length, _FRONTS)
    at_front = axial * wave * strength / stiffness * np.tanh(wave * (length - a))
    force = np.concatenate([[0.0], at_front + strength * a])
    moved = np.concatenate([[0.0], strength / stiffness + at_front * a / axial + strength * a**2 / (2 * axial)])
    return np.interp(np.asarray(displacement, dtype=float), moved + force * free_length / axial, force)


def calibrate_bolt(
    test: PullTest | PathLike, *, length: float, young: float, diameter: float | None = None, area: float | None = None,
    free_length: float = 0.0, yield_force: float | None = None,
) -> BoltFit:  # fmt: skip
    """Fit stiffness and strength of the grout to a pull test; all in SI units.

    `length` is that in grout, `free_length` the steel between the measured point and the grout. Points at the yield
    force of the steel, and those after the largest force where the grout has weakened, are left out."""
    optimize = need("scipy.optimize", "records", "the fit of a pull test")
    if not isinstance(test, PullTest):
        test = read_pull_test(test)
    if (diameter is None) == (area is None):
        raise InputError("give diameter or area")
    values = {"length": length, "young": young, "diameter": diameter, "area": area, "yield_force": yield_force}
    for name, value in values.items():
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"{name}: must be above 0, found {value}")
    for name, value in (values | {"free_length": free_length}).items():
        _refuse_other_units(name, value)
    if not (math.isfinite(free_length) and free_length >= 0):
        raise InputError(f"free_length: must be 0 or more, found {free_length}")
    most = float(np.abs(test.displacement).max(initial=0.0))
    if most > MOST_MOVED * (length + free_length):
        raise InputError(
            f"the displacements go to {most:.4g} m, expected at most {MOST_MOVED:g} of the length of "
            f"{length + free_length:.4g} m: are they in mm under a head in m?",
            test.name or None, test.line, test.column,
        )  # fmt: skip
    axial = young * (area if area is not None else math.pi * diameter**2 / 4)  # type: ignore[operator]
    used, notes = _used_points(test, yield_force)
    moved, force = test.displacement[used], test.force[used]
    if len(force) < 4:
        raise InputError(f"at least 4 points with a force are needed, found {len(force)}", test.name or None)

    def missing(logs: FloatArray) -> FloatArray:
        stiffness, strength = np.exp(logs)
        found = pull_curve(moved, length, axial, stiffness, strength, free_length)
        return (found - force) / force.max()

    # the best of a grid, from long slips to none and from short bolts to long ones, is where the fit begins
    rigid = force.max() / (length * max(float(moved.max()), 1e-30))
    starts = [
        (float((missing(np.log([k, s])) ** 2).sum()), k, s)
        for k in rigid * np.geomspace(0.3, 3e3, 30)
        for s in force.max() / length * np.geomspace(0.7, 30.0, 12)
    ]
    best = min(
        (optimize.least_squares(missing, np.log([k, s]), diff_step=1e-4) for _, k, s in sorted(starts)[:3]),
        key=lambda tried: tried.cost,
    )
    stiffness, strength = (float(x) for x in np.exp(best.x))
    errors = [
        # a fit with an endless value that is as good leaves the value open
        error if _is_worse(_best_without(missing, best.x, k, optimize), best.fun) else math.inf
        for k, error in enumerate(_errors(best.jac, best.fun))
    ]
    _refuse_undetermined(test, errors, stiffness, strength, length, axial, float(force.max()))
    for name, value in (("grout_stiffness", stiffness), ("grout_strength", strength)):
        least, most, unit = USUAL[name]
        if not least <= value <= most:
            notes.append(
                f"{name} of {value:.3g} {unit} is unusual ({least:g} to {most:g}): are displacements and forces in the "
                f"units of the head?"
            )
    return BoltFit(
        test, used, length, axial, free_length,
        stiffness, stiffness * errors[0], strength, strength * errors[1],
        float(force.max() * math.sqrt((best.fun**2).sum() / max(1, len(force) - 2))), tuple(notes),
    )  # fmt: skip


def _refuse_other_units(name: str, value: float | None) -> None:
    """InputError for a number of a bolt that is one in another unit."""
    least, most, unit, others = POSSIBLE[name]
    if value is None or not math.isfinite(value) or least <= value <= most:
        return
    for other, size in others.items():
        if least <= value * size <= most:
            raise InputError(
                f"{name}: {value:g} {unit} cannot be, it seems to be in {other}, where it is {value * size:g} {unit}"
            )


def _used_points(test: PullTest, yield_force: float | None) -> tuple[BoolArray, list[str]]:
    """Points that say something of the grout, and what was left out."""
    notes = []
    used = test.force > 0
    if yield_force is not None and (test.force >= BEFORE_YIELD * yield_force).any():
        first = int(np.argmax(test.force >= BEFORE_YIELD * yield_force))
        notes.append(f"{len(used) - first} points from the yield force of the steel on are left out")
        used[first:] = False
    rows = np.flatnonzero(used)
    if len(rows) < 4:
        return used, notes
    padded = np.pad(test.force[rows], 2, mode="edge")
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)
    peak = int(np.argmax(smooth))
    if smooth[-1] < FALLEN * smooth[peak]:
        first = peak + int(np.argmax(smooth[peak:] < FALLS * smooth[peak]))
        used[rows[first:]] = False
        notes.append(
            f"{len(rows) - first} points after the largest force are left out: the force falls to "
            f"{100 * smooth[-1] / smooth[peak]:.0f} % of it (grout_residual, if all of the bolt slips there)"
        )
    return used, notes


def _best_without(missing: Any, logs: FloatArray, k: int, optimize: Any) -> float:
    """Least sum of squares where parameter k is endless: grout that does not give way, or does not slip."""

    def squares(other: float) -> float:
        both = np.array([other, other])
        both[k] = logs[k] + 14.0  # a million times the value
        return float((missing(both) ** 2).sum())

    other = float(logs[1 - k])
    return float(optimize.minimize_scalar(squares, bracket=(other - 0.2, other + 0.2)).fun)


def _is_worse(squares: float, rest: FloatArray) -> bool:
    """Is a sum of squares beyond what noise explains, by the best fit (F test, 1 in 1000)?"""
    stats = need("scipy.stats", "records", "the interval of a fit")
    free = max(1, len(rest) - 2)
    variance = max(float((rest**2).sum()) / free, LEAST_SCATTER**2)
    return bool((squares - float((rest**2).sum())) / variance > stats.f.ppf(0.999, 1, free))


def _errors(jacobian: FloatArray, rest: FloatArray) -> tuple[float, float]:
    """Half of the 95 % intervals of the logarithms of both parameters; infinite where there is none."""
    stats = need("scipy.stats", "records", "the interval of a fit")
    free = max(1, len(rest) - 2)
    variance = max(float((rest**2).sum()) / free, LEAST_SCATTER**2)
    information = jacobian.T @ jacobian
    values, vectors = np.linalg.eigh(information)
    if values[0] <= 1e-14 * max(values[1], 1e-300):
        blind = np.abs(vectors[:, 0])
        seen = math.sqrt(variance / values[1]) if values[1] > 0 else math.inf
        return tuple(math.inf if share > 1e-3 else 2 * seen for share in blind)  # type: ignore[return-value]
    spread = np.sqrt(variance * np.diag(np.linalg.inv(information)))
    factor = float(stats.t.ppf(0.975, free))
    return float(factor * spread[0]), float(factor * spread[1])


def _refuse_undetermined(
    test: PullTest, errors: list[float], stiffness: float, strength: float, length: float, axial: float,
    largest: float,
) -> None:  # fmt: skip
    """InputError where the curve leaves a parameter open, with what it says all the same."""
    if max(errors) <= DETERMINED:
        return
    wave = math.sqrt(stiffness / axial)
    elastic = axial * wave * math.tanh(wave * length)
    open_ones = []
    if not errors[0] <= DETERMINED:
        open_ones.append("grout_stiffness: the curve has too few points before the bolt slips")
    if not errors[1] <= DETERMINED:
        least = f"at least {largest * stiffness / elastic:.3g} N/m" if errors[0] <= DETERMINED else "it"
        open_ones.append(
            f"grout_strength: the curve has no plateau, nor does it bend enough to show one ({least}; pull further)"
        )
    known = []
    if errors[0] <= DETERMINED:
        known.append(f"grout_stiffness is {stiffness:.4g} N/m² ± {100 * errors[0]:.0f} %")
    if errors[1] <= DETERMINED:
        known.append(f"grout_strength is {strength:.4g} N/m ± {100 * errors[1]:.0f} %")
    message = "the pull test does not determine " + "; nor ".join(open_ones)
    raise InputError(message + "".join(f". What it determines: {text}" for text in known), test.name or None)


def read_pull_test(path: PathLike) -> PullTest:
    """A pull test from a table with its units in the head, such as `displacement [mm], force [kN]`.

    Commas, semicolons or tabs lie between the columns. Other columns are ignored; lines that begin with # are comments.
    """
    path = Path(path)
    text = read_text(path)
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise InputError("expected a head such as 'displacement [mm], force [kN]', found nothing", path)
    number, head = lines[0]
    first = number
    mark = next((mark for mark in (";", "\t", ",") if mark in head), ",")
    columns = _columns(path, number, head, mark)
    n_columns = len(next(csv.reader([head], delimiter=mark)))
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        cells = next(csv.reader([line], delimiter=mark))
        if len(cells) > n_columns:
            hint = "; decimal commas are not read" if mark == "," else ""
            raise InputError(f"expected {n_columns} values, found {len(cells)}{hint}", path, number, 1)
        row = []
        for name, (column, factor) in columns.items():
            cell = cells[column].strip() if column < len(cells) else ""
            place = sum(len(part) + 1 for part in cells[:column]) + 1
            try:
                value = float(cell)
            except ValueError:
                hint = "; decimal commas are not read" if re.fullmatch(r"[-+]?\d+,\d+", cell) else ""
                raise InputError(
                    f"expected a {name}, found {cell!r}{hint}" if cell else f"the {name} is missing",
                    path,
                    number,
                    place,
                ) from None
            if not math.isfinite(value):
                raise InputError(f"expected a finite {name}, found {cell!r}", path, number, place)
            row.append(factor * value)
        if rows and row[0] < rows[-1][0]:
            raise InputError("the displacement falls: give the loading alone, without unloading", path, number, 1)
        rows.append(row)
    if not rows:
        raise InputError("the table has a head, but no numbers", path)
    values = np.array(rows)
    at = columns["displacement"][0]
    return PullTest(
        values[:, 0], values[:, 1], str(path), first, sum(len(cell) + 1 for cell in head.split(mark)[:at]) + 1
    )


def _columns(path: Path, number: int, head: str, mark: str) -> dict[str, tuple[int, float]]:
    """Column and factor to SI of displacement and force, by the units in the head."""
    found: dict[str, tuple[int, float]] = {}
    for column, cell in enumerate(next(csv.reader([head], delimiter=mark))):
        unit = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]", cell)
        if not unit:
            continue
        for name, known in (("displacement", LENGTHS), ("force", FORCES)):
            if unit[1] in known and name not in found:
                found[name] = (column, known[unit[1]])
    missing = [name for name in ("displacement", "force") if name not in found]
    if missing:
        known = {"displacement": LENGTHS, "force": FORCES}[missing[0]]
        raise InputError(
            f"expected a column of {missing[0]}s with its unit in brackets ({', '.join(known)}), "
            f"as in 'displacement [mm], force [kN]', found {head.strip()!r}",
            path, number, 1,
        )  # fmt: skip
    return {name: found[name] for name in ("displacement", "force")}
