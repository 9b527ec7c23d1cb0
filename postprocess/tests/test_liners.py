# SPDX-License-Identifier: MIT
"""Linings in films, the viewer, reports, files for ParaView, models of Python, drawings; shares of their strength."""

import base64
import json
import re
import subprocess
import zlib

import ezdxf
import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest
import rockdda
from browser import Page, find_browser
from rockdda import InputError, Model, export, namelist
from rockdda.cli import main
from rockdda.film.model_data import read_model
from rockdda.film.page import film_page
from rockdda.film.viewer import Viewer
from rockdda.plot.style import Units

SHOTCRETE = {"compressive_strength": 30e6, "tensile_strength": 5e6}
LOAD = 2500 * 9.81 * 0.2  # of the beam, N/m2


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    """A lining of 0.2 m that hangs over a fixed block by 3 m and carries its weight."""
    model = Model("beam", labelled=True, units="SI", gravity=9.81)
    model.add_polygon([(-1, 0), (0, 0), (0, 1), (-1, 1)])
    model.add_block_material(density=2500, young=1e10, poisson=0.2)
    model.add_joint_material(friction=30)
    model.add_boundary([(-1, 1), (0, 1)], "fixed")
    model.add_liner([(-1, 0), (3, 0)], thickness=0.2, young=30e9, name="beam", **SHOTCRETE)
    model.add_stage("before", until="equilibrium")
    model.add_stage("weight", until="equilibrium", install="beam")
    with pytest.warns(rockdda.InputWarning, match="lies beside no rock"):
        yield model.run(output=tmp_path_factory.mktemp("beam") / "beam.h5")
    plt.close("all")


def test_pieces_follow_the_line(beam):
    assert not beam.frames[0].liner_pieces["there"].any()
    assert not beam.frames[0].moved_pieces("liner").n_rows
    now = beam.frames[-1]
    nodes, pieces = now.liner_node_columns, now.liner_pieces
    assert pieces.n_rows == nodes.n_rows - 1
    assert pieces["there"].all()
    root = int(np.abs(nodes["x"]).argmin())
    stress = 6 * LOAD * 3**2 / 2 / 0.2**2
    # the mean of two elements lies a little below the root's moment
    assert nodes["use"][root] == pytest.approx(stress / 5e6, rel=0.01)
    ends = pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    np.testing.assert_array_equal(ends[1:, 0], ends[:-1, 1])
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() == pytest.approx(4, rel=1e-3)
    start = beam.frames[0].liner_pieces.stack("x1", "y1", "x2", "y2")
    enlarged = now.moved_pieces("liner", 50).stack("x1", "y1", "x2", "y2")
    np.testing.assert_allclose(enlarged - start, 50 * (ends.reshape(-1, 4) - start), atol=1e-9)


def test_a_closed_lining_has_a_piece_from_its_last_to_its_first_node(tmp_path):
    model = Model("ring", labelled=True, units="SI", gravity=9.81)
    model.add_polygon([(-4, -4), (4, -4), (4, 4), (-4, 4)])
    hole = [(1, -1), (1, 1), (-1, 1), (-1, -1)]
    model.add_polygon(hole, boundary=False)
    model.add_lines([[-4, 0, -1, 0], [1, 0, 4, 0]])
    model.add_hole((0, 0))
    model.add_block_material(density=2500, young=1e10, poisson=0.2)
    model.add_joint_material(friction=30)
    model.add_boundary([(-4, -4), (4, -4)], "fixed")
    model.add_liner([*hole, hole[0]], thickness=0.1, young=10e9, name="ring")
    model.add_stage(until="equilibrium")
    results = model.run(output=tmp_path / "ring.h5")
    pieces = results.frames[-1].liner_pieces
    assert pieces.n_rows == results.frames[-1].liner_node_columns.n_rows
    ends = pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    np.testing.assert_array_equal(ends[-1, 1], ends[0, 0])
    assert np.isnan(pieces["use"]).all()  # it has no strength
    (outline,) = ezdxf.readfile(export.to_dxf(results, tmp_path / "ring.dxf")).query("*[layer=='liner']")
    assert outline.closed
    assert "unlimited" in written_report(results, tmp_path / "ring.html")


def written_report(results, path):
    assert main(["report", str(results.path), "-o", str(path), "--quiet"]) == 0
    return path.read_text()


@pytest.mark.parametrize("kind", ["blocks", "stress", "contacts", "displacements"])
def test_pictures_show_linings_where_they_are(beam, kind):
    axes = beam.plot(kind=kind)
    now = beam.frames[0 if kind == "displacements" else -1]
    wanted = now.liner_pieces.stack("x1", "y1", "x2", "y2").reshape(-1, 2, 2)
    found = [one for one in axes.collections if hasattr(one, "get_segments") and one.get_linewidths()[0] == 2.2]
    (drawn,) = [one for one in found if one.get_colors().tolist()[0][:3] != [1, 1, 1]]
    np.testing.assert_allclose(np.array(drawn.get_segments()), wanted)


