# SPDX-License-Identifier: MIT
"""Smallest thickness of a semicircular arch under its own weight: Milankovitch's problem.

The truth is limit analysis: joints carry no tension, do not slide and are not crushed, and an arch stands when some
line of thrust stays within it. By symmetry the half from the crown will do: a thrust H at the height z of the crown
joint, and the weight W of the voussoirs from the crown to joint k, with the moment S about the crown's vertical, must
turn them inwards about the joint's inner end (xi, yi) and outwards about its outer end (xo, yo):

    H z > H yi + W xi - S        H z < H yo + W xo - S        for all joints

For given H these are bounds of H z; the largest distance between them over H, a concave function, is the margin. It is
zero at the smallest thickness. Voussoirs are polygons, as in the calculation with DDA; many of them tend to
Milankovitch's arch, for which the same condition is written with integrals.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas
from rockdda.errors import ConvergenceError
from rockdda.model import Model
from rockdda.plot.style import PALETTE

from ..bracket import Bracket, bracket, power_of_ten
from ..case import Case, Record

if TYPE_CHECKING:
    from rockdda.results import Frame, Results

FloatArray = npt.NDArray[np.float64]

MILANKOVITCH, HEYMAN = 0.1075, 0.1059  # published t/R
RADIUS, GRAVITY, DENSITY = 10.0, 10.0, 2500.0  # of the centre line [m]; m/s²; kg/m³
SETTLING = 300  # static steps
DYNAMIC = 2.0  # s, of the dynamic stage in which an arch falls or stands
MOVED = 0.02  # m in that stage: fallen. A mean acceleration of a thousandth of gravity


# -- limit analysis; lengths over R, forces over ρ g R² --


class HalfArch:
    """The half from the crown (joint 0) to the abutment (joint n/2), of an arch of an even number n of voussoirs."""

    def __init__(self, thickness: float, voussoirs: int) -> None:
        self.thickness = thickness
        self.angle = np.arange(voussoirs // 2 + 1) * np.pi / voussoirs  # from the crown
        self.radial = np.column_stack([np.sin(self.angle), np.cos(self.angle)])
        self.inner = (1 - thickness / 2) * self.radial
        self.outer = (1 + thickness / 2) * self.radial
        corners = np.stack([self.inner[:-1], self.outer[:-1], self.outer[1:], self.inner[1:]], axis=1)
        following = np.roll(corners, -1, axis=1)
        cross = corners[..., 0] * following[..., 1] - corners[..., 1] * following[..., 0]
        area = 0.5 * np.abs(cross.sum(axis=1))
        moment = np.abs(((corners[..., 0] + following[..., 0]) * cross).sum(axis=1)) / 6
        self.weight = np.append(0.0, np.cumsum(area))
        self.moment = np.append(0.0, np.cumsum(moment))

    def bounds(self, thrust: float) -> tuple[FloatArray, FloatArray]:
        """Of H z, by all joints."""
        low = thrust * self.inner[:, 1] + self.weight * self.inner[:, 0] - self.moment
        high = thrust * self.outer[:, 1] + self.weight * self.outer[:, 0] - self.moment
        return low, high

    def margin(self) -> tuple[float, float]:
        """The largest distance between the bounds, and the thrust H for it."""

        def gap(thrust: float) -> float:
            low, high = self.bounds(thrust)
            return float(high.min() - low.max())

        thrust = _highest(gap, 0.0, 1.0)
        return gap(thrust), thrust

    def line_of_thrust(self) -> tuple[float, FloatArray]:
        """H, and for each joint the eccentricity of the force over the thickness, between ±½ (outer end)."""
        thrust = self.margin()[1]
        low, high = self.bounds(thrust)
        height = 0.5 * (high.min() + low.max())  # H z
        about = -(height - self.radial[:, 1] * thrust) + self.weight * self.radial[:, 0] - self.moment
        normal = thrust * self.radial[:, 1] + self.weight * self.radial[:, 0]
        return thrust, -about / normal / self.thickness


def smallest_thickness(voussoirs: int) -> float:
    """t/R of the arch of polygons."""
    return _rising_root(lambda t: HalfArch(t, voussoirs).margin()[0], 0.08, 0.13)


def _crown_thrust_of_arcs(t: float, moment: Callable[[float], float]) -> float:
    """H when the line of thrust touches the outer side at crown and abutment; moment: that of the weight from the "
    "crown."""
    outer = 1 + t / 2
    return (t * np.pi / 2 * outer - moment(np.pi / 2)) / outer


