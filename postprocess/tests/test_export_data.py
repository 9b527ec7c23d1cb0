# SPDX-License-Identifier: MIT
"""Results for ParaView in one file, xarray and GeoPandas, read back."""

import subprocess
import warnings

import numpy as np
import pytest
import rockdda
from rockdda import export
from rockdda.convert import convert
from synthetic import add_bolts, write_wall


@pytest.fixture(scope="module")
def dug(program, tmp_path_factory):
    """The start of a tunnel in stages: blocks go away, boundaries, joints."""
    from places import INPUTS

    path = tmp_path_factory.mktemp("dug") / "dug.h5"
    model = INPUTS / "two_headings"
    command = [program, "run", model, "-o", path, "--quiet", "--save-every", "4"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return rockdda.open(path)


def read_at(path, time):
    """What VTK itself reads of a file at a time."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    times = information.Get(reader.GetExecutive().TIME_STEPS())
    reader.UpdateTimeStep(time)
    grid = reader.GetOutputDataObject(0)
    cells = {
        grid.GetCellData().GetArrayName(k): vtk_to_numpy(grid.GetCellData().GetArray(k))
        for k in range(grid.GetCellData().GetNumberOfArrays())
    }
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetNumberOfPoints() else np.zeros((0, 3))
    connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    stage = grid.GetFieldData().GetArray("stage").GetValue(0)
    return times, points[connectivity], offsets, cells, stage


def test_vtk_reads_all_times_of_a_temporal_file(tmp_path):
    pytest.importorskip("vtkmodules.vtkIOHDF")
    path = write_wall(tmp_path / "wall.h5", 5, 4, frames=4)
    add_bolts(path)
    wall = rockdda.open(path)
    out = wall.to_vtk(tmp_path / "wall.vtkhdf")
    for k, frame in enumerate(wall.frames):
        times, vertices, offsets, cells, stage = read_at(out, frame.time)
        np.testing.assert_array_equal(times, wall.times)
        np.testing.assert_array_equal(vertices[:, :2], frame.vertices)
        np.testing.assert_array_equal(offsets, wall.vertex_offset)
        for name in ("displacement", "stress_min", "speed", "material", "block"):
            np.testing.assert_array_equal(cells[name], frame.field(name))
        assert stage == 0
        _, ends, _, bolts, _ = read_at(tmp_path / "wall_bolts.vtkhdf", frame.time)
        np.testing.assert_array_equal(bolts["force"], frame.bolt_force)
        np.testing.assert_array_equal(ends[:, :2], frame.bolt_ends.reshape(-1, 2))
        assert k < 4
    assert not list(tmp_path.glob(".*.part*"))


def test_temporal_files_leave_out_excavated_blocks(dug, tmp_path):
    pytest.importorskip("vtkmodules.vtkIOHDF")
    out = dug.to_vtk(tmp_path / "dug.vtkhdf")
    sizes = set()
    for number in {0, dug.n_frames // 2, dug.n_frames - 1}:
        frame = dug.frames[number]
        _, vertices, offsets, cells, stage = read_at(out, frame.time)
        there = np.repeat(frame.active, np.diff(dug.vertex_offset))
        np.testing.assert_array_equal(vertices[:, :2], frame.vertices[there])
        np.testing.assert_array_equal(cells["block"], np.flatnonzero(frame.active) + 1)
        assert len(offsets) == frame.active.sum() + 1
        assert stage == frame.stage
        sizes.add(int(frame.active.sum()))
        _, ends, _, joints, _ = read_at(tmp_path / "dug_joints.vtkhdf", frame.time)
        table = dug.joints(number)
        assert len(joints["joint"]) == len(table)
        np.testing.assert_array_equal(joints["normal_stress"], table["normal_stress"].to_numpy())
        np.testing.assert_array_equal(ends[:, :2].reshape(-1, 4), table[["x1", "y1", "x2", "y2"]].to_numpy())
    assert len(sizes) > 1
    assert (tmp_path / "dug_boundaries.vtkhdf").exists()
    # the vertices of all frames are written once for the cells, and values are packed
    assert out.stat().st_size < 3 * dug.path.stat().st_size


def test_xarray_selects_by_time_and_holds_contacts(dug):
    pytest.importorskip("xarray")
    data = dug.to_xarray()
    frame = dug.frames[3]
    now = data.sel(time=frame.time)
    np.testing.assert_array_equal(now["stress"], frame.stress)
    assert int(data.sel(time=frame.time * 1.0001, method="nearest")["frame_step"]) == frame.step
    np.testing.assert_array_equal(data.sel(contact_frame=3)["contact_force"], frame.contacts.force)
    np.testing.assert_array_equal(data.sel(contact_frame=3)["contact_slip"], frame.contacts.slip)
    step_time = dug["history/time"][5]
    assert float(data.sel(step_time=step_time)["unbalanced"]) == dug.unbalanced[5]
    assert "contact_force" not in dug.to_xarray(contacts=False)


def test_geopandas_tables_of_blocks_joints_and_contacts(dug, tmp_path):
    geopandas = pytest.importorskip("geopandas")
    with pytest.warns(rockdda.InputWarning, match="crs without origin"):
        plain = dug.to_geopandas(crs="EPSG:32633")
    blocks = dug.to_geopandas(crs="EPSG:32633", origin=(412340, 5678900))
    moved = blocks.total_bounds - plain.total_bounds
    np.testing.assert_allclose(moved, [412340, 5678900, 412340, 5678900], rtol=1e-12)
    assert blocks.crs == "EPSG:32633"
    last = dug.frames[-1]
    assert len(blocks) == last.active.sum() < dug.n_blocks
    np.testing.assert_array_equal(blocks["block"], np.flatnonzero(last.active) + 1)
    np.testing.assert_array_equal(blocks["stress_min"], last.field("stress_min")[last.active])
    # a block keeps its mass: areas change by the strains, which are below 1e-3 here
    np.testing.assert_allclose(blocks.area, dug.block_area[last.active], rtol=1e-3)
    joints = dug.to_geopandas("joints", frame=2)
    np.testing.assert_allclose(joints.length, joints["length"], rtol=0, atol=1e-3 * joints.length.max())
    assert joints["first"].min() >= 1
    contacts = dug.to_geopandas("contacts")
    np.testing.assert_array_equal(contacts["force_x"], last.contacts.force[:, 0])
    blocks.to_file(tmp_path / "blocks.gpkg")
    assert len(geopandas.read_file(tmp_path / "blocks.gpkg")) == len(blocks)
    with pytest.raises(rockdda.InputError, match="there is no table 'bolt'"):
        dug.to_geopandas("bolt")


@pytest.mark.parametrize("origin", [None, (412300.25, 5678900.0)])
def test_a_map_comes_back_to_its_place(program, tmp_path, origin):
    """The origin that convert moves, or is given, is put back: blocks lie where the area was drawn."""
    geopandas = pytest.importorskip("geopandas")
    shapely = pytest.importorskip("shapely")
    area = shapely.box(412345, 5678904, 412349, 5678907)
    geopandas.GeoDataFrame({"kind": ["area"]}, geometry=[area], crs="EPSG:32633").to_file(tmp_path / "map.gpkg")
    convert(tmp_path / "map.gpkg", tmp_path / "m", template=True, origin=origin)
    run = [program, "run", tmp_path / "m.nml", "-o", tmp_path / "m.h5", "--steps", "1", "--quiet"]
    subprocess.run(run, check=True, capture_output=True)
    results = rockdda.open(tmp_path / "m.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = results.to_geopandas(frame=0, crs="EPSG:32633")
    np.testing.assert_allclose(found.total_bounds, area.bounds, rtol=0, atol=1e-6)
    assert results.to_geopandas(frame=0).total_bounds.max() < 100
    with pytest.warns(rockdda.InputWarning, match="counts in US survey foot"):
        results.to_geopandas(crs="EPSG:2263")


def test_missing_geopandas_is_named_with_its_extra(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "geopandas", None)
    with pytest.raises(ImportError, match=r"-m pip install geopandas pyshp shapely"):
        rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2)).to_geopandas()


def test_temporal_files_are_written_without_vtk(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "vtkmodules", None)
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkIOXML", None)
    wall = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2))
    assert export.to_vtk(wall, tmp_path / "wall.vtkhdf").exists()
    with pytest.raises(rockdda.RockddaError, match=r"need VTK: \S+ -m pip install pyvista vtk"):
        export.to_vtk(wall, tmp_path / "wall.pvd")
