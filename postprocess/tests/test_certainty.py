# SPDX-License-Identifier: MIT
"""How sure a number is: what is judged, and what it is judged by, without the program."""

import math
from pathlib import Path

import numpy as np
import pytest
from rockdda.certainty.convergence_study import Convergence
from rockdda.certainty.failure import failure_of, index_of, intervals_of_shares, line_of, shares_of_variance, wilson
from rockdda.certainty.random_inputs import RandomInput, correlation_of, parse_inputs, sample
from rockdda.certainty.running import FAILS, STANDS, UNKNOWN, Found, _side
from rockdda.certainty.surrogate import fit, fitting_kinds
from rockdda.certainty.variants import AS_IT_IS, HALF_STEP, PROPERTY, Variant
from rockdda.certainty.verdict import judge, number_with_error, percent, rounded, two_digits
from rockdda.errors import InputError
from rockdda.units import Units

QUARTER = Variant("step ÷ 4", "step", step=0.25)
STIFF = Variant("joints × 2 as stiff", PROPERTY, stiffness=2.0)
SOFT = Variant("joints ÷ 2 as stiff", PROPERTY, stiffness=0.5)
VARIANTS = [AS_IT_IS, HALF_STEP, QUARTER, STIFF, SOFT]


def random_input(name, law, *numbers):
    return RandomInput(name, "joint_material", "friction", 0, None, False, law, numbers)


# -- convergence ------------------------------------------------------------------------------------------------------


def verdict_of(*values, noise=0.0):
    names = [variant.name for variant in VARIANTS[1:]]
    changed = dict(zip(names, values[1:], strict=True))
    return judge("point 1 y", "heading", "length", (values[0], abs(values[0])), changed, VARIANTS, noise)


def test_a_number_that_converges_is_extrapolated():
    """v(Δt) = 1 + 0.08 Δt: first order; the error of the value as it is lies within what the verdict says."""
    found = verdict_of(1.08, 1.04, 1.02, 1.08, 1.08)
    assert found.order == pytest.approx(1.0)
    assert found.extrapolated == pytest.approx(1.0)
    assert found.plus_minus["step"] == pytest.approx(1.25 * 0.08)
    assert found.exceeds(0.05) == ["step"]
    second = verdict_of(1.08, 1.02, 1.005, 1.08, 1.08)
    assert (second.order, second.extrapolated) == (pytest.approx(2.0), pytest.approx(1.0))


def test_a_number_that_jumps_has_no_order_and_a_wide_error():
    found = verdict_of(1.0, 1.001, 1.3, 1.0, 1.0)
    assert found.order is None and found.extrapolated is None
    assert found.grows
    assert found.plus_minus["step"] == pytest.approx(0.3 + 4 * 0.299)
    assert "refinement changes ever more: there is no answer yet" in found.words(Units())


def test_errors_that_are_nothing_do_not_decide():
    """A point that moved by 0.45 µm, and by 1.6 µm on joints half as stiff, made the factor uncertain: exit 3."""
    changed = {"joints × 2 as stiff": -4.7e-7, "joints ÷ 2 as stiff": -1.6e-6}
    for nothing, decides in ((0.0, True), (1e-6, True), (7e-5, False)):
        one = judge("point 1 y", "", "length", (-4.5e-7, 4.5e-7), changed, [AS_IT_IS, STIFF, SOFT], nothing=nothing)
        assert one.exceeds(0.05) == ["joint stiffness"] * decides
        assert ("nothing beside the factor" in one.words(Units())) != decides
        study = Convergence("", (one,), (), {}, 0.05, Units(), False, "", Path())
        assert study.exceeded == decides
        assert ("do not count beside a factor. Half or twice" in study.summary) != decides


def test_rounding_has_no_order():
    found = verdict_of(1.0, 1.0 + 1e-9, 1.0 + 1.5e-9, 1.0, 1.0)
    assert found.order is None
    assert found.exceeds(0.05) == []


def test_the_words_name_method_and_property():
    words = verdict_of(-5.3e-3, -5.18e-3, -5.1e-3, -4.3e-3, -6.9e-3).words(Units("m", "s", "N", multiples=True))
    step, joints = "± 0.5 by the step (a number of the method: refine it)", "± 1.6 by the joint stiffness"
    assert words == f"point 1 y, heading: -5.3 mm: {step}, {joints} (a property: measure it)"
    chosen = verdict_of(-5.3e-3, -5.3e-3, -5.3e-3, -4.3e-3, -6.9e-3).words(Units(), chosen=True)
    assert "less than 0.05 % by the step" in chosen
    assert "± 0.0016 by the joint stiffness (a property, here chosen by the program: measure it)" in chosen


