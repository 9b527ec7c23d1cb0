# SPDX-License-Identifier: MIT
"""Limit analysis against closed forms and published limit loads."""

import math

import numpy as np
import pytest
from rockdda.analysis.limit_analysis import RigidBlocks, find_joints
from rockdda.errors import RockddaError
from rockdda_validation.factor_models import (
    FIRST_WALL,
    PIERCED_WALL,
    Dam,
    PlaneFailure,
    arch,
    arch_blocks,
    courses,
    random_plane_failures,
    rectangle,
    stack,
    wall,
)

pytest.importorskip("scipy")

BASE = rectangle(-5, -1, 15, 1)
TAN_10 = math.tan(math.radians(10))
TANGENT = math.degrees(math.atan(0.65))


def on_base(*blocks, friction=35.0, **rest):
    return RigidBlocks.from_polygons([BASE, *blocks], {0}, friction=friction, **rest)


@pytest.mark.parametrize(("friction", "width", "height"), [(30, 1, 3), (10, 1, 3), (40, 2, 1), (35, 1, 1)])
def test_one_block_slides_or_topples(friction, width, height):
    block = on_base(rectangle(0, 0, width, height), friction=friction)
    limit = min(math.tan(math.radians(friction)), width / height)
    assert block.push().factor == pytest.approx(limit, rel=1e-9)
    assert block.push(-1).factor == pytest.approx(limit, rel=1e-9)
    assert block.tilt() == pytest.approx(math.degrees(math.atan(limit)), abs=1e-3)
    velocity = block.push().velocity[1]
    assert velocity[0] > 0
    if width / height < math.tan(math.radians(friction)):  # about its toe, clockwise: u = h/2 ω, v = b/2 ω
        assert velocity[:2] / -velocity[2] == pytest.approx([height / 2, width / 2], rel=1e-6)
    else:  # along the base, with the dilation of an associated material
        assert velocity[1] / velocity[0] == pytest.approx(math.tan(math.radians(friction)), rel=1e-6)
        assert velocity[2] == pytest.approx(0, abs=1e-9)


def test_a_sliding_block_under_a_roof_is_locked_by_dilation_alone():
    """Associated friction lifts the block against the roof and never fails; without dilation it slides at tan φ."""
    tangent = math.tan(math.radians(30))
    blocks = [BASE, rectangle(-5, 1, 15, 1), rectangle(0, 0, 2, 1)]
    under = RigidBlocks.from_polygons(blocks, {0, 1}, friction=30.0)
    assert under.push().factor == math.inf
    assert under.push_of_mechanism([(0, 0, 0), (0, 0, 0), (1, 0, 0)]) == pytest.approx(tangent, rel=1e-9)
    assert under.push_without_dilation().factor == pytest.approx(tangent, rel=1e-4)
    with pytest.raises(RockddaError, match="no push"):
        under.push_of_mechanism([(0, 0, 0), (0, 0, 0), (0, 1, 0)])  # lifted off: nothing carries its weight


def test_load_of_a_mechanism_of_one_block():
    slides = on_base(rectangle(0, 0, 1, 3), friction=10.0, cohesion=0.2)
    assert slides.push_of_mechanism([(0, 0, 0), (1, 0, 0)]) == pytest.approx(TAN_10 + 0.2 / 3, rel=1e-9)
    topples = on_base(rectangle(0, 0, 1, 3), friction=40.0)
    about_its_toe = [(0, 0, 0), (1.5, 0.5, -1.0)]
    assert topples.push_of_mechanism(about_its_toe) == pytest.approx(1 / 3, rel=1e-9)


def test_load_on_the_top_edge_topples_or_slides():
    """H at the top of a block b × h: W b/2 = H h, or H = W tan φ; the same without dilation."""
    pull = np.zeros((2, 3))
    for width, height, friction in ((1.0, 3.0, 30.0), (3.0, 1.0, 20.0)):
        block = on_base(rectangle(0, 0, width, height), friction=friction)
        weight = width * height
        pull[1] = 2.0, 0.0, -2.0 * height / 2
        least = weight * min(width / (2 * height), math.tan(math.radians(friction)))
        assert 2 * block.largest(pull).factor == pytest.approx(least, rel=1e-9)
        assert 2 * block.largest_without_dilation(pull).factor == pytest.approx(least, rel=1e-4)


