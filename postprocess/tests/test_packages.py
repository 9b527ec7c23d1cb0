# SPDX-License-Identifier: MIT
"""What packages say agrees: the wheel, the conda recipe, the page about extras; and wheels get their licences."""

import importlib.util
import re
import tomllib

import pytest
from places import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONDA_NAMES = {"matplotlib": "matplotlib-base"}


def name_of(requirement: str) -> str:
    return re.split(r"[ <>=\[]", requirement, maxsplit=1)[0]


def test_the_recipe_needs_what_the_package_needs():
    yaml = pytest.importorskip("yaml")
    recipe = yaml.safe_load((ROOT / "recipe/recipe.yaml").read_text(encoding="utf-8"))
    version = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))
    assert version is not None
    assert recipe["context"]["version"] == version.group(1)
    wanted = {CONDA_NAMES.get(name_of(entry), name_of(entry)) for entry in PROJECT["dependencies"]}
    assert {name_of(entry) for entry in recipe["requirements"]["run"]} == wanted | {"python"}
    extras = {name_of(entry) for entries in PROJECT["optional-dependencies"].values() for entry in entries}
    assert {name_of(entry) for entry in recipe["requirements"]["run_constraints"]} <= extras


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


def test_every_extra_that_messages_name_exists():
    named = set()
    for path in (ROOT / "postprocess/rockdda").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        named |= set(re.findall(r"rockdda\[(\w+)\]", text)) | set(re.findall(r'\bneed\("\w+", "(\w+)"', text))
    assert len(named) > 8
    assert named <= set(PROJECT["optional-dependencies"])


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
