# SPDX-License-Identifier: MIT
"""Load factors of an arch, design values and probabilities of failure, against limit analysis and closed forms."""

from __future__ import annotations

import subprocess

import numpy as np
import pandas as pd
from rockdda.analysis.limit_analysis import RigidBlocks
from rockdda.certainty import Reliability, reliability
from rockdda.certainty.failure import wilson
from rockdda.program import find_program
from rockdda.writing import write_file

from ..case import Case, Record
from ..factor_models import PlaneFailure, arch_blocks, assemble, footing
from ..factor_runs import LENGTH, draw_mechanism, search, trial_table, within_bound

__all__ = ["CASES"]

PART = "Critical factors"
WATER = "crack"  # the group of water of `PlaneFailure`
PROGRAMME = "limit analysis (linear programme of rigid blocks)"


def loaded_arch(record: Record) -> None:
    """An arch of 31 voussoirs under a point load on its back."""
    record.text(
        "A segment of 120°, mean radius 5 m, 0.5 m thick, of 31 voussoirs of 20 kN/m³ between fixed springers carries "
        "a vertical load on the back of one voussoir: near the quarter of the span (120.97° from the right) and at the "
        "crown. The load rises from nothing (`--search load`); the arch fails as hinges form. Blocks and joints of the "
        f"program are elastic, those of the linear programme rigid. {LENGTH}"
    )
    found = []
    for name, voussoir, truth in (("quarter", 23, 68.871), ("crown", 15, 132.773)):
        middle = 30 + (voussoir + 0.5) * 120 / 31  # from the right
        model = assemble(
            f"arch_{name}", arch_blocks(5.0, 0.5, 120.0, 31), {0, 1}, friction=31.0, density=2000.0, gravity=10.0
        )
        half = np.radians(60 / 31)
        back = 5.25 * np.cos(half)  # the middle of a straight face
        place = [float(back * np.cos(np.radians(middle))), float(back * np.sin(np.radians(middle)))]
        model.options["loading_point"] = [{"name": "axle", "at": place, "force": [0.0, -1000.0]}]
        one = search(record, model, model.name, search="load", loads="axle")
        # half of the interval of a factor is 0.5 %, the deformation of the blocks as much
        record.compare(f"{name}: load", one.value, "kN/m", truth=truth, truth_source=PROGRAMME, allowed=0.01)
        found.append((name, one))
        stiff = []
        for stiffness in (6e11, 24e11):
            model.options["contact"] = {"stiffness": stiffness}
            stiff.append(search(record, model, f"{name}_{stiffness:g}", search="load", loads="axle", tolerance=0.002))
        record.compare(
            f"{name}: load with joints four times as stiff, over the load", stiff[1].value / stiff[0].value, truth=1.0,
            truth_source="stiffness of joints does not decide", scale=1, allowed=0.01,
        )  # fmt: skip
    trial_table(record, found, "Search of the loads that the arch carries")
    draw_mechanism(
        record, found[0][1], "mechanism", "The arch at the first load near its quarter that it does not carry"
    )


def loaded_rock(record: Record) -> None:
    """A strip footing on rock with two joint sets."""
    record.text(
        "A footing 2 m wide stands on rock with a through-going joint set 1 m apart and a staggered one, between fixed "
        "walls; joints have friction alone. The load rises from nothing (`--search load`). Coulomb friction slides "
        "without dilation: the linear programme of the associated material is an upper bound, the iterated one "
        "(Gilbert, Casapulla and Ahmed 2006) has no dilation. Both know no corners: where two sets cross each other "
        "throughout, slips on both push corners of opposite blocks against each other, and the load is higher than "
        f"theirs. {LENGTH}"
    )
    found = []
    for name, dips, spacing, friction, width, depth in (
        ("45 and 135", (45.0, 135.0), 2.0, 10.0, 12.0, 4.0),
        ("50 and 122", (50.0, 122.0), 1.6, 6.0, 12.8, 4.7),
        ("135 and 205", (135.0, 205.0), 1.33, 12.0, 14.9, 4.5),
        ("40 and 131", (40.0, 131.0), 2.09, 9.4, 12.4, 2.3),
    ):
        model = footing(dips, spacing, friction, width=width, depth=depth, name=f"footing_{name.replace(' ', '_')}")
        blocks = RigidBlocks.from_model(model)
        live = np.zeros((len(blocks.polygons), 3))
        live[np.argmax([polygon[:, 1].max() for polygon in blocks.polygons]), 1] = -1000.0
        one = search(record, model, model.name, search="load", loads="column")
        within_bound(record, f"sets {name}°: load", one.value, blocks.largest(live).factor, PROGRAMME, "kN/m")
        record.compare(
            f"sets {name}°: load without dilation", one.value, "kN/m",
            truth=blocks.largest_without_dilation(live).factor,
            truth_source="limit analysis without dilation (iterated linear programmes)", allowed=0.01,
        )  # fmt: skip
        found.append((f"{name}°", one))
    trial_table(record, found, "Search of the loads that the rock carries")
    draw_mechanism(record, found[0][1], "mechanism", "The footing at the first load that the rock does not carry")


