"""One owner of a file at a time: two loops on one card would fight over the motor."""

from __future__ import annotations

import fcntl
import time
from typing import IO

PATIENCE = 5.0
"""s: the loop of a rig node that was killed brakes first and lets go then."""
_POLL = 0.05


def own(file: int | IO[bytes], patience: float | None = None) -> bool:
    """Lock an open file for this process, for as long as it or a map of it is open; False where another keeps it.

    Args:
        file: open file or descriptor.
        patience: s to wait for it; None: `PATIENCE`.
    """
    end = time.monotonic() + (PATIENCE if patience is None else patience)
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end:
                return False
            time.sleep(_POLL)
        else:
            return True


def release(file: int | IO[bytes]) -> None:
    """Unlock it while a map of it is still open."""
    fcntl.flock(file, fcntl.LOCK_UN)
