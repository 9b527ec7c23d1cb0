# SPDX-License-Identifier: MIT
"""The page that shows a model before any run: its data, and the page in a browser while the file is edited."""

import json
import re
import threading

import pytest
import rockdda
from browser import Page, find_browser
from rockdda.film.model_data import ModelViewer, read_model
from rockdda.film.server import serve

MODEL = """&model geometry = 'dig.dc' /
&block_material number = 1, name = 'rock', density = 2500, young = 5e9, poisson = 0.25 /
&joint_material number = 1, name = 'joint', friction = 30, normal_stiffness = 5e9, shear_stiffness = 2e9 /
&load gravity = 9.81 /
&region name = 'bench', box = 2, 2, 4, 4 /
&boundary along = 0, 0, 4, 0, kind = 'fixed' /
&boundary along = 0, 0, 0, 4, kind = 'roller' /
&water name = 'spring', table = 0, 3, unit_weight = 9810 /
&stage name = 'rest', kind = 'static', until = 'equilibrium', water = 'none' /
&stage name = 'dig', kind = 'static', until = 'equilibrium', excavate = 'bench', water = 'spring',
   reset_displacement = .true. /
"""


@pytest.fixture
def model(native, program, tmp_path, monkeypatch):
    """A ground of four blocks, with a bench that is taken out."""
    monkeypatch.setenv("ROCKDDA_PROGRAM", program)
    lines = [[0, y, 4, y] for y in (0, 2, 4)] + [[x, 0, x, 4] for x in (0, 2, 4)]
    drawn = rockdda.Model("dig", e0=0.001)
    drawn.add_lines(lines)
    drawn.add_measured((1.0, 3.0))
    drawn.add_bolt((0.5, 1.0), (3.5, 1.0), stiffness=1e6)
    (tmp_path / "dig.dc").write_text(drawn.geometry_text())
    (tmp_path / "dig.nml").write_text(MODEL)
    return tmp_path / "dig.nml"


def test_the_data_hold_all_parts_of_the_model(model):
    page = read_model(model).page
    assert {message["severity"] for message in page["messages"]} == {"note"}
    assert [(m["message"], m["place"]) for m in page["messages"] if m["line"] == 5] == [
        ("region 'bench': 1 block", (3, 3))
    ]
    assert len(page["blocks"]["material"]) == 4
    assert [region["name"] for region in page["regions"]] == ["bench"]
    (inside,) = page["regions"][0]["blocks"]
    assert page["blocks"]["centroids"][inside] == [3, 3]
    assert [(entry["kind"], len(entry["along"])) for entry in page["boundaries"]] == [("fixed", 2), ("roller", 2)]
    assert page["water"] == [{"name": "spring", "table": [[0, 3]]}]
    assert [(s["name"], s["excavate"], s["water"]) for s in page["stages"]] == [
        ("rest", [], "none"),
        ("dig", ["bench"], "spring"),
    ]
    assert [stage["line"] for stage in page["stages"]] == [9, 10]
    assert page["stages"][1]["words"].endswith("water = spring, reset_displacement = .true.")
    assert (len(page["lines"]), len(page["bolts"]), page["measured"]) == (6, 1, [[1, 3]])


def test_bolts_of_a_pattern_are_drawn(model):
    groups = "&bolt name = 'wall', along = 0,2, 4,2, spacing = 2, length = 1, kind = 'end_anchored', "
    groups += "diameter = 0.02, young = 2e11, yield_force = 1e5, rupture_strain = 0.1 /\n"
    model.write_text(model.read_text() + groups)
    page = read_model(model).page
    # with that of the geometry; at half the spacing from the start
    assert sorted(bolt[0] for bolt in page["bolts"][1:]) == [1, 3]
    assert {abs(bolt[3] - bolt[1]) for bolt in page["bolts"][1:]} == {1}


def test_messages_stand_at_their_places(model):
    broken = MODEL.replace("kind = 'roller'", "kind = 'rollr'")
    model.write_text(broken)
    (message, *_) = read_model(model).page["messages"]
    assert (message["severity"], message["line"], message["file"]) == ("error", 7, "dig.nml")
    assert message["place"] == (0, 2)  # the middle of the boundary
    model.write_text(MODEL)
    geometry = model.with_suffix(".dc")
    lines = geometry.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("0  2  4  2"))
    lines[row] = "0 2 4"
    before = read_model(model)
    geometry.write_text("\n".join(lines))
    after = read_model(model, before).page
    assert any(m["severity"] == "error" and m["file"] == "dig.dc" for m in after["messages"])
    assert after["blocks"] == before.page["blocks"]  # the last state that could be read


def test_a_file_that_is_half_written_keeps_the_drawing(model):
    before = read_model(model)
    model.write_text(MODEL[: MODEL.index("'equilibrium'") + 6])
    after = read_model(model, before).page
    assert any(m["severity"] == "error" for m in after["messages"])
    assert len(after["blocks"]["material"]) == 4
    assert [region["name"] for region in after["regions"]] == ["bench"]


def test_what_is_no_model_is_refused(tmp_path):
    (tmp_path / "options.nml").write_text("&run steps = 3 /\n")
    with pytest.raises(rockdda.InputError, match="has no group &model"):
        ModelViewer(tmp_path / "options.nml")
    with pytest.raises(rockdda.InputError, match="no such file"):
        ModelViewer(tmp_path / "none.nml")
    (tmp_path / "empty").mkdir()
    with pytest.raises(rockdda.InputError, match="a folder without a model"):
        ModelViewer(tmp_path / "empty")


def test_only_news_are_sent(model):
    viewer = ModelViewer(model)
    first = json.loads(viewer.answer("/state/0")[1])
    assert first["version"] == 1
    assert "model" in first
    assert json.loads(viewer.answer("/state/1")[1]) == {"version": 1}
    with pytest.raises(KeyError):
        viewer.answer("/frames/1")


@pytest.mark.skipif(find_browser() is None, reason="there is no browser")
def test_the_page_follows_the_file(model, tmp_path):
    pytest.importorskip("websocket")
    viewer = ModelViewer(model)
    server = serve(viewer)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()
    page = Page(tmp_path / "browser")
    try:
        page.open(f"http://127.0.0.1:{server.server_address[1]}/?token={viewer.token}")
        shown = [page.data(name) for name in ("blocks", "stages", "errors", "gone", "water")]
        assert shown == ["4", "2", "0", "0", "1"]
        page.evaluate("canvas.dispatchEvent(new PointerEvent('pointermove', {clientX: 300, clientY: 300}))")
        assert re.fullmatch(r"x \S+ m, y \S+ m", page.evaluate("$('tip').textContent"))
        page.key("]")
        assert (page.data("gone"), page.data("water")) == ("0", "0")  # at rest: no water
        page.key("]")
        assert (page.data("gone"), page.data("water")) == ("1", "1")  # the bench is out
        model.write_text(MODEL.replace("kind = 'roller'", "kind = 'rollr'"))
        page.wait("document.body.dataset.errors === '1'")
        marked = page.evaluate("document.querySelector('#text .marked').textContent")
        assert "rollr" in marked
        assert "▲" in marked
        page.evaluate("document.querySelector('#messages li').click()")
        assert page.evaluate("document.querySelector('#text .now').textContent").startswith("7")
        model.write_text(MODEL)
        page.wait("document.body.dataset.errors === '0'")
        assert page.errors == []
    finally:
        page.close()
        server.shutdown()
        server.server_close()
