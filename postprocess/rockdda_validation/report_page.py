# SPDX-License-Identifier: MIT
"""The report of the validation as a page to read (HTML) and to print (PDF)."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable
from pathlib import Path

from rockdda.report.paper import pdf_of
from rockdda.writing import complete_file

__all__ = ["page_of", "write_pdf"]

STYLE = """
:root { color: #1a1a1a; background: #fff; font: 15px/1.5 system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif; }
body { max-width: 66rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.9rem; margin: 0 0 .8rem; } h2 { font-size: 1.35rem; margin: 2.4rem 0 .6rem;
  border-bottom: 1px solid #c8ced4; padding-bottom: .2rem; } h3 { font-size: 1.08rem; margin: 2rem 0 .5rem; }
p, li { max-width: 52rem; } a { color: #0060a0; text-decoration: none; } a:hover { text-decoration: underline; }
code { font: .88em ui-monospace, Menlo, Consolas, monospace; background: #f2f4f6; padding: .05em .3em; }
pre { background: #f2f4f6; padding: .6rem .8rem; } pre code { padding: 0; }
.wide { margin: .6rem 0 1rem; }
table { border-collapse: collapse; font-size: .84rem; line-height: 1.35; font-variant-numeric: tabular-nums; }
th { text-align: left; border-bottom: 1.5px solid #444; padding: .25rem .7rem .25rem 0; vertical-align: bottom; }
td { border-bottom: 1px solid #e0e4e8; padding: .25rem .7rem .25rem 0; vertical-align: top; }
td:first-child { min-width: 11em; } td strong { color: #b03a00; } img { max-width: 100%; height: auto; display: block; }
@media screen { .wide, pre { overflow-x: auto; } }
@page { size: A4; margin: 14mm 14mm; }
@media print {
  :root { font-size: 10px; } body { max-width: none; margin: 0; padding: 0; } p, li { max-width: none; }
  h1 { margin: 0 0 .5rem; } h2 { break-after: avoid; margin-top: 1.4rem; } h2.part, h2.next { break-before: page; }
  h3, caption { break-after: avoid; } tr, img { break-inside: avoid; } img { max-width: 135mm; } a { color: inherit; }
  table.first td { white-space: nowrap; padding: .1rem .6rem .1rem 0; }
}
"""


def page_of(text: str, parts: Iterable[str]) -> str:
    """The Markdown as a page that needs nothing but the figures beside it."""
    from markdown_it import MarkdownIt

    marked = re.sub(r'<a id="(case-[a-z0-9-]+)"></a>\n\n### ', "### \ue000\\1\ue001", text)
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(marked)
    body = re.sub("<h3>\ue000([^\ue001]*)\ue001", r'<h3 id="\1">', body)
    for title in parts:
        body = body.replace(f"<h2>{html.escape(title)}</h2>", f'<h2 class="part">{html.escape(title)}</h2>')
    body = body.replace("<h2>What does not match</h2>", '<h2 class="next">What does not match</h2>')
    body = body.replace("<table>", '<table class="first">', 1)  # that of the first page
    body = body.replace("<table", '<div class="wide"><table').replace("</table>", "</table></div>")
    head = '<meta charset="utf-8">\n<meta name="viewport" content="width=device-width, initial-scale=1">\n'
    head += f"<title>Validation of RockDDA</title>\n<style>{STYLE}</style>"
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n{body}</body>\n</html>\n'


def write_pdf(page: Path) -> Path:
    """Lay the page out on paper, beside it."""
    with complete_file(page.with_suffix(".pdf")) as part:
        pdf_of(part, page=page)
    return page.with_suffix(".pdf")
