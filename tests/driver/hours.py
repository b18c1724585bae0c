"""Hours of frames through the driver's session in simulated time: what `soak` runs without ROS, port or disk."""

from __future__ import annotations

import os
import random
import time
from collections import Counter
from pathlib import Path
from typing import Any

from tests.bench.slow.driver_soak import rss_mb
from tests.driver import wire

from gsense_driver.samples import ImuReading
from gsense_driver.session import Session
from gsense_driver.settings import PARAMETERS, TRANSPORT_DELAY, make_settings

SLOTS_PER_S = 200
"""Of the board: an MPU frame each, a BNO frame in every second one."""
HOUR = 3600
GROWTH_MB = 2.0
"""An hour, after the first one."""
STEP_NS = 3600 * 10**9


def packets(slot: int, slot_us: float, draw: random.Random) -> bytes:
    """What the board sends in one slot."""
    time_us = 4_000_000_000 + round(slot * slot_us)  # five minutes before the clock wraps
    sequence = slot + (slot + 1) // 2
    noise = (draw.randrange(-40, 40), draw.randrange(-40, 40), draw.randrange(-40, 40))
    out = wire.cobs(wire.payload(1, sequence, time_us, wire.mpu_body(gyr=noise)))
    if slot % 2 == 0:
        out += wire.cobs(wire.payload(2, sequence + 1, time_us + 200, wire.bno_body(gyr=noise)))
    return out


def open_files(pid: int) -> int:
    return len(list(Path(f"/proc/{pid}/fd").iterdir()))


class Counting:
    """An outlet that keeps figures alone."""

    def __init__(self) -> None:
        self.readings: Counter[str] = Counter()
        self.links = 0
        self.worst_s = 0.0
        """Between two stamps of an IMU, other than at the step."""
        self.last: dict[str, int] = {}

    def configure(self, *_: Any) -> None:
        return

    def publish(self, reading: Any) -> None:
        name = f"{type(reading).__name__} {getattr(reading, 'sensor', '')}"
        self.readings[name] += 1
        if not isinstance(reading, ImuReading):
            return
        step = abs(reading.stamp_ns - self.last.get(name, reading.stamp_ns))
        self.last[name] = reading.stamp_ns
        if step < STEP_NS // 2:
            self.worst_s = max(self.worst_s, step * 1e-9)

    def publish_link(self, *_: Any) -> None:
        self.links += 1

    def publish_health(self, *_: Any) -> None:
        return


def simulated(hours: float, seed: int) -> bool:
    """All frames of some hours through the driver's session; whether none was lost and nothing grew."""
    draw, outlet = random.Random(seed), Counting()
    given = {parameter.name: parameter.default for parameter in PARAMETERS}
    session = Session(make_settings({**given, "port": "soak", TRANSPORT_DELAY: 0.0}), 10**18, outlet, "soak")
    skew, begun = 1.0 + draw.uniform(-4e-5, 4e-5), time.monotonic()
    slots = round(hours * HOUR * SLOTS_PER_S)
    memory, now_ns, figures = [], 0, None
    for slot in range(slots):
        late_ns = round(1e5 + 1e6 * draw.random() ** 4)
        now_ns = round(slot * 1e9 * skew / SLOTS_PER_S) + late_ns
        session.feed(packets(slot, 1e6 / SLOTS_PER_S, draw), now_ns)
        if slot % SLOTS_PER_S == 0:
            figures = session.report(now_ns, 10**18 + now_ns, None)
        if slot == slots // 2:
            session.set_wall_offset(10**18 + STEP_NS, now_ns)
        if (slot + 1) % (HOUR * SLOTS_PER_S) == 0 or slot == slots - 1:
            memory.append(rss_mb(os.getpid()))
            hour = (slot + 1) / HOUR / SLOTS_PER_S
            print(f"  hour {hour:5.2f}: {memory[-1]:.1f} MB, {open_files(os.getpid())} open files", flush=True)
    took = time.monotonic() - begun
    assert figures is not None
    counts, grown = figures.counts, growth(memory)
    sent = slots + (slots + 1) // 2
    print(
        f"simulated time: {hours:g} h in {took:.0f} s ({hours * HOUR / took:.0f} times real time); {sent} frames sent, "
        f"lost {counts.lost}, corrupt {counts.corrupt}, restarts {counts.restarts}; {sum(outlet.readings.values())} "
        f"readings, {outlet.links} reports; two stamps at most {outlet.worst_s * 1e3:.1f} ms apart but for the step; "
        f"memory {grown:+.2f} MB an hour after the first"
    )
    return (
        counts.lost == counts.corrupt == counts.restarts == 0
        and counts.received >= sent - 2 * 300
        and grown < GROWTH_MB
    )


def growth(values: list[float]) -> float:
    """An hour, from the end of the first to the last."""
    return (values[-1] - values[0]) / (len(values) - 1) if len(values) > 1 else 0.0
