"""Detection of faults, once a period, from what was read and what was commanded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from gsense_rig.safety.machine import Finding
from gsense_rig.safety.modes import Fault, Mode

if TYPE_CHECKING:
    from gsense_rig.control.references import Setpoint
    from gsense_rig.hardware.interface import HardwareReading


@dataclass(frozen=True)
class SafetyLimits:
    """Thresholds. Times are times of the loop's clock."""

    overcurrent: float = 6.0  # A; controller and brake ask for 5 at most
    overcurrent_time: float = 2.5e-3  # s: two periods
    soft_limit_margin: float = 5.0e-3  # m beyond the soft limit before it is a fault
    tracking_error: float = 0.04  # m; the PI is 20 mm off in the thesis's fastest run
    tracking_time: float = 5.0e-3  # s
    runaway_speed: float = 1.7  # m/s; the fastest accepted motion has 1.35
    runaway_excess: float = 0.23  # m/s faster than the reference; the PI is 0.17 off in the thesis's fastest run
    runaway_time: float = 4.0e-3  # s: three periods; an encoder fault looks alike and is named after two
    encoder_speed: float = 3.0  # m/s: no real motion, the drive ends at 2.05
    emf_mismatch: float = 0.2  # m/s between back EMF and encoder, plus a quarter of the faster one
    emf_periods: int = 2
    stall_voltage: float = 1.5  # V; breaking loose takes 0.6
    stall_distance: float = 0.4e-3  # m
    stall_time: float = 0.08  # s
    stall_certain: float = 0.015  # s; a tracking error after so long a stand is called a stall
    deadline: float = 0.015  # s between two ticks
    command_timeout: float | None = None  # s without a sign of life of the command source; None: not watched


class Observation(NamedTuple):
    """What the monitor looks at."""

    now: float  # s
    period: float  # s since the last tick
    mode: Mode
    homed: bool  # the position's zero is the rail's middle
    reading: HardwareReading
    position: float  # m, encoder
    setpoint: Setpoint | None  # None: no control
    voltage: float | None  # V applied since the last tick; None: bridge open
    emf_speed: float | None  # m/s by the motor's back EMF; None: bridge open
    command_age: float  # s since the last sign of life


