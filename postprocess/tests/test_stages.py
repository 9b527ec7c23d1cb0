# SPDX-License-Identifier: MIT
"""Stages, boundaries, joints and water of results: in Python, films, the viewer and exports."""

import csv
import json
import threading
import warnings

import h5py
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from PIL import Image
from rockdda import plot
from rockdda.export import to_csv, to_dxf, to_text, to_vtk
from rockdda.film import animate
from rockdda.film.overlays import boundary_rows, joint_range, joint_rows, water_of
from rockdda.film.server import serve
from rockdda.film.viewer import Viewer
from rockdda.plot.boundary_marks import ALONG, INWARD, OUTWARD, add_boundaries, edge_arrows
from rockdda.plot.water_levels import wetted_stretches
from synthetic import write_wall

mpl.use("Agg")


@pytest.fixture(scope="module")
def dug(tmp_path_factory) -> rockdda.Results:
    """A wall of 3 x 2 blocks, of which the upper middle one is taken out; later the upper left one is placed."""
    pytest.importorskip("rockdda._rockdda")
    model = rockdda.Model("wall", labelled=True, gravity=10.0)
    model.add_polygon([(0, 0), (6, 0), (6, 4), (0, 4)])
    model.add_lines([[0, 2, 6, 2], [2, 0, 2, 4], [4, 0, 4, 4]], joint="joint")
    model.add_block_material(density=2500, young=1e9, poisson=0.2, name="rock")
    model.add_joint_material(friction=35, name="joint", normal_stiffness=1e9, shear_stiffness=1e9)
    model.add_region("middle", box=(2, 2, 4, 4))
    model.add_region("left", box=(0, 2, 2, 4))
    model.add_boundary([(0, 0), (6, 0)], "fixed")
    model.add_boundary([(6, 0), (6, 4)], "roller")
    model.add_boundary([(2, 4), (4, 4)], "traction", pressure=1e4)
    model.add_boundary([(4, 4), (6, 4)], "traction", traction=(3e3, -4e3))
    model.add_water("lake", table=[(0, 1)], unit_weight=1e4)
    model.add_water("low", table=[(0, 0.5), (6, 0.5)], unit_weight=1e4)
    model.add_stage("Ground", until="equilibrium", water="none")
    model.add_stage("digging, face near", until="equilibrium", excavate="middle", water="low")
    model.add_stage("fill", until="equilibrium", place="left")
    model.add_measured((1, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rockdda.InputWarning)
        return model.run(output=tmp_path_factory.mktemp("wall") / "wall.h5")


def block_at(results, x, y):
    return int(np.argmin(np.hypot(*(results.block_centroid - (x, y)).T)))


def test_stages_have_steps_frames_and_ends(dug):
    names = ["Ground", "digging, face near", "fill"]
    assert [stage.name for stage in dug.stages] == dug.stage_names == names
    index = dug["history/stage"]
    assert [stage.n_steps for stage in dug.stages] == np.bincount(index).tolist()
    assert dug.stages[0].first_step == 1
    assert [b.first_step - a.last_step for a, b in zip(dug.stages, dug.stages[1:], strict=False)] == [1, 1]
    assert dug.stages[-1].last_step == dug.n_steps
    assert dug.stages[0].begin == 0
    assert [stage.begin for stage in dug.stages[1:]] == [stage.end for stage in dug.stages[:-1]]
    assert sorted(k for stage in dug.stages for k in stage.frames) == list(range(dug.n_frames))
    for stage in dug.stages:
        end = dug.at_stage(stage.name)
        assert (end.step, end.stage, end.stage_name) == (stage.last_step, stage.index, stage.name)
        assert stage.unbalanced == dug.unbalanced[stage.last_step - 1] <= 1e-5
    assert dug.at_stage(" ground ").index == dug.at_stage(-3).index
    assert dug.has_stages


def test_stages_that_are_not_there(dug):
    with pytest.raises(rockdda.InputError, match="there is no stage 'grond'; did you mean 'Ground'"):
        dug.at_stage("grond")
    with pytest.raises(rockdda.InputError, match="there is no stage 3: there are 3, from 0"):
        dug.at_stage(3)


def test_a_run_that_ended_early_has_stages_without_steps(dug, tmp_path):
    path = tmp_path / "cut.h5"
    path.write_bytes(dug.path.read_bytes())
    with h5py.File(path, "a") as file:
        n = int((file["history/stage"][:] == 0).sum())
        frames = int((file["frames/step"][:] <= n).sum())
        for name in ("history", "frames"):
            for key, data in file[name].items():
                if not key.startswith("contact_"):
                    data.resize(n if name == "history" else frames, axis=0)
        file["frames/contact_offset"].resize(frames + 1, axis=0)
    results = rockdda.open(path)
    assert [stage.n_steps for stage in results.stages] == [n, 0, 0]
    assert np.isnan(results.stages[1].unbalanced)
    with pytest.raises(rockdda.InputError, match="stage 'fill' has no frame: 0 steps were computed"):
        results.at_stage("fill")
    assert set(results.boundary_forces()["stage"]) == {"Ground"}


def test_active_blocks_and_boundary_forces(dug):
    middle, left = block_at(dug, 3, 3), block_at(dug, 1, 3)
    assert dug.active.shape == (dug.n_frames, 6)
    ends = [dug.at_stage(k).active for k in range(3)]
    assert [(bool(there[middle]), bool(there[left])) for there in ends] == [
        (True, False),
        (False, False),
        (False, True),
    ]
    table = dug.boundary_forces()
    base = table[table["boundary"] == 1].set_index("stage")["force_y"]
    weight = 2500 * 10 * 4  # of a block
    assert base["Ground"] == pytest.approx(5 * weight + 1e4 * 2 + 4e3 * 2, rel=1e-5)
    assert base["fill"] == pytest.approx(5 * weight + 4e3 * 2 - 0.5e4 * 6, rel=1e-5)  # less the uplift
    assert table["kind"].tolist() == ["fixed", "roller", "traction", "traction"] * 3


def test_files_of_version_1_have_one_stage(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "old.h5", 3, 2, frames=4))
    (stage,) = results.stages
    assert (stage.name, stage.n_steps, stage.frames) == ("stage 1", 3, (0, 1, 2, 3))
    assert results.at_stage(0).index == 3
    assert not results.has_stages
    assert results.active.all()
    assert np.isnan(results.unbalanced).all()
    assert results.boundary_forces().empty
    page = Viewer(results).answer("/")[1].decode()
    assert '"joint_state"' not in page  # there are no stresses along joints in it
    animate(results, tmp_path / "old.html", joints=True)
    to_csv(results, tmp_path / "old.csv", "blocks")


