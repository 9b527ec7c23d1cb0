# SPDX-License-Identifier: MIT
"""Pages laid out on paper: by WeasyPrint where it is installed, else by Chromium."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from ..errors import RockddaError, how_to_install
from ..writing import written_to

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
LONGEST = 300  #: seconds for a page


def needs_for_pdf() -> str:
    """What lays out the page for a PDF, WeasyPrint or the path of a browser; complains where there is neither."""
    try:
        import weasyprint  # noqa: F401
    except (ImportError, OSError) as problem:  # OSError: it is there, but not the libraries that it needs
        for path in map(shutil.which, BROWSERS):
            if path:
                return path
        advice = f"a PDF needs WeasyPrint, {how_to_install('pdf')}, or Chromium ({problem})"
        raise RockddaError(f"{advice}; the report as .html can be printed from any browser") from None
    return "WeasyPrint"


def pdf_of(target: Path, *, page: Path | None = None, text: str | None = None) -> Path:
    """Lay a page, a file or its text, out on paper."""
    by = needs_for_pdf()
    if by != "WeasyPrint":
        return _by_browser(by, target, page, text)
    import weasyprint

    logging.getLogger("weasyprint").setLevel(logging.ERROR)
    source = weasyprint.HTML(filename=str(page)) if page is not None else weasyprint.HTML(string=text)
    with written_to(target):
        source.write_pdf(str(target))
    return target


def _by_browser(browser: str, target: Path, page: Path | None, text: str | None) -> Path:
    with tempfile.TemporaryDirectory(prefix="rockdda-") as folder:
        if page is None:
            page = Path(folder) / "page.html"
            page.write_text(text or "", encoding="utf-8")
        printed = Path(folder) / "page.pdf"
        options = ["--headless", "--disable-gpu", "--no-pdf-header-footer", f"--user-data-dir={folder}/profile"]
        if os.geteuid() == 0:
            options.append("--no-sandbox")  # the sandbox does not work for root
        command = [browser, *options, f"--print-to-pdf={printed}", page.resolve().as_uri()]
        try:
            subprocess.run(command, capture_output=True, timeout=LONGEST, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise RockddaError(f"{browser} did not lay out the page: {error}") from error
        if not printed.exists():
            raise RockddaError(f"{browser} did not lay out the page: it wrote no PDF")
        with written_to(target):
            shutil.copyfile(printed, target)
    return target