def of_slope(record: Record, name: str, water: float, vary: str, **options: object) -> Reliability:
    """A reliability of the plane failure in a folder of its own."""
    model = PlaneFailure(water=water).model(name)
    folder = record.folder / name
    folder.mkdir(parents=True, exist_ok=True)
    model.write(folder, force=True)
    found = reliability(folder / f"{name}.nml", vary, output=folder / "runs", jobs=record.workers, **options)
    record.runs += found.runs
    return found


def probabilities(record: Record) -> None:
    """The slope of Sau Mau Ping whose strength and water scatter."""
    record.text(
        "The plane failure of Sau Mau Ping with cohesion 0.10 ± 0.02 MPa and tan φ 0.70021 ± 0.10, both "
        "normal: the limit state is linear, and the reliability index has a closed form, for a dry and a full tension "
        "crack. With φ 35 ± 5° and any share of the crack filled the probability of failure comes from quadrature. "
        "Each of 30 runs of a Latin hypercube is a search; a quadratic surface through the factors does the rest. "
        f"{LENGTH}"
    )
    linear = "plane.cohesion = normal(0.10e6, 0.02e6); tan(plane.friction) = normal(0.70021, 0.10)"
    for name, water, index, allowed in (("dry", 0.0, 3.16648, 0.05), ("full", 1.0, 1.38102, 0.03)):
        found = of_slope(record, name, water, linear)
        record.compare(
            f"crack {name}: reliability index", found.beta, truth=index, truth_source="closed form", scale=1,
            allowed=allowed,
        )  # fmt: skip
    for input_name, truth in (("plane.cohesion", 0.078817e6), ("tan(plane.friction)", 0.611586)):
        record.compare(
            f"crack full: {input_name} of the design point", found.design_point[input_name], truth=truth,
            truth_source="closed form", allowed=0.02,
        )  # fmt: skip
    slope = PlaneFailure()
    scattered = (
        "plane.cohesion = normal(0.10e6, 0.02e6); plane.friction = normal(35, 5); "
        f"{WATER}.table[4] = uniform({slope.foot!r}, {slope.height!r})"
    )
    repeated = [
        of_slope(record, f"seed_{seed}", 1.0, scattered, seed=seed).probability
        for seed in range(1, 11 if record.full else 4)
    ]
    worst = max(repeated, key=lambda value: abs(value - 0.023108))
    record.compare(
        "any water: probability of failure, mean of the repetitions", float(np.mean(repeated)), truth=0.023108,
        truth_source="quadrature", scale=1, allowed=0.0012 if record.full else 0.0025,
    )  # fmt: skip
    record.compare(
        "any water: probability of failure, farthest repetition", worst, truth=0.023108, truth_source="quadrature",
        scale=1, allowed=0.004,
    )  # fmt: skip


FACE = """\
&boundary  vertices = 0,-1, 27,-1, 27,10, 5.7735,10, 0,0, joint_material = 2 /
&joint_set inclination = 35, spacing = 5, distribution = 'exponential', randomness = 0.5 /
&line      ends = 0,0, 26,0, joint_material = 2 /
&line      ends = 26,0, 26,10, joint_material = 2 /
"""
FACE_MODEL = """\
&model           geometry = 'face.dc', title = 'Face with planes at random' /
&block_material  number = 1, name = 'rock', density = 2500, young = 20e9, poisson = 0.25 /
&joint_material  number = 1, name = 'plane', friction = 20 /
&joint_material  number = 2, name = 'firm', friction = 60, cohesion = 50e6, tension = 50e6 /
&load            gravity = 9.81 /
&boundary        along = 0,0, 0,-1, 27,-1, kind = 'fixed' /
&boundary        along = 27,-1, 27,10, kind = 'fixed' /
&stage           name = 'weight', until = 'equilibrium' /
"""
REPETITIONS, NETWORKS = 20, 30  # networks of each repetition