class FaultMonitor:
    """Keeps the short memories that the detections need."""

    def __init__(self, limits: SafetyLimits, soft_limit: float) -> None:
        self.limits = limits
        self._soft_limit = soft_limit + limits.soft_limit_margin
        self._last_position: float | None = None
        self.clear()

    def clear(self) -> None:
        """Forget what was counting up (a reset, a new motion)."""
        self._overcurrent = 0.0
        self._runaway = 0.0
        self._tracking = 0.0
        self._emf = 0
        self._stall = 0.0
        self._stall_from = 0.0

    def shift(self, offset: float) -> None:
        """Move the zero: positions become smaller by offset [m]."""
        if self._last_position is not None:
            self._last_position -= offset
        self._stall_from -= offset

    def check(self, seen: Observation) -> Finding | None:
        """Return the first fault found, the most direct ones first."""
        last, self._last_position = self._last_position, seen.position
        reading = seen.reading
        if reading.emergency_stop:
            return Finding(Fault.EMERGENCY_STOP, "emergency stop pressed")
        if not reading.bridge_ok:
            return Finding(Fault.BRIDGE, "the motor's bridge reports a fault")
        speed = 0.0 if last is None or seen.period <= 0.0 else (seen.position - last) / seen.period
        if seen.mode not in (Mode.HOMING, Mode.RUNNING, Mode.STOPPING):
            self.clear()
            return self._jump(seen, speed) if seen.homed else None
        return (
            self._late(seen)
            or self._switches(seen)
            or self._electrical(seen)
            or self._jump(seen, speed)
            or self._encoder(seen, speed)
            or self._motion(seen, speed)
        )

    def _late(self, seen: Observation) -> Finding | None:
        limits = self.limits
        if seen.period > limits.deadline:
            return Finding(Fault.DEADLINE, f"the loop was silent for {seen.period * 1e3:.0f} ms")
        if limits.command_timeout is not None and seen.command_age > limits.command_timeout:
            return Finding(Fault.COMMAND_LOST, f"no sign of life of the command source for {seen.command_age:.2f} s")
        return None

    def _switches(self, seen: Observation) -> Finding | None:
        left, _, right, _ = seen.reading.switches
        if seen.homed and (left or right):  # homing judges the switches itself
            return Finding(Fault.END_SWITCH, f"{'left' if left else 'right'} end switch at {seen.position:+.4f} m")
        return None

    def _electrical(self, seen: Observation) -> Finding | None:
        current = abs(seen.reading.current)
        if not current > self.limits.overcurrent:  # nan where no sensor is wired
            self._overcurrent = 0.0
            return None
        self._overcurrent += seen.period
        if self._overcurrent < self.limits.overcurrent_time:
            return None
        return Finding(Fault.OVERCURRENT, f"motor current {current:.1f} A above {self.limits.overcurrent:g} A")

    def _jump(self, seen: Observation, speed: float) -> Finding | None:
        if abs(speed) <= self.limits.encoder_speed:
            return None
        return Finding(Fault.ENCODER, f"the encoder jumped by {speed * seen.period * 1e3:.1f} mm in one period")

    def _encoder(self, seen: Observation, speed: float) -> Finding | None:
        limits, emf_speed = self.limits, seen.emf_speed
        if emf_speed is None:
            self._emf = 0
            return None
        if abs(emf_speed - speed) <= limits.emf_mismatch + 0.25 * max(abs(emf_speed), abs(speed)):
            self._emf = 0
            return None
        self._emf += 1
        if self._emf < limits.emf_periods:
            return None
        return Finding(Fault.ENCODER, f"encoder says {speed:+.2f} m/s, the motor's back EMF {emf_speed:+.2f} m/s")

    def _motion(self, seen: Observation, speed: float) -> Finding | None:
        if self._runs_away(seen, speed):
            return Finding(Fault.RUNAWAY, f"carriage at {speed:+.2f} m/s")
        if seen.homed and abs(seen.position) > self._soft_limit:
            return Finding(Fault.SOFT_LIMIT, f"carriage at {seen.position:+.4f} m, outside the soft limits")
        return self._stalled(seen) or self._tracking_error(seen)

    def _runs_away(self, seen: Observation, speed: float) -> bool:
        """For some periods faster than any motion, or than the reference in the sense in which the carriage moves."""
        limits = self.limits
        fast = abs(speed) > limits.runaway_speed
        if seen.setpoint is not None:
            excess = speed - seen.setpoint.velocity
            fast = fast or (min(abs(speed), abs(excess)) > limits.runaway_excess and excess * speed > 0.0)
        self._runaway = self._runaway + seen.period if fast else 0.0
        return self._runaway >= limits.runaway_time

    def _tracking_error(self, seen: Observation) -> Finding | None:
        error = 0.0 if seen.setpoint is None else seen.setpoint.position - seen.position
        if abs(error) <= self.limits.tracking_error:
            self._tracking = 0.0
            return None
        self._tracking += seen.period
        if self._tracking < self.limits.tracking_time:
            return None
        if self._stall >= self.limits.stall_certain:
            return self._stall_finding(seen)
        return Finding(Fault.TRACKING, f"carriage {error * 1e3:+.0f} mm off its reference")

    def _stalled(self, seen: Observation) -> Finding | None:
        pushed = seen.voltage is not None and abs(seen.voltage) > self.limits.stall_voltage
        if not pushed or abs(seen.position - self._stall_from) > self.limits.stall_distance:
            self._stall, self._stall_from = 0.0, seen.position
            return None
        self._stall += seen.period
        if self._stall < self.limits.stall_time:
            return None
        return self._stall_finding(seen)

    @staticmethod
    def _stall_finding(seen: Observation) -> Finding:
        return Finding(Fault.STALL, f"{seen.voltage or 0.0:+.1f} V on the motor, but the carriage stands")
