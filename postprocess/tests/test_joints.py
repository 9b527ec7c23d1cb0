# SPDX-License-Identifier: MIT
"""Stresses, opening and slip along joints: tables, pictures, exports; and files of version 1, which have none.

Most datasets are made here in the shape of those of the solver: one row for each contact.
"""

import shutil
import subprocess

import h5py
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas
import pytest
import rockdda
from matplotlib.collections import LineCollection
from places import INPUTS, assert_same_results
from rockdda import cli
from rockdda import plot as pictures
from rockdda.deck import AnalysisDeck, BlockMaterial, JointMaterial
from rockdda.export import to_csv, to_vtk
from rockdda.joints import JOINT_FIELDS, joint_summary
from rockdda.plot.style import STATES
from synthetic import write_wall

WEIGHTS = (1 / 6, 2 / 3, 1 / 6)
#: rounding of coordinates of some metres
ROUNDING = 1e-12


def put(file, name, rows, kind="f8", width=()):
    path = f"frames/contact_{name}"
    if path in file:
        del file[path]
    file.create_dataset(path, data=np.asarray(rows, dtype=kind).reshape(-1, *width), maxshape=(None, *width))


def add_joints(path, columns, rows):
    """Intervals of three points on all joints of a wall that has not moved; the blocks of every second one exchanged.

    Normal stress -100 (1 + y), shear stress 10 (1 + x), opening 1e-3 x, slip -1e-3 y; the first point is open.
    """
    joints = []
    for j in range(rows):
        for i in range(columns):
            block = j * columns + i
            if i + 1 < columns:
                joints.append((block, block + 1, (i + 1.0, j), (i + 1.0, j + 1.0)))
            if j + 1 < rows:
                joints.append((block, block + columns, (i, j + 1.0), (i + 1.0, j + 1.0)))
    blocks, points = [], []
    for number, (first, second, start, end) in enumerate(joints):
        for share in (1.0, 0.0, 0.5) if number % 3 else (0.5, 1.0, 0.0):  # in no order
            blocks.append((second, first) if number % 2 else (first, second))
            points.append((np.array(start) * (1 - share) + np.array(end) * share, WEIGHTS[int(2 * share)]))
    place, length = np.array([p for p, _ in points]), np.array([w for _, w in points])
    normal, shear = -100 * (1 + place[:, 1]), 10 * (1 + place[:, 0])
    state = np.full(len(place), 2)
    state[0], normal[0], shear[0] = 0, 0.0, 0.0
    # any vector does: the second block gets the opposite one
    force = np.where((np.array(blocks)[:, 0] < np.array(blocks)[:, 1])[:, None], 1.0, -1.0) * place * length[:, None]
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = 2
        frames = len(file["frames/time"])
        file["frames/vertices"][:] = file["model/vertices"][()]
        file["frames/contact_offset"][:] = len(place) * np.arange(frames + 1)
        tiled = {
            "point": place, "force": force, "state": state, "blocks": np.array(blocks), "opening": 1e-3 * place[:, 0],
            "slip": -1e-3 * place[:, 1], "length": length, "normal_stress": normal, "shear_stress": shear,
            "strength": np.where(state > 0, shear / (50.0 - normal), 0.0),
        }  # fmt: skip
        for name, values in tiled.items():
            kind = "i4" if name in ("state", "blocks") else "f8"
            put(file, name, np.concatenate([values] * frames), kind, values.shape[1:])
        deck = AnalysisDeck(
            1.0, 10, 0.01, 0.01, [BlockMaterial(2500.0, 25000.0, 1e9, 0.2)], [JointMaterial(45.0, 50.0)], stiffness=1e9,
            fixed_tables=[], loading_tables=[],
        )  # fmt: skip
        for name, text in (("analysis", deck.text()), ("config", "")):
            del file[f"input/{name}"]
            file[f"input/{name}"] = text
    return path


