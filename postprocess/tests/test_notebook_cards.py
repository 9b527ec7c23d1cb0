# SPDX-License-Identifier: MIT
"""What notebooks show of models and results."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import rockdda
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
