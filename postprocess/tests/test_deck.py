# SPDX-License-Identifier: MIT
"""The text of geometry and analysis files: one writer for models, cutting and conversions."""

import math

import numpy as np
import pytest
import rockdda
from rockdda import convert, model
from rockdda.deck import AnalysisDeck, BlockMaterial, GeometryDeck, JointMaterial, number_text

ROCK = BlockMaterial(2500.0, 24525.0, 5.0e9, 0.25)


def test_there_is_one_block_material():
    assert model.BlockMaterial is convert.ddaml.BlockMaterial is BlockMaterial


@pytest.mark.parametrize("value", [0.0, -0.0, 1.0, -3.0, 0.1, 1 / 3, 1e15, 1e16, 1e22, 5e-324, 1.7976931348623157e308])
def test_numbers_read_back_exactly(value):
    again = float(number_text(value))
    assert (again, math.copysign(1, again)) == (value, math.copysign(1, value))


def test_whole_numbers_have_no_point():
    assert [number_text(value) for value in (2.0, -7, 24525.0, 0.5)] == ["2", "-7", "24525", "0.5"]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_are_refused(value):
    with pytest.raises(rockdda.InputError, match="expected a finite number"):
        number_text(value)


@pytest.mark.parametrize("material_lines", [0, 2])
@pytest.mark.parametrize("bolts", [0, 1])
def test_the_first_fixed_line_has_its_line_number(material_lines, bolts):
    deck = GeometryDeck(
        0.01, boundary=[((0, 0, 1, 0), 1)], joints=[((0, 0, 0, 1), 2)] * 3,
        material_lines=[((0, 0, 1, 1), 2)] * material_lines,
        bolts=[(0, 0, 1, 1, 1e6, 0, 0)] * bolts,
        fixed=[(0.25, 0.5, 0.75, 0.5), (3, 3, 3, 3)], measured=[(1, 2)],
    )  # fmt: skip
    rows = deck.text().splitlines()
    assert rows[deck.first_fixed_line() - 1].split() == ["0.25", "0.5", "0.75", "0.5"]
    assert deck.text("a title").splitlines() == ["# a title", *rows]


def test_the_dialects_differ_in_g0_and_tables():
    numbers = (1.0, 10, 0.01, 0.001, [ROCK], [JointMaterial(35.0)])
    plain = AnalysisDeck(*numbers).text()
    assert "g0" not in plain and "SOR" not in plain
    full = AnalysisDeck(*numbers, stiffness=0.0, fixed_tables=[[]], loading_tables=[[(0, 1, 2)]], sor_factor=1.4).text()
    assert "0   # g0: stiffness of contact springs, 0 automatic\n# numbers of" in full
    assert "\n0  1\n# loading point 1: t fx fy\n0  1  2\n" in full
    assert full.endswith("1.4   # SOR factor\n")


def test_many_points_with_tables_are_read_back(tmp_path, native):
    """More numbers of table rows than stand in one line, with tables of different lengths."""
    made = rockdda.Model("many", steps=1)
    made.add_polygon([(0, 0), (10, 0), (10, 1), (0, 1)])
    made.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    made.add_joint_material(friction_angle=35)
    made.add_fixed((0.1, 0.5))
    made.add_fixed((0.2, 0.5), table=[(0, 0, 0), (1, 0.001, 1 / 3)])
    for k in range(45):
        made.add_loading((0.5 + 0.2 * k, 0.5), table=[(t, k, -1 / (k + 1)) for t in range(k % 3)])
    again = rockdda.Model.read(made.write(tmp_path)[0].parent)
    assert again.analysis_text() == made.analysis_text()
    assert again.geometry_text() == made.geometry_text()
    for before, after in zip(made._loading, again._loading, strict=True):
        np.testing.assert_array_equal(before.table, after.table)