@pytest.fixture
def wall(tmp_path):
    return rockdda.open(add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2))


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def test_points_are_ordered_joint_by_joint_and_cover_their_edges(wall):
    table = wall.joints()
    pairs = [(0, 1), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (4, 5)]
    assert list(zip(table["first"], table["second"], strict=True)) == [pair for pair in pairs for _ in range(3)]
    assert table["joint"].tolist() == [k for k in range(7) for _ in range(3)]
    for (first, second), points in table.groupby(["first", "second"]):
        np.testing.assert_allclose(points["length"], WEIGHTS)
        ends = points[["x1", "y1", "x2", "y2"]].to_numpy()
        np.testing.assert_allclose(ends[1:, :2], ends[:-1, 2:], atol=ROUNDING)  # end to end
        column = first % 3
        edge = (
            [[column + 1, first // 3], [column + 1, first // 3 + 1]]
            if second == first + 1
            else [[column, 1], [column + 1, 1]]
        )
        np.testing.assert_allclose(sorted([ends[0, :2].tolist(), ends[-1, 2:].tolist()]), edge, atol=ROUNDING)
        # the edge of the first block whose start is named is this one
        start = wall.vertices[points["edge"].iloc[0]]
        np.testing.assert_allclose(start, ends[0, :2], atol=ROUNDING)


def test_values_stay_with_their_points(wall):
    table = wall.joints()
    closed = table["state"] > 0
    assert (~closed).sum() == 1
    np.testing.assert_allclose(table["normal_stress"][closed], -100 * (1 + table["y"][closed]))
    np.testing.assert_allclose(table["shear_stress"][closed], 10 * (1 + table["x"][closed]))
    np.testing.assert_allclose(table["opening"], 1e-3 * table["x"])
    np.testing.assert_allclose(table["slip"], -1e-3 * table["y"])
    # on the block with the smaller number, whichever the solver had first
    np.testing.assert_allclose(table["force_x"], table["x"] * table["length"])
    np.testing.assert_allclose(table["force_y"], table["y"] * table["length"])


def test_mobilised_strength_is_that_of_the_file(wall):
    table = wall.joints()
    np.testing.assert_allclose(
        table["mobilised"], (table["shear_stress"] / (50.0 - table["normal_stress"])).where(table["state"] > 0, 0.0)
    )


def test_older_files_hold_no_strength(tmp_path):
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        del file["frames/contact_strength"]
    results = rockdda.open(path)
    assert results.joints()["mobilised"].isna().all()
    with pytest.raises(rockdda.InputError, match="no strength of joints"):
        pictures.joints(results, "mobilised")
    pictures.joints(results, "slip")


def test_a_joint_is_the_sum_of_its_points(wall):
    points = wall.joints()
    joints = joint_summary(points)
    assert joints["length"].to_numpy() == pytest.approx(np.ones(7))
    assert joints["points"].tolist() == [3] * 7
    assert joints["open_points"].sum() == 1
    # linear along the joint: the weights of Simpson's rule give the value in its middle
    last = joints.iloc[-1]  # between the blocks 4 and 5: x = 2, y from 1 to 2
    assert (last["normal_stress"], last["shear_stress"], last["slip"]) == pytest.approx((-250.0, 30.0, -1.5e-3))
    assert (last["largest_opening"], last["largest_mobilised"]) == pytest.approx((2e-3, 30 / 250))
    assert (last["force_x"], last["force_y"]) == pytest.approx((2.0, 1.5))


def test_units_are_converted(wall):
    converted = rockdda.units.in_units(wall, "m,s,N", "mm,s,kN")
    a, b = wall.joints(), converted.joints()
    for name, factor in (("x", 1e3), ("opening", 1e3), ("slip", 1e3), ("length", 1e3), ("x2", 1e3)):
        np.testing.assert_allclose(b[name], factor * a[name], atol=1e3 * ROUNDING)
    for name, factor in (("normal_stress", 1e-9), ("shear_stress", 1e-9), ("force_x", 1e-3), ("mobilised", 1.0)):
        np.testing.assert_allclose(b[name], factor * a[name])


@pytest.mark.parametrize("field", JOINT_FIELDS)
def test_the_picture_has_a_line_for_each_point(wall, field):
    axes = pictures.joints(wall, field)
    table = wall.joints()
    shown = table if field == "opening" else table[table["state"] > 0]
    (drawn,) = [c for c in axes.collections if c.get_array() is not None]
    np.testing.assert_allclose(np.sort(drawn.get_array()), np.sort(shown[field]))
    segments = {tuple(ends) for ends in np.round(np.reshape(drawn.get_segments(), (-1, 4)), 9).tolist()}
    assert segments == {tuple(ends) for ends in shown[["x1", "y1", "x2", "y2"]].round(9).to_numpy().tolist()}
    lines = [c for c in axes.collections if isinstance(c, LineCollection)]
    grey = [c for c in lines if c.get_array() is None and len(c.get_segments()) == 1]
    assert len(grey) == (field != "opening")
    if grey:
        assert matplotlib.colors.to_hex(grey[0].get_color()[0]).upper() == STATES["open"]
        assert axes.get_legend().get_texts()[0].get_text().startswith("open")
    if field == "mobilised":
        assert drawn.get_clim() == (0.0, 1.0)


def test_points_without_length_are_dots(tmp_path):
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        file["frames/contact_length"][:] = 0
    results = rockdda.open(path)
    axes = pictures.joints(results, "slip")
    assert len(axes.collections[-1].get_offsets()) == (results.joints()["state"] > 0).sum()
    assert joint_summary(results.joints())["slip"].isna().all()


def test_tables(wall, tmp_path):
    to_csv(wall, tmp_path / "points.csv", "joint_points", [-1])
    to_csv(wall, tmp_path / "joints.csv", "joints", [0, 1])
    points = pandas.read_csv(tmp_path / "points.csv")
    table = wall.joints()
    assert points["frame"].tolist() == [2] * 21
    for name in ("joint", "first", "second"):
        assert points[name].tolist() == (table[name] + 1).tolist()
    for name in ("material", "x1", "length", "state", "normal_stress", "mobilised"):
        assert points[name].tolist() == table[name].tolist()
    joints = pandas.read_csv(tmp_path / "joints.csv")
    assert joints["frame"].tolist() == [0] * 7 + [1] * 7
    assert joints["second"].tolist() == [2, 4, 3, 5, 6, 5, 6] * 2


def test_vtk_lines(wall, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    to_vtk(wall, tmp_path / "wall.pvd")
    files = sorted(path.name for path in (tmp_path / "wall").iterdir())
    assert files == [f"wall_{k:05d}.vtu" for k in range(3)] + [f"wall_joints_{k:05d}.vtu" for k in range(3)]
    assert (tmp_path / "wall.pvd").read_text().count("_joints_") == 3
    grid, table = pyvista.read(tmp_path / "wall/wall_joints_00002.vtu"), wall.joints()
    assert grid.n_cells == 21
    np.testing.assert_allclose(grid.points.reshape(-1, 6)[:, [0, 1, 3, 4]], table[["x1", "y1", "x2", "y2"]])
    for name in JOINT_FIELDS:
        np.testing.assert_array_equal(grid.cell_data[name], table[name])
    assert grid.cell_data["blocks"].tolist() == (table[["first", "second"]] + 1).to_numpy().tolist()


def test_commands(wall, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["plot", "wall.h5", "--kind", "joints", "--dpi", "40"]) == cli.DONE
    assert cli.main(["plot", "wall.h5", "--field", "slip", "--dpi", "40", "-o", "slip.png"]) == cli.DONE
    assert (tmp_path / "wall_joints.png").exists()
    assert cli.main(["export", "wall.h5", "-o", "a.csv", "--table", "joints", "--frames", "-1"]) == cli.DONE
    assert cli.main(["plot", "wall.h5", "--kind", "joints", "--field", "speed"]) == cli.BAD_INPUT
    assert "there is no field 'speed' of joints; the fields are: normal_stress" in capsys.readouterr().err


def test_files_of_version_1_stay_readable(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    results = rockdda.open(write_wall(tmp_path / "old.h5", 3, 2))
    assert results.attributes["format_version"] == 1
    assert not results.has_joints
    assert results.frames[-1].contacts.length is None
    assert len(results.frames[-1].contacts) == 3
    with pytest.raises(rockdda.InputError, match="the file holds no stresses along joints: its version is older"):
        results.joints()
    assert cli.main(["plot", "old.h5", "--kind", "joints"]) == cli.BAD_INPUT
    assert "its version is older" in capsys.readouterr().err
    to_vtk(results, tmp_path / "old.pvd")
    assert not list((tmp_path / "old").glob("*joints*"))


def test_no_contacts(tmp_path):
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        file["frames/contact_offset"][:] = 0
    results = rockdda.open(path)
    assert len(results.joints()) == len(joint_summary(results.joints())) == 0
    for field in JOINT_FIELDS:
        pictures.joints(results, field)
    to_vtk(results, tmp_path / "wall.vtu")
    to_csv(results, tmp_path / "joints.csv", "joints")
    assert (tmp_path / "joints.csv").read_text().startswith("frame,time,joint,first")


def test_rows_that_are_not_yet_written_hide_their_frame(tmp_path):
    """A run that was killed between two tables."""
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        file["frames/contact_slip"].resize(len(file["frames/contact_slip"]) - 1, axis=0)
    results = rockdda.open(path)
    assert results.n_frames == 2
    assert len(results.joints()) == len(results["frames/contact_slip"]) // 2 == 21


@pytest.mark.parametrize(
    ("name", "rows", "message"),
    [
        ("length", -np.ones(63), "frames/contact_length holds an impossible number"),
        ("slip", np.full(63, np.nan), "frames/contact_slip holds a number that is not finite"),
        ("opening", np.zeros((63, 2)), "frames/contact_opening has an unexpected shape"),
    ],
)
def test_damaged_tables_are_refused(tmp_path, name, rows, message):
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        put(file, name, rows, width=rows.shape[1:])
    with pytest.raises(rockdda.InputError, match=message):
        rockdda.open(path).joints()


def run_model(program, model, path, options, *arguments):
    """Results of a model of inputs/ with more options."""
    folder = path / model
    shutil.copytree(INPUTS / model, folder)
    with (folder / f"{model}.nml").open("a", encoding="utf-8") as file:
        file.write(options)
    command = [program, "run", folder, "-o", path / "out.h5", "--quiet", *arguments]
    subprocess.run(command, check=True, capture_output=True)
    return rockdda.open(path / "out.h5")


@pytest.mark.parametrize("formulation", ["vertex", "length"])
@pytest.mark.parametrize("model", ["jointed_slope", "layered_roof"])
def test_joints_of_a_run(program, tmp_path, model, formulation):
    results = run_model(program, model, tmp_path, f"&contact formulation = '{formulation}' /\n", "--steps", "20")
    assert results.attributes["format_version"] == 2
    now, table, contacts = results.frames[-1], results.joints(), results.frames[-1].contacts
    closed = contacts.state > 0
    assert closed.sum() > 100
    joints = joint_summary(table)
    force = np.hypot(joints["force_x"], joints["force_y"])
    # an open joint has no length, and no mean stress
    traction = (np.hypot(joints["normal_stress"], joints["shear_stress"]) * joints["length"]).fillna(0)
    if formulation == "vertex":
        force = np.hypot(*contacts.force.T)
        traction = np.hypot(contacts.normal_stress, contacts.shear_stress) * contacts.length
        assert (contacts.length > 0).all()
    # a few operations per number; the normals at both ends of a joint differ by the angle of its edges
    limit = 1e-13 if formulation == "vertex" else 1e-4
    np.testing.assert_allclose(traction, force, atol=limit * force.max())
    assert (contacts.opening[~closed] > 0).any()
    # each point lies between the edges: on that of the first block, or the opening or half of it away from it
    start, end = now.vertices[table["edge"]], now.vertices[following(results, table["edge"].to_numpy())]
    along = (end - start) / np.hypot(*(end - start).T)[:, None]
    away = table[["x", "y"]].to_numpy() - start
    opening = table["opening"].to_numpy()
    distance = (along[:, 1] * away[:, 0] - along[:, 0] * away[:, 1]) / np.where(opening == 0, 1, opening)
    stations = np.array([0.0, 1.0] if formulation == "vertex" else [0.0, 0.5, 1.0])
    miss = np.abs(distance[:, None] - stations).min(axis=1) * np.abs(opening)
    # the edges of a joint are not quite parallel: seen from the other edge, distances differ
    assert miss.max() < 1e-6
    for field in JOINT_FIELDS:
        pictures.joints(results, field)
        plt.close("all")


def following(results, edge):
    offset = results.vertex_offset
    after = np.arange(1, offset[-1] + 1)
    after[offset[1:] - 1] = offset[:-1]
    return after[edge]


def test_ties_have_a_linear_stress(program, tmp_path):
    """The cubes of a beam, tied, under their weight: a beam between two walls."""
    options = "&contact formulation = 'length' /\n&joint_material number = 1, tie = .true. /\n"
    results = run_model(program, "flat_arch", tmp_path, options, "--steps", "60", "--save-every", "20")
    contacts, table = results.frames[-1].contacts, results.joints()
    assert set(contacts.state) == {2}
    for _, points in table.groupby(["edge", "first", "second"]):
        assert len(points) == 2
    assert np.abs(contacts.force).sum() > 0
    for joint in joint_summary(table).itertuples():
        resultant = joint.length * np.hypot(joint.normal_stress, joint.shear_stress)
        assert resultant == pytest.approx(np.hypot(joint.force_x, joint.force_y), rel=1e-9)
    assert (table["mobilised"] == 0).all()  # without cohesion and tension a tie does not break


@pytest.mark.parametrize("tie", [".false.", ".true."])
def test_a_continued_run_has_the_same_joints(program, tmp_path, tie):
    options = f"&contact formulation = 'length' /\n&joint_material number = 1, tie = {tie} /\n"
    for name, steps in (("whole", "20"), ("half", "10")):
        (tmp_path / name).mkdir()
        run_model(program, "flat_arch", tmp_path / name, options, "--steps", steps, "--save-every", "5")
    command = [program, "resume", tmp_path / "half/out.ckpt.h5", "--steps", "10", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    files = [tmp_path / name / "out.h5" for name in ("whole", "half")]
    assert_same_results(*files, except_for=("created", "planned_time"))


def test_version_2_has_all_tables(tmp_path):
    path = add_joints(write_wall(tmp_path / "wall.h5", 3, 2), 3, 2)
    with h5py.File(path, "a") as file:
        del file["frames/contact_slip"]
    with pytest.raises(rockdda.InputError, match="frames/contact_slip is missing"):
        rockdda.open(path)
