# SPDX-License-Identifier: MIT
"""Texts that come from files and file names, made fit for pictures and pages."""

from __future__ import annotations

import unicodedata

__all__ = ["plain_text", "readable"]


def readable(text: str) -> str:
    """Text whose undecoded bytes (lone surrogates, as Python keeps them in names and titles) are taken as Latin-1."""
    return (
        "".join(chr(ord(c) - 0xDC00) if "\udc80" <= c <= "\udcff" else c for c in text)
        .encode("utf-8", "replace")
        .decode("utf-8")
    )


def plain_text(text: str) -> str:
    """A readable text for matplotlib: control characters become blanks, and $ is a dollar, not mathematics."""
    clean = "".join(" " if unicodedata.category(c) == "Cc" else c for c in readable(text))
    return clean.replace("$", r"\$")