# -- pictures --------------------------------------------------------------------------------------------------------


def test_titles_name_the_stage(dug, tmp_path):
    for kind in ("blocks", "stress", "joints", "water", "displacements", "contacts"):
        axes = plot.plot(dug, kind=kind, frame=dug.at_stage(1).index)
        assert axes.get_title(loc="left").startswith("wall, digging, face near, t = ")
        plot.save(axes, tmp_path / f"{kind}.png", dpi=30)
    assert "stage 1" not in plot.blocks(rockdda.open(write_wall(tmp_path / "a.h5", 2, 2))).get_title(loc="left")


def test_pictures_leave_out_what_is_not_there(dug):
    """Excavated blocks have no cross, no arrow, no edge of a boundary, and no pressure of water."""
    end = dug.at_stage(1)
    gone = np.flatnonzero(~end.active)
    crosses = plot.stress_crosses(dug, end.index).collections
    assert len(next(one for one in crosses if len(one.get_paths()) == 2 * end.active.sum()).get_paths()) == 8
    (arrows,) = (one for one in plot.displacements(dug, end.index).collections if hasattr(one, "U"))
    assert len(arrows.U) == end.active.sum()
    first, last = dug.vertex_offset[gone], dug.vertex_offset[gone + 1]
    assert not any(
        (a <= s.first < b) for s in wetted_stretches(dug, end.index) for a, b in zip(first, last, strict=True)
    )


