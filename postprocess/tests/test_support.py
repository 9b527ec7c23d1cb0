# SPDX-License-Identifier: MIT
"""Bolts with nodes in films, reports, files for ParaView, models of Python and drawings."""

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
from places import INPUTS
from rockdda import InputError, Model, namelist
from rockdda.cli import main
from rockdda.film.page import film_page
from rockdda.plot.style import Units


@pytest.fixture(scope="module")
def hung(program, tmp_path_factory):
    """A block on three bolts, of which the middle one breaks."""
    path = tmp_path_factory.mktemp("hung") / "hung.h5"
    subprocess.run([program, "run", INPUTS / "hung_block", "-o", path, "--quiet"], check=True, capture_output=True)
    return rockdda.open(path)


def test_pieces_know_the_share_of_the_strength(hung):
    pieces = hung.frames[-1].bolt_pieces
    assert pieces["bolt"].tolist() == [0, 1, 2]
    # 50 and 75 kN of 100; the middle one is broken
    np.testing.assert_allclose(pieces["use"], [0.5, 1.0, 0.75], rtol=2e-3)
    np.testing.assert_allclose(pieces["force"], [50e3, 0.0, 75e3], rtol=2e-3, atol=1e-6)
    assert not hung.frames[0].bolt_pieces["use"].any()


def test_picture_shows_the_share(hung):
    axes = hung.plot(kind="bolts", field="use")
    (lines,) = [one for one in axes.collections if one.colorbar]
    np.testing.assert_allclose(lines.get_array(), [50, 100, 75], rtol=2e-3)
    assert lines.get_clim() == (0, 100)
    with pytest.raises(InputError, match="'force' or 'use', not by 'stress'"):
        hung.plot(kind="bolts", field="stress")
    plt.close("all")


def test_film_page_holds_bolts_and_their_share(hung):
    page = film_page(hung, [0, 2, 3], ["displacement"], Units(), "hung")
    setup = json.loads(re.search(r'\{"blocks".*?\}(?=\s*<)', page)[0])
    assert setup["boltNames"] == ["left", "rusted", "right"]
    assert len(setup["bolts"]) == 3
    rows = np.frombuffer(zlib.decompress(base64.b64decode(setup["boltData"])), "<f4").reshape(3, 3, 6)
    np.testing.assert_allclose(rows[2, :, 5], [0.5, 1.0, 0.75], rtol=2e-3)
    np.testing.assert_allclose(rows[0, :, :4], setup["bolts"])