def test_a_variant_that_failed_is_not_hidden():
    found = verdict_of(1.0, None, 1.0, 1.0, 1.0)
    assert found.exceeds(0.05) == ["step"]
    assert "not known by the step, whose runs failed" in found.words(Units())


def test_shares_of_a_small_component_are_said_to_be_of_the_whole():
    """1 ± 0.5 mm beside 20 mm is a share of 2.5 %, and not of 50 % as its own line reads."""
    for scale, is_said in ((20.0, True), (1.0, False)):
        one = judge("point 1 x", "", "length", (1.0, scale), {"step ÷ 2": 1 + 0.25 * scale / 20}, [AS_IT_IS, HALF_STEP])
        study = Convergence("", (one,), (), {}, 0.05, Units(), False, "", Path())
        assert "matters by less than 5 % (all together 2.5 % at most)" in study.summary
        assert ("of the whole displacement of its point" in study.summary) == is_said


def test_shares_beyond_a_hundred_per_cent_have_no_exponent():
    assert [percent(share) for share in (1.3, 0.999, 1, 0.0227, 0)] == ["130 %", "100 %", "100 %", "2.3 %", "0 %"]
    assert (percent(1, 3), percent(0.00651, 3), percent(2.5e-6, 3)) == ("100 %", "0.651 %", "2.5e-06")


@pytest.mark.parametrize(
    ("error", "shown"), [(0.236, "0.24"), (0.62, "0.7"), (1.6, "1.6"), (0.0123, "0.013"), (4, "4"), (0.0, "0")]
)
def test_errors_are_rounded_up(error, shown):
    assert rounded(error) == shown
    assert float(shown) >= error


def test_errors_have_two_digits():
    assert [two_digits(error) for error in (0.0752, 0.1, 12.3, 0.8)] == ["0.075", "0.10", "12", "0.80"]


def test_values_have_the_digits_of_their_error():
    assert number_with_error(-72.1439, [0.5, 0.06]) == "-72.14"
    assert number_with_error(1.19921875, [0.0039]) == "1.199"


# -- inputs that scatter ----------------------------------------------------------------------------------------------

GROUPS = {
    "joint_material": [
        {"number": 1, "name": "bedding", "friction": 30},
        {"number": 2, "name": "joint", "friction": 40},
    ],
    "water": [{"name": "reservoir", "table": [0, 1, 2, 3], "unit_weight": 9810}],
    "load": [{"gravity": 9.81}],
}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("", "nothing is to vary"),
        ("bedding.friction", "expected NAME.OPTION = DISTRIBUTION"),
        ("friction = normal(1, 2)", "expected NAME.OPTION, such as bedding.friction"),
        ("bedding.friction = gauss(35, 5)", r"expected one of normal\(mean"),
        ("bedding.friction = normal(35)", r"expected normal\(mean, standard deviation\[, low, high\]\)"),
        ("bedding.friction = normal(35, -5)", "expected a standard deviation above 0"),
        ("bedding.friction = uniform(35, 5)", "expected low, high in this order"),
        ("bedding.cohesion = lognormal(0, 1)", "above 0"),
        ("beding.friction = normal(35, 5)", "did you mean 'bedding'"),
        ("bedding.phi = normal(35, 5)", "did you mean 'friction'"),
        ("joint_material.friction = normal(35, 5)", r"name one of them \(bedding, joint\)"),
        ("bedding.law = normal(35, 5)", "is no number that can vary continuously"),
        ("reservoir.table = normal(35, 5)", r"is a list of 4 numbers: name one, such as table\[2\]"),
        ("reservoir.table[5] = normal(35, 5)", "has 4 numbers"),
        ("bedding.friction = normal(35, 5); joint_material 1.friction = normal(35, 5)", "are the same number"),
    ],
)
def test_wrong_inputs_are_named(native, given, message):
    with pytest.raises(InputError, match=message):
        parse_inputs(given, GROUPS)


