# SPDX-License-Identifier: MIT
"""scripts/draw: its picture, and what it does under a Python that has no packages."""

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


def test_axes_and_colours_are_labelled(tmp_path):
    for package in ("h5py", "matplotlib"):
        pytest.importorskip(package)
    sys.path.insert(0, str(SCRIPT.parents[1] / "postprocess/tests"))
    from synthetic import write_wall

    write_wall(tmp_path / "wall.h5", 5, 4)
    command = [sys.executable, SCRIPT, tmp_path / "wall.h5", "-o", tmp_path / "wall.svg", "--colour", "sx"]
    subprocess.run([*command, "--units", "SI", "--scale", "2"], check=True)
    text = (tmp_path / "wall.svg").read_text(encoding="utf-8")
    for label in ("x [m]", "y [m]", "[Pa]", "wall, t = 0.2 s, displacements × 2"):
        assert label in text
    done = subprocess.run([*command, "--frame", "9"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, f"draw: {tmp_path / 'wall.h5'} has frames 0 to 2, not 9\n")