def test_block_on_an_incline_with_cohesion():
    """F = (c L + W cos p tan f) / (W sin p), gravity turned instead of the base."""
    weight, dip, friction, cohesion = 2.0 * 1.0 * 25.0, math.radians(20), 30.0, 3.0
    block = on_base(rectangle(0, 0, 2, 1), friction=friction, cohesion=cohesion, unit_weight=25.0)
    turned = np.zeros((2, 3))
    turned[1] = weight * math.sin(dip), weight * (1 - math.cos(dip)), 0.0
    expected = (cohesion * 2 + weight * math.cos(dip) * math.tan(math.radians(friction))) / (weight * math.sin(dip))
    assert block.with_load(turned).strength() == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("n", [1, 3, 10])
def test_stack_topples_as_a_whole(n):
    blocks = on_base(*(rectangle(0, 0.5 * k, 1, 0.5) for k in range(n)), friction=70)
    assert blocks.tilt() == pytest.approx(math.degrees(math.atan(1 / (0.5 * n))), abs=1e-3)


@pytest.mark.parametrize(
    ("rows", "slab", "factor"), [(FIRST_WALL, 2.0, 0.64286), (PIERCED_WALL, None, 0.40369)], ids=["first", "pierced"]
)
def test_walls_of_ferris_and_tin_loi(rows, slab, factor):
    blocks = RigidBlocks.from_polygons(courses(rows, 0.4, 0.175, slab), {0}, friction=TANGENT)
    assert blocks.push().factor == pytest.approx(factor, abs=1e-5)


def test_friction_without_dilation():
    """One block slides or topples as before; a wall fails below the bound, where its mechanism is in equilibrium."""
    for friction, width, height in [(30, 1, 3), (10, 1, 3), (35, 1, 1)]:
        limit = min(math.tan(math.radians(friction)), width / height)
        block = on_base(rectangle(0, 0, width, height), friction=friction)
        assert block.push_without_dilation().factor == pytest.approx(limit, rel=1e-4)
        assert block.push_without_dilation(-1).factor == pytest.approx(limit, rel=1e-4)
        velocity = block.push_without_dilation().velocity[1]
        if width / height >= math.tan(math.radians(friction)):
            assert velocity[1] / velocity[0] == pytest.approx(0, abs=1e-9)
    blocks = RigidBlocks.from_polygons(courses(PIERCED_WALL, 0.4, 0.175, None), {0}, friction=TANGENT)
    found = blocks.push_without_dilation()
    assert found.factor < 0.9 * blocks.push().factor
    assert found.factor == pytest.approx(blocks.push_of_mechanism(found.velocity), rel=1e-3)


@pytest.mark.parametrize(("n", "factor"), [(7, 0.3736), (28, 0.3549)])
def test_arch_of_oppenheim(n, factor):
    blocks = RigidBlocks.from_polygons(arch_blocks(10, 1.5, 157.5, n), {0, 1}, friction=75)
    assert blocks.push().factor == pytest.approx(factor, abs=5e-5)


def test_thinnest_semicircular_arch():
    """Milankovitch: t/R = 0.1075 for an arch of uniform thickness with radial joints everywhere."""

    def stands(thickness):
        return RigidBlocks.from_polygons(arch_blocks(1.0, thickness, 180, 80), {0, 1}, friction=80).is_stable()

    low, high = 0.10, 0.12
    while high - low > 5e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if stands(middle) else (middle, high)
    assert high == pytest.approx(0.1075, abs=1e-4)


def test_unstable_from_the_start():
    blocks = on_base(rectangle(9, 0, 4, 1))  # its centroid hangs over the end of the base
    assert not blocks.is_stable()
    with pytest.raises(RockddaError, match="no equilibrium under the dead load"):
        blocks.push()
    with pytest.raises(RockddaError, match="not stable without tilt"):
        blocks.tilt()
    with pytest.raises(RockddaError, match="not stable with any friction"):
        blocks.strength()


