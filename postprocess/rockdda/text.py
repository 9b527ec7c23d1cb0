# SPDX-License-Identifier: MIT
"""Texts from files and file names, made fit for messages, scripts, pictures and pages."""

from __future__ import annotations

import unicodedata

__all__ = ["has_controls", "plain_text", "readable", "short", "shown"]

LONGEST_SHOWN = 60


def short(text: str, longest: int = LONGEST_SHOWN) -> str:
    """The text, or its beginning and three dots."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def has_controls(text: str) -> bool:
    """True with line breaks or other control characters (Unicode: Cc, Zl, Zp, lone surrogates)."""
    return not text.isprintable() and any(unicodedata.category(letter) in ("Cc", "Zl", "Zp", "Cs") for letter in text)


def shown(value: object, longest: int = LONGEST_SHOWN) -> str:
    """The value in a message, cut to a length."""
    try:
        return short(repr(value), longest)
    except ValueError:  # Python refuses to print thousands of digits
        return "a number of too many digits"


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
