"""The loop in a process of its own: nothing that ROS or Python does elsewhere can delay it.

The parent holds one end of each of two pipes: commands in, telemetry out. The loop's time is CLOCK_MONOTONIC. When the
command pipe closes (the parent died), the motor is stopped and the process ends.
"""

from __future__ import annotations

import gc
import signal
import sys
import time
from typing import TYPE_CHECKING

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.messages import Stop
from gsense_rig.loop.pacing import LatenessMeter, Pacer
from gsense_rig.loop.simulated import make_simulated_loop
from gsense_rig.loop.spec import ProcessSpec, Shutdown, SignOfLife, StartFailure
from gsense_rig.loop.wire import FrameReader, FrameWriter, PipeClosed
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from types import FrameType

    from gsense_rig.hardware.sim import SimRail
    from gsense_rig.loop.rig_loop import RigLoop

_LAST_STOP = 3.0  # s that a stop may take before the process ends anyway, motor disabled
_HEALTH_INTERVAL = 1.0  # s


class LoopService:
    """Runs the loop against the wall clock until told to end."""

    def __init__(self, spec: ProcessSpec, commands: FrameReader, telemetry: FrameWriter) -> None:
        self._spec = spec
        self._commands = commands
        self._out = telemetry
        self._feed = spec.feed_factory() if spec.feed_factory is not None else None
        self._ending: float | None = None
        self._orphan = False
        self._warm_up()
        self._start = time.monotonic()
        self._loop, self._hardware = make_simulated_loop(spec.parameters, spec.seed, spec.position, self._start)
        self._meter = LatenessMeter(spec.parameters.period)

    def request_end(self) -> None:
        """Ask for a soft stop and the end (signal handler)."""
        self._ending = time.monotonic() if self._ending is None else self._ending

    def run(self) -> None:
        """Tick until the end; leaves the motor disabled."""
        loop, hardware = self._loop, self._hardware
        pacer = Pacer(self._start, self._spec.parameters.rate, catch_up=True)
        next_health = self._start + _HEALTH_INTERVAL
        tick, stopping = 0, False
        loop.tick(self._start)
        gc.collect()
        gc.freeze()
        try:
            while True:
                due = pacer.next_due(time.monotonic())
                late = self._sleep_until(due)
                self._take_commands()
                self._tick(loop, hardware, due, tick)
                tick += 1
                self._meter.note(late, max(time.monotonic() - due - late, 0.0))
                if due >= next_health:
                    next_health += _HEALTH_INTERVAL
                    self._send(self._meter.report(self._out.dropped))
                if self._ending is not None:
                    if not stopping:
                        stopping = True
                        self._stop()
                    if loop.at_rest or time.monotonic() - self._ending > _LAST_STOP:
                        return
        finally:
            hardware.close()
            if self._feed is not None:
                self._feed.close()

    def _warm_up(self) -> None:
        """Compile everything and fill the caches before the first period counts."""
        loop, hardware = make_simulated_loop(self._spec.parameters)
        for k in range(1, 20):
            hardware.advance(k * self._spec.parameters.period)
            loop.tick(k * self._spec.parameters.period)

    @staticmethod
    def _sleep_until(due: float) -> float:
        """Sleep; return how late it is [s]."""
        wait = due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        return max(time.monotonic() - due, 0.0)

    def _tick(self, loop: RigLoop, hardware: SimRail, due: float, tick: int) -> None:
        history = hardware.advance(due)
        if self._feed is not None:
            self._feed.advance(history)
        telemetry = loop.tick(due)
        if tick % self._spec.telemetry_every == 0:
            self._send(telemetry)
        for result in loop.take_results():
            self._send(result)

    def _take_commands(self) -> None:
        if self._orphan:
            return
        try:
            items = self._commands.receive()
        except PipeClosed:
            self._lost()
            return
        if items:
            # The present, not the tick's due time: while late ticks are caught up, the source was not silent.
            self._loop.sign_of_life(time.monotonic())
        for item in items:
            if isinstance(item, Shutdown):
                self.request_end()
            elif not isinstance(item, SignOfLife):
                self._send(self._loop.submit(item))

    def _send(self, item: object) -> None:
        if self._orphan:
            return
        try:
            self._out.send(item)
        except PipeClosed:
            self._lost()

    def _lost(self) -> None:
        self._orphan = True
        self._loop.abort(Fault.COMMAND_LOST, "the command source is gone")
        self.request_end()

    def _stop(self) -> None:
        self._loop.submit(Stop(-1))


def main() -> int:
    """Run the loop for a parent: argv is the commands' and the telemetry's file descriptor."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the whole group; the parent decides
    commands = FrameReader(int(sys.argv[1]), blocking=True)
    telemetry = FrameWriter(int(sys.argv[2]))
    try:
        items = commands.receive()
        while not items:
            items = commands.receive()
        spec: ProcessSpec = items[0]
        reader = FrameReader(int(sys.argv[1]), blocking=False)
        service = LoopService(spec, reader, telemetry)
    except PipeClosed:
        return 0
    except (HardwareError, ValueError, OSError) as error:
        telemetry.send(StartFailure(str(error)))
        return 2

    def end(_signal: int, _frame: FrameType | None) -> None:
        service.request_end()

    signal.signal(signal.SIGTERM, end)
    service.run()
    return 0