def test_blocks_that_need_no_strength():
    assert math.isinf(on_base(rectangle(0, 0, 1, 1)).strength())


def test_joints_are_where_edges_face_each_other():
    lower = [rectangle(0, 0, 1, 1), rectangle(1, 0, 1, 1)]
    joints = find_joints([*lower, rectangle(0.5, 1, 1, 1)], [np.full(4, 1), np.full(4, 3), np.full(4, 2)])
    assert [(j.first, j.second, j.material, pytest.approx(j.length)) for j in joints] == [
        (0, 1, 3, 1.0), (0, 2, 2, 0.5), (1, 2, 3, 0.5),
    ]  # fmt: skip
    # the first block lies to the left
    assert joints[0].start == pytest.approx((1, 0))
    assert joints[0].end == pytest.approx((1, 1))
    # a gap, and blocks that only share a corner
    apart = [rectangle(0, 0, 1, 1), rectangle(1.01, 0, 1, 1), rectangle(1, 1, 1, 1)]
    assert [(j.first, j.second) for j in find_joints(apart)] == [(1, 2)]
    assert [(j.first, j.second) for j in find_joints(apart, distance=0.02)] == [(0, 1), (1, 2)]
    assert find_joints(lower, [np.zeros(4, dtype=int), np.ones(4, dtype=int)]) == []


def test_truths_of_the_formulas():
    """T1, T2 and a dam, whose formulas the models carry."""
    dry, full = PlaneFailure(), PlaneFailure(water=1.0)
    assert (dry.weight / 1e6, dry.depth, dry.factor) == pytest.approx((23.924, 14.009, 1.584), abs=6e-4)
    assert (full.uplift / 1e6, full.thrust / 1e6, full.factor) == pytest.approx((5.617, 0.981, 1.199), abs=6e-4)
    dam = Dam(height=10, crest=10, base=10, water=10, unit_weight=24e3, water_weight=10e3)  # a square block
    assert dam.forces == pytest.approx((2.4e6, 0.5e6, 0.5e6))
    assert (dam.factor, dam.place) == pytest.approx((3.8, (2.4e6 * 5 + 0.5e6 * 10 / 3 - 0.5e6 * 10 / 3) / 1.9e7))


@pytest.mark.usefixtures("native")
class TestCutModels:
    """Blocks as RockDDA cuts them have the limits of the blocks that were drawn."""

    def test_walls_and_arches(self):
        assert RigidBlocks.from_model(wall("wall", FIRST_WALL, slab=2.0)).push().factor == pytest.approx(
            0.64286, abs=1e-5
        )
        assert RigidBlocks.from_model(wall("pierced", PIERCED_WALL)).push().factor == pytest.approx(0.40369, abs=1e-5)
        assert RigidBlocks.from_model(arch(7)).push().factor == pytest.approx(0.3736, abs=5e-5)
        assert RigidBlocks.from_model(stack(4)).tilt() == pytest.approx(math.degrees(math.atan(0.5)), abs=1e-3)

    def test_gravity_of_the_model(self):
        """Models read from files have it as an attribute, not among the options."""
        model = arch(7)
        expected = RigidBlocks.from_model(model).weight
        model.gravity = model.options.pop("load")["gravity"]
        assert RigidBlocks.from_model(model).weight == pytest.approx(expected)

    def test_plane_failures(self):
        for case in random_plane_failures(10):
            found = RigidBlocks.from_model(case.model()).strength()
            assert found == pytest.approx(case.factor, rel=1e-4)


def test_weights_come_from_the_gravity_of_the_model():
    model = wall("wall", [[1, 1]])
    weight = RigidBlocks.from_model(model).weight
    model.gravity = model.options.pop("load")["gravity"]
    assert RigidBlocks.from_model(model).weight == pytest.approx(weight, rel=1e-15)
