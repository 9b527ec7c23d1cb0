# SPDX-License-Identifier: MIT
"""A slide on a slope of bricks that stay at rest: block, analysis and options file of a run for scripts/bench.

Bricks of 1 m x 0.5 m in running bond on a fixed base, all of it turned by 20 degrees; on top of them the slide, one in
twenty of the bricks in ten courses. Stage 1 finds equilibrium with a friction angle of 35 degrees in all joints; stage
2, dynamic, takes 10 degrees for the joints of the slide.
"""

from __future__ import annotations

import math
from pathlib import Path

SLOPE = math.radians(20)
LENGTH, HEIGHT, DENSITY, STIFFNESS = 1.0, 0.5, 2500.0, 1e9


def write_slide(stem: Path, blocks: int, steps: int, ratio: float = 40) -> tuple[str, ...]:
    """Files of a slide of about so many blocks and so many dynamic steps; `ratio`: contact stiffness over 2 m/dt**2."""
    courses = min(20, max(2, round((blocks / 8) ** 0.5)))
    columns = max(2, round(0.95 * blocks / courses))
    boxes: list[tuple[float, ...]] = [(-1.0, -1.0, columns * LENGTH + 1, 0.0, 1)]
    boxes += bricks(0.0, columns * LENGTH, 0.0, courses, 1)
    thick = min(10, max(2, courses // 4))
    wide = max(2, round(0.05 * blocks / thick))
    # it lies in the upper half of the slope
    first = max(0.0, columns * LENGTH - wide * LENGTH - 2.0)
    boxes += bricks(first, first + wide * LENGTH, courses * HEIGHT, thick, 2)
    lines = ["rockdda-blocks 1", "e0 0.001", f"blocks {len(boxes)}", f"vertices {4 * len(boxes)}"]
    lines += ["fixed 4", "loading 0", "measured 0", "bolts 0"]
    turned = [[turn(x, y) for x, y in ((a, b), (c, b), (c, d), (a, d))] for a, b, c, d, _ in boxes]
    for number, (corners, box) in enumerate(zip(turned, boxes, strict=True), start=1):
        lines += [f"block {number} 1 4", *(f"{x:.12g} {y:.12g} {box[4]}" for x, y in corners)]
    lines += ["fixed_points", *(f"{x:.12g} {y:.12g} 1" for x, y in turned[0])]
    lines += ["loading_points", "measured_points", "bolt_list", "end"]
    names = [Path(f"{stem}.{ending}") for ending in ("blk", "df", "nml")]
    names[0].write_text("\n".join(lines) + "\n")
    step = (ratio * 2 * DENSITY * LENGTH * HEIGHT / STIFFNESS) ** 0.5
    rock = f"{DENSITY:g} {DENSITY * 9.81:.9g} 1e10 0.25 0 0 0 0 0 0 0 0 0"
    names[1].write_text(f"1\n{steps}\n1\n2\n0.01\n{step:.9g}\n{STIFFNESS:g}\n0 0 0 0\n{rock}\n35 0 0\n35 0 0\n1.4\n")
    names[2].write_text(
        "&stage name = 'weight', kind = 'static', until = 'equilibrium', max_steps = 100 /\n"
        f"&stage name = 'slide', kind = 'dynamic', duration = {steps * step:.9g} /\n"
        "&change stage = 'slide', joint_material = 2, friction = 10 /\n"
        "&output contacts = .false. /\n&run save_every = 1000000 /\n"
    )
    return str(names[0]), str(names[1]), "--config", str(names[2])


def bricks(left: float, right: float, bottom: float, courses: int, joint: int) -> list[tuple[float, ...]]:
    """Bricks in running bond."""
    found: list[tuple[float, ...]] = []
    for j in range(courses):
        x = left
        width = LENGTH / 2 if j % 2 else LENGTH
        while x < right - 1e-9:
            found.append((x, bottom + j * HEIGHT, min(x + width, right), bottom + (j + 1) * HEIGHT, joint))
            x += width
            width = LENGTH
    return found


def turn(x: float, y: float) -> tuple[float, float]:
    c, s = math.cos(SLOPE), math.sin(SLOPE)
    return c * x - s * y, s * x + c * y
