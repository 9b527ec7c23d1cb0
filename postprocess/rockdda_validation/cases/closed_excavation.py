# SPDX-License-Identifier: MIT
"""An opening excavated in one step and in ten: the same place where nothing slips, another one where joints do."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.model import Model
from rockdda.plot.style import PALETTE, PAPER_WIDTH
from rockdda.results import Results

from ..case import Case, Record

FloatArray = npt.NDArray[np.float64]
SIDE, DEPTH = 7, 100.0  # blocks of 1 m, m of rock above
UNIT_WEIGHT, POISSON = 26e3, 0.25  # N/m3
HOLDS = {"friction": 35.0, "cohesion": 1e9, "tension": 1e9}
SLIPS = {"friction": 20.0}
MANY = 10


def opening(young: float, joint: dict[str, float], shares: int) -> Model:
    """Blocks in running bond under k0 = 0.5; three in a row are taken out, in equal shares, each to its equilibrium."""
    model = Model("opening", labelled=True, e0=0.001, gravity=9.81)
    model.add_polygon([(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE)])
    for row in range(SIDE):
        if row:
            model.add_line((0, row), (SIDE, row))
        shift = 0.5 * (row % 2)
        for k in range(1, SIDE + (row % 2)):
            model.add_line((k - shift, row), (k - shift, row + 1))
    model.add_measured((0.5 * SIDE, 4.5))
    # contacts of vertices come to rest only to 1e-7
    model.options.setdefault("contact", {})["formulation"] = "length"
    model.add_block_material(density=UNIT_WEIGHT / 9.81, young=young, poisson=POISSON)
    model.add_joint_material(**joint)
    for along in ([(0, SIDE), (0, 0)], [(0, 0), (SIDE, 0)], [(SIDE, 0), (SIDE, SIDE)]):
        model.add_boundary(along, "roller")
    pressure = UNIT_WEIGHT * DEPTH
    model.add_boundary([(0, SIDE), (SIDE, SIDE)], "traction", pressure=pressure)
    model.add_in_situ(surface=float(SIDE), surcharge=pressure, k0=0.5)
    model.add_region("opening", box=(1.9, 2.9, 5.1, 4.1))
    end = {"until": "equilibrium", "tolerance": 1e-7}
    model.add_stage("ground", reset_displacement=True, **end)
    for k in range(1, shares + 1):
        first = {"excavate": "opening"} if k == 1 else {}
        model.add_stage(f"share {k}", relax=k / shares, relax_steps=1, **first, **end)
    return model


def moved(results: Results) -> FloatArray:
    """Displacements of all corners that are there at the end."""
    last = results.frames[-1]
    there = np.repeat(last.active, np.diff(results.vertex_offset))
    return np.asarray(last.vertices - results.vertices)[there]


def order_of_stages(record: Record) -> None:
    """Elastic joints at three strains, then joints that slip."""
    record.text(
        f"""
{SIDE} courses of blocks of 1 m lie in running bond under {DEPTH:g} m of rock (k0 = 0.5) between rollers. Three blocks
beside each other are taken out: the forces that they gave are released at once, or in {MANY} stages, each to its
equilibrium. Joints that hold leave the ground elastic: the end does not depend on the way to first order in the strains
(σ/E). To second order lengths of joints and the directions of their edges change with each step: 0.035 of the strain
is left. (A column, in which only blocks are strained, ends in the same place to 5e-10 at strains of 1e-4.) Joints with
friction alone slip; where they end depends on the order in which they slip, and the difference is told
as it is.
"""
    )
    rows, ways = [], {}
    cases = [(young, HOLDS, "hold") for young in (200e9, 20e9, 2e9)] + [(20e9, SLIPS, "slip")]
    for young, joint, name in cases:
        pair = []
        for shares in (1, MANY):
            results = record.run(opening(young, joint, shares), f"{name}-{young:g}-{shares}")
            pair.append(moved(results))
            ways[name, young, shares] = results
        size = float(np.abs(pair[0]).max())
        difference = float(np.abs(pair[0] - pair[1]).max()) / size
        rows.append([f"{name}, E = {young / 1e9:g} GPa", UNIT_WEIGHT * DEPTH / young, 1e3 * size, difference])
        record.compare(
            f"places after one step and after {MANY}, joints that {name}, strains of {UNIT_WEIGHT * DEPTH / young:.1e}:"
            " largest difference over the largest displacement",
            difference,
            truth=0.0 if name == "hold" else None,
            truth_source="elasticity" if name == "hold" else "",
            scale=1,
            # second order: lengths and directions of edges change by a strain
            allowed=0.05 * UNIT_WEIGHT * DEPTH / young if name == "hold" else None,
            explanation="of second order in the strains" if name == "hold" else "slip depends on the way",
        )
    names = ["joints", "strain", "largest displacement [mm]", "difference of one and ten"]
    record.table(pandas.DataFrame(rows, columns=names), "ways", "Places at the end, by the way there.")
    draw(record, ways)


def draw(record: Record, ways: dict[tuple[str, float, int], Results]) -> None:
    """Ground reaction of the roof, by the way."""
    from matplotlib import pyplot as plt

    with record.style():
        fig, axes = plt.subplots(figsize=(0.6 * PAPER_WIDTH, 2.8))
        for colour, name in zip(PALETTE, ("hold", "slip"), strict=False):
            for shares, mark in ((MANY, "o-"), (1, "s")):
                results = ways[name, 20e9, shares]
                index = results["history/stage"]
                ends = [np.flatnonzero(index == k)[-1] for k in range(shares + 1)]
                way = -1e3 * results["history/measured_displacement"][ends, 0, 1]
                axes.plot(way, np.arange(shares + 1) / shares, mark, color=colour, ms=4 if shares > 1 else 8,
                          mfc="none", label=f"joints {name}, {shares} step{'s' * (shares > 1)}")  # fmt: skip
        axes.set(xlabel="roof, downwards [mm]", ylabel="released share")
        axes.legend()
        record.figure(fig, "reaction", "Ground reaction of the block above the opening, E = 20 GPa.")


CASES = [Case("closed-excavation", "Excavation in one step and in ten", "Closed forms", order_of_stages)]
