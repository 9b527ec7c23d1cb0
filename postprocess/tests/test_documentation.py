# SPDX-License-Identifier: MIT
"""The pages about pictures are correct: commands run, pictures and kinds are there."""

import re
import shlex
import shutil
from pathlib import Path

import pytest
import rockdda
from PIL import Image
from rockdda.cli import main
from rockdda.plot import KINDS
from rockdda.results import FIELDS
from synthetic import write_wall

ROOT = Path(__file__).resolve().parents[2]

PAGE = ROOT / "docs/post-processing.md"
GALLERY = ROOT / "docs/gallery"
COMMANDS = re.findall(r"^    rockdda-post ((?:plot|animate) [^#\n]*)", PAGE.read_text(encoding="utf-8"), re.M)


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_of_the_page_run(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    if ".dc" in command or ".blk" in command:
        pytest.importorskip("rockdda._rockdda")
        shutil.copy(ROOT / "inputs/tunnel/tunnel.dc", "slope.dc")
        rockdda.cut("slope.dc", output="slope.blk")
    for name in ("slope", "roof"):
        write_wall(tmp_path / f"{name}.h5", 5, 4)
    before = set(tmp_path.iterdir())
    assert main(shlex.split(command.replace("-5,0.2,5,0.2", "0,0.2,5,0.2"))) == 0, capsys.readouterr().err
    (made,) = set(tmp_path.iterdir()) - before
    assert made.stat().st_size > 1000


def test_there_are_commands_to_run():
    assert len(COMMANDS) >= 6


def test_the_page_names_all_kinds_and_fields():
    text = PAGE.read_text(encoding="utf-8")
    for kind in KINDS:
        assert f"| `{kind}` |" in text
    suffixes = set(re.findall(r"`_([xy]+)`", text))
    for field in FIELDS:
        stem, _, suffix = field.rpartition("_")
        assert f"`{field}`" in text or (f"`{stem}" in text and suffix in suffixes), field


def test_the_gallery_has_a_picture_of_every_kind():
    text = (GALLERY / "README.md").read_text(encoding="utf-8")
    linked = re.findall(r"\]\(([\w-]+\.(?:png|html))\)", text)
    assert {f"{kind}.png" for kind in KINDS} | {"multiples.png", "contact_sheet.png"} <= set(linked)
    for name in linked:
        if name.endswith(".png"):
            with Image.open(GALLERY / name) as image:
                assert min(image.size) > 150
        else:
            assert "</html>" in (GALLERY / name).read_text(encoding="utf-8")
