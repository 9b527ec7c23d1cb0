# SPDX-License-Identifier: MIT
"""Cutting, and models built in Python."""

import subprocess
import warnings

import numpy as np
import pytest
import rockdda
from places import INPUTS, assert_same_results
from rockdda.groups import plain_options
from rockdda.namelist import format_groups, parse_groups

pytestmark = pytest.mark.usefixtures("native")


def brick(name="brick"):
    """A block 1 x 1 on a base 3 x 1 that is fixed along a line, pushed and pulled; every kind of thing is there."""
    model = rockdda.Model(name, e0=1e-3, steps=20, dt_max=0.005, stiffness=1e9)
    model.add_line((1.0, 1.0), (1.0, 2.0), joint=2)
    model.add_polygon([(0, 0), (3, 0), (3, 1), (0, 1)])
    model.add_lines([[2, 1, 2, 2], [1, 2, 2, 2]], joint=[2, 1])
    model.add_material_line((1.2, 1.5), (1.8, 1.5), material=2)
    model.add_fixed((0.5, 0.5), (2.5, 0.5))
    model.add_fixed((1.5, 0.25), table=[(0, 0, 0), (1, 0, 1e-4)])
    model.add_loading((1.5, 1.75), table=[(0, 0, 0), (1, 1e4, 0)])
    model.add_measured((1.5, 1.5))
    model.add_bolt((1.5, 1.5), (1.5, 0.5), stiffness=1e6, pretension=10.0, strength=1e5)
    model.add_block_material(density=2500, gravity=9.81, youngs_modulus=5e9, poisson_ratio=0.25)
    model.add_block_material(
        density=2000, weight=2e4, youngs_modulus=1e9, poisson_ratio=0.2, velocity=(0.1, 0, 0), stress=(0, -1e3, 0)
    )
    model.add_joint_material(friction_angle=30)
    model.add_joint_material(friction_angle=20, cohesion=1e3, tension=1e2)
    model.options["run"] = {"title": "it's a brick", "save_every": 5}
    model.options["joint_law"] = [{"material": 1, "law": "coulomb", "damping_ratio": 0.05}]
    model.base_acceleration = [(0, 0, 0), (0.05, 0.5, 0.0), (0.1, 0, 0)]
    return model


def test_lines_become_blocks():
    side = np.arange(4.0)
    lines = [[0, y, 3, y] for y in side] + [[x, 0, x, 3] for x in side]
    blocks = rockdda.cut(lines)
    assert len(blocks) == 9
    np.testing.assert_allclose(blocks.areas, 1.0, rtol=1e-14)
    assert {tuple(c) for c in np.round(blocks.centroids, 9)} == {(x + 0.5, y + 0.5) for x in range(3) for y in range(3)}
    assert all(len(polygon) == 4 for polygon in blocks.polygons())
    assert blocks.report.lines == 8
    assert blocks.report.block_area == pytest.approx(9.0, rel=1e-14)
    assert abs(blocks.report.area_difference) < 1e-13
    assert len(rockdda.cut(np.array(lines), holes=[(1.5, 1.5)])) == 8


def test_joint_materials_of_lines_are_those_of_edges():
    blocks = rockdda.cut([[0, 0, 2, 0], [2, 0, 2, 1], [2, 1, 0, 1], [0, 1, 0, 0]], joint=[1, 2, 3, 4])
    start = dict(zip(map(tuple, blocks.vertices), blocks.edge_joint, strict=True))
    assert start == {(0, 0): 1, (2, 0): 2, (2, 1): 3, (0, 1): 4}


def test_areas_and_centroids_of_a_triangle_far_away():
    corners = np.array([[0, 0], [4, 0], [0, 3]]) + 1e6
    blocks = rockdda.cut(np.hstack([corners, np.roll(corners, -1, axis=0)]))
    assert blocks.areas[0] == 6.0
    np.testing.assert_allclose(blocks.centroids[0], corners.mean(axis=0), rtol=1e-15)


