"""`python -m gsense_rig.loop.guard_process`: the guard, started by `guard_link.GuardLink`; its spec comes by stdin.

It ends when the loop says that the motor is off, or when the loop is dead and the guard has stopped the motor.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import time
from typing import TYPE_CHECKING

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.watch_page import WatchPage
from gsense_rig.safety.guard import Guard

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import GuardedRail
    from gsense_rig.loop.guard_link import GuardSpec

_PRIORITY = 60  # of SCHED_FIFO: above the loop


def urgent(priority: int) -> bool:
    """Ask for real-time scheduling; true where the system grants it."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        return True
    return False


def watch(guard: Guard, rail: GuardedRail, page: WatchPage, owner: int) -> None:
    """Look again and again until the guard is no longer needed."""
    said = False
    while not page.closing:
        page.guard_beat = time.monotonic()
        if guard.report is not None and page.acknowledged == page.stops:
            guard.rearm()
        if page.beat > 0.0:
            before = guard.report
            guard.tick(rail.now(), page.beat)
            if before is None and guard.report is not None:
                page.stops += 1
                said = False
        if guard.at_rest and not said and guard.report is not None:
            print(f"guard: {guard.report.text()}", file=sys.stderr, flush=True)  # noqa: T201
            said = True
        if os.getppid() != owner and (page.beat == 0.0 or guard.at_rest):
            return
        time.sleep(guard.limits.period)


def main() -> int:
    """Run the guard for the loop that started it."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    spec: GuardSpec = pickle.loads(sys.stdin.buffer.read())  # noqa: S301 - from our own parent
    try:
        rail = spec.rail.open_guarded(spec.owner)
    except HardwareError as error:
        print(f"guard: {error}", file=sys.stderr)  # noqa: T201
        return 2
    urgent(_PRIORITY)
    watch(Guard(rail, spec.drive, spec.limits), rail, WatchPage(spec.page), spec.owner)
    rail.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
