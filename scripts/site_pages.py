#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Gathers the pages of the documentation site in a folder, laid out as the tree is, so that links hold.

    scripts/site_pages.py PAGES

The README is the first page; docs, the models of inputs with their pictures and the notebooks follow. Pages made here:
`api` (one for each module of the Python package) and `models.md`, thumbnails of all models with the commands that run
and draw them. Equations (```math in pages, $ in notebooks) become MathML, which browsers show without a network; this
needs latex2mathml.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from pathlib import Path

from api_sources import ROOT, write_pages

#: Kept as they are: text and pictures that pages show or link to.
KINDS = {".md", ".png", ".svg", ".html", ".json", ".toml", ".ipynb", ".nml", ".dc", ".df", ".dl", ".csv"}
SINGLE = ["README.md", "CONTRIBUTING.md", "LICENSE", "scripts/hpc/job.sh"]


def copy_pages(target: Path) -> None:
    """Copy what the site shows into an empty folder."""
    shutil.rmtree(target, ignore_errors=True)
    files = [ROOT / name for name in SINGLE]
    files += [file for folder in ("docs", "inputs") for file in (ROOT / folder).rglob("*") if file.suffix in KINDS]
    for file in files:
        copy = target / file.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copy)
    for page in target.rglob("*.md"):
        page.write_text(typeset_page(page.read_text(encoding="utf-8")), encoding="utf-8")
    for notebook in target.rglob("*.ipynb"):
        notebook.write_text(typeset_notebook(notebook.read_text(encoding="utf-8")), encoding="utf-8")


def mathml(latex: str, display: str) -> str:
    """An equation as MathML; display: 'block' or 'inline'."""
    from latex2mathml.converter import convert

    return convert(latex.strip(), display=display)


def typeset_page(text: str) -> str:
    """A page with its blocks of equations as MathML."""
    return re.sub(
        r"^( *)```math\n(.*?)\n *```$",
        lambda m: f'{m[1]}<div class="equation" markdown="0">{mathml(m[2], "block")}</div>',
        text,
        flags=re.M | re.S,
    )


def typeset_notebook(text: str) -> str:
    """A notebook with the equations of its text cells as MathML."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            words = re.sub(r"\$\$(.+?)\$\$", lambda m: mathml(m[1], "block"), "".join(cell["source"]), flags=re.S)
            cell["source"] = re.sub(r"\$([^$\n]+)\$", lambda m: mathml(m[1], "inline"), words)
    return json.dumps(notebook)


def models() -> list[tuple[str, str]]:
    """Folder and title of each model whose README shows a picture of it."""
    found = []
    for readme in sorted((ROOT / "inputs").glob("*/README.md")):
        text = readme.read_text(encoding="utf-8")
        if "(end.png)" in text:
            found.append((readme.parent.name, text.splitlines()[0].lstrip("# ")))
    return found


def commands_of(readme: str) -> list[str]:
    """The commands of a README: its indented lines that begin with a program of ours."""
    return re.findall(r"^    ((?:rockdda|rockdda-post|scripts/\w+) .*)$", readme, re.M)


def models_page() -> str:
    """Thumbnails of the models in a grid, each with its commands."""
    lines = [
        "# Models in pictures",
        "",
        "Each model of `inputs/` at the end of its run, and the commands that run and draw it.",
        "",
    ]
    for name, title in models():
        commands = commands_of((ROOT / "inputs" / name / "README.md").read_text(encoding="utf-8"))
        lines += [
            f"## {title}",
            "",
            f"[![{title}](inputs/{name}/end.png){{ width=360 loading=lazy }}](inputs/{name}/README.md)",
            "",
            *(f"    {command}" for command in commands),
            "",
        ]
    return "\n".join(lines)


def write_site(target: Path) -> None:
    """All pages of the site."""
    copy_pages(target)
    write_pages(target / "api")
    (target / "models.md").write_text(models_page(), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("scripts/site_pages.py PAGES")
    write_site(Path(sys.argv[1]))