def test_places_of_inputs(native):
    given = "tan(bedding.friction) = normal(0.7, 0.1); joint_material 2.cohesion = lognormal(1e5, 2e4)"
    given += (
        "; water.level = uniform(-2, 2); reservoir.table[4] = triangular(0, 1, 2); load.gravity = normal(10, 1, 9, 11)"
    )
    found = parse_inputs(given, GROUPS)
    places = [(one.group, one.entry, one.option, one.index) for one in found]
    assert places == [
        ("joint_material", 0, "friction", None), ("joint_material", 1, "cohesion", None), ("water", 0, "level", None),
        ("water", 0, "table", 4), ("load", 0, "gravity", None),
    ]  # fmt: skip
    assert found[0].value(1.0) == pytest.approx(45.0)
    lognormal = found[1].distribution
    assert (lognormal.mean(), lognormal.std()) == (pytest.approx(1e5), pytest.approx(2e4))


def test_samples_have_the_correlation_and_are_those_of_their_seed():
    pytest.importorskip("scipy")
    inputs = [random_input("a", "normal", 10.0, 2.0), random_input("b", "lognormal", 5.0, 1.0)]
    matrix = correlation_of("a, b = -0.5", inputs)
    values = sample(inputs, matrix, 2000, 3)
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(-0.5, abs=0.03)
    assert values.mean(axis=0) == pytest.approx([10.0, 5.0], rel=2e-3)
    assert np.array_equal(values, sample(inputs, matrix, 2000, 3))
    assert not np.array_equal(values, sample(inputs, matrix, 2000, 4))
    for seed in range(8):  # independent inputs of a small sample: up to 0.34 in a plain hypercube
        assert abs(np.corrcoef(sample(inputs, np.eye(2), 30, seed).T)[0, 1]) < 0.1
    for wrong in ("a = 1", "a, c = 0.5", "a, b = 2", "a, a = 0.5"):
        with pytest.raises(InputError, match="correlate"):
            correlation_of(wrong, inputs)


# -- surfaces ---------------------------------------------------------------------------------------------------------


def sau_mau_ping(cohesion, tangent, share):
    """Hoek and Bray's factor: a plane of 35 degrees below a slope of 60 m, water in the crack of 14 m by its share."""
    angle, crack, weight = math.radians(35), 14.0089839705, 23.924e6
    area, level = (60 - crack) / math.sin(angle), share * crack
    uplift, push = 0.5e4 * level * area, 0.5e4 * level**2
    normal = weight * math.cos(angle) - uplift - push * math.sin(angle)
    return (cohesion * area + normal * tangent) / (weight * math.sin(angle) + push * math.cos(angle))


def surface_of(inputs, factors_of, runs, seed, noise=0.004):
    """A surface through factors that a search has found within an interval."""
    values = sample(inputs, np.eye(len(inputs)), runs, seed)
    factors = factors_of(*values.T) + np.random.default_rng(seed).uniform(-noise, noise, runs)
    laws = [one.distribution for one in inputs]
    return values, fit(values, factors, *(np.array([getattr(law, name)() for law in laws]) for name in ("mean", "std")))


def test_a_linear_limit_state_has_its_closed_index():
    """TRUTHS-3 R1: β 3.16648 dry, 1.38102 with the crack full, and the design point."""
    pytest.importorskip("scipy")
    inputs = [random_input("c", "normal", 1e5, 2e4), random_input("t", "normal", 0.70021, 0.1)]
    for share, index, tolerance in ((0.0, 3.16648, 0.05), (1.0, 1.38102, 0.03)):
        _, surface = surface_of(inputs, lambda c, t, share=share: sau_mau_ping(c, t, share), 30, 1)
        found = failure_of(surface, inputs, np.eye(2), 1.0, 0.002)
        assert index_of(found.probability) == pytest.approx(index, abs=tolerance)
        assert found.interval[0] < found.probability < found.interval[1]
        assert found.distance == pytest.approx(index, abs=tolerance)
    assert found.design_point == pytest.approx([0.078817e6, 0.611586], rel=0.02)
    shares = shares_of_variance(surface, inputs, np.eye(2))
    assert sum(shares.values()) == pytest.approx(1.0)
    gradients = np.array([2e4 * (sau_mau_ping(1.1e5, 0.7, 1) - sau_mau_ping(1e5, 0.7, 1)) / 1e4,
                          0.1 * (sau_mau_ping(1e5, 0.8, 1) - sau_mau_ping(1e5, 0.7, 1)) / 0.1])  # fmt: skip
    assert shares["c"] == pytest.approx(gradients[0] ** 2 / np.sum(gradients**2), abs=0.02)


