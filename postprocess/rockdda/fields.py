# SPDX-License-Identifier: MIT
"""Names of the fields of blocks and joints, without what computes them: the help of a command loads no NumPy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class JointField:
    """A number for every point of a joint."""

    label: str
    dimension: str  # for its unit


#: Label, for axes and colour bars, and description of each field of blocks.
FIELD_TEXTS = {
    "displacement": ("displacement", "of the centroid since the start"),
    "displacement_x": ("displacement in x", "of the centroid since the start"),
    "displacement_y": ("displacement in y", "of the centroid since the start"),
    "rotation": ("rotation [rad]", "since the start, counter-clockwise"),
    "speed": ("speed", "of the centroid"),
    "velocity_x": ("velocity in x", "of the centroid"),
    "velocity_y": ("velocity in y", "of the centroid"),
    "spin": ("spin [rad per time]", "angular velocity, counter-clockwise"),
    "stress_x": ("σx", "tension positive"),
    "stress_y": ("σy", "tension positive"),
    "stress_xy": ("τxy", "shear stress"),
    "stress_min": ("smallest principal stress", "compression is negative"),
    "stress_max": ("largest principal stress", "tension positive"),
    "stress_mean": ("mean stress", "(σx + σy)/2, tension positive"),
    "stress_shear": ("largest shear stress", "half the difference of the principal stresses"),
    "material": ("block material", "number, from 1"),
    "block": ("block", "number, from 1"),
}
JOINT_FIELDS = {
    "normal_stress": JointField("normal stress of joints", "stress"),
    "shear_stress": JointField("shear stress of joints", "stress"),
    "opening": JointField("opening of joints", "length"),
    "slip": JointField("slip of joints", "length"),
    "mobilised": JointField("mobilised shear strength", ""),
}
