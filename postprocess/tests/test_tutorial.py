# SPDX-License-Identifier: MIT
"""The section of the tutorial on stages: its files and commands, as printed, give its table."""

import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rockdda
from rockdda.cli import main

PAGE = Path(__file__).resolve().parents[2] / "docs/tutorial.md"
SECTION = PAGE.read_text(encoding="utf-8").partition("## 7. ")[2]


@pytest.fixture(scope="module")
def driven(program, tmp_path_factory) -> Path:
    """The folder after all commands of the section."""
    folder = tmp_path_factory.mktemp("tutorial")
    files = re.findall(r"Put this into `([^`]+)`.*?\n\n((?:    .*\n)+)", SECTION)
    assert [name for name, _ in files] == ["heading.dl", "heading.nml"]
    for name, text in files:
        (folder / name).write_text(re.sub(r"^    ", "", text, flags=re.M), encoding="utf-8")
    commands = re.findall(r"^    (rockdda(?:-post)? [a-z].*)$", SECTION, re.M)
    assert len(commands) == 5
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for command in commands:
            words = shlex.split(command)
            if words[0] == "rockdda":
                done = subprocess.run([program, *words[1:]], check=False, capture_output=True, text=True)
                assert done.returncode == 0, command + done.stderr
            else:
                assert main(words[1:]) == 0, command
    return folder


def test_pictures_are_made(driven):
    for name in ("heading.png", "reaction.png"):
        assert (driven / name).stat().st_size > 1000


def test_crown_and_walls_move_as_the_table_has_it(driven):
    results = rockdda.open(driven / "heading.h5")
    moved, stage = results["history/measured_displacement"], results["history/stage"]
    rows = re.findall(r"^\| ([a-z ]+) \| (\d+) \| ([\d.]+) mm down \| ([\d.]+) mm closer \|$", SECTION, re.M)
    assert [name for name, *_ in rows] == results.stage_names[1:]
    for k, (_, steps, crown, walls) in enumerate(rows, start=1):
        end = np.flatnonzero(stage == k)[-1]
        assert (stage == k).sum() == pytest.approx(int(steps), abs=3)
        # two decimals are printed
        assert -1e3 * moved[end, 0, 1] == pytest.approx(float(crown), abs=0.006)
        assert 1e3 * (moved[end, 1, 0] - moved[end, 2, 0]) == pytest.approx(float(walls), abs=0.006)
        assert results["history/unbalanced"][end] <= 1e-5


def test_without_cohesion_the_friction_decides(driven, program, tmp_path):
    text = (driven / "heading.nml").read_text(encoding="utf-8")
    text = text.replace("cohesion = 0.4e6, tension = 0.1e6", "cohesion = 0")
    (tmp_path / "heading.dc").write_bytes((driven / "heading.dc").read_bytes())
    for friction, code in ((40, 0), (25, 3)):
        weak = text.replace("friction = 40", f"friction = {friction}")
        weak = weak.replace("excavate = 'b", "max_steps = 120, excavate = 'b")
        assert weak.count("max_steps") == 1
        (tmp_path / "heading.nml").write_text(weak, encoding="utf-8")
        command = [program, "run", "heading.nml", "--force", "--quiet"]
        done = subprocess.run(command, cwd=tmp_path, check=False, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
    assert "stage 'bench' did not come to equilibrium in " in done.stderr
    results = rockdda.open(tmp_path / "heading.h5")
    moved = results["frames/centroid"][-1] - results["frames/centroid"][0]
    left = np.abs(results["frames/centroid"][0] - [-5.5, -5.5]).max(axis=1) < 1.5
    assert moved[left, 0].max() > 0.02  # 1.3 mm with cohesion
