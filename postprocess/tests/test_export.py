# SPDX-License-Identifier: MIT
"""Files for other programs, read back."""

import csv
import subprocess
import sys
from pathlib import Path

import ezdxf
import h5py
import numpy as np
import pandas
import pytest
import pyvista
import rockdda
from rockdda import export
from rockdda.convert import convert
from synthetic import write_wall


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    """5 × 4 squares, 3 frames."""
    return rockdda.open(write_wall(tmp_path_factory.mktemp("wall") / "wall.h5", 5, 4))


def check_grid(grid, frame):
    """An unstructured grid is a frame."""
    results = frame.results
    assert grid.n_cells == results.n_blocks
    assert grid.n_points == results.n_vertices
    assert set(grid.celltypes) == {7}  # polygons
    low, high = frame.vertices.min(axis=0), frame.vertices.max(axis=0)
    np.testing.assert_allclose(grid.bounds, [low[0], high[0], low[1], high[1], 0, 0])
    for i in (0, results.n_blocks - 1):
        np.testing.assert_array_equal(grid.get_cell(i).points[:, :2], frame.polygons()[i])
    for name in ("displacement", "stress_min", "speed", "stress_x", "rotation", "material", "block"):
        np.testing.assert_array_equal(grid.cell_data[name], frame.field(name))
    np.testing.assert_array_equal(grid.cell_data["velocity"][:, :2], frame.velocity[:, :2])
    np.testing.assert_array_equal(grid.point_data["displacement"][:, :2], frame.vertex_displacement)
    tensor = grid.cell_data["stress_tensor"].reshape(-1, 3, 3)
    np.testing.assert_array_equal(tensor[:, 0, 1], frame.stress[:, 2])
    np.testing.assert_array_equal(tensor[:, 1, 0], frame.stress[:, 2])
    assert grid.field_data["TimeValue"][0] == frame.time


