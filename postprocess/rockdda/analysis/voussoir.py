# SPDX-License-Identifier: MIT
"""The classic voussoir beam: a roof layer that carries its weight as a flat arch.

A layer of span S and thickness t without tensile strength, cut at mid-span and at the abutments, carries itself by a
parabolic arch that is compressed over a share n of the thickness, triangularly, with the greatest stress f_c at its
ends and middle (Evans 1941; Beer and Meek 1982). For a given n

    equilibrium      f_c = g S^2 / (4 n Z)                                        (A2)
    arm at first     Z0 = t (1 - 2n/3)                                            (A3)
    length of arch   L = S + 8 Z0^2 / (3 S)                                       (A4)
    shortening       dL = f_av L / E                                              (A5)
    arm at last      Z^2 = Z0^2 - 3 S dL / 8                                      (A7)

with the weight g per volume; the average stress is f_av = f_c/2 (2/3 + n/2) (Beer and Meek) or f_c/3 (2/3 + n)
(Diederichs and Kaiser 1999). Among all n the arch takes the one with the smallest f_c. The numbers are those of the
appendix of the thesis that RockDDA reproduces; its n = 2/3 (1 - Z/t) is a misprint of n = 3/2 (1 - Z/t), which is A3
turned round, and its last cycle is the minimum of f_c that is looked for here directly.

No n with an arch at all: the beam snaps through. Diederichs and Kaiser call the share of n without an arch the
buckling limit and advise against more than 35 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..errors import InputError

Variant = Literal["beer-meek", "diederichs-kaiser"]

#: Buckling limit that Diederichs and Kaiser allow in design.
DESIGN_BUCKLING_LIMIT = 0.35


@dataclass(frozen=True)
class VoussoirBeam:
    """A roof layer. Units are consistent, for example m, N/m3, Pa.

    ``strength`` (uniaxial compression) and ``friction_angle`` (of the joints, degrees) are needed for the factors of
    safety only."""

    span: float
    thickness: float
    unit_weight: float
    modulus: float
    strength: float | None = None
    friction_angle: float | None = None

    def __post_init__(self) -> None:
        for name in ("span", "thickness", "unit_weight", "modulus", "strength"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise InputError(f"{name}: must be greater than 0, found {value}")
        if self.friction_angle is not None and not 0 <= self.friction_angle < 90:
            raise InputError(
                f"friction_angle: must be at least 0 and less than 90 degrees, found {self.friction_angle}"
            )


@dataclass(frozen=True)
class VoussoirSolution:
    """State of the arch. When the beam snaps through, everything but ``buckling_limit`` is NaN."""

    beam: VoussoirBeam
    variant: Variant
    compressed_share: float  #: n
    moment_arm: float  #: Z
    first_moment_arm: float  #: Z0
    stress: float  #: f_c, compression positive
    buckling_limit: float  #: share of all n for which no arch exists, 0 … 1

    @property
    def snaps_through(self) -> bool:
        """No arch carries the layer."""
        return math.isnan(self.stress)

    @property
    def deflection(self) -> float:
        """Of mid-span, downwards: Z0 - Z."""
        return self.first_moment_arm - self.moment_arm

    @property
    def thrust(self) -> float:
        """T = f_c n t / 2, per thickness of one out of the plane."""
        return 0.5 * self.stress * self.compressed_share * self.beam.thickness

    @property
    def safety_crushing(self) -> float:
        """Strength over f_c (A9); NaN when no strength was given."""
        return math.nan if self.beam.strength is None else self.beam.strength / self.stress

    @property
    def safety_shear(self) -> float:
        """T tan(phi) over half the weight: f_c n tan(phi)/(g S) (A10); NaN without a friction angle."""
        if self.beam.friction_angle is None:
            return math.nan
        tangent = math.tan(math.radians(self.beam.friction_angle))
        return self.stress * self.compressed_share * tangent / (self.beam.unit_weight * self.beam.span)

    @property
    def required_friction_angle(self) -> float:
        """Friction angle [deg] at which the abutments just hold."""
        return math.degrees(math.atan(self.beam.unit_weight * self.beam.span / (self.stress * self.compressed_share)))


def solve_beam(beam: VoussoirBeam, variant: Variant = "beer-meek", samples: int = 2000) -> VoussoirSolution:
    """The arch of smallest stress. ``samples`` values of n are tried; the best one is then refined."""
    if variant not in ("beer-meek", "diederichs-kaiser"):
        raise InputError(f"variant: must be 'beer-meek' or 'diederichs-kaiser', found '{variant}'")
    if samples < 10:
        raise InputError(f"samples: must be at least 10, found {samples}")
    shares = (np.arange(samples) + 0.5) / samples
    stresses = np.array([_stress(beam, variant, n) for n in shares.tolist()])
    exists = np.isfinite(stresses)
    limit = float(1 - exists.mean())
    if not exists.any():
        return VoussoirSolution(beam, variant, math.nan, math.nan, math.nan, math.nan, limit)
    best = int(np.nanargmin(stresses))
    share = float(shares[best])
    low, high = max(share - 1 / samples, 1e-9), min(share + 1 / samples, 1.0)
    n = _golden_section(lambda share: _stress(beam, variant, share), low, high)
    arm = _arm(beam, variant, n)
    first = beam.thickness * (1 - 2 * n / 3)
    return VoussoirSolution(beam, variant, n, arm, first, _stress(beam, variant, n), limit)


def _arm(beam: VoussoirBeam, variant: Variant, n: float) -> float:
    """Z for a given n: the larger root of Z^3 - Z0^2 Z + 3/8 S L c = 0 with f_av/E = c/Z; NaN when there is none.

    The smaller root is the arch on its way through: its thrust falls as it sinks."""
    first = beam.thickness * (1 - 2 * n / 3)
    length = beam.span + 8 * first**2 / (3 * beam.span)
    share = (2 / 3 + n / 2) / 2 if variant == "beer-meek" else (2 / 3 + n) / 3
    c = share * beam.unit_weight * beam.span**2 / (4 * n) / beam.modulus
    q = 3 / 8 * beam.span * length * c
    # z = Z/Z0: z^3 - z + p = 0 has its larger root at 2/sqrt(3) cos(acos(-p sqrt(27)/2)/3) while p <= 2/sqrt(27)
    p = q / first**3
    argument = -p * math.sqrt(27) / 2
    if argument < -1:
        return math.nan
    return first * 2 / math.sqrt(3) * math.cos(math.acos(argument) / 3)


def _stress(beam: VoussoirBeam, variant: Variant, n: float) -> float:
    """f_c for a given n (A2); NaN without an arch."""
    return beam.unit_weight * beam.span**2 / (4 * n * _arm(beam, variant, n))


def _golden_section(function, low: float, high: float) -> float:
    """Place of the minimum of a function with one minimum; values without meaning count as infinite."""
    ratio = (math.sqrt(5) - 1) / 2

    def value(x: float) -> float:
        y = function(x)
        return math.inf if math.isnan(y) else y

    for _ in range(60):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        if value(a) <= value(b):
            high = b
        else:
            low = a
    return 0.5 * (low + high)
