# SPDX-License-Identifier: MIT
"""Rules of thumb for the height of the rock that loads a tunnel.

Heights are in the unit of span and height of the tunnel.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError


@dataclass(frozen=True)
class RockLoad:
    """Expected height of loosened rock above the crown."""

    condition: str
    low: float
    high: float
    source: str


def terzaghi(condition: str, span: float, height: float) -> RockLoad:
    """Terzaghi (1946), in a tunnel of given span B and height H_t at a depth of up to 1.5 (B + H_t).

    Conditions: ``"horizontally stratified"`` (0 to 0.5 B), ``"vertically stratified"`` (0 to 0.25 B),
    ``"moderately jointed"`` (0 to 0.25 B), ``"blocky"`` (0.25 B to 1.1 (B + H_t))."""
    _check(span, height)
    ranges = {
        "horizontally stratified": (0.0, 0.5 * span),
        "vertically stratified": (0.0, 0.25 * span),
        "moderately jointed": (0.0, 0.25 * span),
        "blocky": (0.25 * span, 1.1 * (span + height)),
    }
    if condition not in ranges:
        raise InputError(f"condition: must be one of {', '.join(map(repr, ranges))}, found '{condition}'")
    return RockLoad(condition, *ranges[condition], source="Terzaghi (1946)")


def rose(rqd: float, span: float, height: float) -> RockLoad:
    """Rose (1982): Terzaghi's loads by rock quality designation RQD [%], between 30 and 85."""
    _check(span, height)
    if not 30 <= rqd <= 85:
        raise InputError(f"rqd: Rose's classes reach from 30 to 85 %, found {rqd}")
    if rqd >= 75:
        # at small heights 0.25 B is the larger of the two published limits
        low, high = sorted((0.25 * span, 0.2 * (span + height)))
        return RockLoad("moderately blocky", low, high, source="Rose (1982)")
    return RockLoad("very blocky", 0.2 * (span + height), 0.6 * (span + height), source="Rose (1982)")


def _check(span: float, height: float) -> None:
    for name, value in (("span", span), ("height", height)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{name}: must be greater than 0, found {value}")
