# SPDX-License-Identifier: MIT
"""Results made by the program, shared by all tests."""

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
import rockdda
from places import EXTENSION, INPUTS, ROOT

if EXTENSION.is_dir():
    rockdda.__path__.append(str(EXTENSION))


def pytest_configure():
    """SIGINT has its usual effect here and in what the tests start, also in the background of a shell."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def native():
    """Skips a test where the extension is not built."""
    pytest.importorskip("rockdda._rockdda")


@pytest.fixture(scope="session")
def program() -> str:
    """Path of the program."""
    built = ROOT / "build/bin/rockdda"
    found = os.environ.get("ROCKDDA_PROGRAM") or (str(built) if built.exists() else shutil.which("rockdda"))
    if not found:
        pytest.skip("the program is not built")
    return found


@pytest.fixture(scope="session")
def flat_arch(program, tmp_path_factory) -> Path:
    """Results of inputs/flat_arch: 60 steps, a frame every 20."""
    path = tmp_path_factory.mktemp("results") / "flat_arch.h5"
    command = [program, "run", INPUTS / "flat_arch", "-o", path, "--steps", "60", "--save-every", "20", "--quiet"]
    subprocess.run(command, check=True, capture_output=True)
    return path
