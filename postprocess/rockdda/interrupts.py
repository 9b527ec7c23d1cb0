# SPDX-License-Identifier: MIT
"""Ctrl-C at places where it does no harm.

Python raises KeyboardInterrupt wherever it runs code, that is also in functions that compiled libraries call back, such
as those by which HDF5 reads a stream. A library that does not expect an exception there crashes, or loses it.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Any


class HeldInterrupts:
    """Within a `with` block SIGINT waits for `check` or the end of the block. A second one takes effect at once.

    The handler that was there before then gets the signal, and is there again after the block. Nothing changes where
    SIGINT is ignored or ends the process without Python, and in other threads than the main one, which alone runs
    handlers of signals. Blocks may be nested."""

    def __init__(self) -> None:
        self._before: Callable[[int, FrameType | None], Any] | None = None
        self._waits = False

    def __enter__(self) -> HeldInterrupts:
        if threading.current_thread() is threading.main_thread():
            before = signal.getsignal(signal.SIGINT)
            if callable(before):
                self._before = before
                signal.signal(signal.SIGINT, self._hold)
        return self

    def _hold(self, number: int, frame: FrameType | None) -> None:
        if not self._waits:
            self._waits = True
            return
        assert self._before is not None
        signal.signal(signal.SIGINT, self._before)
        self.check()  # a block around this one counts both
        self._before(number, frame)

    def check(self) -> None:
        """Let a signal that waits take effect: KeyboardInterrupt, unless another handler was set before."""
        if self._waits and self._before is not None:
            self._waits = False
            self._before(signal.SIGINT, None)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
            self.check()
