#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prepares what scripts/docs gives to FORD.

    scripts/api_sources.py FORTRAN

FORTRAN becomes a copy of src in which FORD finds nothing that it misreads:
- a comment that begins with one word and a colon, which FORD takes for metadata and drops;
- a name that a module imports and makes public again, which FORD does not know;
- a length of a text with commas, as of max(…).
The pages of the Python package are made here, too, for scripts/site_pages.py: one for each module.
"""

import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def for_ford(text: str) -> str:
    """The text of a Fortran source as FORD reads it right."""
    text = re.sub(r"^( *!> *[\w-]+):", r"\1&#58;", text, flags=re.M)
    text = re.sub(r"(!! *[\w-]+):", r"\1&#58;", text)
    text = re.sub(r"\bcharacter\(len=max\([^:\n]*\)\) ::", "character(len=:) ::", text)
    imported = {
        name.split("=>")[0].strip().lower()
        for names in re.findall(r"^ *use\b[^\n:]*only *:((?:[^\n!]*&[^\n]*\n)*[^\n!]*)", text, re.M)
        for name in names.replace("&", " ").replace("\n", " ").split(",")
    }

    def without_imported(match: re.Match[str]) -> str:
        names = [name.strip() for name in match[2].replace("&", " ").split(",")]
        own = [name for name in names if name.lower() not in imported]
        if len(own) == len(names):
            return match[0]
        return match[1] + ", ".join(own) if own else ""

    return re.sub(r"^( *public *:: *)((?:[^\n!]*&[^\n]*\n)*[^\n!]*)", without_imported, text, flags=re.M)


def copy_source(target: Path) -> None:
    """Write src, changed, into an empty folder."""
    shutil.rmtree(target, ignore_errors=True)
    for file in [*ROOT.glob("src/**/*.f90"), *ROOT.glob("src/**/*.F90")]:
        copy = target / file.relative_to(ROOT / "src")
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(for_ford(file.read_text(encoding="utf-8")), encoding="utf-8")


def python_modules() -> list[str]:
    """Modules of the package with public names."""
    names = []
    for file in sorted((ROOT / "postprocess/rockdda").glob("**/*.py")):
        parts = file.relative_to(ROOT / "postprocess").with_suffix("").parts
        if parts[-1] not in ("__init__", "__main__") and not parts[-1].startswith("_"):
            names.append(".".join(parts))
    return names


def write_pages(target: Path) -> None:
    """Write one page for each module into an empty folder, and the first page with the names that users import."""
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    (target / "index.md").write_text(
        "# RockDDA\n\nThe names that `import rockdda` gives.\n\n::: rockdda\n", encoding="utf-8"
    )
    for name in python_modules():
        (target / f"{name}.md").write_text(
            f"# {name}\n\n::: {name}\n    options:\n      show_root_heading: false\n", encoding="utf-8"
        )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("scripts/api_sources.py FORTRAN")
    copy_source(Path(sys.argv[1]))
