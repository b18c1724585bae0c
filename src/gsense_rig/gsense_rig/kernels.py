"""Compiles plant and sensor kernels into numba's cache, so that the first live run does not wait for the compiler."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop
from gsense_rig.sensors.live import LiveFeedSpec, make_live_feed

TICKS = 20


def main() -> int:
    """Run a few ticks of a simulated rail with its sensors."""
    with tempfile.TemporaryDirectory() as folder:
        feed = make_live_feed(LiveFeedSpec(bus_path=Path(folder) / "bus"))
        loop, hardware = make_simulated_loop()
        clock = VirtualClock(loop, hardware, on_tick=lambda _telemetry, history: feed.advance(history))
        steps = clock.steps()
        for _ in range(TICKS):
            next(steps)
        feed.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
