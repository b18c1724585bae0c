"""The guard: stops the motor when the loop's heartbeat ends. Pure; runs in a process of its own (`loop.guard_process`).

While the loop lives the guard only looks at the encoder. When the heartbeat is older than the limit, it does what the
loop does in a fault: brake with limited current until standstill, then DIS; DIS at once where there is no bridge to
brake with. It repeats its outputs until the loop says that it knows (`rearm`), so that a loop that was only held up
cannot go on as if nothing had happened.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from gsense_rig.control.model import DriveModel
from gsense_rig.hardware.interface import HardwareError, MotorOutput
from gsense_rig.safety.brake import Brake, BrakeParameters
from gsense_rig.safety.modes import Light

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import GuardedRail, HardwareReading
    from gsense_rig.plant.parameters import DriveParameters


@dataclass(frozen=True)
class GuardLimits:
    """When the guard acts, and how."""

    timeout: float = 0.014  # s of the rail's clock without a heartbeat
    period: float = 0.002  # s between two looks
    window: float = 0.006  # s over which the encoder's speed is taken
    brake: BrakeParameters = field(default_factory=BrakeParameters)


@dataclass
class GuardReport:
    """What the guard did: times of the rail's clock [s], positions along the belt [m] since the trip."""

    tripped: float
    silence: float  # s without a heartbeat at that time
    speed: float  # m/s at that time, by the encoder
    distance: float = 0.0  # m covered until DIS
    disabled: float | None = None  # time of DIS

    def text(self) -> str:
        """One line."""
        line = f"no heartbeat of the loop for {self.silence * 1e3:.0f} ms: braked from {self.speed:+.2f} m/s"
        if self.disabled is None:
            return line
        took = self.disabled - self.tripped
        return f"{line}, motor off after {abs(self.distance) * 1e3:.0f} mm and {took * 1e3:.0f} ms"


class Guard:
    """Watches one heartbeat and stops one motor.

    Attributes:
        report: of the stop in force; None while all is well.
    """

    def __init__(self, rail: GuardedRail, drive: DriveParameters, limits: GuardLimits | None = None) -> None:
        self.limits = limits or GuardLimits()
        self.report: GuardReport | None = None
        self._rail = rail
        self._model = DriveModel(drive)
        self._brake = Brake(self.limits.brake)
        self._seen: deque[tuple[float, int]] = deque()
        self._start = 0
        self._output = MotorOutput(0.0, True, int(Light.RED))

    @property
    def at_rest(self) -> bool:
        """Whether the guard has stopped the motor and disabled it."""
        return self.report is not None and self.report.disabled is not None

    def tick(self, now: float, last_beat: float) -> None:
        """Look once: time and time of the newest heartbeat [s], both of the rail's clock."""
        if self.report is None:
            self._watch(now)
            if now - last_beat > self.limits.timeout:
                self._trip(now, now - last_beat)
        else:
            self._stop(now)

    def rearm(self) -> None:
        """The loop has taken over again and knows of the stop."""
        self.report = None
        self._brake.release()
        self._seen.clear()

    def _watch(self, now: float) -> int | None:
        if self._seen and now <= self._seen[-1][0]:
            return self._seen[-1][1]
        try:
            counts = self._rail.read_counts()
        except HardwareError:
            return None
        self._seen.append((now, counts))
        while now - self._seen[0][0] > self.limits.window and len(self._seen) > 2:
            self._seen.popleft()
        return counts

    def _speed(self) -> float:
        """By the encoder [m/s]."""
        if len(self._seen) < 2:
            return 0.0
        (t0, first), (t1, last) = self._seen[0], self._seen[-1]
        return (last - first) / self._rail.counts_per_metre / (t1 - t0)

    def _trip(self, now: float, silence: float) -> None:
        speed = self._speed()
        self.report = GuardReport(now, silence, speed)
        self._start = self._seen[-1][1] if self._seen else 0
        self._brake.begin(now)
        self._write(now, (speed,) if speed else ())

    def _stop(self, now: float) -> None:
        """Go on braking, or keep the motor off."""
        try:
            reading = self._rail.read()
        except HardwareError:
            self._brake.release()
            self._disable(now)
            return
        self._watch(now)
        if not reading.bridge_ok:
            self._brake.release()
        if self._brake.update(now, self._speed()):
            self._write(now, self._speeds(reading))
        else:
            self._disable(now)

    def _speeds(self, reading: HardwareReading) -> tuple[float, ...]:
        drive = self._model.drive
        if math.isnan(reading.current):
            return (self._speed(),)
        voltage = self._model.duty_voltage(self._output.duty)
        return self._speed(), (voltage - drive.resistance * reading.current) / drive.force_constant

    def _write(self, now: float, speeds: tuple[float, ...]) -> None:
        drive = self._model.drive
        voltage = self._brake.voltage(now, speeds, drive.force_constant, drive.resistance)
        self._put(MotorOutput(self._model.duty(voltage), False, int(Light.RED)))

    def _disable(self, now: float) -> None:
        if self.report is not None and self.report.disabled is None:
            self.report.disabled = now
            last = self._seen[-1][1] if self._seen else self._start
            self.report.distance = (last - self._start) / self._rail.counts_per_metre
        self._put(MotorOutput(0.0, True, int(Light.RED)))

    def _put(self, output: MotorOutput) -> None:
        self._output = output
        try:
            self._rail.write(output)
        except HardwareError:  # the next look tries again; nothing else can be done from here
            return