def test_film_page_holds_the_forces_of_linings(beam):
    page = film_page(beam, [0, beam.n_frames - 1], ["displacement"], Units("m", "s", "N", True), "beam")
    setup = json.loads(re.search(r'\{"blocks".*?\}(?=\s*<)', page)[0])
    n = len(setup["liners"])
    assert setup["linerNames"] == ["beam"] * n
    assert setup["linerUnits"] == ["kN/m", "kNm/m", "kN/m"]
    rows = np.frombuffer(zlib.decompress(base64.b64decode(setup["linerData"])), "<f4").reshape(2, n, 8)
    assert np.isnan(rows[0, :, :4]).all()  # not there yet
    pieces = beam.frames[-1].liner_pieces
    np.testing.assert_allclose(rows[1, :, 4], pieces["use"], rtol=1e-6)
    np.testing.assert_allclose(rows[1, :, 6], pieces["M"] / 1e3, rtol=1e-6, atol=1e-6)
    assert setup["linerRanges"][1] == pytest.approx(np.abs(pieces["M"]).max() / 1e3, rel=1e-5)


def test_viewer_gives_linings(beam):
    kind, answer = Viewer(beam).answer(f"/liners/{beam.n_frames - 1}")
    assert kind == "application/octet-stream"
    assert np.frombuffer(answer, "<f4").size == 8 * beam.frames[-1].liner_pieces.n_rows


def test_viewer_colours_and_names_linings(beam, tmp_path):
    if find_browser() is None:
        pytest.skip("no browser")
    pytest.importorskip("websocket")
    beam.animate(tmp_path / "beam.html")
    page = Page(tmp_path / "browser")
    try:
        page.open((tmp_path / "beam.html").as_uri() + f"#frame={beam.n_frames - 1}&liner=M")
        assert page.evaluate("document.getElementById('liner').value") == "M"
        assert page.evaluate("supportBars().map((bar) => bar.label)") == ["linings: M [kNm/m]"]
        pieces = beam.frames[-1].liner_pieces
        root = int(np.abs(pieces["x1"]).argmin())
        x, y = pieces.stack("x1", "y1", "x2", "y2")[root].reshape(2, 2).mean(axis=0)
        page.evaluate(f"hover(Array.from(places(new Float32Array([{x}, {y}]))))")
        words = page.evaluate("document.getElementById('tip').textContent")
        found = re.search(r"beam: N (\S+) kN/m, M (\S+) kNm/m, Q (\S+) kN/m, (\d+) % of its strength", words)
        assert found, words
        assert float(found[2]) == pytest.approx(pieces["M"][root] / 1e3, rel=1e-3)
        assert int(found[4]) == round(100 * pieces["use"][root])
        assert page.errors == []
    finally:
        page.close()


@pytest.mark.parametrize(("by", "label"), [("use", "linings: share of a strength [%]"), ("M", "linings: M [kNm/m]")])
def test_film_of_pictures_colours_linings(beam, tmp_path, monkeypatch, by, label):
    from matplotlib.figure import Figure

    labels = []
    plain = Figure.colorbar
    monkeypatch.setattr(Figure, "colorbar", lambda self, *a, **k: labels.append(k.get("label")) or plain(self, *a, **k))
    beam.animate(tmp_path / "beam.gif", dpi=50, liner=by)
    assert label in labels
    with pytest.raises(InputError, match="linings are coloured by use, N, M, Q, not by 'axial'"):
        beam.animate(tmp_path / "beam.gif", liner="axial")


def test_report_has_a_table_and_pictures_of_linings(beam, tmp_path):
    page = written_report(beam, tmp_path / "beam.html")
    head = re.search(r"<th>lining</th>(.*?)</tr>", page)[1]
    assert "<th>M [kNm/m]</th><th>Q [kN/m]</th>" in head
    row = re.search(r"<td>beam</td>(.*?)</tr>", page)[1]
    values = re.findall(r"<td>(.*?)</td>", row)
    assert float(values[2]) == pytest.approx(LOAD * 4.5 / 1e3, rel=0.01)
    assert values[4] == f"{100 * 6 * LOAD * 4.5 / 0.2**2 / 5e6:.0f} %"
    assert values[5].endswith("; weight")
    assert values[6] == f"0, 0 of {beam.frames[-1].liner_node_columns.n_rows}"
    assert "largest forces in linings" in page
    assert page.count("<figcaption>N") == 2


