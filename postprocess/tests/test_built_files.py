# SPDX-License-Identifier: MIT
"""Built files load no library from the folder where a user works, and cannot be changed by what they read."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from built import faults, linked_files
from places import EXTENSION, ROOT

BUILD = ROOT / "build"

pytestmark = [
    pytest.mark.skipif(shutil.which("readelf") is None, reason="no readelf"),
    pytest.mark.skipif(not (BUILD / "CMakeCache.txt").exists(), reason="not built here"),
]


def test_no_built_file_looks_for_libraries_in_the_current_folder():
    """The extension had a RUNPATH that ended in a colon: an empty element is the current folder."""
    files = linked_files(BUILD / "bin") + linked_files(EXTENSION)
    assert files
    for folder in ("tests", "benchmarks"):
        files += linked_files(BUILD / folder)
    assert faults(files) == []


def test_no_installed_file_looks_for_libraries_in_the_current_folder(tmp_path):
    command = ["cmake", "--install", BUILD, "--prefix", tmp_path]
    if shutil.which("cmake") is None or not linked_files(EXTENSION):
        pytest.skip("no cmake, or no extension")
    subprocess.run(command, check=True, capture_output=True)
    files = linked_files(tmp_path)
    assert {path.name.split(".")[0] for path in files} == {"rockdda", "_rockdda"}
    assert faults(files) == []


def test_a_library_in_the_current_folder_is_not_loaded(tmp_path, native):
    """It ran its code on import."""
    names = set()
    for path in linked_files(EXTENSION) + linked_files(BUILD / "bin"):
        text = subprocess.run(["readelf", "-dW", path], capture_output=True, text=True, check=True).stdout
        names |= set(re.findall(r"\(NEEDED\).*\[(.*)\]", text))
    for name in names:
        (tmp_path / name).write_text("no library")  # loading one would be an error
    environment = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    command = [sys.executable, "-c", "import _rockdda"]
    environment["PYTHONPATH"] = str(EXTENSION)
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    program = BUILD / "bin/rockdda"
    if program.exists():
        done = subprocess.run([program, "--version"], cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_c_parts_check_their_stack_and_copies():
    cache = (BUILD / "CMakeCache.txt").read_text()
    if "CMAKE_BUILD_TYPE:STRING=Release" not in cache or not (BUILD / "src/librockdda.a").exists():
        pytest.skip("not optimised")
    told = subprocess.run(["nm", "-A", BUILD / "src/librockdda.a"], capture_output=True, text=True, check=True).stdout
    checked = set(re.findall(r"U (__stack_chk_fail|__\w+_chk)\b", told))
    assert "__stack_chk_fail" in checked
    assert len(checked) > 1  # copies and formats whose room is known