def test_film_of_pictures_colours_bolts(hung, tmp_path):
    from PIL import Image

    hung.animate(tmp_path / "hung.gif", dpi=60)
    film = Image.open(tmp_path / "hung.gif")
    film.seek(film.n_frames - 1)
    pixels = np.asarray(film.convert("RGB")).reshape(-1, 3).astype(int)
    # of the bolts, beside the bar of colours: half, three quarters and all of the strength
    columns = np.asarray(film.convert("RGB")).astype(int)[60:-60, : film.width * 6 // 10]
    for share in (0.5, 0.75, 1.0):
        wanted = 255 * np.array(matplotlib.colormaps["plasma"](share)[:3])
        assert (np.abs(columns - wanted).sum(axis=2) < 45).sum() > 30, share
    assert (np.abs(pixels - 255 * np.array(matplotlib.colors.to_rgb("#B3006B"))).sum(axis=1) < 20).sum() == 0


def test_report_has_forces_per_bolt_and_per_metre(program, tmp_path):
    folder = tmp_path / "hung"
    folder.mkdir()
    for file in (INPUTS / "hung_block").glob("hung_block.*"):
        text = file.read_text().replace("yield_force", "spacing_out_of_plane = 0.5, yield_force")
        (folder / file.name).write_text(text)
    subprocess.run([program, "run", folder, "-o", tmp_path / "h.h5", "--quiet"], check=True, capture_output=True)
    assert main(["report", str(tmp_path / "h.h5"), "-o", str(tmp_path / "h.html"), "--quiet"]) == 0
    page = (tmp_path / "h.html").read_text()
    assert "largest axial force per bolt [kN]" in page
    assert "per metre [kN/m]" in page
    # two bolts in every metre share 29.2, 41.7 and 54.2 kN
    rows = re.findall(r"<td[^>]*>(left|rusted|right)</td>\s*<td[^>]*>([\d.]+)</td>\s*<td[^>]*>([\d.]+)</td>", page)
    found = {name: (float(bolt), float(metre)) for name, bolt, metre in rows}
    assert found["left"] == pytest.approx((14.6, 29.2), abs=0.2)
    assert found["rusted"] == pytest.approx((20.8, 41.7), abs=0.2)


def test_paraview_gets_pieces_with_their_share(hung, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    hung.to_vtk(tmp_path / "last.vtu")
    grid = pyvista.read(tmp_path / "last_bolts.vtu")
    np.testing.assert_allclose(grid.cell_data["use"], [0.5, 1.0, 0.75], rtol=2e-3)
    assert grid.cell_data["bolt"].tolist() == [1, 2, 3]
    np.testing.assert_allclose(grid.cell_data["force_per_metre"], grid.cell_data["force"])


def test_models_of_python_have_bolts_of_all_kinds(tmp_path):
    model = Model("bolted", labelled=True, units="SI")
    model.add_polygon([(0, 0), (4, 0), (4, 2), (0, 2)])
    model.add_lines([[0, 1, 4, 1]], joint=1)
    steel = {"diameter": 0.025, "young": 200e9}
    model.add_bolt((1, 0), (1, 2), kind="grouted", name="bar", grout_stiffness=1e9, grout_strength=2e5, **steel)
    model.add_bolt((2, 0), (2, 2), kind="yielding", plateau_force=1e5, stroke=0.2, **steel)
    model.add_bolts([(0, 0), (4, 0)], kind="end_anchored", spacing=1, length=1.5, pretension=5e4, **steel)
    text = model.options_text()
    groups = namelist.parse_groups(text)["bolt"]
    assert [one["kind"] for one in groups] == ["grouted", "yielding", "end_anchored"]
    assert groups[0]["from"] == [1, 0]
    assert groups[2]["along"] == [0, 0, 4, 0]
    with pytest.raises(InputError, match="give stiffness"):
        model.add_bolt((0, 0), (1, 1))
    with pytest.raises(InputError, match="those of a spring"):
        model.add_bolt((0, 0), (1, 1), kind="grouted", stiffness=1)
    with pytest.raises(InputError, match="give along or outline"):
        model.add_bolts(kind="grouted", spacing=1, length=1)


def test_layers_of_drawings_name_kinds_of_bolts(program, tmp_path, capsys):
    drawing = ezdxf.new()
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (4, 0), (4, 2), (0, 2)], close=True, dxfattribs={"layer": "boundary"})
    space.add_line((0, 1), (4, 1), dxfattribs={"layer": "joint"})
    for x, layer in ((1, "bolt_grouted"), (2, "Bolts end-anchored"), (3, "BOLT_YIELDING"), (3.5, "bolt friction")):
        space.add_line((x, 0), (x, 1.8), dxfattribs={"layer": layer.replace("Bolts", "bolt")})
    drawing.saveas(tmp_path / "room.dxf")
    assert main(["convert", str(tmp_path / "room.dxf"), "-o", str(tmp_path / "room"), "--template"]) == 0
    assert "4 bolts with a kind" in capsys.readouterr().err
    bolts = namelist.parse_groups((tmp_path / "room.nml").read_text())["bolt"]
    assert sorted(one["kind"] for one in bolts) == ["end_anchored", "friction", "grouted", "yielding"]
    assert {tuple(one["from"]) for one in bolts} == {(1, 0), (2, 0), (3, 0), (3.5, 0)}
    checked = subprocess.run([program, "check", tmp_path / "room.nml"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
    assert main(["convert", str(tmp_path / "room.dxf"), "-o", str(tmp_path / "bare")]) == 0
    assert "--template writes it" in capsys.readouterr().err