def test_arrows_of_boundaries_point_as_they_act(dug, tmp_path):
    arrows = edge_arrows(dug)
    of = dug.boundary_edges[:, 0]
    assert (arrows[of <= 1] == 0).all()
    assert (arrows[of == 2] == [INWARD, 0, 0]).all()
    np.testing.assert_allclose(arrows[of == 3], [[ALONG, 0.6, -0.8]])
    # other kinds, by the text of the input
    path = tmp_path / "wall.h5"
    path.write_bytes(dug.path.read_bytes())
    for old, new, mode in (
        ("pressure = 1e4", "pressure = -1e4", [OUTWARD, 0, 0]),
        ("pressure = 1e4", "stress = 0, -2, 0", [ALONG, 0, -1]),
        ("pressure = 1e4", "stress = 0, 0, 2", [ALONG, 1, 0]),
    ):
        with h5py.File(path, "a") as file:
            text = dug["input/config"]
            assert old in text.replace("10000", "1e4")
            del file["input/config"]
            file["input/config"] = text.replace("10000", "1e4").replace(old, new)
        results = rockdda.open(path)
        np.testing.assert_allclose(edge_arrows(results)[of == 2], [mode], atol=1e-12)
        axes = plot.blocks(results)
        axes.figure.canvas.draw()


def test_arrows_follow_the_factor_of_their_table(dug, tmp_path):
    path = tmp_path / "wall.h5"
    path.write_bytes(dug.path.read_bytes())
    with h5py.File(path, "a") as file:
        text = (
            dug["input/config"].replace("10000", "1e4").replace("pressure = 1e4", "pressure = 1e4\ntable = 0, 1, 4, -1")
        )
        del file["input/config"]
        file["input/config"] = text.replace("traction = 3000", "table = 1, -2\ntraction = 3000")
    results = rockdda.open(path)
    of = dug.boundary_edges[:, 0]
    for time, mode in ((None, INWARD), (-1, INWARD), (1.9, INWARD), (2, 0), (2.1, OUTWARD), (9, OUTWARD)):
        arrows = edge_arrows(results, time)
        assert (arrows[of == 2] == [mode, 0, 0]).all()
        np.testing.assert_allclose(arrows[of == 3], [[ALONG, *(np.array([0.6, -0.8]) * (1 if time is None else -1))]])
    assert boundary_rows(results)["tables"] == [[], [], [0, 1, 4, -1], [1, -2]]


def test_quiet_boundaries_have_dashpots(dug, monkeypatch):
    """Rod, piston, cylinder and rod at each foot; a free field has a line along the edge behind them."""
    _, axes = plt.subplots()
    monkeypatch.setattr(type(dug), "boundary_kinds", ["viscous", "free_field", "roller", "roller"])
    add_boundaries(axes, dug, dug.frames[0].shown_vertices)
    blue = mpl.colors.to_rgba(plot.style.BOUNDARIES["viscous"])
    base, dashpots, side, more, ground = (
        np.array(one.get_segments()) for one in axes.collections if tuple(one.get_colors()[0]) == blue
    )
    assert (len(base), len(side), len(ground)) == (3, 2, 2)
    assert len(dashpots) % 6 == len(more) % 6 == 0
    assert len(dashpots) > 6 and dashpots[..., 1].max() == 0 > dashpots[..., 1].min()  # below the base
    assert more[..., 0].min() == 6 < ground[..., 0].min() == pytest.approx(more[..., 0].max())
    np.testing.assert_allclose(ground[..., 1], side[..., 1])


def test_films_move_boundaries_and_water(dug, tmp_path):
    """Each frame has those of its own: none on the block that is gone."""
    _, axes = plt.subplots()
    first = add_boundaries(axes, dug, dug.frames[0].shown_vertices)
    for artist in first:
        artist.remove()
    assert not axes.collections
    shown = dug.at_stage(1).shown_vertices
    assert len(add_boundaries(axes, dug, shown)) == len(first)
    lines = [path.vertices for one in axes.collections for path in one.get_paths()]
    assert not any(np.all((line[:, 1] > 3.9) & (line[:, 0] > 2.1) & (line[:, 0] < 3.9)) for line in lines)
    film = animate(dug, tmp_path / "wall.gif", dpi=40)
    with Image.open(film) as picture:
        assert picture.n_frames == dug.n_frames


