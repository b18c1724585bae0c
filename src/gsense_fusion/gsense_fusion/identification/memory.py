"""Memory that arrays give back is kept for the next ones.

The analysis makes some hundred thousand arrays of 50 kB to 1 MB. The C library hands such memory back to the system and
asks for it again, and each page of it comes back empty, at the price of a fault: a tenth of the analysis' time.
"""

from __future__ import annotations

import ctypes

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
"""Options of `mallopt` (glibc's malloc.h)."""
LARGEST_REUSED = 32 * 2**20
"""glibc allows no more."""
KEPT_FREE = 2**30


def keep_freed_memory() -> None:
    """Keep up to `KEPT_FREE` bytes that are freed; other C libraries than glibc do as ever."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return
    mallopt(MMAP_THRESHOLD, LARGEST_REUSED)
    mallopt(TRIM_THRESHOLD, KEPT_FREE)
