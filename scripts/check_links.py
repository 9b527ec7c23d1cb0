#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Names links, pictures and anchors of a site that lead nowhere; ends with 1 then. Links to the network are not
followed.

scripts/check_links.py SITE
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.links.append(value)
            elif name == "id" or (name == "name" and tag == "a"):
                self.anchors.add(value or "")


def broken_links(site: Path) -> list[str]:
    """Pages and their links that lead nowhere."""
    pages = {file.resolve(): Page(file.read_text(encoding="utf-8", errors="replace")) for file in site.rglob("*.html")}
    found = []
    for file, page in sorted(pages.items()):
        for link in dict.fromkeys(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or link.startswith(("${", "{{")):
                continue
            base = site if parts.path.startswith("/") else file.parent
            target = (base / unquote(parts.path).lstrip("/")).resolve() if parts.path else file
            if target.is_dir():
                target = target / "index.html"
            anchor = unquote(parts.fragment)
            is_there = target.exists() and (
                target not in pages or not anchor or anchor in pages[target].anchors or anchor == "__top"
            )
            if not is_there:
                found.append(f"{file.relative_to(site.resolve())}: {link}")
    return found


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("scripts/check_links.py SITE")
    wrong = broken_links(Path(sys.argv[1]))
    for line in wrong:
        print(line, file=sys.stderr)
    print(f"{len(wrong)} broken links", file=sys.stderr)
    sys.exit(bool(wrong))
