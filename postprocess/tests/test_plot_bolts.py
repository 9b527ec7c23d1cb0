# SPDX-License-Identifier: MIT
"""Bolts: read from results, drawn, exported."""

import subprocess

import ezdxf
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas
import pytest
import rockdda
from matplotlib.collections import LineCollection
from places import INPUTS
from rockdda import export, plot
from rockdda.analysis.compare import compare
from rockdda.film.page import describe, film_page
from rockdda.plot.style import BOLT, Units
from synthetic import add_bolts, write_wall


@pytest.fixture
def bolted(tmp_path):
    path = write_wall(tmp_path / "wall.h5", 5, 4, frames=3)
    add_bolts(path)
    yield rockdda.open(path)
    plt.close("all")


def drawn_bolts(axes):
    (found,) = [
        artist
        for artist in axes.get_children()
        if isinstance(artist, LineCollection)
        and artist.get_edgecolor().tolist()[0] == [*matplotlib.colors.to_rgba(BOLT)]
    ]
    return np.array(found.get_segments())


def test_bolts_are_read_and_may_be_missing(bolted, tmp_path):
    np.testing.assert_array_equal(bolted.frames[2].bolt_ends[0], [[0.5, 0.5], [1.6, 0.5]])
    np.testing.assert_array_equal(bolted.frames[2].bolt_force, [100 + 1e5, -2])
    np.testing.assert_array_equal(bolted.bolt_blocks, [[0, 1], [0, -1]])
    older = rockdda.open(write_wall(tmp_path / "older.h5", 2, 2))
    assert (older.bolt_ends.shape, older.frames[0].bolt_ends.shape, len(older.frames[0].bolt_force)) == (
        (0, 2, 2), (0, 2, 2), 0,
    )  # fmt: skip
    assert len(older["frames/stress"]) == 3


@pytest.mark.parametrize("kind", ["blocks", "stress", "contacts"])
def test_pictures_show_bolts_where_they_are(bolted, kind):
    np.testing.assert_allclose(drawn_bolts(bolted.plot(kind=kind)), bolted.frames[-1].bolt_ends)


def test_enlarged_bolts_move_with_their_blocks(bolted):
    shown = drawn_bolts(bolted.plot(scale=10))
    np.testing.assert_allclose(shown[0], [[0.5, 0.5], [2.5, 0.5]])


def test_pages_hold_bolts(bolted):
    setup = describe(bolted, ["displacement"], Units())
    assert setup["bolts"] == bolted.bolt_ends.reshape(-1, 4).tolist()
    assert '"boltData":"' in film_page(bolted, [0, 2], ["displacement"], Units(), "wall")


def test_tables_and_drawings_hold_bolts(bolted, tmp_path):
    table = pandas.read_csv(export.to_csv(bolted, tmp_path / "bolts.csv", "bolts"))
    assert list(table["bolt"]) == [1, 2] * 3
    assert list(table["second"]) == [2, 0] * 3  # 0: the fixed outside
    last = table[table["frame"] == 2]
    np.testing.assert_allclose(last["length"], [1.1, 1.5])
    np.testing.assert_array_equal(last["force"], bolted.frames[2].bolt_force)
    drawing = ezdxf.readfile(export.to_dxf(bolted, tmp_path / "wall.dxf"))
    lines = [(line.dxf.start.x, line.dxf.end.x) for line in drawing.modelspace().query('LINE[layer=="bolts"]')]
    assert lines == [(0.5, 1.6), (0.5, -1.0)]