# -- what the page draws over the blocks -----------------------------------------------------------------------------


def test_joints_are_stretches_of_edges(dug):
    now = dug.at_stage("fill")
    table, rows = dug.joints(now.index), joint_rows(now)
    edge = rows[:, 0].astype(int)
    offset = dug.vertex_offset
    block = np.searchsorted(offset, edge, side="right") - 1
    assert np.array_equal(block, table["first"])
    after = np.where(edge + 1 < offset[block + 1], edge + 1, offset[block])
    start, along = now.vertices[edge], now.vertices[after] - now.vertices[edge]
    for column, end in ((1, "1"), (2, "2")):
        place = start + rows[:, column, None] * along
        away = np.hypot(*(place - table[[f"x{end}", f"y{end}"]].to_numpy()).T)
        assert away.max() < 1e-3  # a point lies on one edge or the other; they overlap by the load
    np.testing.assert_array_equal(rows[:, 3], table["state"])
    np.testing.assert_array_equal(rows[:, 4], table["normal_stress"])
    low, high, _, _ = joint_range(rows, "joint_normal_stress")
    closed = table[table["state"] > 0]["normal_stress"]
    assert (low, high) == (closed.min(), closed.max())


def test_water_of_a_frame_keeps_the_forces(dug):
    """The corners that are left of a pressure diagram give the same force."""
    now = dug.at_stage("fill")
    water = water_of(dug, now)
    assert water["tables"] == [[0, 0.5, 6, 0.5]]
    stretches = wetted_stretches(dug, now.index)
    assert len(water["bands"]) == len(stretches) > 4
    for band, stretch in zip(water["bands"], stretches, strict=True):
        assert band[:3] == [stretch.first, stretch.second, stretch.free]
        share, pressure = np.array(band[3:]).reshape(-1, 2).T
        assert len(share) <= 4  # ends, and the table between two places
        assert np.trapezoid(pressure, share) == pytest.approx(np.trapezoid(stretch.pressure, stretch.share), rel=1e-2)


def test_edges_of_boundaries_for_the_page(dug):
    found = boundary_rows(dug)
    assert found["kinds"] == ["fixed", "roller", "traction", "traction"]
    assert [row[2] for row in found["edges"]] == dug.boundary_edges[:, 0].tolist()
    assert json.loads(json.dumps(found)) == found


# -- exports ---------------------------------------------------------------------------------------------------------


def test_exports_know_stages_and_boundaries(dug, tmp_path):
    with to_csv(dug, tmp_path / "b.csv", "boundaries").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 12
    assert rows[5]["stage"] == "digging, face near"
    with to_csv(dug, tmp_path / "c.csv", "blocks").open() as stream:
        blocks = list(csv.DictReader(stream))
    assert [int(row["active"]) for row in blocks] == dug.active.astype(int).ravel().tolist()
    assert [int(row["stage"]) for row in blocks[::6]] == dug.frame_stages.tolist()
    frame = dug.at_stage(1)
    text = to_text(dug, tmp_path / "o.txt", [frame.index]).read_text()
    drawn = {int(line.split()[0]) for line in text.splitlines() if line and line[0] != "#"}
    assert drawn == set((1 + np.flatnonzero(frame.active)).tolist())
    import ezdxf

    drawing = ezdxf.readfile(to_dxf(dug, tmp_path / "o.dxf", frame.index))
    assert len(drawing.modelspace().query("LWPOLYLINE")) == frame.active.sum()


