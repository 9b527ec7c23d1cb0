# SPDX-License-Identifier: MIT
"""The examples of docs/python.md and of the docstrings do what the page says."""

import contextlib
import doctest
import io
import re

import pytest
import rockdda.model
from places import INPUTS, ROOT

pytestmark = pytest.mark.usefixtures("native")


def test_the_examples_of_the_page(tmp_path, monkeypatch):
    """One after the other, as a reader would; what a text block shows is what the Python block before it prints."""
    text = (ROOT / "docs/python.md").read_text()
    (tmp_path / "inputs").symlink_to(INPUTS)
    monkeypatch.chdir(tmp_path)
    names = {}
    printed = ""
    shown = 0
    for kind, body in re.findall(r"^```(\w+)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        if kind == "python":
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(compile(body, "docs/python.md", "exec"), names)
            printed = out.getvalue().replace(f"{tmp_path}/", "")
        elif kind == "text":
            assert printed == body
            shown += 1
    assert shown >= 7


@pytest.mark.parametrize("module", [rockdda, rockdda.model, rockdda.simulation], ids=lambda module: module.__name__)
def test_docstrings(module):
    assert doctest.testmod(module).failed == 0