def test_vtk_holds_bolts(bolted, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    bolted.to_vtk(tmp_path / "last.vtu")
    grid = pyvista.read(tmp_path / "last_bolts.vtu")
    np.testing.assert_array_equal(grid.points[:, :2], bolted.frames[-1].bolt_ends.reshape(-1, 2))
    np.testing.assert_array_equal(grid.cell_data["force"], bolted.frames[-1].bolt_force)
    np.testing.assert_array_equal(grid.cell_data["blocks"], [[1, 2], [1, 0]])
    reader = pyvista.get_reader(bolted.to_vtk(tmp_path / "all.pvd"))
    reader.set_active_time_value(0.1)
    blocks, bolts = reader.read()
    assert (blocks.n_cells, bolts.n_cells) == (20, 2)


def test_comparison_names_the_bolt(bolted, tmp_path):
    import h5py

    other = tmp_path / "other.h5"
    other.write_bytes(bolted.path.read_bytes())
    with h5py.File(other, "a") as file:
        file["frames/bolt_force"][1, 1] = 7.0
    (difference,) = compare(bolted, rockdda.open(other)).differences
    assert (difference.dataset, difference.step, difference.block) == ("frames/bolt_force", 1, None)
    assert "bolt 2" in difference.message


def test_input_is_drawn_before_any_run(native, tmp_path):
    axes = plot.input_plot(INPUTS / "bolted_beam/bolted_beam.dc", units="SI")
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert texts[:2] == ["boundary, joint material 1", "boundary, joint material 2"]
    assert {"bolt", "fixed point", "measured point"} <= set(texts)
    assert axes.get_xlabel() == "x [m]"
    numbers = [text.get_text() for text in axes.texts]
    assert numbers == [*"123456", *"1234"]  # fixed and measured points, counted from 1
    np.testing.assert_array_equal(drawn_bolts(axes), [[[-2.5, 0.3], [2.5, 0.3]]])
    blocks = rockdda.cut(INPUTS / "tunnel/tunnel.dc", output=tmp_path / "tunnel.blk")
    for path, kind in ((INPUTS / "tunnel/tunnel.dc", "blocks"), (tmp_path / "tunnel.blk", None)):
        axes = plot.input_plot(path, kind)
        (polygons,) = [a for a in axes.collections if isinstance(a, matplotlib.collections.PolyCollection)]
        assert len(polygons.get_paths()) == blocks.n_blocks
    with pytest.raises(rockdda.InputError, match="has no lines"):
        plot.input_plot(tmp_path / "tunnel.blk", "lines")
    with pytest.raises(rockdda.InputError, match="not as 'stress'"):
        plot.input_plot(tmp_path / "tunnel.blk", "stress")


def lines_of_forces(axes):
    (found,) = [artist for artist in axes.collections if isinstance(artist, LineCollection) and artist.colorbar]
    return found


MODEL = """\
&model geometry = 'two.dc', units = 'none' /
&block_material number = 1, density = 2500, young = 1e12, poisson = 0 /
&joint_material number = 1, friction = 30 /
&load gravity = 10 /
&boundary along = -1, 3, 1, 3, kind = 'fixed' /
&bolt name = 'roof', along = -1, 0, 1, 0, spacing = 1, length = 2, kind = 'grouted', area = 1e-4, young = 2e11,
      grout_stiffness = 1e8, grout_strength = 2e5, plate_strength = 1e5, spacing_out_of_plane = 2 /
&stage until = 'equilibrium' /
"""
LINES = "0.001\n8 8\n0\n0\n0\n0\n0\n0\n" + "".join(
    f"-1 {low} 1 {low} 1\n1 {low} 1 {high} 1\n1 {high} -1 {high} 1\n-1 {high} -1 {low} 1\n"
    for low, high in ((0, 1), (1, 3))
)


def test_bolts_with_nodes_are_read_drawn_and_exported(program, tmp_path):
    (tmp_path / "two.dc").write_text(LINES)
    (tmp_path / "two.nml").write_text(MODEL)
    subprocess.run([program, "run", tmp_path / "two.nml", "-o", tmp_path / "two.h5", "--quiet"], check=True)
    results = rockdda.open(tmp_path / "two.h5")
    assert results.bolt_names == ["roof 1", "roof 2"]
    assert results.bolt_spacing.tolist() == [2, 2]
    now = results.frames[-1]
    nodes = now.bolt_nodes
    assert len(nodes) == results.bolt_first[-1] == 2 * (len(nodes) // 2)
    assert now.bolt_force.size == 0  # no springs
    # each holds half of what hangs on both: 2 m3 of rock in every metre, per bolt twice that
    at_joint = nodes.groupby("bolt")["force"].max()
    assert at_joint.to_numpy() == pytest.approx([50e3, 50e3], rel=0.01)
    ends = ("x1", "y1", "x2", "y2")
    parts, enlarged = (now.moved_pieces("bolt", scale).stack(*ends).reshape(-1, 2, 2) for scale in (1, 100))
    assert len(parts) == len(nodes) - 2
    assert np.hypot(*(parts[:, 1] - parts[:, 0]).T).sum() == pytest.approx(4, rel=2e-3)
    assert results.frames[0].bolt_nodes["state"].min()  # they are there from the start
    start = results.frames[0].bolt_pieces.stack(*ends).reshape(-1, 2, 2)
    np.testing.assert_allclose(enlarged - start, 100 * (parts - start), atol=1e-9)
    axes = results.plot(kind="bolts")
    assert lines_of_forces(axes).get_clim()[0] == 0
    lines = [artist for artist in axes.get_children() if isinstance(artist, LineCollection)]
    assert any(len(line.get_segments()) == len(parts) for line in lines)
    plt.close("all")
    table = pandas.read_csv(export.to_csv(results, tmp_path / "bolts.csv", "bolts"))
    last = table[table["frame"] == table["frame"].max()]
    assert last["name"].tolist() == nodes["name"].tolist()
    np.testing.assert_allclose(last["force_per_metre"], nodes["force"] / 2)


def test_a_run_without_bolts_has_no_picture_of_them(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 2, 2, frames=1))
    with pytest.raises(rockdda.InputError, match="has no bolts in this frame"):
        results.plot(kind="bolts")
    plt.close("all")