def _excess(t: float, angle: float, moment: Callable[[float], float]) -> float:
    """How much the weight exceeds the thrust in turning the part above a joint about the joint's inner end."""
    inner, outer = 1 - t / 2, 1 + t / 2
    weights = t * angle * inner * np.sin(angle) - moment(angle)
    return float(weights - _crown_thrust_of_arcs(t, moment) * (outer - inner * np.cos(angle)))


def smallest_thickness_of_arcs() -> float:
    """t/R of the arch of very many voussoirs: Milankovitch's. The line of thrust touches the inner side somewhere."""

    def margin(t: float) -> float:
        def moment(angle: float) -> float:
            return float((1 - np.cos(angle)) * (t + t**3 / 12))

        return -_excess(t, _highest(lambda angle: _excess(t, angle, moment), 0.3, 1.4), moment)

    return _rising_root(margin, 0.08, 0.13)


def heyman() -> float:
    """t/R by Heyman: mass on the centre line, and at the inner hinge the thrust has the direction of the arch.

    (It is the line of thrust that touches the inner side; the thrust itself is not tangential to it there.)
    """

    def margin(t: float) -> float:
        def moment(angle: float) -> float:
            return float((1 - np.cos(angle)) * t)

        thrust = _crown_thrust_of_arcs(t, moment)
        hinge = _rising_root(lambda angle: thrust * np.tan(angle) - t * angle, 0.1, 1.5)
        return -_excess(t, hinge, moment)

    return _rising_root(margin, 0.08, 0.13)


