# SPDX-License-Identifier: MIT
"""What scripts/docs gives to its tools is valid. The tools themselves take minutes and are not run here."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def load(name):
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f"scripts/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def api_sources():
    return load("api_sources")


def test_comments_that_ford_takes_for_metadata_are_marked(api_sources):
    text = "!> Bolts: springs.\nmodule a\n   integer :: n !! count: of all\n   print *, 'a: b'   ! c: d\n"
    assert api_sources.for_ford(text) == (
        "!> Bolts&#58; springs.\nmodule a\n   integer :: n !! count&#58; of all\n   print *, 'a: b'   ! c: d\n"
    )


def test_lengths_of_texts_with_commas_are_left_out(api_sources):
    """FORD says `Bad declaration of character, too many parameters`, and drops the file."""
    text = "      character(len=max(len(name), len(words))) :: around(2)\n      character(len=3), intent(in) :: x\n"
    assert api_sources.for_ford(text) == text.replace("len=max(len(name), len(words))", "len=:")


def test_the_reference_of_ford_needs_no_network_and_no_place_of_this_machine():
    mended = load("ford_site").mended
    bootstrap = (
        '<link href="https://cdn.jsdelivr.net/npm/bootstrap@5.3.3/dist/css/bootstrap.min.css" rel="stylesheet"\n'
        '  integrity="sha384-Q" crossorigin="anonymous">'
    )
    assert mended(bootstrap, "/x", "../") == '<link href="../css/bootstrap.min.css" rel="stylesheet">'
    assert mended('<a href="/x/y/type/a.html#b">', "/x/y", "../") == '<a href="../type/a.html#b">'
    assert mended('<a href="a.html#moduleprocedure-b~2">', "/x", "") == '<a href="a.html">'


def test_broken_links_are_named(tmp_path):
    (tmp_path / "one.html").write_text(
        '<h1 id="a">A</h1><a href="two.html#b">x</a><a href="two.html#c">x</a><a href="#a">x</a><img src="p.png">'
        '<a href="https://example.org/x">x</a><a href="/one.html">x</a><a href="%20y.html">x</a>'
    )
    (tmp_path / "two.html").write_text('<p id="b">B</p>')
    assert load("check_links").broken_links(tmp_path) == [
        "one.html: two.html#c", "one.html: p.png", "one.html: %20y.html"
    ]  # fmt: skip


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
    assert "docs=build/docs" in script and "api_sources.py $docs/source" in script
    assert "site_pages.py $docs/pages" in script
    assert "src_dir: ../build/docs/source" in ford and "output_dir: ../build/docs/site/fortran" in ford
    assert "docs_dir: ../build/docs/pages" in mkdocs and "site_dir: ../build/docs/site" in mkdocs
    assert "paths: [../postprocess]" in mkdocs
    assert ford.startswith("---\n") and ford.count("\n---\n") == 1


@pytest.mark.parametrize("name", ["docs", "site"])
def test_tools_have_bounds(name):
    """FORD is pinned: another version may warn of other things."""
    lines = [
        x for x in (ROOT / f"scripts/requirements-{name}.txt").read_text().splitlines() if x and not x.startswith("#")
    ]
    assert lines
    assert all(re.fullmatch(r"[\w-]+(\[\w+\])? (==[\d.]+|>=[\d.]+, <[\d.]+)", line) for line in lines), lines


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The module that gathers the pages of the site, and the folder that it has filled."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        import site_pages
    finally:
        sys.path.pop(0)
    target = tmp_path_factory.mktemp("site") / "pages"
    site_pages.write_site(target, None)
    return site_pages, target


def test_all_pages_and_models_are_in_the_site(site):
    module, pages = site
    for file in [*(ROOT / "docs").rglob("*.md"), *(ROOT / "inputs").rglob("README.md"), ROOT / "README.md"]:
        assert (pages / file.relative_to(ROOT)).is_file()
    shown = (pages / "models.md").read_text(encoding="utf-8")
    pictures = re.findall(r'<a href="inputs/(\w+)/index\.html"', shown)
    assert pictures == sorted(file.parent.name for file in (ROOT / "inputs").glob("*/end.png"))
    for name, _ in module.models():
        assert "\n## Input\n" in (pages / "inputs" / name / "README.md").read_text(encoding="utf-8"), name


@pytest.mark.parametrize(("name", "moves"), [("toppling_column", True), ("arch_on_centring", False)])
def test_a_model_that_moves_has_a_film(site, program, tmp_path, name, moves):
    post = Path(program).with_name("rockdda-post")
    if not post.is_file():
        pytest.skip("rockdda-post is not beside the program: scripts/build")
    assert site[0].make_film(name, post.parent, tmp_path / "film.html") is moves
    assert (tmp_path / "film.html").exists() is moves


def test_navigation_names_pages_that_exist(site):
    text = (ROOT / "scripts/mkdocs.yml").read_text()
    named = re.findall(r"(?:- |: )([\w/.-]+\.(?:md|ipynb))$", text, re.M)
    assert len(named) > 30
    assert [name for name in named if not (site[1] / name).is_file()] == []
    listed = {f"docs/{file.name}" for file in (ROOT / "docs").glob("*.md")}
    assert listed - set(named) == set()


def test_equations_become_mathml(site):
    module, pages = site
    theory = (pages / "docs/theory.md").read_text(encoding="utf-8")
    n = (ROOT / "docs/theory.md").read_text(encoding="utf-8").count("```math")
    assert theory.count("<math") == n > 20
    assert "```math" not in theory and "\\mathbf" not in theory
    assert "<mfrac><mn>1</mn><mn>2</mn></mfrac>" in module.mathml(r"\frac12", "inline")
    notebook = '{"cells": [{"cell_type": "markdown", "source": ["a $x$\\n", "$$y$$"]}, {"cell_type": "code"}]}'
    assert module.typeset_notebook(notebook).count("<math") == 2