def test_vtk_has_boundaries_and_the_name_of_the_stage(dug, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    frame = dug.at_stage(1)
    to_vtk(dug, tmp_path / "wall.vtu", [frame.index])
    blocks, joints, boundaries = (pyvista.read(tmp_path / f"wall{name}.vtu") for name in ("", "_joints", "_boundaries"))
    assert list(blocks.field_data["stage_name"]) == ["digging, face near"]
    assert blocks.field_data["stage"][0] == 1
    assert blocks.n_cells == frame.active.sum()
    assert joints.n_cells == len(dug.joints(frame.index))
    assert boundaries.cell_data["kind"].tolist() == [1, 1, 1, 2, 2, 4]  # that of the excavated block is gone
    base = boundaries.cell_data["force_of_boundary"][boundaries.cell_data["boundary"] == 1]
    np.testing.assert_array_equal(base[0, :2], dug.boundary_force[frame.step - 1, 0])


def test_xarray_has_names_of_stages(dug):
    pytest.importorskip("xarray")
    data = dug.to_xarray()
    assert data["frame_stage"].values.tolist() == [dug.stage_names[k] for k in dug.frame_stages]
    assert data["boundary_kind"].values.tolist() == dug.boundary_kinds


# -- in a browser ----------------------------------------------------------------------------------------------------


@pytest.fixture
def browser(tmp_path):
    if find_browser() is None:
        pytest.skip("no Chromium")
    pytest.importorskip("websocket")
    page = Page(tmp_path / "browser")
    yield page
    page.close()


@pytest.fixture
def address(dug):
    viewer = Viewer(dug, units="SI")
    server = serve(viewer)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}/?token={viewer.token}"
    server.shutdown()
    server.server_close()


def test_the_viewer_shows_stages_joints_boundaries_and_water(dug, browser, address):
    end = dug.at_stage("digging, face near")
    browser.open(f"{address}#frame={end.index}&field=joint_normal_stress")
    assert browser.data("stage") == "digging, face near"
    assert browser.evaluate("[...$('stages').children].map((mark) => mark.textContent)") == dug.stage_names
    states = dug.joints(end.index)["state"].to_numpy()
    assert browser.data("joints") == f"{(states > 0).sum()} {len(states)}"
    # compression of some 50 kPa, in the unit of the label
    low, high, _, _ = (value / 1000 for value in joint_range(joint_rows(end), "joint_normal_stress"))
    assert browser.evaluate("[Math.min(...values), Math.max(...values)]") == pytest.approx([low, high], rel=1e-6)
    assert browser.data("water").startswith("1 ")
    with_middle = int(browser.data("symbols"))
    browser.key("[")  # the end of the stage before
    browser.wait(f"document.body.dataset.frame === '{dug.at_stage(0).index}'")
    assert browser.data("water").startswith("0 ")
    assert int(browser.data("symbols")) > with_middle  # the pressure on the middle block
    browser.evaluate("$('stages').children[2].onclick()")
    browser.wait(f"document.body.dataset.frame === '{dug.n_frames - 1}'")
    assert browser.data("stage") == "fill"
    assert browser.errors == []


def test_gone_blocks_stay_gone_when_displacements_are_enlarged(dug, browser, address):
    """They are drawn as points, whose "displacement" must not be enlarged."""
    end = dug.at_stage("digging, face near")
    browser.open(f"{address}#frame={end.index}&enlarge=100")
    assert browser.evaluate("Array.from(gone)") == (~end.active).astype(int).tolist()
    places = np.array(browser.evaluate("Array.from(present())")).reshape(-1, 2)
    for block in np.flatnonzero(~end.active):
        corners = places[dug.vertex_offset[block] : dug.vertex_offset[block + 1]]
        assert np.ptp(corners, axis=0).max() < 1e-5
    assert browser.errors == []


def test_a_film_page_holds_joints_and_stages(dug, browser, tmp_path):
    film = animate(dug, tmp_path / "wall.html", joints=True)
    browser.open(f"{film.as_uri()}#frame={dug.n_frames - 1}&field=joint_state")
    assert browser.data("stage") == "fill"
    states = dug.joints(-1)["state"].to_numpy()
    assert browser.data("joints") == f"{len(states)} {len(states)}"
    assert browser.evaluate("Array.from(joints).filter((_, i) => i % WIDTH === 3)") == states.tolist()
    assert browser.data("water").startswith("1 ")
    plain = animate(dug, tmp_path / "plain.html")
    assert '"joint_state"' not in plain.read_text()
    assert browser.errors == []
