# SPDX-License-Identifier: MIT
"""Names of fields and numbers that commands begin with, without what computes them: their help loads no NumPy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class JointField:
    """A number for every point of a joint."""

    label: str
    dimension: str  # for its unit


#: Label, for axes and colour bars, description, and dimension (for its unit) of each field of blocks.
FIELD_TEXTS = {
    "displacement": ("displacement", "of the centroid since the start", "length"),
    "displacement_x": ("displacement in x", "of the centroid since the start", "length"),
    "displacement_y": ("displacement in y", "of the centroid since the start", "length"),
    "rotation": ("rotation [rad]", "since the start, counter-clockwise", "rad"),
    "speed": ("speed", "of the centroid", "speed"),
    "velocity_x": ("velocity in x", "of the centroid", "speed"),
    "velocity_y": ("velocity in y", "of the centroid", "speed"),
    "spin": ("spin [rad per time]", "angular velocity, counter-clockwise", "spin"),
    "stress_x": ("σx", "tension positive", "stress"),
    "stress_y": ("σy", "tension positive", "stress"),
    "stress_xy": ("τxy", "shear stress", "stress"),
    "stress_min": ("smallest principal stress", "compression is negative", "stress"),
    "stress_max": ("largest principal stress", "tension positive", "stress"),
    "stress_mean": ("mean stress", "(σx + σy)/2, tension positive", "stress"),
    "stress_shear": ("largest shear stress", "half the difference of the principal stresses", "stress"),
    "material": ("block material", "number, from 1", ""),
    "block": ("block", "number, from 1", ""),
}
JOINT_FIELDS = {
    "normal_stress": JointField("normal stress of joints", "stress"),
    "shear_stress": JointField("shear stress of joints", "stress"),
    "opening": JointField("opening of joints", "length"),
    "slip": JointField("slip of joints", "length"),
    "mobilised": JointField("mobilised shear strength", ""),
}
#: Of loosening: gradient of displacements below which rock moves together, and the share of the planned time at the end
#: of a run in which a point must be in equilibrium.
GRADIENT_LIMIT = 0.005
WINDOW = 2 / 3
