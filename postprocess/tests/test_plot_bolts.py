# SPDX-License-Identifier: MIT
"""Bolts: read from results, drawn, exported."""

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
