# SPDX-License-Identifier: MIT
"""What packages say agrees: the wheel, the conda recipe, the page about extras; and wheels get their licences."""

import contextlib
import importlib.metadata
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib

import pytest
from places import ROOT
from rockdda.errors import EXTRAS, how_to_install, need

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base"}


def name_of(requirement: str) -> str:
    return re.split(r"[ <>=\[]", requirement, maxsplit=1)[0]


def test_the_recipe_needs_what_the_package_needs():
    yaml = pytest.importorskip("yaml")
    recipe = yaml.safe_load((ROOT / "recipe/recipe.yaml").read_text(encoding="utf-8"))
    wanted = {CONDA_NAMES.get(name_of(entry), name_of(entry)) for entry in PROJECT["dependencies"]}
    assert {name_of(entry) for entry in recipe["requirements"]["run"]} == wanted | {"python"}
    extras = {name_of(entry) for entries in PROJECT["optional-dependencies"].values() for entry in entries}
    assert {name_of(entry) for entry in recipe["requirements"]["run_constraints"]} <= extras


def test_all_files_have_the_version_of_cmake():
    version = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))
    assert version is not None
    done = subprocess.run([ROOT / "scripts/release", "--check"], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, version[1], "")


def test_another_version_is_named_with_its_file(tmp_path):
    for name in (
        "scripts/release",
        "CMakeLists.txt",
        "CITATION.cff",
        "recipe/recipe.yaml",
        "fpm.toml",
        "docs/changelog.md",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    cmake = tmp_path / "CMakeLists.txt"
    cmake.write_text(re.sub(r"VERSION \d+\.\d+\.\d+", "VERSION 9.8.7", cmake.read_text(encoding="utf-8")))
    done = subprocess.run([tmp_path / "scripts/release", "--check"], capture_output=True, text=True)
    assert done.returncode == 1
    assert re.findall(r"^(\S+): expected the line: .*9\.8\.7", done.stderr, re.M) == [
        "CITATION.cff", "recipe/recipe.yaml", "fpm.toml", "docs/changelog.md",
    ]  # fmt: skip


def test_fpm_builds_every_folder_of_the_library():
    """cmake/fpm has a link to each folder of src that src/CMakeLists.txt adds, but for the program."""
    text = (ROOT / "src/CMakeLists.txt").read_text(encoding="utf-8")
    listed = re.search(r"foreach\(folder IN ITEMS ([\w ]+)\)", text)
    assert listed is not None
    links = {path.name: path.resolve() for path in (ROOT / "cmake/fpm").iterdir() if path.is_symlink()}
    assert links == {name: ROOT / "src" / name for name in listed[1].split() if name != "app"}


def test_the_recipe_is_one_for_rattler_build():
    rattler = pytest.importorskip("rattler_build")
    recipe = rattler.Stage0Recipe.from_file(str(ROOT / "recipe/recipe.yaml"))
    variants = "python: ['3.12.* *_cpython']\nc_compiler: [gcc]\nfortran_compiler: [gfortran]\n"
    variants += "c_stdlib: [sysroot]\nc_stdlib_version: ['2.17']\n"
    assert len(recipe.render(rattler.VariantConfig.from_yaml(variants))) == 1


def test_the_page_names_every_extra():
    page = (ROOT / "docs/installation.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", page, re.M)
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert named == set(PROJECT["optional-dependencies"])


def test_messages_name_packages_of_every_extra_and_no_index_has_rockdda():
    """`pip install 'rockdda[pdf]'` was advised, which no index has."""
    extras = dict(PROJECT["optional-dependencies"])
    del extras["all"]
    assert {name: set(packages.split()) for name, packages in EXTRAS.items()} == {
        name: {name_of(entry) for entry in entries} for name, entries in extras.items()
    }
    found = []
    for folder in ("postprocess/rockdda", "docs"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".md", ".ipynb", ".js"):
                text = path.read_text(encoding="utf-8")
                found += [f"{path}: {line}" for line in re.findall(r".*pip install '?rockdda\[.*", text)]
    assert found == []


def test_the_advice_installs_for_this_python():
    assert how_to_install("pdf") == f"{shlex.quote(sys.executable)} -m pip install weasyprint"
    with pytest.raises(ImportError, match=r"a film needs the package is_missing: \S+ -m pip install imageio-ffmpeg \("):
        need("is_missing", "films", "a film")


LIGHT = """
import sys
sys.modules["pandas"] = None
from rockdda.cli import main
name = sys.argv[1]
for kind in ("blocks", "thrust", "joints", "history", "energy", "iterations"):
    assert main(["plot", name, "--kind", kind, "--quiet"]) == 0, kind
for table in ("history", "boundaries", "joints", "joint_points"):
    assert main(["export", name, "--table", table, "-o", f"{table}.csv", "--quiet"]) == 0, table
assert main(["report", name, "-o", "report.html", "--quiet"]) == 0
import rockdda
try:
    rockdda.open(name).history()
except ImportError as error:
    assert "a table of the history needs the package pandas" in str(error)
else:
    raise AssertionError("pandas was there")
"""


def test_pictures_exports_and_reports_need_no_pandas(flat_arch, tmp_path):
    path = os.pathsep.join([str(ROOT / "postprocess"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", LIGHT, flat_arch], cwd=tmp_path, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]


def requirements() -> dict[str, list[str]]:
    """All requirements by the file where they stand."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = [entry for entries in PROJECT["optional-dependencies"].values() for entry in entries]
    found = {"pyproject.toml": [*project["build-system"]["requires"], *PROJECT["dependencies"], *extras]}
    for path in (ROOT / "scripts").glob("requirements*.txt"):
        lines = path.read_text(encoding="utf-8").splitlines()
        found[path.name] = [line for line in lines if line.strip() and not line.startswith("#")]
    recipe = (ROOT / "recipe/recipe.yaml").read_text(encoding="utf-8").split("  run:\n")[1].split("tests:")[0]
    found["recipe.yaml"] = [entry for entry in re.findall(r"- (.+)", recipe) if entry != "python"]
    return found


def test_every_requirement_has_an_upper_bound():
    open_ = [
        f"{file}: {entry}"
        for file, entries in requirements().items()
        for entry in entries
        if not re.search(r"<|==", entry) and not entry.startswith("rockdda[")
    ]
    assert open_ == []


def test_installed_packages_lie_within_all_bounds():
    """What the tests run with is what the bounds promise; files agree about the upper one."""
    packaging = pytest.importorskip("packaging.requirements")
    upper: dict[str, set[str]] = {}
    tried = 0
    for file, entries in requirements().items():
        for entry in entries:
            if entry.startswith("rockdda["):
                continue
            wanted = packaging.Requirement(entry)
            name = {conda: name for name, conda in CONDA_NAMES.items()}.get(wanted.name, wanted.name)
            upper.setdefault(name, set()).update(re.findall(r"<\s*([\d.]+)", entry))
            with contextlib.suppress(importlib.metadata.PackageNotFoundError):
                installed = importlib.metadata.version(name)
                assert wanted.specifier.contains(installed, prereleases=True), f"{file}: {entry}, found {installed}"
                tried += 1
    assert tried > 30
    assert {name: bounds for name, bounds in upper.items() if len(bounds) > 1} == {}


@pytest.mark.parametrize(
    ("bundled", "original"),
    [
        ("libz-1a2b3c4d.so.1", "libz.so.1"),
        ("libopenblasp-r0-234bd196.3.21.so", "libopenblasp-r0.3.21.so"),
        ("libhdf5_serial-8768aa43.so.103.3.1", "libhdf5_serial.so.103.3.1"),
    ],
)
def test_names_of_bundled_libraries_are_found_back(bundled, original):
    spec = importlib.util.spec_from_file_location("add_licences", ROOT / "scripts/add_licences.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.original(bundled) == original