def test_paraview_gets_linings(beam, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    beam.to_vtk(tmp_path / "last.vtu")
    grid = pyvista.read(tmp_path / "last_liners.vtu")
    pieces = beam.frames[-1].liner_pieces
    for name in ("N", "M", "Q", "use"):
        np.testing.assert_array_equal(grid.cell_data[name], pieces[name])
    assert set(grid.cell_data["liner"]) == {1}


def test_table_has_units(beam, tmp_path):
    head = export.to_csv(beam, tmp_path / "liner.csv", "liner").read_text().splitlines()[0]
    sides = "N_before [N/m],Q_before [N/m],N_behind [N/m],Q_behind [N/m]"
    assert (
        head == f"frame,time [s],liner,name,x [m],y [m],N [N/m],M [Nm/m],Q [N/m],{sides},opening [m],slip [m],use,state"
    )


def test_models_of_python_have_linings(tmp_path, program, monkeypatch):
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    model = Model("lined", labelled=True, units="SI", gravity=9.81)
    model.add_polygon([(0, 0), (8, 0), (8, 6), (0, 6)])
    model.add_lines([[0, y, 8, y] for y in (2, 4)] + [[x, 0, x, 6] for x in (3, 5)])
    model.add_block_material(density=2600, young=1e10, poisson=0.2)
    model.add_joint_material(name="joint", friction=35, normal_stiffness=5e9, shear_stiffness=2e9)
    model.add_region("heading", box=(3, 2, 5, 4))
    model.add_boundary([(0, 0), (8, 0)], "fixed")
    model.add_liner([(3, 2), (3, 4), (5, 4), (5, 2)], name="first", thickness=0.1, young=10e9, **SHOTCRETE)
    model.add_liner(on="first", name="second", thickness=0.15, young=25e9, joint_material="joint", element=0.2)
    model.add_liner(outline="heading", name="around", thickness=0.2, young=30e9)
    model.add_stage("ground", until="equilibrium")
    model.add_stage("dig", until="equilibrium", excavate="heading", install=("first", "second"))
    model.add_stage("later", until="equilibrium", install="around")
    model.add_change("later", liner="first", young=25e9)
    groups = namelist.parse_groups(model.options_text())["liner"]
    assert groups[0]["along"] == [3, 2, 3, 4, 5, 4, 5, 2]
    assert groups[1]["on"] == "first"
    model.to_files(tmp_path)
    again = Model.from_files(tmp_path / "lined.nml")
    assert again == model
    checked = subprocess.run([program, "check", tmp_path / "lined.nml"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
    page = read_model(tmp_path / "lined.nml").page["liners"]
    assert [one["name"] for one in page] == ["first", "second", "around"]
    assert page[1]["along"] == page[0]["along"] == [[3, 2], [3, 4], [5, 4], [5, 2]]
    assert page[2]["along"] == [[3, 2], [5, 2], [5, 4], [3, 4], [3, 2]]
    with pytest.raises(InputError, match="give one of along, outline and on"):
        model.add_liner(thickness=0.1, young=1e10)
    with pytest.raises(InputError, match="thickness"):
        model.add_liner([(0, 0), (1, 0)], thickness=-0.1, young=1e10)


def test_layers_of_drawings_are_linings(program, tmp_path, capsys):
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (8, 0), (8, 6), (0, 6)], close=True, dxfattribs={"layer": "boundary"})
    heading = [(3, 2), (5, 2), (5, 4), (3, 4)]
    space.add_lwpolyline(heading, close=True, dxfattribs={"layer": "joint"})
    space.add_line((0, 2), (3, 2), dxfattribs={"layer": "joint"})
    space.add_lwpolyline([(5, 2), (5, 4), (3, 4), (3, 2)], dxfattribs={"layer": "Lining"})
    space.add_lwpolyline(heading, close=True, dxfattribs={"layer": "LINERS"})
    space.add_lwpolyline([(0, 2), (3, 2)], dxfattribs={"layer": "sprayed"})
    drawing.saveas(tmp_path / "room.dxf")
    asked = ["convert", str(tmp_path / "room.dxf"), "--layer", "sprayed=liner"]
    assert main([*asked, "-o", str(tmp_path / "room"), "--template"]) == 0
    assert "3 linings" in capsys.readouterr().err
    linings = namelist.parse_groups((tmp_path / "room.nml").read_text())["liner"]
    assert [one["along"] for one in linings] == [
        [5, 2, 5, 4, 3, 4, 3, 2], [3, 2, 5, 2, 5, 4, 3, 4, 3, 2], [0, 2, 3, 2]
    ]  # fmt: skip
    checked = subprocess.run([program, "check", tmp_path / "room.nml"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
    assert main([*asked, "-o", str(tmp_path / "bare")]) == 0
    assert "linings stand in the labelled file: --template writes it" in capsys.readouterr().err
    # of GeoJSON
    features = [
        {"type": "Feature", "properties": {"kind": "liner"},
         "geometry": {"type": "LineString", "coordinates": [[0, 0], [1, 1], [2, 0]]}},
        {"type": "Feature", "properties": {"kind": "boundary"},
         "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]}},
    ]  # fmt: skip
    (tmp_path / "map.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    assert main(["convert", str(tmp_path / "map.geojson"), "-o", str(tmp_path / "map"), "--template"]) == 0
    lining = namelist.parse_groups((tmp_path / "map.nml").read_text())["liner"]
    assert (lining[0] if isinstance(lining, list) else lining)["along"] == [0, 0, 1, 1, 2, 0]
