# SPDX-License-Identifier: MIT
"""Units of results, and what is shown of them.

A results file states the system of its units (`&model units`), or that they are any consistent ones. With a system,
values are shown in engineering multiples: mm or m, kPa or MPa, kN or MN. `--units` states the units of a file that
does not, `--show` those of the picture; `--units SI` names the system, and has the multiples too.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arrays import AnyArray
from .errors import InputError
from .materials import densities_and_weights
from .results import Results
from .storage.tables import POWERS, TABLES

__all__ = ["ConvertedResults", "Units", "check_units", "description", "in_units", "with_units"]

#: Length, time and force of the systems of `&model units`.
SYSTEMS = {"SI": ("m", "s", "N"), "kN": ("m", "s", "kN"), "mm": ("mm", "s", "N")}
#: Multiples that are shown: name, size in SI, smallest value in SI that is shown in it. As in src/model/data/units.f90.
MULTIPLES: dict[str, tuple[tuple[str, float, float], ...]] = {
    "length": (("m", 1.0, 0.1), ("mm", 1e-3, 0.0)),
    "area": (("m²", 1.0, 1e-2), ("mm²", 1e-6, 0.0)),
    "time": (("s", 1.0, 0.0),),
    "density": (("kg/m³", 1.0, 0.0),),
    "weight": (("kN/m³", 1e3, 0.0),),
    "stress": (("MPa", 1e6, 1e6), ("kPa", 1e3, 0.0)),
    "stiffness": (("MPa/m", 1e6, 1e6), ("kPa/m", 1e3, 0.0)),
    "force": (("MN", 1e6, 1e6), ("kN", 1e3, 0.0)),
    "single_force": (("MN", 1e6, 1e6), ("kN", 1e3, 0.0)),
    "section_force": (("MN/m", 1e6, 1e6), ("kN/m", 1e3, 0.0)),
    "moment": (("MNm/m", 1e6, 1e6), ("kNm/m", 1e3, 0.0)),
    "energy": (("MJ", 1e6, 1e6), ("kJ", 1e3, 1.0), ("J", 1.0, 0.0)),
    "speed": (("m/s", 1.0, 0.1), ("mm/s", 1e-3, 0.0)),
    "acceleration": (("m/s²", 1.0, 0.0),),
    "line_load": (("MN/m", 1e6, 1e6), ("kN/m", 1e3, 0.0)),
    "frequency": (("1/s", 1.0, 0.0),),
}
#: Powers of length, time and force of these quantities; forces and energies are shown for a metre of thickness, but for
#: the force of one bolt.
DIMENSIONS = {
    "length": (1, 0, 0), "area": (2, 0, 0), "time": (0, 1, 0), "density": (-4, 2, 1), "weight": (-3, 0, 1),
    "stress": (-2, 0, 1), "stiffness": (-3, 0, 1), "force": (-1, 0, 1), "energy": (0, 0, 1), "speed": (1, -1, 0),
    "acceleration": (1, -2, 0), "line_load": (-2, 0, 1), "frequency": (0, -1, 0), "single_force": (0, 0, 1),
    "section_force": (-1, 0, 1), "moment": (0, 0, 1),
}  # fmt: skip

LENGTHS = {"mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048}
TIMES = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "GN": 1e9, "kgf": 9.80665, "tf": 9806.65, "lbf": 4.4482216152605}

JOULES = {("N", "m"): "J", ("kN", "m"): "kJ"}
PASCALS = {("N", "m"): "Pa", ("kN", "m"): "kPa", ("MN", "m"): "MPa", ("N", "mm"): "MPa"}

# Bounds for solids and soils: density [kg/m³] and weight [N/m³]; 500 kg/m³ is dry peat, 23,000 is uranium-like.
DENSITY, WEIGHT = (200.0, 30_000.0), (2_000.0, 300_000.0)


#: Dimensions of the columns of tables, by what their names begin with; the others are pure numbers or names.
COLUMNS = (
    (r"time|dt", "time"),
    (r"max_displacement|measured_displacement|displacement|largest_opening|opening|slip|length|[xy][12]?$", "length"),
    (r"measured_stress|stress|normal_stress|shear_stress", "stress"),
    (r"force_per_metre|[NQ](_before|_behind)?$", "line_load"),
    (r"M$", "moment"),
    (r"force|fixed_force|boundary_force", "force"),
    (r"energy_", "energy"),
    (r"speed|velocity", "speed"),
    (r"spin", "spin"),
    (r"rotation|measured_rotation", "rad"),
)


def description(system: str) -> str:
    """'SI (m, kg, s, N, Pa)', as src/model/data/units.f90 has it; 'none' of any consistent units."""
    if system not in SYSTEMS:
        return "none"
    length, time, force = SYSTEMS[system]
    return f"{system} ({length}, {'kg' if system == 'SI' else 't'}, {time}, {force}, {PASCALS[force, length]})"


def dimension_of(column: str) -> str:
    """Dimension of a column of a table; '' of a pure number or a name."""
    return next((dimension for begin, dimension in COLUMNS if re.match(begin, column)), "")


def with_units(columns: Iterable[str], units: Units) -> list[str]:
    """Headers of a table: 'force_x [kN]'; the names alone where no units are known."""
    names = list(columns)
    if not units.length:
        return names
    return [units.label(name, dimension_of(name)) for name in names]


@dataclass(frozen=True)
class Units:
    """Names of the units of length, time and force; without names, labels show the quantity."""

    length: str = ""
    time: str = ""
    force: str = ""
    multiples: bool = False  #: show values in the multiples of engineers

    @classmethod
    def parse(cls, text: str | Units | None, results: Results | None = None) -> Units:
        """From 'm,s,N', or 'SI': these in engineering multiples. Without a text those that the results state."""
        if isinstance(text, Units):
            return text
        stated = SYSTEMS.get(results.units if results is not None else "none")
        if text and text.upper() == "SI":
            return cls(*SYSTEMS["SI"], multiples=True)
        parts = [part.strip() for part in (text or "").split(",")]
        if stated and (not text or tuple(parts) == stated):
            return cls(*stated, multiples=True)
        if not text:
            return cls()
        if len(parts) != 3 or not all(parts):
            raise InputError(f"units {text!r}: expected length, time, force, such as 'm,s,kN'")
        return cls(parts[0], parts[1], parts[2])

    def of(self, dimension: str) -> str:
        """The unit of a quantity, such as 'stress' or 'speed'; '' for pure numbers."""
        known = bool(self.length)
        length, time, force = (self.length, self.time, self.force) if known else ("length", "time", "force")
        names = {
            "length": length,
            "time": time,
            "force": force,
            "speed": f"{length}/{time}",
            "acceleration": f"{length}/{time}²",
            "line_load": f"{force}/{length}",
            "single_force": force,
            "section_force": f"{force}/{length}",
            "moment": f"{force}{length}/{length}" if known else "force × length/length",
            "frequency": f"1/{time}",
            "spin": f"rad/{time}",
            "stress": PASCALS.get((force, length), f"{force}/{length}²"),
            "energy": JOULES.get((force, length), f"{force} {length}" if known else "force × length"),
            "rad": "rad",
            "area": f"{length}²",
            "density": "kg/m³" if (force, length, time) == ("N", "m", "s") else f"t/{length}³" if known else "",
            "weight": f"{force}/{length}³",
            "stiffness": f"{PASCALS.get((force, length), f'{force}/{length}²')}/{length}",
        }
        return names.get(dimension, "")

    def multiple(self, dimension: str, largest: float) -> tuple[float, str]:
        """The factor on the numbers of the file, and the unit, in which values up to the largest one are shown."""
        known = MULTIPLES.get(dimension) if self.multiples else None
        sizes = _sizes(self)
        if known is None or sizes is None:
            return 1.0, self.of(dimension)
        in_si = _product(sizes, DIMENSIONS[dimension])
        found = abs(largest) * in_si
        chosen = [row for row in known if not np.isfinite(found) or found >= row[2] * (1 - 1e-12)]
        name, size, _ = (chosen or known[-1:])[0]
        return _ratio(in_si, size), name

    def of_section(self, name: str, largest: float) -> tuple[float, str]:
        """The factor and the unit in which N, M or Q of a lining are shown, per metre of thickness: 'kN/m', 'kNm/m'; ''
        where no unit is known."""
        factor, unit = self.multiple("moment" if name == "M" else "section_force", largest)
        return factor, unit if self.length else ""

    def of_bolt(self, has_spacing: bool, largest: float) -> tuple[float, str]:
        """The factor and the unit of forces of bolts: per bolt where rows have a spacing, else per metre."""
        return self.multiple("single_force" if has_spacing else "force", largest)

    def text(self, value: float, dimension: str, digits: int = 4) -> str:
        """'5.3 mm'."""
        factor, unit = self.multiple(dimension, value)
        return f"{factor * value:.{digits}g} {unit}".rstrip()

    def label(self, text: str, dimension: str) -> str:
        """'text [unit]'."""
        unit = self.of(dimension)
        return f"{text} [{unit}]" if unit else text


def _sizes(units: Units) -> tuple[float, float, float] | None:
    """Length, time and force in m, s, N; None where a name is unknown."""
    found = (LENGTHS.get(units.length), TIMES.get(units.time), FORCES.get(units.force))
    return None if None in found else found  # type: ignore[return-value]


def _product(factors: tuple[float, float, float], powers: tuple[int, int, int]) -> float:
    """A product of powers."""
    return float(np.prod([f**p for f, p in zip(factors, powers, strict=True)]))


def _ratio(a: float, b: float) -> float:
    """a / b, exact where both are powers of ten."""
    return float(f"{a / b:.12g}")


class ConvertedResults(Results):
    """A results file whose numbers are multiplied as they are read; it behaves as a file in the other units."""

    def __init__(self, path: Any, factors: tuple[float, float, float]) -> None:
        self._factors = factors
        super().__init__(path)

    def __getitem__(self, path: str) -> Any:
        found = super().__getitem__(path)
        return found if self._rows(path.strip("/")) is not None else self._converted(path.strip("/"), found)

    def _table(self, path: str, start: int, stop: int, *rest: int) -> AnyArray:
        return self._converted(path, super()._table(path, start, stop, *rest))

    @property
    def units(self) -> str:
        """None of the systems: the numbers are not those of the file."""
        return "none"

    def _converted(self, path: str, values: Any) -> Any:
        powers = TABLES[path].powers if path in TABLES else [POWERS["-"]]
        if powers == [POWERS["-"]]:
            return values
        factors = [_product(self._factors, of_column) for of_column in powers]
        return values * (np.array(factors) if len(factors) > 1 else factors[0])


def in_units(results: Results, units: str | Units, shown: str | Units) -> Results:
    """The results of a file in `units`, such as 'm,s,N', with all numbers in `shown`, such as 'm,s,kN'."""
    given, wanted = Units.parse(units), Units.parse(shown)
    sizes, targets = _sizes(given), _sizes(wanted)
    if sizes is None or targets is None:
        bad = given if sizes is None else wanted
        raise InputError(
            f"units {bad.length},{bad.time},{bad.force} cannot be converted; known are lengths {', '.join(LENGTHS)}, "
            f"times {', '.join(TIMES)}, forces {', '.join(FORCES)}"
        )
    return ConvertedResults(results.path, tuple(a / b for a, b in zip(sizes, targets, strict=True)))  # type: ignore[arg-type]


def check_units(results: Results, units: str | Units) -> None:
    """InputError when the file cannot be in these units: no material of it would have a possible density or weight.

    No check where names of units are unknown or the analysis file that the results hold cannot be read."""
    given = Units.parse(units)
    stated = Units.parse(None, results)
    if stated.length and (given.length, given.time, given.force) != (stated.length, stated.time, stated.force):
        names = ",".join((given.length, given.time, given.force))
        raise InputError(
            f"--units {names}: the file states other units, {results.units} ({stated.length}, {stated.time}, "
            f"{stated.force}); --show {names} converts to these",
            results.path,
        )
    sizes = _sizes(given)
    materials = _densities_and_weights(results)
    if sizes is None or not materials:
        return
    length, time, force = sizes
    mass = force * time**2 / length
    for density, weight in materials:
        in_si = density * mass / length**3, weight * force / length**3
        if DENSITY[0] <= in_si[0] <= DENSITY[1] or WEIGHT[0] <= abs(in_si[1]) <= WEIGHT[1]:
            return
    density, weight = materials[0]
    fitting = [
        name
        for name in ("m,s,N", "m,s,kN", "m,s,MN", "mm,s,N")
        if any(_fits(name, *material) for material in materials)
    ]
    hint = f"; it seems to be in {' or '.join(fitting)}" if fitting else ""
    names = f"{given.length},{given.time},{given.force}"
    raise InputError(
        f"--units {names}: the file cannot be in these units, its density {density:g} and weight {weight:g} would be "
        f"{density * mass / length**3:.3g} kg/m³ and {weight * force / length**3:.3g} N/m³{hint}. --units states the "
        f"units of the file; --show {names} converts to these",
        results.path,
    )


def _fits(name: str, density: float, weight: float) -> bool:
    sizes = _sizes(Units.parse(name))
    assert sizes is not None
    length, time, force = sizes
    return DENSITY[0] <= density * force * time**2 / length**4 <= DENSITY[1] and (
        weight == 0 or WEIGHT[0] <= abs(weight) * force / length**3 <= WEIGHT[1]
    )


def _densities_and_weights(results: Results) -> list[tuple[float, float]]:
    """Of the block materials in the input that the results hold; [] where it cannot be read."""
    try:
        return densities_and_weights(str(results["input/analysis"]), str(results["input/config"]))
    except (KeyError, InputError):
        return []
