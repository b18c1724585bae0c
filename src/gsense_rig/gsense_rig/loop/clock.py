"""From the loop's clock (CLOCK_MONOTONIC) to the host's time (what ROS stamps are)."""

from __future__ import annotations

import time

_STEP_NS = 1_000_000  # a larger change than this is a step of the system clock, a smaller one is measuring noise


def measured_offset_ns() -> int:
    """System time minus monotonic time [ns]; the tightest of a few readings."""
    best, width = 0, 1 << 62
    for _ in range(5):
        before = time.monotonic_ns()
        system = time.time_ns()
        after = time.monotonic_ns()
        if after - before < width:
            best, width = system - (before + after) // 2, after - before
    return best


class HostTime:
    """Constant offset, so that intervals between stamps are the loop's; followed only where the system clock steps.

    Both clocks are slewed alike by the kernel, so the offset does not drift.
    """

    def __init__(self, offset_ns: int) -> None:
        self._offset_ns = offset_ns

    def check(self, offset_ns: int) -> bool:
        """Take a newly measured offset [ns]; true where the system clock was stepped and the offset follows."""
        if abs(offset_ns - self._offset_ns) < _STEP_NS:
            return False
        self._offset_ns = offset_ns
        return True

    def stamp_ns(self, monotonic: float) -> int:
        """System time [ns] of a monotonic time [s]."""
        return round(monotonic * 1e9) + self._offset_ns
