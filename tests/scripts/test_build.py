# SPDX-License-Identifier: MIT
"""`rockdda-post` of a build tree, as scripts/build writes it, in a folder where anything may lie."""

import os
import re
import signal
import subprocess
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def command(tmp_path):
    """The script in the place of build/bin of this tree, with the programs of the build."""
    program, extension = ROOT / "build/bin/rockdda", ROOT / "build/python"
    if not program.exists() or not list(extension.glob("_rockdda*")) or not (ROOT / ".venv/bin/python").exists():
        pytest.skip("not built here")
    text = re.search(r"rockdda-post <<'END'\n(.*?)\nEND\n", (ROOT / "scripts/build").read_text(), re.S)
    tree = tmp_path / "a tree"
    (tree / "build/bin").mkdir(parents=True)
    for name in ("postprocess", ".venv", "build/python", "build/bin/rockdda"):
        (tree / name).symlink_to(ROOT / name)
    script = tree / "build/bin/rockdda-post"
    script.write_text(text[1] + "\n")
    script.chmod(0o755)
    return script


@pytest.fixture
def folder(tmp_path, command):
    """A model, and modules that must not be imported."""
    place = tmp_path / "work"
    place.mkdir()
    subprocess.run([ROOT / "build/bin/rockdda", "new", "slope", "portal", "--quiet"], cwd=place, check=True)
    for name in ("numpy", "typer", "rockdda", "_rockdda", "h5py"):
        (place / f"{name}.py").write_text("raise SystemExit('code of the current folder')\n")
    return place


ENVIRONMENT = {
    name: value
    for name, value in os.environ.items()
    if name not in ("PYTHONPATH", "ROCKDDA_PROGRAM", "ROCKDDA_EXTENSION")
}


@pytest.mark.parametrize("arguments", [["plot", "portal.dc", "-o", "portal.png"],
                                       ["plot", "portal.dc", "--kind", "blocks", "-o", "portal.png"]])  # fmt: skip
def test_a_model_is_drawn_before_any_run(command, folder, arguments):
    """'the compiled part of rockdda is missing'."""
    done = subprocess.run([command, *arguments], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert (folder / "portal.png").stat().st_size > 5000


def test_a_model_is_shown_before_any_run(command, folder):
    """An empty page, and forty lines of traceback."""
    with subprocess.Popen(
        [command, "view", "portal.nml", "--no-browser"], cwd=folder, env=ENVIRONMENT, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            line = process.stdout.readline()
            address = re.search(r"http://\S+", line)
            assert address, line + process.stderr.read()
            with urllib.request.urlopen(address[0], timeout=30) as answer:
                assert b'"lines"' in answer.read()
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.communicate(timeout=30)[1] == ""


def test_a_missing_compiled_part_is_one_line(command, folder):
    (command.parents[2] / "build/python").unlink()
    done = subprocess.run(
        [command, "view", "portal.nml", "--no-browser"], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.startswith("rockdda-post: error: the compiled part of rockdda is missing")
    assert done.stderr.count("\n") == 1
