"""Ctrl-C and its like, for commands that unwind upon it: an exception in the main thread that does not get lost."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterable
from types import FrameType, TracebackType
from typing import final

_AGAIN = 0.05
"""s after which a signal is sent again whose exception was dropped."""


class Interrupted(KeyboardInterrupt):
    """A signal asks the command to end; its argument is the signal's number."""


@final
class Interruption:
    """Raises `Interrupted` in the main thread upon a signal, and again where the interpreter dropped it.

    A handler runs between any two instructions of the main thread. Where that is in a `__del__` or in a callback of
    the garbage collector, the interpreter prints "Exception ignored in" and goes on as if nobody had asked; the
    signal is then sent once more. As a context it puts the handlers of before back. To be made in the main thread.

    Args:
        numbers: signals that ask.
    """

    def __init__(self, numbers: Iterable[int] = (signal.SIGINT, signal.SIGTERM)) -> None:
        self.number: int | None = None
        """The first signal that came."""
        self._dropped = sys.unraisablehook
        sys.unraisablehook = self._unraisable
        self._before = {number: signal.signal(number, self._raise) for number in numbers}

    def __enter__(self) -> Interruption:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        sys.unraisablehook = self._dropped

    def over(self) -> None:
        """Ignore further signals: what follows is bounded and must not be cut short."""
        for number in self._before:
            signal.signal(number, signal.SIG_IGN)

    def _raise(self, number: int, _frame: FrameType | None) -> None:
        if self.number is None:
            self.number = number
        raise Interrupted(number)

    def _unraisable(self, dropped: sys.UnraisableHookArgs) -> None:
        if isinstance(dropped.exc_value, Interrupted):
            again = threading.Timer(_AGAIN, os.kill, (os.getpid(), dropped.exc_value.args[0]))
            again.daemon = True
            again.start()
        else:
            self._dropped(dropped)