def test_dropped_lines_are_warned_of():
    square = [[0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 0, 0]]
    with pytest.warns(rockdda.InputWarning, match="lines.dc:14"):
        blocks = rockdda.cut([*square, [0.2, 0.2, 0.4, 0.4]])
    assert blocks.report.dropped_lines == 1
    assert [problem.severity for problem in blocks.messages if problem.line == 14] == ["warning"]


@pytest.mark.parametrize("name", ["flat_arch", "island", "tunnel", "jointed_slope"])
def test_files_are_cut_as_the_program_does(program, tmp_path, name):
    source = INPUTS / name / f"{name}.dc"
    subprocess.run([program, "cut", source, "-o", tmp_path / "a.blk"], check=True, capture_output=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rockdda.InputWarning)  # the island
        blocks = rockdda.cut(source, output=tmp_path / "b.blk")
    assert (tmp_path / "a.blk").read_bytes() == (tmp_path / "b.blk").read_bytes()
    again = rockdda.cut(tmp_path / "b.blk")
    assert again.report is None
    np.testing.assert_array_equal(again.vertices, blocks.vertices)
    np.testing.assert_array_equal(again.fixed_points.block, blocks.fixed_points.block)
    again.write(tmp_path / "c.blk")
    assert (tmp_path / "c.blk").read_bytes() == (tmp_path / "b.blk").read_bytes()


def test_what_cannot_be_cut(tmp_path):
    with pytest.raises(rockdda.InputError, match="no such file"):
        rockdda.cut(tmp_path / "a.dc")
    with pytest.raises(rockdda.InputError, match="expected a geometry or block file"):
        rockdda.cut(INPUTS / "island/island.df")
    with pytest.raises(rockdda.InputError, match=r"shape \(n, 4\), found \(2, 3\)"):
        rockdda.cut([[0, 0, 1], [0, 0, 1]])
    with pytest.raises(rockdda.InputError, match="finite"):
        rockdda.cut([[0, 0, 1, np.nan]])
    with pytest.raises(rockdda.InputError, match="no lines"):
        rockdda.cut(np.zeros((0, 4)))


def test_a_model_has_what_was_added():
    blocks = brick().cut()
    assert blocks.n_blocks == 2
    np.testing.assert_array_equal(blocks.material, [1, 2] if blocks.centroids[0, 1] < 1 else [2, 1])
    assert len(blocks.fixed_points) == 3  # both ends of the line, and the point
    assert len(blocks.loading_points) == len(blocks.measured_points) == len(blocks.bolts) == 1
    np.testing.assert_array_equal(blocks.bolts.ends, [[1.5, 1.5, 1.5, 0.5]])
    assert set(blocks.bolts.block[0]) == {0, 1}
    assert (blocks.bolts.stiffness[0], blocks.bolts.pretension[0], blocks.bolts.strength[0]) == (1e6, 10.0, 1e5)


def test_boundary_lines_come_first():
    model = brick()
    np.testing.assert_array_equal(model.lines[0], [0, 0, 3, 0])
    np.testing.assert_array_equal(model.lines[4], [1, 1, 1, 2])
    assert model.geometry_text().splitlines()[1].startswith("7 4 ")


