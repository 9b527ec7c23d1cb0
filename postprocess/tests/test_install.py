# SPDX-License-Identifier: MIT
"""`pip install .` in a fresh environment. It compiles everything once more: only on demand, as the pipeline does."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
from built import faults, linked_files
from places import INPUTS, ROOT

SCRIPT = """
import rockdda
results = rockdda.run({model!r}, steps=5)
assert results.complete and results.n_steps == 5
assert rockdda.__file__.startswith({home!r}), rockdda.__file__
print(rockdda.native.build_description())
"""


@pytest.mark.skipif("ROCKDDA_TEST_INSTALL" not in os.environ, reason="set ROCKDDA_TEST_INSTALL=1 to install afresh")
def test_pip_installs_package_and_program(tmp_path):
    home = tmp_path / "env"
    venv.create(home, with_pip=True)
    python = home / "bin/python"
    # what the package needs is taken from the environment of the tests instead of being downloaded again
    packages = next(home.glob("lib/python*/site-packages"))
    (packages / "needs.pth").write_text(sysconfig.get_path("purelib") + "\n")
    install = [python, "-m", "pip", "install", "--no-deps", "--no-build-isolation", "--disable-pip-version-check"]
    # unoptimised, which takes a fifth of the time: what is tested is the installation
    given = (f"build-dir={tmp_path}/build", "cmake.define.CMAKE_Fortran_FLAGS_RELEASE=-O0")
    settings = [f"--config-settings={one}" for one in given]  # pip knows -C from 23.1 on
    done = subprocess.run([*install, *settings, str(ROOT)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr

    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    place = tmp_path / "work"
    place.mkdir()
    script = SCRIPT.format(model=str(INPUTS / "flat_arch"), home=str(home))
    told = subprocess.run([python, "-c", script], cwd=place, env=environment, capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    version = subprocess.run([home / "bin/rockdda", "--version"], capture_output=True, text=True, check=True)
    # program and extension come from one build
    assert version.stdout.splitlines()[0] == told.stdout.splitlines()[0]
    # the package is typed, and its tests stay at home
    folder = packages / "rockdda"
    assert (folder / "py.typed").exists()
    source = ROOT / "postprocess/rockdda"
    wanted = {file.relative_to(source) for file in source.rglob("*") if file.is_file() and file.suffix != ".pyc"}
    assert {file for file in wanted if not (folder / file).is_file()} == set()  # sub-packages, page files, tables
    assert not list(packages.glob("tests"))
    assert sys.version_info[:2] == tuple(int(n) for n in packages.parent.name.removeprefix("python").split("."))


def pythons_here() -> list[str]:
    """That of the tests, and others from 3.11 on that are on the path and have headers; one for each version."""
    found = {}
    places = "import sys, sysconfig; print(sys.executable, sysconfig.get_path('include'), *sys.version_info[:2])"
    for name in (sys.executable, *(f"python3.{minor}" for minor in range(11, 20))):
        if (path := shutil.which(name)) is None:
            continue
        told = subprocess.run([path, "-c", places], capture_output=True, text=True)
        if told.returncode == 0:  # pyenv has commands of versions that are not chosen
            real, include, *version = told.stdout.split()
            if Path(include, "Python.h").exists():
                found.setdefault(tuple(version), real)
    return list(found.values())


@pytest.mark.skipif(
    "ROCKDDA_TEST_WHEELS" not in os.environ, reason="set ROCKDDA_TEST_WHEELS=1: it compiles and downloads"
)
def test_wheels_work_in_empty_environments(tmp_path):
    """One for each Python that is here, installed and tried by the commands of docs/installation.md."""
    pythons = pythons_here()
    options = [word for python in pythons for word in ("--python", python)]
    done = subprocess.run(
        [ROOT / "scripts/wheels", *options, "-o", tmp_path, "--test"], capture_output=True, text=True
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("first picture") == len(pythons), done.stdout
    print(done.stdout)
    wheels = sorted(tmp_path.glob("*.whl"))
    assert len(wheels) == len(pythons)
    for wheel in wheels:
        assert "manylinux" in wheel.name
        with zipfile.ZipFile(wheel) as packed:
            names = packed.namelist()
            packed.extractall(tmp_path / wheel.stem)
            listed = next(name for name in names if name.endswith("licenses/bundled/README.txt"))
            text = packed.read(listed).decode()
        ours = [path for path in linked_files(tmp_path / wheel.stem) if "rockdda.libs" not in path.parts]
        assert len(ours) == 2
        assert faults(ours) == []
        bundled = linked_files(tmp_path / wheel.stem / "rockdda.libs")  # built by others
        assert [fault for fault in faults(bundled) if "binds late" not in fault] == []
        libraries = [name for name in names if name.startswith("rockdda.libs/")]
        assert any("libhdf5" in name for name in libraries)
        assert all(name.removeprefix("rockdda.libs/") in text for name in libraries)
