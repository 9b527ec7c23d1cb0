# SPDX-License-Identifier: MIT
"""Texts of others in messages and scripts: control characters, lengths."""

from __future__ import annotations

import unicodedata

LONGEST_SHOWN = 60


def short(text: str, longest: int = LONGEST_SHOWN) -> str:
    """The text, or its beginning and three dots."""
    return text if len(text) <= longest else text[: longest - 3] + "..."


def has_controls(text: str) -> bool:
    """Are there line breaks or other control characters (Unicode: Cc, Zl, Zp, lone surrogates)?"""
    return not text.isprintable() and any(unicodedata.category(letter) in ("Cc", "Zl", "Zp", "Cs") for letter in text)


def shown(value: object, longest: int = LONGEST_SHOWN) -> str:
    """The value in a message, cut to a length."""
    try:
        return short(repr(value), longest)
    except ValueError:  # Python refuses to print thousands of digits
        return "a number of too many digits"
