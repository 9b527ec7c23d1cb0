# SPDX-License-Identifier: MIT
"""Pull tests of bolts: the closed form, the fit of noisy curves, and curves that leave a parameter open."""

import json

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
from rockdda import InputError
from rockdda.analysis.pull_test import calibrate_bolt, pull_curve, read_pull_test
from rockdda.cli import app
from typer.testing import CliRunner

AREA, YOUNG, STIFFNESS, STRENGTH = 181e-6, 98.6e9, 112e6, 175e3
AXIAL = AREA * YOUNG
BAR = {"area": AREA, "young": YOUNG}


def write(path, moved, force, head="displacement [mm], force [kN]", scale=(1e3, 1e-3), mark=","):
    rows = "".join(f"{x * scale[0]:.6g}{mark}{f * scale[1]:.6g}\n" for x, f in zip(moved, force, strict=True))
    path.write_text(f"# pull test\n{head}\n{rows}")
    return path


def noisy(seed, length=1.0, largest=9e-3, noise=0.02, free=0.0, points=60):
    """A curve with noise of a share of its largest force."""
    moved = np.linspace(0, largest, points)
    force = pull_curve(moved, length, AXIAL, STIFFNESS, STRENGTH, free)
    return moved, np.abs(force + noise * force.max() * np.random.default_rng(seed).normal(size=points))


def test_curve_is_that_of_the_closed_form():
    # slip begins; fronts at L/4, L/2, 3L/4; plateau
    moved = [1.5625e-3, 2.8029e-3, 4.4498e-3, 5.9511e-3, 9e-3]
    found = pull_curve(moved, 1.0, AXIAL, STIFFNESS, STRENGTH)
    np.testing.assert_allclose(found, [68.93e3, 110.42e3, 146.81e3, 170.05e3, 175e3], rtol=1e-4)
    assert pull_curve(1e-3, 1.0, AXIAL, STIFFNESS, STRENGTH) == pytest.approx(44.116e3, rel=1e-4)
    # a free length adds its own elongation
    longer = np.array(moved) + found * 0.5 / AXIAL
    np.testing.assert_allclose(pull_curve(longer, 1.0, AXIAL, STIFFNESS, STRENGTH, 0.5), found, rtol=1e-4)


@pytest.mark.parametrize(("length", "largest", "free"), [(1.0, 9e-3, 0.0), (0.3, 4e-3, 0.0), (1.0, 14e-3, 0.5)])
def test_noisy_curves_give_the_numbers_back(tmp_path, length, largest, free):
    """The truth lies within the 95 % interval in most of 40 tests, and the interval is not much too wide."""
    inside, errors = np.zeros((40, 2)), np.zeros((40, 2))
    for seed in range(40):
        path = write(tmp_path / "lab.csv", *noisy(seed, length, largest, free=free))
        fit = calibrate_bolt(path, length=length, free_length=free, **BAR)
        for k, (found, error, truth) in enumerate(
            [
                (fit.grout_stiffness, fit.grout_stiffness_error, STIFFNESS),
                (fit.grout_strength, fit.grout_strength_error, STRENGTH),
            ]
        ):
            inside[seed, k] = abs(found - truth) <= error
            errors[seed, k] = (found - truth) / error
    # 95 % of 40 are 38; fewer than 33 have a probability of 1e-3
    assert (inside.sum(axis=0) >= 33).all(), inside.sum(axis=0)
    # 1.96 standard deviations are the error
    assert (errors.std(axis=0) < 0.75).all(), errors.std(axis=0)
    assert (errors.std(axis=0) > 0.3).all(), errors.std(axis=0)


def test_exact_curve_gives_the_exact_numbers(tmp_path):
    fit = calibrate_bolt(write(tmp_path / "lab.csv", *noisy(0, noise=0)), length=1.0, **BAR)
    assert fit.grout_stiffness == pytest.approx(STIFFNESS, rel=1e-4)
    assert fit.grout_strength == pytest.approx(STRENGTH, rel=1e-4)
    assert fit.onset == pytest.approx((1.5625e-3, 68.93e3), rel=1e-3)
    assert fit.plateau == pytest.approx(175e3, rel=1e-3)


@pytest.mark.parametrize(
    ("scale", "numbers", "words"),
    [
        (
            (1e3, 1e-3),
            {},
            r"lab.csv:2:1: error: the displacements go to 9 m, expected at most 0.3 of the length of 1 m: .* mm",
        ),
        ((1, 1e-3), {"length": 1000}, r"length: 1000 m cannot be, it seems to be in mm, where it is 1 m"),
        ((1, 1e-3), {"area": 181}, r"area: 181 m² cannot be, it seems to be in mm², where it is 0.000181 m²"),
        ((1, 1e-3), {"young": 98.6}, r"young: 98.6 Pa cannot be, it seems to be in GPa"),
        ((1, 1e-3), {"yield_force": 200}, r"yield_force: 200 N cannot be, it seems to be in kN, where it is 200000 N"),
    ],
)
def test_another_unit_is_refused(tmp_path, scale, numbers, words):
    path = write(tmp_path / "lab.csv", *noisy(0, noise=0), head="displacement [m], force [kN]", scale=scale)
    with pytest.raises(InputError, match=words):
        calibrate_bolt(path, **({"length": 1.0} | BAR | numbers))


