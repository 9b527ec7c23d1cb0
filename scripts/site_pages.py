#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Gathers the pages of the documentation site in a folder, laid out as the tree is, so that links hold.

    scripts/site_pages.py PAGES PROGRAMS

The README is the first page; docs, the models of inputs with their pictures and the notebooks follow. Pages made here:
`api` (one for each module of the Python package) and `models.md`, the pictures of all models. The page of a model ends
with its film, where it moves, and its input; the programs rockdda and rockdda-post of the folder PROGRAMS make the
films. Equations (```math in pages, $ in notebooks) become MathML, which browsers show without a network; this
needs latex2mathml.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from api_sources import ROOT, write_pages

#: Kept as they are: text and pictures that pages show or link to.
KINDS = {".md", ".png", ".svg", ".html", ".json", ".toml", ".ipynb", ".nml", ".dc", ".df", ".dl", ".csv"}
#: Frames from which on a run is a film: one that only comes to rest has a few.
FILM = 20
MOST_FRAMES = 60
#: Files that a model consists of, in the order of the page, and lines of each that are shown.
INPUT = (".nml", ".toml", ".df", ".dl", ".dc", ".csv")
MOST_LINES = 40
STYLE = """\
.models { display: grid; grid-template-columns: repeat(auto-fill, minmax(13rem, 1fr)); gap: 0.8rem; }
.models a { display: flex; flex-direction: column; border: 1px solid var(--md-default-fg-color--lightest);
  border-radius: 0.2rem; overflow: hidden; color: var(--md-typeset-color); }
.models a:hover { border-color: var(--md-accent-fg-color); }
.models img { width: 100%; height: 9rem; object-fit: contain; background: white; }
.models b { padding: 0.4rem 0.6rem 0; }
.models span { padding: 0 0.6rem 0.5rem; font-size: 0.64rem; line-height: 1.4; }
iframe.film { width: 100%; height: 32rem; border: 1px solid var(--md-default-fg-color--lightest); }
.md-typeset table:not([class]) { display: block; overflow-x: auto; }
.md-typeset table:not([class]) td:first-child code { white-space: nowrap; }
.md-typeset pre > code { white-space: pre-wrap; overflow-wrap: anywhere; }
.equation { overflow-x: auto; overflow-y: hidden; }
"""
SINGLE = ["README.md", "CONTRIBUTING.md", "LICENSE", "CITATION.cff", "scripts/hpc/job.sh"]


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
    """A page with its blocks of equations as MathML; bars in the code of tables without the sign that GitHub needs."""
    rows = [re.sub(r"`[^`]*`", lambda m: m[0].replace(r"\|", "|"), row) if row.startswith("|") else row
            for row in text.split("\n")]  # fmt: skip
    text = "\n".join(rows)
    return re.sub(
        r"^( *)```math\n(.*?)\n *```$",
        lambda m: f'{m[1]}<div class="equation" markdown="0">{mathml(m[2], "block")}</div>',
        text,
        flags=re.M | re.S,
    )


def typeset_notebook(text: str) -> str:
    """A notebook with the equations of its text cells as MathML, and its links to pages as the site has them."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        if cell["cell_type"] == "markdown":
            words = re.sub(r"\$\$(.+?)\$\$", lambda m: mathml(m[1], "block"), "".join(cell["source"]), flags=re.S)
            words = re.sub(r"\]\((?!\w+:)([^)#]*/)README\.md(#[^)]*)?\)", r"](\1index.html\2)", words)
            words = re.sub(r"\]\((?!\w+:)([^)#]+)\.md(#[^)]*)?\)", r"](\1.html\2)", words)
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


def shown_number() -> dict[str, str]:
    """What each model shows, from the table of inputs/README.md."""
    text = (ROOT / "inputs/README.md").read_text(encoding="utf-8")
    return dict(re.findall(r"^\| \[(\w+)\]\(\w+/README\.md\) \| [^|]* \| ([^|]*) \|", text, re.M))


def words_of(text: str) -> str:
    """A cell of a table of Markdown in HTML: its code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text, quote=False))


def models_page() -> str:
    """The pictures of the models in a grid, each a link to the page of the model."""
    shows = shown_number()
    lines = [
        "# Models in pictures",
        "",
        "Each model of `inputs/`, which the program runs as it is. Its page has a number from a closed form, the film "
        "where it moves, and the input.",
        "",
        '<div class="models">',
    ]
    for name, title in models():
        lines.append(
            f'<a href="inputs/{name}/index.html"><img src="inputs/{name}/end.png" alt="{html.escape(title)}" '
            f'loading="lazy"><b>{html.escape(title)}</b><span>{words_of(shows.get(name, ""))}</span></a>'
        )
    return "\n".join([*lines, "</div>", ""])


def make_film(name: str, programs: Path, target: Path) -> bool:
    """Run a model and write its film, a page that plays it; False for a model of several runs, or without motion."""
    with tempfile.TemporaryDirectory() as folder:
        results = Path(folder) / "out.h5"
        command = [programs / "rockdda", "run", ROOT / "inputs" / name, "-o", results, "--json", "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        frames = json.loads(done.stdout).get("frames", 0) if done.returncode == 0 else 0
        if frames < FILM:
            return False
        command = [programs / "rockdda-post", "animate", results, "-o", target, "--quiet", "--units", "SI"]
        subprocess.run([*command, "--every", str(-(-frames // MOST_FRAMES))], check=True, capture_output=True)
    return True


def input_section(folder: Path) -> str:
    """The files of a model: the beginning of each, and a link to all of it."""
    files = [file for ending in INPUT for file in sorted(folder.rglob(f"*{ending}"))]
    if not files:
        return ""
    parts = ["", "## Input", ""]
    for file in files:
        name = file.relative_to(folder).as_posix()
        lines = file.read_text(encoding="utf-8").splitlines()
        rest = f"; the first {MOST_LINES} of {len(lines)} lines" if len(lines) > MOST_LINES else ""
        parts += [f"[{name}]({name}){rest}", "", "```text", *lines[:MOST_LINES], "```", ""]
    return "\n".join(parts)


def complete_models(target: Path, programs: Path | None) -> None:
    """Add film and input to the page of each model; without programs no films."""
    for readme in sorted((target / "inputs").glob("*/README.md")):
        text = readme.read_text(encoding="utf-8")
        if programs is not None and make_film(readme.parent.name, programs, readme.parent / "film.html"):
            text += (
                '\n## Film\n\n<iframe class="film" src="film.html" title="Film of the run" loading="lazy"></iframe>\n'
            )
        text += input_section(readme.parent)
        readme.write_text(f"[All models](../../models.md)\n\n{text}", encoding="utf-8")


def write_site(target: Path, programs: Path | None) -> None:
    """All pages of the site."""
    copy_pages(target)
    complete_models(target, programs)
    write_pages(target / "api")
    (target / "site.css").write_text(STYLE, encoding="utf-8")
    (target / "models.md").write_text(models_page(), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("scripts/site_pages.py PAGES PROGRAMS")
    write_site(Path(sys.argv[1]), Path(sys.argv[2]).resolve())