def test_three_inputs_have_the_probability_of_quadrature():
    """TRUTHS-3 R2: 0.023108; each of four repetitions within 0.004, and within its interval."""
    pytest.importorskip("scipy")
    inputs = [random_input("c", "normal", 1e5, 2e4), random_input("phi", "normal", 35.0, 5.0),
              random_input("share", "uniform", 0.0, 1.0)]  # fmt: skip

    def factor(cohesion, angle, share):
        return np.vectorize(sau_mau_ping)(cohesion, np.tan(np.radians(angle)), share)

    for seed in range(4):
        _, surface = surface_of(inputs, factor, 30, seed)
        found = failure_of(surface, inputs, np.eye(3), 1.0, 0.002)
        assert found.probability == pytest.approx(0.023108, abs=0.004)
        assert found.interval[0] <= 0.023108 <= found.interval[1]
        assert found.distance_interval[0] <= 1.9019 <= found.distance_interval[1]
        shares = intervals_of_shares(surface, inputs, np.eye(3), 0.002)
        for name, share in {"c": 0.257, "phi": 0.490, "share": 0.253}.items():
            assert shares[name][0] <= share <= shares[name][1] <= shares[name][0] + 0.06


def test_a_factor_that_jumps_fits_no_surface():
    pytest.importorskip("scipy")
    inputs = [random_input("a", "normal", 0.0, 1.0), random_input("b", "normal", 0.0, 1.0)]
    _, surface = surface_of(inputs, lambda a, b: 1.0 + 0.5 * np.sign(np.sin(3 * a)), 30, 1)
    assert surface.explained < 0.5
    _, smooth = surface_of(inputs, lambda a, b: 1.2 + 0.1 * a - 0.05 * b + 0.03 * a * b, 30, 1)
    assert smooth.kind == "quadratic with cross terms"
    assert smooth.explained > 0.99


def test_a_surface_has_terms_for_its_runs():
    assert fitting_kinds(30, 3) == ["linear", "quadratic", "quadratic with cross terms"]
    assert fitting_kinds(30, 6) == ["linear", "quadratic"]
    assert fitting_kinds(10, 6) == []


def test_the_line_of_a_back_analysis_gives_the_factor():
    pytest.importorskip("scipy")
    inputs = [random_input("c", "normal", 1e5, 2e4), random_input("t", "normal", 0.70021, 0.1)]
    values, surface = surface_of(inputs, lambda c, t: sau_mau_ping(c, t, 1.0), 30, 1)
    pairs = line_of(surface, values, 0, 1, 1.0, surface.mean)
    assert len(pairs) > 10
    assert [sau_mau_ping(c, t, 1.0) for c, t in pairs] == pytest.approx(np.ones(len(pairs)), abs=0.01)


def test_an_interval_of_what_was_counted():
    pytest.importorskip("scipy")
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert wilson(15, 30) == pytest.approx((0.3315, 0.6685), abs=1e-4)


@pytest.mark.parametrize(
    ("message", "side"),
    [
        ("stable at 64, the upper end of the search of the strength: search further", STANDS),
        ("rockdda: error: stable at 0.8, the upper end of the search of the strength: look", UNKNOWN),
        ("not stable at 0.5, the lower end of the search of the strength: begin lower", FAILS),
        ("not stable at 2, the lower end of the search of the strength: begin lower", UNKNOWN),
        (
            "the model does not stand even with 64 times …: … moved by 1 m, and the force that moves it does not fall",
            FAILS,
        ),
        ("the model does not stand: stage 'a' did not come to equilibrium in 5000 steps (unbalanced 1e-3)", UNKNOWN),
        ("the model did not come to rest: stage 'a' did not come to equilibrium in 5000 steps", UNKNOWN),
        ("not found to be stable at 0.5, the lower end of the search: that trial neither came to rest", UNKNOWN),
        ("killed by signal 9", UNKNOWN),
    ],
)
def test_the_side_of_a_search_without_a_factor(message, side):
    assert _side(message, 1.0) == side


def test_runs_whose_side_is_not_known_widen_the_interval():
    from rockdda.certainty.reliability_study import _counted

    pytest.importorskip("scipy")
    known = [Found(i, 1.2, 0.0, "sliding", STANDS, "") for i in range(18)] + [Found(19, 0.8, 0.0, "", FAILS, "")] * 2
    unknown = [Found(20, None, 0.0, "", UNKNOWN, "killed")] * 5
    assert _counted(known)[0] == _counted(known + unknown)[0] == pytest.approx(0.1)
    assert _counted(known + unknown)[1][1] > _counted(known)[1][1] + 0.1
    assert _counted(known + unknown)[1][0] < _counted(known)[1][0]