def test_a_model_runs_as_its_files_do(program, tmp_path):
    model = brick()
    mine = model.run(output=tmp_path / "mine.h5")
    assert mine.title == "it's a brick"
    assert mine.n_steps == 20
    paths = model.write(tmp_path / "files")
    assert [path.suffix for path in paths] == [".dc", ".df", ".nml", ".csv"]
    command = [program, "run", tmp_path / "files", "-o", tmp_path / "theirs.h5", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    assert_same_results(mine.path, tmp_path / "theirs.h5")
    subprocess.run([program, "check", *paths[:3]], check=True, capture_output=True)
    # and everything had its effect
    history = mine.history()
    # friction stops the block after v²/(2 g tan 30°) = 0.88 mm; load, bolt, base and fixed point change that a little
    assert 6e-4 < history["measured_displacement_1_x"].iloc[-1] < 9e-4
    assert history["energy_external_work"].iloc[-1] > 0
    with pytest.raises(rockdda.InputError, match="force=True"):
        model.write(tmp_path / "files")
    model.write(tmp_path / "files", force=True)


def test_a_named_bolt_is_a_group_of_the_options(tmp_path):
    columns, named = brick(), brick()
    named._bolts.clear()
    named.add_bolt((1.5, 1.5), (1.5, 0.5), stiffness=1e6, pretension=10.0, strength=1e5, name="anchor")
    assert named.options["bolt"][0]["name"] == "anchor"
    forces = [m.run(output=tmp_path / "x.h5", force=True).frames[-1].bolt_force for m in (columns, named)]
    np.testing.assert_array_equal(*forces)
    named.write(tmp_path / "files")
    read = rockdda.Model.read(tmp_path / "files")
    assert plain_options(read.options)["bolt"] == plain_options(named.options)["bolt"]
    with pytest.raises(rockdda.InputError, match="stiffness"):
        named.add_bolt((0, 0), (1, 1), stiffness=-1, name="wrong")


def test_numbers_read_back_exactly(tmp_path):
    model = rockdda.Model("thirds", e0=1 / 300, dt_max=0.1 / 3, displacement_ratio=1e-2 / 3, steps=1)
    corners = np.array([[0, 0], [1 / 3, 0.1], [2 / 3, 7e-5 + 1], [1e-17, 1 / 7]])
    model.add_polygon(corners)
    model.add_block_material(density=1 / 3, weight=1e-5 / 3, youngs_modulus=2e9 / 3, poisson_ratio=1 / 3)
    model.add_joint_material(friction_angle=100 / 3)
    results = model.run(output=tmp_path / "x.h5")
    assert {tuple(v) for v in results.vertices} == {tuple(v) for v in corners}


def test_a_block_falls_freely(tmp_path):
    """y = -g t²/2, which DDA integrates exactly."""
    model = rockdda.Model("fall", steps=50, dt_max=0.01, displacement_ratio=1.0)
    model.add_polygon([(0, 0), (1, 0), (1, 1), (0, 1)])
    model.add_block_material(density=2500, gravity=10.0, youngs_modulus=1e9, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=30)
    simulation = model.simulate()
    simulation.advance(50)
    assert simulation.finished
    # rounding of 50 steps
    assert simulation.centroid[0, 1] - 0.5 == pytest.approx(-5 * simulation.time**2, rel=1e-12)
    assert simulation.velocity[0, 1] == pytest.approx(-10 * simulation.time, rel=1e-12)


def test_problems_of_a_model_name_its_files(tmp_path):
    model = rockdda.Model("bad")
    model.add_polygon([(0, 0), (1, 0), (1, 1)], joint=5)
    model.add_block_material(density=-1, gravity=9.81, youngs_modulus=1e9, poisson_ratio=0.2)
    model.add_joint_material(friction_angle=95)
    with pytest.raises(rockdda.InputError) as caught:
        model.run(output=tmp_path / "x.h5")
    assert {problem.file for problem in caught.value.problems} == {"bad.df"}
    assert {problem.line for problem in caught.value.problems} == {9, 14}
    assert list(tmp_path.iterdir()) == []


def test_mistakes_are_found_at_once():
    model = rockdda.Model()
    with pytest.raises(rockdda.InputError, match="expected a point"):
        model.add_line((0, 0, 0), (1, 1))
    with pytest.raises(rockdda.InputError, match="finite"):
        model.add_fixed((0, float("inf")))
    with pytest.raises(rockdda.InputError, match="joint: expected a whole number"):
        model.add_line((0, 0), (1, 1), joint=1.5)
    with pytest.raises(rockdda.InputError, match=r"shape \(m, 3\)"):
        model.add_loading((0, 0), table=[(0, 1)])
    with pytest.raises(rockdda.InputError, match="either gravity or weight"):
        model.add_block_material(density=1, youngs_modulus=1, poisson_ratio=0.2)
    with pytest.raises(rockdda.InputError, match="its own analysis"):
        rockdda.run(model, "x.df")


def test_options_become_namelists():
    model = rockdda.Model()
    assert model.options_text() == ""
    model.options["output"] = {"frames": False, "file": "it's.h5"}
    model.options["stage"] = [{"until_step": 5, "k01": 0}, {"k01": np.float64(1), "release": np.array([1, 2])}]
    model.options["load"] = {"harmonic": [(1.0, 0, 2.5, 0, 0), (0, 1, 3, 0, 0)]}
    assert " ".join(model.options_text().split()) == (
        "&output frames = .false. file = 'it''s.h5' / &stage until_step = 5 k01 = 0 / "
        "&stage k01 = 1.0 release = 1, 2 / &load harmonic = 1.0, 0, 2.5, 0, 0, 0, 1, 3, 0, 0 /"
    )


@pytest.mark.parametrize(
    "name", ["flat_arch", "bolted_beam", "shaking_block", "released_block", "gravity_dam", "pushed_block", "tunnel"]
)
def test_a_model_that_is_read_runs_as_its_files_do(program, tmp_path, name):
    command = [program, "run", INPUTS / name, "-o", tmp_path / "theirs.h5", "--steps", "5", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    model = rockdda.Model.read(INPUTS / name)
    mine = model.run(output=tmp_path / "mine.h5", steps=5)
    assert mine.title == rockdda.open(tmp_path / "theirs.h5").title
    assert_same_numbers(mine.path, tmp_path / "theirs.h5")
    model.write(tmp_path / "again")
    again = rockdda.Model.read(tmp_path / "again")
    assert again.geometry_text() == model.geometry_text()
    assert again.analysis_text() == model.analysis_text()
    assert again.options == model.options


def test_blocks_of_a_region_become_cells(tmp_path):
    whole = brick().run(output=tmp_path / "whole.h5", steps=1)
    np.testing.assert_array_equal(whole.parent, np.arange(whole.n_blocks))
    model = brick()
    model.options["region"] = [{"name": "all", "material": "1"}]
    model.options["subdivide"] = {"region": "all", "size": 0.3, "kind": "triangles", "joint_material": 1}
    cells = model.run(output=tmp_path / "cells.h5", steps=1)
    assert cells.n_blocks > 2 * whole.n_blocks
    area = np.bincount(cells.parent, weights=cells.block_area)
    np.testing.assert_allclose(area, whole.block_area, rtol=1e-12)  # sums of rounded areas
    model.options["joint_material"] = {"number": 2, "name": "inner", "friction": 30.0}
    model.options["subdivide"]["joint_material"] = "inner"
    named = model.run(output=tmp_path / "named.h5", steps=1)
    assert set(named.edge_joint.tolist()) == {1, 2}
    for name, value, fault in (
        ("size", 0, r"size.*greater than 0"),
        ("joint_material", 0, r"joint_material.*at least 1"),
    ):
        model.options["subdivide"] = {"size": 0.3, "joint_material": 1, name: value}
        with pytest.raises(rockdda.InputError, match=fault):
            model.run(steps=1)


def assert_same_numbers(one, other):
    """All datasets but the texts of the input, bit for bit."""
    with rockdda.open(one) as a, rockdda.open(other) as b:
        for path in a.keys():  # noqa: SIM118
            if not path.startswith("input/"):
                np.testing.assert_array_equal(a[path], b[path], err_msg=path)


def test_a_model_of_the_peer_dialect_keeps_its_meaning(program, tmp_path):
    """Its step limits and length scale are other ones; also tables of fixed lines and points on one line of text."""
    model = brick("old")
    model._fixed, model._loading = [], []
    model.add_fixed((0.5, 0.5), (2.5, 0.5))
    model.base_acceleration = None
    model.options = {}
    model.stiffness = 0.0
    (tmp_path / "m").mkdir()
    (tmp_path / "m/old.dc").write_text(model.geometry_text())
    (tmp_path / "m/old.df").write_text(
        "1 20 2 2 0.01 0.005\n2500 24525 5e9 0.25 0 0 0 0 0 0 0 0 0\n2000 2e4 1e9 0.2 0 -1e3 0 0 0 0 0.1 0 0\n"
        "30 0 0\n20 1e3 1e2\n"
    )
    command = [program, "run", tmp_path / "m", "-o", tmp_path / "theirs.h5", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    read = rockdda.Model.read(tmp_path / "m")
    assert read.options["time"] == {"length_scale": "largest", "dt_min": 5e-5}
    assert_same_numbers(read.run(output=tmp_path / "mine.h5").path, tmp_path / "theirs.h5")


def test_tables_of_fixed_points_are_read(tmp_path):
    model = brick()
    model.write(tmp_path)
    again = rockdda.Model.read(tmp_path)
    assert again.analysis_text() == model.analysis_text()
    # all numbers of the geometry on one line: points cannot be told from lines by where they stand
    numbers = " ".join(line.partition("#")[0] for line in model.geometry_text().splitlines())
    (tmp_path / "brick.dc").write_text(numbers + "\n")
    flat = rockdda.Model.read(tmp_path)
    first, second = (m.run(output=tmp_path / f"{i}.h5") for i, m in enumerate((model, flat)))
    assert_same_numbers(first.path, second.path)


def test_blocks_are_no_model(tmp_path):
    rockdda.cut(INPUTS / "flat_arch/flat_arch.dc", output=tmp_path / "a.blk")
    with pytest.raises(rockdda.InputError, match="is a block file"):
        rockdda.Model.read(tmp_path / "a.blk", INPUTS / "flat_arch/flat_arch.df")


def test_namelists_read_back():
    text = "&Run title='it''s', T_END = 2d0/ # c\n&stage k01=0 release = 1, 2 3*7 /\n&stage k01 = 1. /\n"
    text += "&load harmonic = 1, 0, 2.5, 0, 0 ! x = 'y'\n harmonic = 0 1 3 0 0 /\n"
    text += '&output frames = .FALSE. file="a/b.h5" /'
    assert parse_groups(text, {"harmonic"}) == {
        "run": {"title": "it's", "t_end": 2.0},
        "stage": [{"k01": 0, "release": [1, 2, 7, 7, 7]}, {"k01": 1.0}],
        "load": {"harmonic": [1, 0, 2.5, 0, 0, 0, 1, 3, 0, 0]},
        "output": {"frames": False, "file": "a/b.h5"},
    }
    groups = parse_groups(text, {"harmonic"})
    assert parse_groups(format_groups(groups)) == groups
    with pytest.raises(rockdda.InputError, match="expected a mapping"):
        format_groups({"run": [("title", "x")]})
    with pytest.raises(rockdda.InputError, match="expected a number, text"):
        format_groups({"run": {"steps": None}})


def test_an_outline_with_a_gap_is_refused_unless_allowed(tmp_path):
    model = rockdda.Model("gap", labelled=True, gravity=9.81, steps=1)
    for start, end in (((0, 0), (4, 0)), ((4, 0), (4, 4)), ((4, 4), (0.5, 4)), ((0, 4), (0, 0))):
        model.add_line(start, end, boundary=True)
    model.add_line((-1, 2), (5, 2))
    model.add_block_material(density=2600, young=20e9, poisson=0.25)
    model.add_joint_material(friction=35)
    model.add_boundary([(0, 0), (4, 0)], "fixed")
    for act in (model.cut, lambda: model.run(output=tmp_path / "gap.h5")):
        with pytest.raises(rockdda.InputError, match=r"\(0.5, 4\) and line 4 at \(0, 4\), 0.5 apart.*allow_open=True"):
            act()
    for act in (model.cut, lambda **options: model.run(output=tmp_path / "gap.h5", **options)):
        with pytest.warns(rockdda.InputWarning, match="0.5 apart"):
            act(allow_open=True)
