#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the Fortran reference of FORD a part of the site: what its pages load from the network comes from MkDocs here.

    scripts/ford_site.py REFERENCE MKDOCS

REFERENCE is the folder that FORD has written, MKDOCS that of the installed package, which holds Bootstrap and lunr.
Links of FORD to procedures that are not shown lead to paths of this machine, or to places that their page does not
have: they become links to the page.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

FILES = {
    "css/bootstrap.min.css": "themes/mkdocs/css/bootstrap.min.css",
    "js/bootstrap.bundle.min.js": "themes/mkdocs/js/bootstrap.bundle.min.js",
    "js/lunr.js": "contrib/search/templates/search/lunr.js",
}


def mended(text: str, here: str, up: str) -> str:
    """The text of a page; `here`: the absolute path of the reference, `up`: the way to it from the page."""
    text = re.sub(
        r'"https://cdn\.jsdelivr\.net/npm/bootstrap[^"]*/(css|js)/([^"]*)"([^>]*?)\s+integrity="[^"]*"\s*'
        r'crossorigin="anonymous"',
        rf'"{up}\1/\2"\3',
        text,
    )
    text = text.replace("https://unpkg.com/lunr/lunr.js", f"{up}js/lunr.js")
    text = re.sub(r'<script src="https://cdn[^"]*MathJax[^>]*></script>', "", text)
    return re.sub(r'#moduleprocedure-[^"]*"', '"', text.replace(f"{here}/", up))


def main(reference: Path, mkdocs: Path) -> None:
    """Mend all pages."""
    for target, source in FILES.items():
        (reference / target).parent.mkdir(exist_ok=True)
        shutil.copyfile(mkdocs / source, reference / target)
    here = str(reference.resolve())
    for page in reference.rglob("*.html"):
        up = "../" * len(page.relative_to(reference).parent.parts) or "./"
        page.write_text(mended(page.read_text(encoding="utf-8"), here, up), encoding="utf-8")
    page = reference.parent / "api/index.html"  # what leads to it: MkDocs has no pages but its own in its menu
    link = '</h1>\n<p>The Fortran library has <a href="../fortran/index.html">a reference of its own</a>.</p>'
    page.write_text(page.read_text(encoding="utf-8").replace("</h1>", link, 1), encoding="utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("scripts/ford_site.py REFERENCE MKDOCS")
    main(Path(sys.argv[1]), Path(sys.argv[2]))
