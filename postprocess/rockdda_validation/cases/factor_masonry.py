# SPDX-License-Identifier: MIT
"""Critical push and tilt of masonry: walls, arches, stacks of blocks, against limit analysis and closed forms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rockdda.analysis.limit_analysis import RigidBlocks

from ..case import Case, Record
from ..factor_models import (
    BUTTRESS,
    DOORWAY,
    FIRST_WALL,
    PIERCED_WALL,
    TALL_WALL,
    TOWER,
    TWO_OPENINGS,
    arch,
    arch_blocks,
    stack,
    wall,
)
from ..factor_runs import (
    ASSOCIATED,
    LENGTH,
    draw_mechanism,
    load_of_mechanism,
    of_own_mechanism,
    search,
    trial_table,
    within_bound,
)

if TYPE_CHECKING:
    from rockdda.critical import CriticalFactor

__all__ = ["CASES"]

PART = "Critical factors"
PROGRAMME = "limit analysis (linear programme)"


def walls(record: Record) -> None:
    """Dry-stone walls pushed by a horizontal load."""
    record.text(
        "Dry-stone walls of blocks of 0.4 × 0.175 m with μ = 0.65 everywhere stand on a fixed slab; a load α × weight "
        "pushes every block to the right. Five walls are those of Ferris and Tin-Loi (2001), of whose limits 0.64286 "
        "and 0.40369 the linear programme gives the first and third; a pier and a wall with a door are our own. "
        f"{ASSOCIATED}. So it is told as a bound, and met by the same walls when their joints dilate by their friction "
        "angle: at most 1 % above, and below by what joints give way (the tower: 3.2 %, with joints four times as "
        "stiff 0.6 %). Joints without dilation have two truths. One knows nothing of the program: a row of linear "
        "programmes with sliding that does not dilate (Gilbert, Casapulla and Ahmed 2006). The other is the statics of "
        "the blocks as they were drawn, in the mechanism that the failing trial shows: joints that slide carry their "
        "friction, ends that open carry nothing, all others anything within Coulomb's law; the linear programme finds "
        "the least α with equilibrium. From the program it takes which joints slide and open, no force and no "
        "stiffness. It is the least of the loads that a mechanism without dilation can have, where forces are not "
        f"unique: for the tower, which moves as a whole, it depends on what counts as sliding. {LENGTH}"
    )
    published = {"wall": 0.64286, "pierced wall": 0.40369}
    rows: dict[str, list[list[float]]] = {
        "wall": FIRST_WALL,
        "pierced wall": PIERCED_WALL,
        "tall wall": TALL_WALL,
        "wall with two openings": TWO_OPENINGS,
        "tower": TOWER,
        "pier": BUTTRESS,
        "wall with a door": DOORWAY,
    }
    found: list[tuple[str, CriticalFactor]] = []
    limits: dict[str, float] = {}
    for name, row in rows.items():
        model = wall(name.replace(" ", "_"), row)
        blocks = RigidBlocks.from_model(model)
        limits[name] = limit = blocks.push().factor
        if name in published:
            record.compare(
                f"{name}: α of the linear programme", limit, truth=published[name],
                truth_source="Ferris and Tin-Loi (2001)", scale=1, allowed=1e-5,
            )  # fmt: skip
        one = search(record, model, model.name, search="push", tolerance=0.002)
        record.compare(
            f"{name}: α", one.value, truth=blocks.push_without_dilation().factor,
            truth_source="limit analysis without dilation (linear programmes)", allowed=0.01,
        )  # fmt: skip
        if name == "tower":
            own = load_of_mechanism(one, blocks)
            record.compare(
                f"{name}: share by which α is below that of its mechanism", max(0.0, 1 - one.value / own), truth=0.0,
                truth_source="statics of its mechanism without dilation (linear programme)", scale=1, allowed=0.01,
            )  # fmt: skip
        else:
            of_own_mechanism(record, f"{name}: α of the mechanism", one, blocks)
        within_bound(record, f"{name}: α", one.value, limit, PROGRAMME)
        found.append((name, one))
    for name in ("wall", "pierced wall", "tall wall", "wall with two openings", "tower") if record.full else ():
        model = wall(f"{name.replace(' ', '_')}_dilating", rows[name])
        (joint,) = model.joint_materials
        model.options["joint_law"] = [{"material": 1, "dilation": joint.friction_angle}]
        one = search(record, model, model.name, search="push", tolerance=0.002)
        record.compare(
            f"{name} whose joints dilate by their friction angle: α", one.value, truth=limits[name],
            truth_source=PROGRAMME, allowed=0.04,
        )  # fmt: skip
        within_bound(record, f"{name}, dilating: α", one.value, limits[name], PROGRAMME)
        found.append((f"{name}, dilating", one))
    trial_table(record, found, "Search of the push that the walls stand")
    for name, one in found[:2]:
        draw_mechanism(record, one, name.replace(" ", "-"), f"The {name} at the first push that it does not stand")


def arches(record: Record) -> None:
    """A circular arch pushed by a horizontal load."""
    record.text(
        "A circular arch of mean radius 10 m, 1.5 m thick, of 157.5° between fixed springers, in 7 or 28 equal "
        "voussoirs with straight faces; friction of 75° keeps the joints from sliding. It fails as four hinges form "
        f"(Oppenheim 1992). {LENGTH}"
    )
    found = []
    for n, known in ((7, 0.3736), (28, 0.3549)):
        model = arch(n)
        limit = RigidBlocks.from_model(model).push().factor
        record.compare(
            f"{n} voussoirs: α of the linear programme", limit, truth=known, truth_source="Oppenheim (1992)", scale=1,
            allowed=5e-5,
        )  # fmt: skip
        one = search(record, model, model.name, search="push", tolerance=0.001)
        record.compare(f"{n} voussoirs: α", one.value, truth=limit, truth_source=PROGRAMME, allowed=0.015)
        record.compare(
            f"{n} voussoirs: told that they turn", float(one.mechanism.kind == "toppling"), truth=1.0,
            truth_source="hinges, as no joint can slide", scale=1, allowed=0,
        )  # fmt: skip
        found.append((f"{n} voussoirs", one))
    trial_table(record, found, "Search of the push that the arches stand")
    draw_mechanism(
        record, found[1][1], "mechanism", "The arch of 28 voussoirs at the first push that it does not stand"
    )


def thinnest(n: int, *, tilt: float = 0.0, push: float = 0.0) -> float:
    """Thickness over mean radius at which a semicircular arch of n voussoirs is at its limit, by limit analysis."""

    def stands(thickness: float) -> bool:
        blocks = RigidBlocks.from_polygons(arch_blocks(1.0, thickness, 180.0, n), {0, 1}, friction=75.0)
        return blocks.is_stable(tilt=tilt) and (not push or blocks.push().factor >= push)

    low, high = 0.08, 0.4
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if stands(middle) else (middle, high)
    return 0.5 * (low + high)


def thin_arches(record: Record) -> None:
    """The thinnest semicircular arch that stands a tilt or a push."""
    n = 28
    record.text(
        "How thick must a semicircular arch be? Under its weight alone t/R = 0.1075 (Milankovitch 1907; the linear "
        f"programme with 80 voussoirs gives it, with {n} it is a little less). An arch as thin as that stands by "
        "nothing, so the question is put the other way round: for a given thickness the search finds the tilt, or the "
        "push, at which the arch fails; the linear programme then finds the thickness of the arch that fails at this "
        f"tilt or push. Friction of 75° keeps {n} voussoirs from sliding. {LENGTH}"
    )
    weightless = thinnest(80)
    record.compare(
        "thinnest arch under its weight, t/R of the linear programme", weightless, truth=0.1075,
        truth_source="Milankovitch (1907)", allowed=2e-3,
    )  # fmt: skip
    found = []
    for thickness in (1.2, 1.5, 2.0) if record.full else (1.5,):
        model = arch(n, thickness=thickness, span=180.0)
        for kind, tolerance in (("tilt", 0.05), ("push", 0.001)):
            one = search(record, model, f"{kind}_{thickness:g}", search=kind, tolerance=tolerance)
            needed = thinnest(n, **{kind: one.value})
            record.compare(
                f"thinnest arch that stands a {kind} of {one.value:.4g}{'°' if kind == 'tilt' else ''}, t/R",
                thickness / 10.0, truth=needed, truth_source=PROGRAMME, allowed=0.02,
            )  # fmt: skip
            found.append((f"{kind}, t = {thickness:g} m", one))
    trial_table(record, found, "Search of the tilt and the push that the arches stand")
    draw_mechanism(record, found[0][1], "mechanism", "The arch at the first tilt that it does not stand")


def stacks(record: Record) -> None:
    """Stacks of blocks on a plane that is tilted."""
    record.text(
        "n blocks 1 m wide and 0.5 m high lie on one another; friction of 70° keeps them from sliding. Tilted, all of "
        "them topple together at tan θ = b/(n h); a single block of 2 × 0.5 m with 25° slides at 25°. "
        f"The search ends within 0.05°. {LENGTH}"
    )
    found = []
    for n in range(1, 11) if record.full else (1, 2, 5, 10):
        one = search(record, stack(n), f"stack_{n}", search="tilt", tolerance=0.05)
        truth = math.degrees(math.atan(1 / (0.5 * n)))
        record.compare(
            f"{n} block{'s' if n > 1 else ''}: tilt", one.value, "°", truth=truth, truth_source="statics", scale=1,
            allowed=0.2,
        )  # fmt: skip
        found.append((f"{n} block{'s' if n > 1 else ''}", one))
    one = search(record, stack(1, width=2.0, friction=25.0), "sliding", search="tilt", tolerance=0.05)
    record.compare("block that slides: tilt", one.value, "°", truth=25.0, truth_source="statics", scale=1, allowed=0.2)
    kinds = [(one.mechanism.kind, "sliding"), *((tower.mechanism.kind, "toppling") for _, tower in found)]
    wrong = sum(told != expected for told, expected in kinds)
    record.compare(
        f"mechanisms told wrongly, of {len(kinds)}", wrong, truth=0, truth_source="statics", scale=1, allowed=0
    )
    trial_table(record, [*found, ("block that slides", one)], "Search of the tilt that the stacks stand")


CASES = [
    Case("factor-walls", "Dry-stone walls pushed", PART, walls),
    Case("factor-arch", "Circular arch pushed", PART, arches),
    Case("factor-thin-arch", "Thinnest semicircular arch, by tilt and by push", PART, thin_arches),
    Case("factor-stack", "Stacks of blocks tilted", PART, stacks),
]
