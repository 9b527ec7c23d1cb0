#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draw the figure of boundaries in the user guide: docs/images/boundaries.png.

    scripts/draw_boundaries.py

A slope in jointed rock under its in-situ stress, between rollers, on a fixed base, with a load on the bench. Needs the
Python package with its compiled part (scripts/build) and matplotlib.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "postprocess"))

import matplotlib as mpl  # noqa: E402

mpl.use("Agg")

import rockdda  # noqa: E402

rockdda.__path__.append(os.environ.get("ROCKDDA_EXTENSION", str(ROOT / "build/python")))

from rockdda import plot  # noqa: E402


def slope() -> rockdda.Model:
    """Benches of a slope, and the ground below."""
    model = rockdda.Model("slope", e0=0.005, k01=0.0, steps=20, dt_max=0.01, stiffness=1e9)
    model.add_polygon([(0, 0), (24, 0), (24, 8), (15, 8), (12, 14), (0, 14)])
    for i in range(1, 12):
        y = 1.25 * i
        if y < 14:
            model.add_line((0, y), (24 if y < 8 else 15 - (y - 8) / 2, y))
    for i in range(1, 15):
        x = 1.6 * i
        model.add_line((x, 0), (x, 14 if x < 12 else 14 - 2 * (x - 12) if x < 15 else 8))
    model.add_block_material(density=2600, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    model.add_joint_material(friction_angle=40)
    model.options = {
        "contact": {"formulation": "length"},
        "boundary": [
            {"along": [0, 14, 0, 0], "kind": "roller"},
            {"along": [0, 0, 24, 0], "kind": "fixed"},
            {"along": [24, 0, 24, 8], "kind": "roller"},
            {"along": [0, 14, 12, 14], "kind": "traction", "pressure": 5e4},
        ],
        "in_situ": {"profile": [12, 14, 15, 8], "k0": 0.7},
    }
    return model


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        results = slope().run(output=Path(folder) / "slope.h5")
        axes = plot.blocks(results, "stress_y", units="SI", title="")
        plot.save(axes, ROOT / "docs/images/boundaries.png", 110)


if __name__ == "__main__":
    main()
