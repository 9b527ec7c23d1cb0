# SPDX-License-Identifier: MIT
"""What scripts/docs gives to its tools is valid. The tools themselves take minutes and are not run here."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def api_sources():
    spec = importlib.util.spec_from_file_location("api_sources", ROOT / "scripts/api_sources.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_comments_that_ford_takes_for_metadata_are_marked(api_sources):
    text = "!> Bolts: springs.\nmodule a\n   integer :: n !! count: of all\n   print *, 'a: b'   ! c: d\n"
    assert api_sources.for_ford(text) == (
        "!> Bolts&#58; springs.\nmodule a\n   integer :: n !! count&#58; of all\n   print *, 'a: b'   ! c: d\n"
    )


def test_names_made_public_again_are_left_out(api_sources):
    text = """module a
   use b, only : taken, other => original, &
      third
   private
   public :: taken, own, &
      third
   public :: taken
end module a
"""
    changed = api_sources.for_ford(text)
    assert re.findall(r"public ::(.*)", changed) == [" own"]
    assert api_sources.for_ford(text.replace("taken", "kept", 1).replace("third", "fourth", 1)).count("public ::") == 2


def test_the_whole_source_is_prepared(api_sources, tmp_path):
    api_sources.copy_source(tmp_path / "source")
    copies = sorted(file.relative_to(tmp_path / "source") for file in (tmp_path / "source").rglob("*.[fF]90"))
    assert copies == sorted(file.relative_to(ROOT / "src") for file in (ROOT / "src").rglob("*.[fF]90"))
    for file in copies:
        text = (tmp_path / "source" / file).read_text(encoding="utf-8")
        assert not re.search(r"^ *!> *[\w-]+:", text, re.M), file
        assert text.count("\nmodule ") == (ROOT / "src" / file).read_text(encoding="utf-8").count("\nmodule "), file


def test_every_module_of_the_package_has_a_page(api_sources, tmp_path):
    api_sources.write_pages(tmp_path / "pages")
    named = {
        name
        for file in (tmp_path / "pages").glob("*.md")
        for name in re.findall(r"^::: (\S+)$", file.read_text(), re.M)
    }
    assert {"rockdda", "rockdda.results", "rockdda.model"} <= named
    for name in named:
        path = ROOT / "postprocess" / name.replace(".", "/")
        assert path.with_suffix(".py").exists() or (path / "__init__.py").exists(), name


def test_settings_name_folders_that_scripts_docs_makes():
    script = (ROOT / "scripts/docs").read_text()
    ford = (ROOT / "scripts/ford.md").read_text()
    mkdocs = (ROOT / "scripts/mkdocs.yml").read_text()
    assert "docs=build/docs" in script and "api_sources.py $docs/source $docs/pages" in script
    assert "src_dir: ../build/docs/source" in ford and "output_dir: ../build/docs/fortran" in ford
    assert "docs_dir: ../build/docs/pages" in mkdocs and "site_dir: ../build/docs/python" in mkdocs
    assert "paths: [../postprocess]" in mkdocs
    assert ford.startswith("---\n") and ford.count("\n---\n") == 1


def test_tools_have_bounds():
    """FORD and mkdocstrings are pinned: another version may warn of other things."""
    lines = [
        x for x in (ROOT / "scripts/requirements-docs.txt").read_text().splitlines() if x and not x.startswith("#")
    ]
    assert len(lines) >= 3
    assert all(re.fullmatch(r"[\w-]+(\[\w+\])? (==[\d.]+|>=[\d.]+, <[\d.]+)", line) for line in lines), lines
