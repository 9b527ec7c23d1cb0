# SPDX-License-Identifier: MIT
"""Pages laid out on paper, by WeasyPrint."""

from __future__ import annotations

import logging
from pathlib import Path

from ..errors import OutputError, RockddaError, how_to_install

__all__ = ["needs_for_pdf", "pdf_of"]


def needs_for_pdf() -> None:
    """Complain if there is no WeasyPrint, which lays out the page for the PDF."""
    try:
        import weasyprint  # noqa: F401
    except (ImportError, OSError) as problem:  # OSError: it is there, but not the libraries that it needs
        raise RockddaError(f"a PDF needs WeasyPrint: {how_to_install('pdf')} ({problem})") from None


def pdf_of(target: Path, *, page: Path | None = None, text: str | None = None) -> Path:
    """Lay a page, a file or its text, out on paper."""
    needs_for_pdf()
    import weasyprint

    logging.getLogger("weasyprint").setLevel(logging.ERROR)
    source = weasyprint.HTML(filename=str(page)) if page is not None else weasyprint.HTML(string=text)
    try:
        source.write_pdf(str(target))
    except OSError as error:
        raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error
    return target