def _highest(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function with one hill is highest (golden section)."""
    ratio = 0.5 * (np.sqrt(5.0) - 1)
    for _ in range(80):
        first, second = high - ratio * (high - low), low + ratio * (high - low)
        if function(first) < function(second):
            low = first
        else:
            high = second
    return 0.5 * (low + high)


def _rising_root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function is zero."""
    assert function(low) < 0 < function(high)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if function(middle) > 0 else (middle, high)
    return 0.5 * (low + high)


# -- the same arch with DDA --


def arch(thickness: float, voussoirs: int, stiffness: float, dt: float, friction: float, dynamic: float) -> Model:
    """Voussoirs between two fixed blocks. Settles without inertia first, then moves with it."""
    model = Model("arch", e0=0.002 * RADIUS, dt_max=dt, stiffness=stiffness)
    inner, outer = RADIUS * (1 - thickness / 2), RADIUS * (1 + thickness / 2)
    angle = np.pi * np.arange(voussoirs + 1) / voussoirs
    unit = np.column_stack([np.cos(angle), np.sin(angle)])
    unit[[0, -1], 1] = 0.0
    for n in range(voussoirs):
        if n:
            model.add_line(inner * unit[n], outer * unit[n])
        for radius in (inner, outer):
            model.add_line(radius * unit[n], radius * unit[n + 1])
        middle = 0.5 * (angle[n] + angle[n + 1])
        model.add_measured((RADIUS * np.cos(middle), RADIUS * np.sin(middle)))
    for side in (1, -1):
        near, far = side * (inner - 0.1 * RADIUS), side * (outer + 0.1 * RADIUS)
        model.add_polygon([(near, -0.2 * RADIUS), (far, -0.2 * RADIUS), (far, 0.0), (near, 0.0)])
        for x in (near + side * 0.01 * RADIUS, far - side * 0.01 * RADIUS):
            for y in (-0.19 * RADIUS, -0.01 * RADIUS):
                model.add_fixed((x, y))
    model.add_block_material(density=DENSITY, gravity=GRAVITY, youngs_modulus=1e11, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=friction)
    model.steps = SETTLING + round(dynamic / dt)
    model.options = {
        "run": {"save_every": SETTLING},
        "stage": [{"until_step": SETTLING, "k01": 0.0}, {"k01": 1.0}],
    }
    return model


def run(
    record: Record,
    thickness: float,
    voussoirs: int = 40,
    stiffness: float = 1e11,
    dt: float = 0.01,
    friction: float = 70.0,
    dynamic: float = DYNAMIC,
) -> Results:
    model = arch(thickness, voussoirs, stiffness, dt, friction, dynamic)
    name = f"n{voussoirs}-k{power_of_ten(stiffness)}-dt{dt:g}-phi{friction:g}-t{thickness:.6g}-{dynamic:g}s"
    try:
        return record.run(model, name)
    except ConvergenceError as error:  # in a fall, with voussoirs all over the place; it has been judged by then
        if error.results.n_steps <= SETTLING + 1:
            raise
        return error.results


def fallen(results: Results) -> float:
    """Largest way of a voussoir in the dynamic stage [m]."""
    way = results["history/measured_displacement"]
    return float(np.hypot(*(way[-1] - way[SETTLING - 1]).T).max())


def bisect(
    record: Record, width: float, stands_at: float = 0.12, **settings: float
) -> tuple[Bracket, dict[float, Results]]:
    """Between which t/R does the arch begin to fall?"""
    runs: dict[float, Results] = {}

    def stands(thickness: float) -> bool:
        runs[thickness] = run(record, thickness, **settings)  # type: ignore[arg-type]
        return fallen(runs[thickness]) < MOVED

    return bracket(stands, 0.10, stands_at, width), runs


def line_of_thrust(frame: Frame, thickness: float, voussoirs: int) -> tuple[FloatArray, FloatArray]:
    """Of DDA: angle of the joints from the crown, and the eccentricity of the force over the thickness."""
    contacts = frame.contacts
    closed = contacts.state > 0
    point, force = contacts.point[closed], contacts.force[closed]
    angle = np.arctan2(point[:, 0], point[:, 1])
    joint = np.rint(angle / np.pi * voussoirs).astype(int)
    tangent = np.column_stack([np.cos(joint * np.pi / voussoirs), -np.sin(joint * np.pi / voussoirs)])
    normal = np.abs((force * tangent).sum(axis=1))
    joints = np.unique(joint)
    radius = np.hypot(*point.T)
    middle = [np.average(radius[joint == j], weights=normal[joint == j]) for j in joints]
    return joints * np.pi / voussoirs, (np.array(middle) / RADIUS - 1) / thickness


def crown_thrust(frame: Frame, voussoirs: int) -> float:
    """Horizontal force in the joint at the crown [N]."""
    contacts = frame.contacts
    angle = np.arctan2(contacts.point[:, 0], contacts.point[:, 1])
    crown = (np.abs(angle) < 0.25 * np.pi / voussoirs) & (contacts.state > 0)
    return float(np.abs(contacts.force[crown, 0]).sum())


def thickness(record: Record) -> None:
    voussoirs = 40
    truth, limit = smallest_thickness(voussoirs), smallest_thickness_of_arcs()
    record.text(
        "A semicircular arch of equal voussoirs with radial joints, under its own weight, on fixed abutments; t is "
        "its thickness, R the radius of its centre line. Limit analysis (Heyman's assumptions: no tension, no "
        "slip, no crushing) gives the smallest t/R; with voussoirs of finite size and their true centroids it is a "
        "little smaller than Milankovitch's value for infinitely many. Heyman's own value is smaller: he "
        "puts all mass on the centre line (0.05 %) and gives the thrust at the inner hinge the direction of the arch "
        "(1.4 %)."
    )
    record.compare(
        "limit analysis (no DDA), infinitely many voussoirs: t/R",
        limit,
        published=MILANKOVITCH,
        published_source="Milankovitch (1907); Ochsendorf (2006)",
        allowed=5e-4,  # the published digits
    )
    record.compare(
        "limit analysis (no DDA) with Heyman's assumptions: t/R",
        heyman(),
        published=HEYMAN,
        published_source="Heyman (1969)",
        allowed=2e-3,  # the published digits; 0.106 is found, too
    )
    record.text(
        f"DDA: {voussoirs} voussoirs, R = {RADIUS:g} m, φ = 70°, g0 = 1e11 N/m, E = 1e11 Pa, gravity at once, "
        f"{SETTLING} static steps (k01 = 0), then {DYNAMIC:g} s of dynamics (k01 = 1). **Criterion:** the arch has "
        f"fallen when some voussoir has moved by more than {100 * MOVED:g} cm in the dynamic stage (just above the "
        "limit it moves by less than a micrometre). t/R is bisected."
    )
    found, runs = bisect(record, 1e-5 * 8 if record.full else 5e-4)
    record.compare(
        f"smallest t/R of an arch of {voussoirs} voussoirs",
        found.middle,
        truth=truth,
        truth_source=f"limit analysis of {voussoirs} polygons",
        published=MILANKOVITCH,
        published_source="Milankovitch (1907), infinitely many voussoirs",
        allowed=0.005,
        explanation=f"bracket {found}",
    )
    half = HalfArch(truth, voussoirs)
    thrust, eccentricity = half.line_of_thrust()
    frame = next(frame for frame in runs[found.stands].frames if frame.step == SETTLING)
    record.compare(
        "thrust at the crown when the arch just stands, over ρ g R²",
        crown_thrust(frame, voussoirs) / (DENSITY * GRAVITY * RADIUS**2),
        truth=thrust,
        truth_source="limit analysis at the smallest thickness",
        # standing arches have a range of thrusts that closes at the limit; the weight is in proportion to the thickness
        allowed=0.01 if record.full else 0.03,
    )
    joints, computed = line_of_thrust(frame, found.stands, voussoirs)
    expected_line = np.interp(np.abs(joints), half.angle, eccentricity)
    record.compare(
        "line of thrust when the arch just stands: largest distance from limit analysis, over t",
        np.abs(computed - expected_line).max(),
        truth=0.0,
        truth_source="limit analysis at the smallest thickness",
        scale=1.0,
        allowed=0.02,
    )
    falling = run(record, 0.104, dynamic=1.8)
    hinge = _hinge(falling.frames[-1], voussoirs)
    expected = np.degrees(half.angle[1:-1][np.argmin(eccentricity[1:-1])])
    record.compare(
        "inner hinge of an arch with t/R = 0.104, from the crown",
        hinge,
        "°",
        truth=float(expected),
        truth_source="limit analysis (joints are 4.5° apart)",
        scale=1.0,
        allowed=4.5 + 1e-6,
        explanation="with t/R below the limit the neighbouring joint opens as well",
    )
    if record.full:
        _sensitivity(record, found)
    _figures(record, runs, found, falling, voussoirs)
    record.energy_closes(1e-8, "some of the many arches fall, and collide, for seconds")


def _hinge(frame: Frame, voussoirs: int) -> float:
    """Angle from the crown [deg] of the joint between 20° and 80° that has turned most."""
    rotation, centroid = frame.rotation, frame.centroid - frame.displacement
    inside = np.hypot(*centroid.T) < 1.2 * RADIUS
    inside &= centroid[:, 1] > 0
    angle = np.degrees(np.arctan2(centroid[inside, 0], centroid[inside, 1]))
    order = np.argsort(angle)
    turn = np.abs(np.diff(rotation[inside][order]))
    joints = 0.5 * (angle[order][1:] + angle[order][:-1])
    between = (np.abs(joints) > 20) & (np.abs(joints) < 80)
    assert len(order) == voussoirs
    return float(np.abs(joints[between][np.argmax(turn[between])]))


def _sensitivity(record: Record, found: Bracket) -> None:
    """Number of voussoirs, contact stiffness, time step, friction."""
    rows = []
    base: dict[str, float] = {"voussoirs": 40, "stiffness": 1e11, "dt": 0.01, "friction": 70.0}
    changes: list[dict[str, float]] = [{}, {"voussoirs": 20}, {"voussoirs": 80}]
    changes += (
        [{"stiffness": k} for k in (1e9, 1e10, 1e12)] + [{"dt": dt} for dt in (0.02, 0.005)] + [{"friction": 60.0}]
    )
    for change in changes:
        settings = base | change
        # hinges sink in where contacts are soft, and the arch must be thicker: 1e9 N/m by length
        widest = 0.2 if settings["stiffness"] < 1e10 else 0.12
        one = bisect(record, 1e-5 * 8, widest, **settings)[0] if change else found
        truth = smallest_thickness(int(settings["voussoirs"]))
        rows.append(
            {
                "voussoirs": int(settings["voussoirs"]),
                "g0 [N/m]": power_of_ten(settings["stiffness"]),
                "dt [s]": settings["dt"],
                "φ [°]": settings["friction"],
                "t/R with DDA": str(one),
                "limit analysis": f"{truth:.5f}",
                "difference": f"{100 * (one.middle / truth - 1):+.2f} %",
            }
        )
    record.table(
        pandas.DataFrame(rows),
        "convergence",
        "Smallest t/R against the number of voussoirs and the numbers that it should not depend on. With soft "
        "contacts the forces at the hinges sink in and the arch is thinner than it looks.",
    )


def _figures(record: Record, runs: dict[float, Results], found: Bracket, falling: Results, voussoirs: int) -> None:
    half = HalfArch(smallest_thickness(voussoirs), voussoirs)
    eccentricity = half.line_of_thrust()[1]
    frame = next(frame for frame in runs[found.stands].frames if frame.step == SETTLING)
    joints, computed = line_of_thrust(frame, found.stands, voussoirs)
    with record.style():
        import matplotlib.pyplot as plt

        figure, (left, right) = plt.subplots(1, 2, figsize=(6.3, 2.7), layout="constrained")
        both = np.concatenate([-half.angle[::-1], half.angle[1:]])
        line = np.concatenate([eccentricity[::-1], eccentricity[1:]])
        left.plot(np.degrees(both), line, color=PALETTE[0], label=f"limit analysis, t/R = {half.thickness:.5f}")
        left.plot(np.degrees(joints), computed, ".", color=PALETTE[1], label=f"DDA, t/R = {found.stands:.5f}")
        for side in (-0.5, 0.5):
            left.axhline(side, color="0.5", linewidth=0.8)
        left.set(
            xlabel="angle from the crown [°]", ylabel="line of thrust: eccentricity / t", xticks=range(-90, 91, 45)
        )
        left.set_ylim(-0.65, 0.95)
        left.legend(loc="upper center")
        values = np.array(sorted((t, fallen(results)) for t, results in runs.items()))
        right.semilogy(values[:, 0], np.maximum(values[:, 1], 1e-9), "o-", ms=3.5, color=PALETTE[1], label="DDA")
        right.axhline(MOVED, color="0.5", linewidth=0.8, linestyle="--")
        right.annotate("criterion", (values[-1, 0], MOVED), ha="right", va="bottom", fontsize=8, color="0.4")
        right.axvline(half.thickness, color=PALETTE[0], linewidth=0.8, label="limit analysis")
        right.set(xlabel="t/R", ylabel=f"largest way in {DYNAMIC:g} s [m]")
        right.legend(loc="center right")
    record.figure(
        figure,
        "limit",
        "Left: line of thrust of the arch that just stands. Right: motion in the dynamic stage against thickness.",
    )
    with record.style():
        figure, axes = plt.subplots(figsize=(6.3, 3.4), layout="constrained")
        for start, polygon in zip(falling.frames[0].polygons(), falling.frames[-1].polygons(), strict=True):
            axes.fill(*start.T, facecolor="none", edgecolor="0.7", linewidth=0.5)
            axes.fill(*polygon.T, facecolor=PALETTE[5], edgecolor="black", linewidth=0.6)
        axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    time = falling.times[-1] - falling["history/time"][SETTLING - 1]
    record.figure(figure, "fall", f"An arch that is too thin (t/R = 0.104) after {time:.2g} s; thin lines: the start.")


CASES = [
    Case("closed-arch", "Smallest thickness of a semicircular arch", "Closed forms", thickness),
]
