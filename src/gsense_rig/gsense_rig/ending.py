"""The end of a process that moves something: bounded, whatever its main thread does when the signal comes."""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import threading


class Ending:
    """Sets an event upon SIGINT or SIGTERM, and ends the process where it has not ended in time.

    The signal is seen by a thread of its own, through a pipe that the kernel's handler fills: a Python handler would
    wait for the main thread, which may be stuck, or hold the very lock that the event needs. To be made in the main
    thread.

    Args:
        requested: is set upon the first signal.
        grace: s from then on; after it the stacks of all threads are printed and the process exits with 1. Its children
            see their pipes close.
    """

    def __init__(self, requested: threading.Event, grace: float = 20.0) -> None:
        self._requested = requested
        self._grace = grace
        self._read, write = os.pipe()
        os.set_blocking(write, False)
        signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: None)
        threading.Thread(target=self._await, name="ending", daemon=True).start()

    def over(self) -> None:
        """Ignore further signals: while the interpreter ends, they would have their default again."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)

    def _await(self) -> None:
        asked = False
        while not asked:  # any signal with a Python handler fills the pipe
            asked = bool({signal.SIGINT, signal.SIGTERM} & set(os.read(self._read, 16)))
        self._requested.set()
        threading.Event().wait(self._grace)
        sys.stderr.write(f"not ended {self._grace:g} s after the signal; exiting. Where it was:\n")
        faulthandler.dump_traceback(file=sys.stderr)
        os._exit(1)