def test_vtu_opens_in_pyvista(flat_arch, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    results = rockdda.open(flat_arch)
    path = results.to_vtk(tmp_path / "arch.vtu")
    check_grid(pyvista.read(path), results.frames[-1])
    check_grid(pyvista.read(results.to_vtk(tmp_path / "start.vtu", frames=[0])), results.frames[0])


def test_pvd_opens_in_pyvista_with_all_times(wall, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path = wall.to_vtk(tmp_path / "wall.pvd")
    reader = pyvista.get_reader(path)
    np.testing.assert_array_equal(reader.time_values, wall.times)
    for k, time in enumerate(reader.time_values):
        reader.set_active_time_value(time)
        check_grid(reader.read()[0], wall.frames[k])


def test_vtk_has_every_field_under_its_name_and_no_former_one(wall, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(wall.to_vtk(tmp_path / "wall.vtu"))
    assert set(grid.cell_data.keys()) == {*rockdda.FIELDS, "velocity", "stress_tensor", "area_at_start"}
    assert set(grid.point_data.keys()) == {"displacement", "edge_joint"}
    assert grid.cell_data["velocity"].shape == (wall.n_blocks, 3)
    assert grid.cell_data["block"].dtype == np.int32


def test_vtk_files_are_written_without_graphics(wall, tmp_path):
    """Machines without a display and without OpenGL can export, too."""
    program = f"""
import sys, rockdda
rockdda.open({str(wall.path)!r}).to_vtk("wall.pvd")
assert not [name for name in sys.modules if name.startswith(("pyvista", "vtkmodules.vtkRendering"))]
"""
    environment = {"PYTHONPATH": str(Path(rockdda.__file__).parents[1])}
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, check=True, timeout=60)
    assert len(list(tmp_path.glob("wall/*.vtu"))) == wall.n_frames


def test_missing_vtk_is_reported(wall, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkIOXML", None)
    with pytest.raises(rockdda.RockddaError, match=r"need VTK: \S+ -m pip install pyvista vtk"):
        wall.to_vtk(tmp_path / "wall.pvd")
    assert list(tmp_path.iterdir()) == []


def test_other_vtk_endings_are_refused(wall, tmp_path):
    with pytest.raises(rockdda.InputError, match=r"end in \.pvd"):
        wall.to_vtk(tmp_path / "wall.vtk")


def test_history_as_csv(flat_arch, tmp_path):
    results = rockdda.open(flat_arch)
    table = pandas.read_csv(
        export.to_csv(results, tmp_path / "history.csv"), index_col="step", float_precision="round_trip"
    )
    pandas.testing.assert_frame_equal(
        table, results.history(), check_exact=True, check_dtype=False, check_index_type=False
    )


@pytest.mark.parametrize(("system", "length", "stress", "code"), [("mm", "mm", "MPa", 4), ("kN", "m", "kPa", 6)])
def test_exports_say_the_units_of_the_results(tmp_path, system, length, stress, code):
    path = write_wall(tmp_path / "wall.h5", 3, 2)
    with h5py.File(path, "r+") as file:
        file.attrs["units"] = system
        file["frames/stress"].attrs["units"] = stress
    results = rockdda.open(path)
    header = export.to_csv(results, tmp_path / "a.csv", "blocks").read_text().splitlines()[0].split(",")
    assert header[:5] == ["frame", "time [s]", "block", f"x [{length}]", f"y [{length}]"]
    assert {f"stress_min [{stress}]", f"speed [{length}/s]", "rotation [rad]", "stage", "material"} <= set(header)
    header = export.to_csv(results, tmp_path / "a.csv").read_text().splitlines()[0].split(",")
    assert {"step", "time [s]", "dt [s]", "open", f"max_displacement [{length}]", "attempts"} <= set(header)
    said = f"{system} ({length}, t, s, {'N' if system == 'mm' else 'kN'}, {stress})"
    assert export.to_text(results, tmp_path / "a.txt").read_text().startswith(f"# block vertex x y, units: {said}\n")
    export.to_dxf(results, tmp_path / "a.dxf")
    assert ezdxf.readfile(tmp_path / "a.dxf").header["$INSUNITS"] == code
    convert(tmp_path / "a.dxf", tmp_path / "b")  # to metres
    corners = [line.split()[:2] for line in (tmp_path / "b.blk").read_text().splitlines() if line.count(" ") == 2]
    size = np.ptp([[float(x) for x in row] for row in corners if row[0] != "block"], axis=0)
    shape = np.ptp(results.frames[-1].vertices, axis=0) * (1e-3 if length == "mm" else 1)
    np.testing.assert_allclose(size, shape, rtol=1e-9)
    with h5py.File(export.to_vtk(results, tmp_path / "a.vtkhdf")) as file:
        assert file.attrs["units"] == said
    assert pyvista.read(export.to_vtk(results, tmp_path / "a.vtu")).field_data["units"][0] == said
    data = results.to_xarray(contacts=False)
    assert (data.attrs["units"], data["stress"].attrs["units"]) == (said, stress)


def test_blocks_vertices_and_contacts_as_csv(flat_arch, tmp_path):
    results = rockdda.open(flat_arch)

    def read(what, frames):
        path = export.to_csv(results, tmp_path / f"{what}.csv", what, frames)
        return pandas.read_csv(path, float_precision="round_trip")

    blocks = read("blocks", [1, 3])
    assert len(blocks) == 2 * results.n_blocks
    last = blocks[blocks["frame"] == 3]
    np.testing.assert_array_equal(last[["x", "y"]], results.frames[3].centroid)
    np.testing.assert_array_equal(last["stress_y"], results.frames[3].stress[:, 1])
    vertices = read("vertices", [-1])
    np.testing.assert_array_equal(vertices[["x", "y"]], results.frames[-1].vertices)
    np.testing.assert_array_equal(vertices["vertex"][vertices["block"] == 1], range(1, results.vertex_offset[1] + 1))
    contacts = read("contacts", None)
    assert len(contacts) == results["frames/contact_offset"][-1]
    np.testing.assert_array_equal(contacts[["force_x", "force_y"]], results["frames/contact_force"])
    with pytest.raises(
        rockdda.InputError, match="there is no table 'cracks'; the tables are: history, boundaries, blocks"
    ):
        read("cracks", None)


def test_plain_text_of_outlines(wall, tmp_path):
    path = export.to_text(wall, tmp_path / "wall.txt", [0, -1])
    lines = path.read_text().splitlines()
    assert lines[0] == "# block vertex x y"
    assert [line for line in lines if line.startswith("# frame")] == [
        "# frame 0 step 0 time 0.0",
        "# frame 2 step 2 time 0.2",
    ]
    rows = np.loadtxt(path)
    assert rows.shape == (2 * 5 * wall.n_blocks, 4)  # five corners: the first is repeated
    second = rows[5 * wall.n_blocks :]
    np.testing.assert_array_equal(second[second[:, 0] == 7][:4, 2:], wall.polygons(-1)[6])
    np.testing.assert_array_equal(second[second[:, 0] == 7][:, 1], [1, 2, 3, 4, 1])
    assert lines.count("") == 2 * (wall.n_blocks + 1)
    with path.open() as stream:
        assert next(csv.reader(stream, delimiter=" ")) == ["#", "block", "vertex", "x", "y"]


def test_frames_by_number_and_range():
    assert export.parse_frames(None, 10) is None
    assert export.parse_frames("all", 10) is None
    assert export.parse_frames("-1", 10) == [-1]
    assert export.parse_frames("0,5:8,::4", 10) == [0, 5, 6, 7, 0, 4, 8]
    with pytest.raises(rockdda.InputError, match="expected numbers and ranges"):
        export.parse_frames("a:b", 10)
