# SPDX-License-Identifier: MIT
"""Glossary and list of sources hold what other pages and the code refer to."""

import calendar
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
CITING = sorted(
    [*DOCS.glob("*.md"), *DOCS.glob("notes/*.md"), DOCS / "validation/index.md", *ROOT.glob("inputs/**/*.md")]
)
CITATION = re.compile(
    r"(?<![\w-])([A-Z][A-Za-zé-]{2,})(?:,? (?:and|et al\.?|&) ?(?:[A-Z][A-Za-z-]+)?)?(?:'s)? "
    r"\(?((?:18|19|20)\d\d)\)?(?!-)"
)
TERMS = ["open-close loop", "locked", "sliding", "open", "w0", "bonded"]
TERMS += ["loading point", "measured point", "hole point", "fixed point"]
NO_AUTHORS = {"Ubuntu", "Python", "Fortran", "Standard"}


def is_month(name):
    return name in calendar.month_name or name in calendar.month_abbr


def sources():
    """The list of works at the end of the theory manual."""
    return (DOCS / "theory.md").read_text(encoding="utf-8").split("\n## Sources\n")[1]


def bibliography():
    """(Surname, year) of every author of every entry."""
    found = set()
    for entry in re.findall(r"^- (.*?)\((\d{4})\):", sources(), re.M | re.S):
        found |= {(name, entry[1]) for name in re.findall(r"([A-Z][\w-]{2,}),", entry[0])}
    return found


def citations(text):
    text = re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.S)
    return {m.groups() for m in CITATION.finditer(text) if m[1] not in NO_AUTHORS and not is_month(m[1])}


def test_entries_are_complete_and_in_order():
    sections = re.split(r"^### ", sources(), flags=re.M)[1:]
    assert len(sections) == 4
    for section in sections:
        keys = re.findall(r"^- <a id=\"(\w+)\"></a>([\w'-]+), .*?\((\d{4})\):", section, re.M | re.S)
        assert len(keys) == len(re.findall(r"^- ", section, re.M))
        assert all(key == re.sub("['-]", "", name.lower()) + year for key, name, year in keys)
        assert [k[0] for k in keys] == sorted(k[0] for k in keys)


def test_citations_are_found_in_text():
    text = (
        "Friction (Ida 1972), Goodman and Bray (1976), Shi (1988); Doolin and Sitar 2004. In May 2020, 3 of 1976 rows."
    )
    assert citations(text) == {("Ida", "1972"), ("Goodman", "1976"), ("Shi", "1988"), ("Doolin", "2004")}


@pytest.mark.parametrize("page", CITING, ids=lambda p: p.relative_to(ROOT).as_posix())
def test_works_cited_are_in_the_bibliography(page):
    assert citations(page.read_text(encoding="utf-8")) <= bibliography()


def test_works_cited_in_the_source_are_in_the_bibliography():
    """In comments (!>, !!) and docstrings."""
    found = set()
    for file in ROOT.glob("src/**/*.f90"):
        found |= citations(" ".join(re.findall(r"![>!](.*)", file.read_text(encoding="utf-8"))))
    assert ("Shi", "1988") in found
    assert found <= bibliography()


def test_the_standard_works_are_there():
    names = bibliography()
    for work in [
        ("Shi", "1988"),
        ("Tsesarsky", "2005"),
        ("Doolin", "2002"),
        ("Sitar", "2004"),
        ("MacLaughlin", "2006"),
    ]:
        assert work in names


def test_the_glossary_explains_the_terms_with_unit_and_choice():
    text = (DOCS / "glossary.md").read_text(encoding="utf-8")
    chosen = text.split("## Numbers that you choose")[1].split("\n## ")[0]
    rows = [re.split(r"(?<!\\)\|", row)[1:-1] for row in chosen.splitlines() if row.startswith("| **")]
    assert all(len(row) == 4 and all(cell.strip() for cell in row) for row in rows)
    named = " ".join(row[0] for row in rows)
    for term in ("g0", "g1", "g2", "k01", "e0", "ratio", "SOR", "max_open_close"):
        assert re.search(rf"\b{term}\b", named), term
    for term in TERMS:
        assert f"| **{term}** |" in text, term


def test_pages_are_few_and_short():
    """What was tried and measured belongs into docs/notes, what developers did into the history of the repository."""
    pages = list(DOCS.glob("*.md"))
    assert len(pages) <= 18
    assert sum(len(page.read_text(encoding="utf-8").split()) for page in pages) <= 60_000
    versions = re.split(r"^## ", (DOCS / "changelog.md").read_text(encoding="utf-8"), flags=re.M)[1:]
    assert len(versions) >= 2
    assert all(sum(bool(line.strip()) for line in version.splitlines()) <= 60 for version in versions)
