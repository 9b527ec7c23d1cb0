# SPDX-License-Identifier: MIT
"""Selection of frames, and writing of text files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..errors import InputError
from ..results import Results

#: Called with the number of frames written and the number to write.
Progress = Callable[[int, int], None]


def chosen(results: Results, frames: Iterable[int] | None) -> list[int]:
    """Frame numbers from 0, all of them by default; negative ones count from the end."""
    return [results.frames[k].index for k in (range(results.n_frames) if frames is None else frames)]


def parse_frames(text: str | None, count: int) -> Sequence[int] | None:
    """Frame numbers from '3', '-1', '0,5,10', '0:50:10' or '::5'; None for all."""
    if text is None or text in ("", "all", ":"):
        return None
    found: list[int] = []
    for part in text.split(","):
        numbers = part.split(":")
        try:
            if len(numbers) == 1:
                found.append(int(part))
            else:
                found += range(count)[slice(*(int(number) if number else None for number in numbers))]
        except ValueError:
            raise InputError(f"frames {text!r}: expected numbers and ranges, such as -1, 0,5,10 or 0:50:10") from None
    return found
