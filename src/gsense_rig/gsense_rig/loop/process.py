"""The loop in a process of its own: nothing that ROS or Python does elsewhere can delay it.

The parent holds one end of each of two pipes: commands in, telemetry out. The loop's time is CLOCK_MONOTONIC. When the
command pipe closes (the parent died), the motor is stopped and the process ends. A guard process, its child, stops the
motor when this one dies.
"""

from __future__ import annotations

import gc
import signal
import sys
import time
from typing import TYPE_CHECKING

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.messages import Reply, Reset, Stop
from gsense_rig.loop.pacing import LatenessMeter, Pacer
from gsense_rig.loop.rail_source import make_source
from gsense_rig.loop.simulated import make_simulated_loop
from gsense_rig.loop.spec import Mount, ProcessSpec, Shutdown, SignOfLife, StartFailure
from gsense_rig.loop.wire import FrameReader, FrameWriter, PipeClosed
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from types import FrameType

    from gsense_rig.loop.messages import Command

_LAST_STOP = 3.0  # s that a stop may take before the process ends anyway, motor disabled
_HEALTH_INTERVAL = 1.0  # s


class LoopService:
    """Runs the loop against the wall clock until told to end."""

    def __init__(self, spec: ProcessSpec, commands: FrameReader, telemetry: FrameWriter) -> None:
        self._spec = spec
        self._commands = commands
        self._out = telemetry
        self._ending: float | None = None
        self._orphan = False
        self._source = make_source(spec)
        self._guard = self._source.guard
        self._guard.start()
        self._warm_up()
        self._guard.wait_ready()
        self._start = time.monotonic()
        self._loop, self._hardware = self._source.open(self._start)
        self._meter = LatenessMeter(spec.parameters.period)

    def request_end(self) -> None:
        """Ask for a soft stop and the end (signal handler)."""
        self._ending = time.monotonic() if self._ending is None else self._ending

    def run(self) -> None:
        """Tick until the end; leaves the motor disabled."""
        loop = self._loop
        pacer = Pacer(self._start, self._spec.parameters.rate, self._source.catch_up)
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
                self._tick(due, tick)
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
            self._hardware.close()
            self._guard.end()
            self._source.close()

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

    def _tick(self, due: float, tick: int) -> None:
        self._source.advance(due)
        trouble = self._guard.check()
        if trouble is not None:
            self._loop.abort(Fault.GUARD, trouble)
        telemetry = self._loop.tick(due)
        self._guard.beat(due)
        if tick % self._spec.telemetry_every == 0:
            self._send(telemetry)
        for result in self._loop.take_results():
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
            elif isinstance(item, Mount):
                self._source.mount(item.name)
            elif not isinstance(item, SignOfLife):
                self._send(self._submit(item))

    def _submit(self, command: Command) -> Reply:
        """Hand a command to the loop; nothing moves without a guard, and a reset brings a new one."""
        if isinstance(command, Reset) and self._guard.gone:
            self._guard.start()
        elif not isinstance(command, Stop | Reset) and not self._guard.ready:
            return Reply(command.id, False, "the guard process is starting: try again")
        return self._loop.submit(command)

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
