# SPDX-License-Identifier: MIT
"""What notebooks show of models and results."""

import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
import rockdda
from places import INPUTS
from rockdda.notebook import MOST, drawing_of_blocks, drawing_of_lines
from synthetic import write_wall


def shapes(text: str) -> list[str]:
    """The paths of the drawing."""
    (svg,) = re.findall("<svg.*</svg>", text)
    return [path.get("d") for path in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}path")]


def test_results_show_facts_and_blocks(tmp_path):
    text = rockdda.open(write_wall(tmp_path / "wall <1>.h5", 3, 2, frames=4))._repr_html_()
    assert "wall &lt;1&gt;.h5" in text
    for name, value in (("blocks", "6"), ("steps", "3"), ("frames", "4"), ("state", "complete")):
        assert re.search(f">{name}</th><td[^>]*>{value}</td>", text), name
    assert "stages" not in text
    (path,) = shapes(text)
    assert path.count("Z") == 6
    places = np.array(re.findall(r"([\d.]+),([\d.]+)", path), dtype=float)
    assert places.min() >= 0
    # the wall is 3 long and 2 high, as is its drawing
    assert np.ptp(places[:, 0]) / np.ptp(places[:, 1]) == pytest.approx(1.5, rel=0.03)


def test_a_model_shows_what_it_has():
    model = rockdda.Model("slope <a>", labelled=True)
    assert "<svg" not in model._repr_html_()
    model.add_polygon([(0, 0), (2, 0), (2, 1), (0, 1)])
    model.add_fixed((0.5, 0.5))
    model.add_joint_material(friction=30, name="bedding")
    model.options = {"stage": [{"name": "rest"}, {"k01": 0}], "boundary": {"kind": "fixed", "along": [0, 0, 2, 0]}}
    text = model._repr_html_()
    for shown in ("slope &lt;a&gt;", "bedding", "rest → stage 2", ">fixed<"):
        assert shown in text
    lines, triangle = shapes(text)
    assert lines.count("M") == 4
    assert triangle.endswith("Z")


def test_what_cannot_be_seen_is_not_drawn():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    assert "Z" in drawing_of_blocks(square, np.array([0, 4]), np.array([True]))
    assert drawing_of_blocks(square, np.array([0, 4]), np.array([False])) == ""
    assert drawing_of_lines(np.zeros((MOST + 1, 4))) == ""
    assert "M" in drawing_of_lines(np.array([[0.0, 0, 0, 1]]))  # no width


def test_a_slider_draws_the_frame_and_field_that_are_chosen(tmp_path):
    pytest.importorskip("ipywidgets")
    results = rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2, frames=4))
    widget = results.slider("stress_min")
    (frames, fields, label), picture = widget.children[0].children, widget.children[1]
    assert (frames.value, frames.max, fields.value, label.value) == (3, 3, "stress_min", "step 3, time 0.3")
    pictures = [picture.value]
    frames.value = 0
    pictures.append(picture.value)
    assert label.value == "step 0, time 0"
    fields.value = "material"
    pictures.append(picture.value)
    assert len(set(pictures)) == 3
    assert all(bytes(found).startswith(b"\x89PNG") for found in pictures)


def test_a_slider_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(ImportError, match=r"a slider needs the package ipywidgets: \S+ -m pip install ipywidgets"):
        rockdda.open(write_wall(tmp_path / "wall.h5", 3, 2)).slider()


def test_progress_in_a_notebook_is_a_bar_of_its_own(native, tmp_path):
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    paths = [str(Path(rockdda.__file__).parents[1]), *map(str, rockdda.__path__)]
    source = (
        f"import sys; sys.path.insert(0, {paths[0]!r})\nimport rockdda; rockdda.__path__.extend({paths[1:]!r})\n"
        f"results = rockdda.run({str(INPUTS / 'flat_arch')!r}, steps=3, progress=True)"
    )
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)])
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    (bar,) = [output["data"]["text/html"] for output in notebook.cells[0].outputs if "data" in output]
    assert 'progress value="1.0000"' in bar
    assert "100 % step 3, time" in bar
