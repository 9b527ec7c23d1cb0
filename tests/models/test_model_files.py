# SPDX-License-Identifier: MIT
"""What inputs/ holds: the files that the generator writes, each model complete and documented."""

import subprocess
import sys

import pytest
from model_runs import INPUTS


def test_generator_reproduces_the_files():
    outcome = subprocess.run(
        [sys.executable, str(INPUTS / "make_models.py"), "--check"], capture_output=True, text=True, check=False
    )
    assert outcome.returncode == 0, outcome.stderr


def test_every_folder_is_a_known_model(models):
    folders = {path.parent.name for path in INPUTS.glob("*/*.dc")}
    assert set(models) <= folders
    assert len(models) >= 10


def test_every_model_has_a_readme_with_a_picture_that_exists(models):
    for name in models:
        text = (INPUTS / name / "README.md").read_text(encoding="utf-8")
        assert f"rockdda run inputs/{name}" in text, name
        pictures = [part.split(")")[0] for part in text.split("](")[1:] if part.split(")")[0].endswith(".png")]
        assert pictures, f"{name}: no picture"
        for picture in pictures:
            path = INPUTS / name / picture
            assert path.is_file(), f"{name}: {picture}"
            assert path.stat().st_size < 60_000, f"{name}: {picture} is larger than 60 kB"


def test_both_dialects_are_shown():
    texts = [path.read_text(encoding="utf-8") for path in INPUTS.glob("*/*.df")]
    assert any("# g0" in text for text in texts)
    assert any("# g0" not in text for text in texts)


def test_program_finds_no_fault_in_any_model(program, models):
    for name in models:
        outcome = subprocess.run(
            [str(program), "check", str(INPUTS / name)], capture_output=True, text=True, check=False
        )
        assert outcome.returncode == 0, outcome.stderr
        # an island and a splinter of 4 mm are legal, but rare enough to be pointed out
        warnings = "1 warning" if name in ("island", "crossed_joints") else "0 warnings"
        assert outcome.stdout.strip().endswith(f"0 errors, {warnings}")


@pytest.mark.parametrize("text", ["nonsense", "--chek nonsense"])
def test_generator_refuses_unknown_names(text):
    outcome = subprocess.run(
        [sys.executable, str(INPUTS / "make_models.py"), *text.split()], capture_output=True, text=True, check=False
    )
    assert outcome.returncode == 2
    assert "nonsense" in outcome.stderr or "--chek" in outcome.stderr


def test_energy_is_accounted_for_in_every_model(run_model, models):
    """The ledger closes to round-off: 1e-9 of the largest energy turned over, with a direct solver.

    Ties are a thousand times as stiff as the cells between them, and their forces lose as many digits. Joints that are
    closed on a part are not linear: their forces agree to 1e-8 of the loads.
    """
    for name in models:
        loose = name in ("cantilever", "arch_on_centring", "dowelled_roof")
        assert run_model(name).relative_residual() <= (1e-8 if loose else 1e-9), name
