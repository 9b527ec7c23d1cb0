# SPDX-License-Identifier: MIT
"""scripts/draw under a Python that has no packages."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "draw"


@pytest.fixture
def draw(tmp_path):
    """Runs a copy of the script, without any installed package."""
    (tmp_path / "scripts").mkdir()
    copy = shutil.copy(SCRIPT, tmp_path / "scripts" / "draw")
    (tmp_path / "a.h5").touch()

    def run():
        command = [sys.executable, "-S", "-E", copy, tmp_path / "a.h5", "-o", tmp_path / "a.png"]
        return subprocess.run(command, capture_output=True, text=True)

    return run


def test_it_says_what_is_missing(draw):
    result = draw()
    assert result.returncode == 1
    assert result.stderr.startswith("draw: this Python has no h5py, matplotlib, numpy; scripts/setup puts them into ")
    assert result.stderr.count("\n") == 1


def test_the_python_of_the_project_takes_over(draw, tmp_path):
    python = tmp_path / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text('#!/bin/sh\necho "$@"\n')
    python.chmod(0o755)
    result = draw()
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.split() == [str(tmp_path / name) for name in ("scripts/draw", "a.h5")] + [
        "-o",
        str(tmp_path / "a.png"),
    ]