def random_networks(record: Record) -> None:
    """Planes at random behind a face: how often does one daylight, and how often does the interval hold the truth?"""
    dip, crest = np.radians(35), np.array([5.7735, 10.0])
    truth = 1 - np.exp(-(crest[1] * np.cos(dip) - crest[0] * np.sin(dip)) / 5)
    record.text(
        "Planes that dip 35° out of a face of 60°, 10 m high, lie at distances that are exponential with the mean 5 m. "
        "Their friction is 20°, so the face fails where any plane daylights in it: a process of Poisson's, whose "
        f"chance has a closed form. {REPETITIONS} repetitions of {NETWORKS} networks each (`--seeds`), every one with "
        f"the interval of Wilson, which holds the truth in 95 of 100. {LENGTH}"
    )
    write_file(record.folder / "face.dl", FACE)
    write_file(record.folder / "face.nml", FACE_MODEL)
    subprocess.run([find_program(), "lines", "face.dl", "--quiet"], cwd=record.folder, check=True)
    rows = []
    for i in range(REPETITIONS):
        found = reliability(
            record.folder / "face.nml", seeds=NETWORKS, seed=1 + NETWORKS * i, precision=0, joints="plane", to=2.0,
            tolerance=0.1, output=record.folder / f"runs_{i}", jobs=record.workers,
        )  # fmt: skip
        record.runs += found.runs
        low, high = found.interval
        rows.append((1 + NETWORKS * i, found.failed, found.probability, low, high, low <= truth <= high))
    frame = pd.DataFrame(rows, columns=["first seed", "fail", "share", "from", "to", "holds the truth"])
    record.table(frame, "networks", f"Networks that fail, of {NETWORKS} each; the truth is {truth:.4f}")
    networks, fail = REPETITIONS * NETWORKS, int(frame["fail"].sum())
    low, high = wilson(fail, networks)
    record.compare(
        f"chance of failure, {networks} networks", fail / networks, truth=float(truth), truth_source="closed form",
        scale=1, allowed=2.5 * float(np.sqrt(truth * (1 - truth) / networks)),
        explanation=f"95 % interval {low:.3f} to {high:.3f}",
    )  # fmt: skip
    expected, spread = 0.95 * REPETITIONS, np.sqrt(0.95 * 0.05 * REPETITIONS)
    record.compare(
        "intervals that hold the truth", int(frame["holds the truth"].sum()), truth=expected,
        truth_source=f"95 of 100, of {REPETITIONS}", scale=1, allowed=3 * float(spread),
    )  # fmt: skip


def design_values(record: Record) -> None:
    """The slope of Sau Mau Ping with cohesion and tan φ divided by 1.25."""
    record.text(
        "Does the slope of Sau Mau Ping stand with cohesion and tan φ divided by 1.25 (Eurocode 7)? The reserve is the "
        f"factor of safety with these values, Hoek and Bray's over 1.25. {LENGTH}"
    )
    found = []
    for name, water, truth in (("full", 1.0, 0.9590), ("half full", 0.5, 1.1305), ("dry", 0.0, 1.2675)):
        model = PlaneFailure(water=water).model(f"design_{name.replace(' ', '_')}")
        factors = {"friction": 1.25, "cohesion": 1.25}
        one = search(record, model, model.name, factors=factors, tolerance=0.002)
        # half of the interval is 0.1 %
        record.compare(f"crack {name}: reserve", one.value, truth=truth, truth_source="Hoek and Bray", allowed=0.003)
        stands = float(bool(one.stands))
        record.compare(
            f"crack {name}: told that it stands", stands, truth=float(truth > 1), truth_source="Hoek and Bray", scale=1,
            allowed=0,
        )  # fmt: skip
        found.append((name, one))
    trial_table(record, found, "Search of the reserve")


CASES = [
    Case("factor-load", "Arch under a point load", PART, loaded_arch),
    Case("factor-footing", "Strip footing on two joint sets", PART, loaded_rock),
    Case("factor-probability", "A slope whose strength and water scatter", PART, probabilities),
    Case("factor-networks", "A face with planes at random", PART, random_networks, quick=False),
    Case("factor-design-values", "A slope with design values", PART, design_values),
]