def test_unusual_grout_is_told(tmp_path):
    """Forces in kN under a head that has them in N."""
    usual = calibrate_bolt(write(tmp_path / "lab.csv", *noisy(0, noise=0)), length=1.0, **BAR)
    assert not usual.notes
    path = write(tmp_path / "lab.csv", *noisy(0, noise=0), scale=(1e3, 1e-6))
    found = calibrate_bolt(path, length=1.0, **BAR | {"young": 1e9})
    assert any(note.startswith("grout_strength of 171 N/m is unusual (10000 to 1e+07)") for note in found.notes), (
        found.notes
    )


def test_a_curve_without_plateau_leaves_the_strength_open(tmp_path):
    path = write(tmp_path / "lab.csv", *noisy(1, largest=1.4e-3))
    with pytest.raises(
        InputError, match=r"does not determine grout_strength.*at least 1[4-7]\de\+05|at least"
    ) as caught:
        calibrate_bolt(path, length=1.0, **BAR)
    assert "grout_stiffness is 1." in str(caught.value)
    assert "nor" not in str(caught.value).split("What it")[0].replace("nor does it bend", "")


def test_a_curve_on_the_plateau_leaves_the_stiffness_open(tmp_path):
    moved, force = noisy(2, noise=0.005)
    on = moved > 7.5e-3
    with pytest.raises(InputError, match="does not determine grout_stiffness") as caught:
        calibrate_bolt(write(tmp_path / "lab.csv", moved[on], force[on]), length=1.0, **BAR)
    assert "grout_strength is 1.7" in str(caught.value)


def test_points_of_steel_and_of_weak_grout_are_left_out(tmp_path):
    moved, force = noisy(3, noise=0.002)
    weak = np.where(moved > 8e-3, 0.6 * force, force)
    fit = calibrate_bolt(write(tmp_path / "lab.csv", moved, weak), length=1.0, **BAR)
    assert fit.grout_strength == pytest.approx(STRENGTH, rel=0.02)
    assert "60 %" in fit.notes[0]
    fit = calibrate_bolt(
        write(tmp_path / "lab.csv", moved, np.minimum(force, 160e3)), length=1.0, yield_force=160e3, **BAR
    )
    assert fit.grout_strength == pytest.approx(STRENGTH, rel=0.05)
    assert "yield force" in fit.notes[0]


def test_units_of_the_head_count(tmp_path):
    moved, force = noisy(4)
    expected = read_pull_test(write(tmp_path / "a.csv", moved, force))
    other = read_pull_test(write(tmp_path / "b.csv", moved, force, "Weg [m]; Kraft [N]", (1.0, 1.0), ";"))
    np.testing.assert_allclose(other.displacement, expected.displacement, rtol=1e-5)
    np.testing.assert_allclose(other.force, expected.force, rtol=1e-5)
    swapped = tmp_path / "c.csv"
    swapped.write_text("time [s]\tforce [MN]\tdisplacement [cm]\n0\t0\t0\n1\t0.1\t0.2\n")
    np.testing.assert_allclose(read_pull_test(swapped).force, [0, 1e5])
    np.testing.assert_allclose(read_pull_test(swapped).displacement, [0, 2e-3])


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("displacement, force\n1,2\n", (1, 1), "a column of displacements with its unit in brackets"),
        ("displacement [mm], force [K]\n1,2\n", (1, 1), "a column of forces with its unit"),
        ("displacement [mm], force [kN]\n0,0\n1,x\n", (3, 3), "expected a force, found 'x'"),
        ("displacement [mm], force [kN]\n0,0\n1\n", (3, 3), "the force is missing"),
        ("displacement [mm], force [kN]\n0,5,1,0\n", (2, 1), "decimal commas"),
        ("displacement [mm]; force [kN]\n0,5;1\n", (2, 1), "decimal commas"),
        ("displacement [mm], force [kN]\n1,1\n0.5,2\n", (3, 1), "the displacement falls"),
        ("displacement [mm], force [kN]\n", (None, None), "no numbers"),
    ],
)
def test_bad_tables_are_refused_with_their_place(tmp_path, text, place, words):
    path = tmp_path / "lab.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_pull_test(path)
    assert (caught.value.problems[0].line, caught.value.problems[0].column) == place


def test_command_prints_draws_and_refuses(tmp_path):
    lab = write(tmp_path / "lab.csv", *noisy(5))
    arguments = ["calibrate-bolt", str(lab), "--length", "1", "--area", str(AREA), "--young", str(YOUNG)]
    picture = tmp_path / "fit.png"
    done = CliRunner().invoke(app, [*arguments, "-o", str(picture), "--json"])
    assert done.exit_code == 0, done.output
    summary = json.loads(done.stdout)
    assert summary["grout_stiffness"] == pytest.approx(STIFFNESS, rel=0.1)
    assert summary["grout_strength_error"] < 0.05 * STRENGTH
    assert picture.stat().st_size > 10_000
    with pytest.raises(InputError, match="give diameter or area"):
        calibrate_bolt(lab, length=1.0, young=YOUNG)


def test_picture_marks_what_was_left_out(tmp_path):
    moved, force = noisy(6, noise=0.002)
    fit = calibrate_bolt(
        write(tmp_path / "lab.csv", moved, np.where(moved > 8e-3, 0.6 * force, force)), length=1.0, **BAR
    )
    labels = [text.get_text() for text in fit.plot().get_legend().get_texts()]
    assert {"measured", "left out", "fit"} <= set(labels)
    plt.close("all")
