"""The control loop of the rail: one tick reads, judges, controls and writes. Pure but for the hardware it is given."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gsense_rig.control.references import Setpoint, SoftStop
from gsense_rig.hardware.interface import HardwareError, HardwareReading
from gsense_rig.loop.admission import busy_text, refuse_motion
from gsense_rig.loop.axis import Axis
from gsense_rig.loop.drive import Bridge, Drive
from gsense_rig.loop.messages import (
    Command,
    DriveMove,
    DriveSine,
    Home,
    Park,
    Reply,
    Reset,
    Result,
    Stop,
    Telemetry,
    Tune,
    UseModel,
)
from gsense_rig.loop.motion import Motion, motion_of
from gsense_rig.loop.work import Work
from gsense_rig.safety.homing import Homing, Phase
from gsense_rig.safety.machine import Finding, StateMachine
from gsense_rig.safety.modes import Fault, Mode
from gsense_rig.safety.monitor import FaultMonitor, Observation

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import RailHardware
    from gsense_rig.loop.parameters import LoopParameters


NOT_RUN = "the loop has not run yet"


class RigLoop:
    """State machine and control of the rail.

    Call `tick(now)` once a period with a steadily growing time; `submit` commands in between; `take_results` hands out
    the ends of commands. The motor is off (DIS) in UNHOMED and IDLE, under control in HOMING, RUNNING and STOPPING; in
    FAULT it brakes to standstill and then goes off, at once where the bridge is broken.

    Attributes:
        machine: mode, fault, homed.
    """

    def __init__(self, hardware: RailHardware, parameters: LoopParameters) -> None:
        self.parameters = parameters
        self.machine = StateMachine()
        self._axis = Axis(hardware, parameters)
        self._drive = Drive(self._axis, parameters)
        self._work = Work()
        self._monitor = FaultMonitor(parameters.safety, parameters.motion.soft_limit)
        self._now: float | None = None
        self._last_sign = 0.0

    # ---- commands

    def sign_of_life(self, now: float) -> None:
        """Note that the command source is alive."""
        self._last_sign = now

    def submit(self, command: Command) -> Reply:
        """Accept or refuse a command; refusals say why."""
        reading = self._axis.reading
        if reading is None or self._now is None:
            return Reply(command.id, False, NOT_RUN)
        if isinstance(command, Home):
            return self._home(command, reading, self._now)
        if isinstance(command, Stop):
            return self._stop(command, self._now)
        if isinstance(command, Reset):
            return self._reset(command)
        if isinstance(command, UseModel):
            return self._use_model(command)
        return self._move(command, reading, self._now)

    def abort(self, fault: Fault, text: str) -> None:
        """Enter FAULT on a finding from outside (the command source is gone)."""
        if self.machine.mode is not Mode.FAULT:
            self._trip(Finding(fault, text))

    @property
    def at_rest(self) -> bool:
        """Whether the motor is off and nothing is in work."""
        return self._axis.output.disabled and self.machine.resting

    def take_results(self) -> list[Result]:
        """Results since the last call."""
        return self._work.take_results()

    def _home(self, command: Home, reading: HardwareReading, now: float) -> Reply:
        if self.machine.mode not in (Mode.UNHOMED, Mode.IDLE):
            return Reply(command.id, False, busy_text(self.machine.mode, self.machine.fault_text))
        homing = Homing(self.parameters.homing)
        homing.begin(now, self._axis.position, reading.switches)
        self._work.begin_homing(homing, command.id, now)
        self._begin(Mode.HOMING, now)
        return Reply(command.id, True, "homing")

    def _move(self, command: DriveSine | DriveMove | Park | Tune, reading: HardwareReading, now: float) -> Reply:
        machine, p = self.machine, self.parameters
        reason = refuse_motion(command, machine.mode, machine.fault_text, reading.switches, p)
        if reason is not None:
            return Reply(command.id, False, reason)
        motion = motion_of(command, self._axis.position, now, p)
        self._work.begin_motion(motion, now)
        self._begin(Mode.RUNNING, now)
        return Reply(command.id, True, f"{motion.duration:.1f} s of motion")

    def _use_model(self, command: UseModel) -> Reply:
        if not self.at_rest:
            return Reply(command.id, False, busy_text(self.machine.mode, self.machine.fault_text))
        self.parameters = replace(self.parameters, model=command.drive, tuned=True)
        self._axis.use_model(self.parameters)
        self._drive.use_model(self.parameters)
        self._work.finish(command.id, True, "the identified drive is in use")
        return Reply(command.id, True, "taken over")

    def _stop(self, command: Stop, now: float) -> Reply:
        mode = self.machine.mode
        if mode not in (Mode.HOMING, Mode.RUNNING, Mode.STOPPING):
            self._work.finish(command.id, True, "the motor is off already")
            return Reply(command.id, True, "stopping")
        self._work.begin_stop(command.id)
        if mode is Mode.RUNNING:
            start = self._drive.setpoint or Setpoint(self._axis.position, 0.0, 0.0)
            self._work.motion = Motion(command.id, [SoftStop(start)], now)
        elif mode is Mode.HOMING:
            self._begin_brake(now)
        self.machine.enter(Mode.STOPPING)
        return Reply(command.id, True, "stopping")

    def _reset(self, command: Reset) -> Reply:
        if self.machine.mode is not Mode.FAULT:
            return Reply(command.id, False, "no fault to reset")
        if self._drive.brake.active:
            return Reply(command.id, False, "still braking")
        self.machine.reset()
        self._monitor.clear()
        self._work.finish(command.id, True, "idle" if self.machine.homed else "not homed: call rig/home")
        return Reply(command.id, True, "reset")

    # ---- the period

    def tick(self, now: float) -> Telemetry:
        """Run one period of the loop at a time [s] of its clock."""
        period = self.parameters.period if self._now is None else now - self._now
        if self._now is None:
            self._last_sign = now
        reading, finding = self._sense(now, period)
        self._now = now
        if finding is not None and self.machine.mode is not Mode.FAULT:
            self._trip(finding)
        self._write(self._act(now, reading))
        return self._telemetry(now, reading)

    def _sense(self, now: float, period: float) -> tuple[HardwareReading, Finding | None]:
        """Read the inputs and judge them; a reading that failed is the last one again."""
        last = self._axis.reading
        try:
            reading = self._axis.read()
        except HardwareError as error:
            if last is None:
                raise
            return last, Finding(Fault.HARDWARE, str(error))
        return reading, self._monitor.check(self._observe(now, period, reading))

    def _observe(self, now: float, period: float, reading: HardwareReading) -> Observation:
        drive, machine = self._drive, self.machine
        return Observation(
            now, period, machine.mode, machine.homed, reading, self._axis.position, drive.setpoint, self._axis.voltage,
            self._axis.emf_speed, now - self._last_sign,
        )  # fmt: skip

    def _act(self, now: float, reading: HardwareReading) -> Bridge:
        """What the bridge is told in this period."""
        if self._work.homing is not None:
            return self._act_homing(self._work.homing, now, reading)
        if self._drive.brake.active:
            return self._act_braking(now)
        if self._work.motion is not None:
            return self._act_motion(self._work.motion, now, reading)
        return self._drive.off()

    def _act_motion(self, motion: Motion, now: float, reading: HardwareReading) -> Bridge:
        setpoint = motion.setpoint(now)
        if setpoint is not None:
            motion.note_error(now, setpoint.position - self._axis.position)
            if motion.record is not None:
                motion.record.append((self._axis.position, self._axis.output.duty, reading.current))
            return self._drive.follow(setpoint)
        if self.machine.mode is Mode.STOPPING:
            self._begin_brake(now)
            return self._act_braking(now)
        self._work.end_motion("done")
        self.machine.rest()
        return self._drive.off()

    def _act_homing(self, homing: Homing, now: float, reading: HardwareReading) -> Bridge:
        before = homing.reference
        homing.update(now, self._axis.position, reading.switches)
        if homing.failure is not None:
            self._trip(Finding(homing.failure.fault, homing.failure.text))
            return self._act_braking(now)
        if homing.phase is Phase.DONE:
            return self._homing_done(homing)
        if homing.reference is None:
            self._drive.setpoint = None
            self._drive.brake.begin(now)
            return Bridge(0.0, False)  # homing is slow enough for a full short circuit
        if homing.reference is not before:
            self._drive.prepare()
        return self._drive.follow(homing.reference.at(now - homing.started))

    def _homing_done(self, homing: Homing) -> Bridge:
        self._axis.shift_zero(homing.zero)
        self._monitor.shift(homing.zero)
        self.machine.zero_found()
        self._drive.brake.release()
        self._work.end_homing(f"homed; the carriage is at {self._axis.position * 1e3:+.2f} mm")
        return self._drive.off()

    def _act_braking(self, now: float) -> Bridge:
        """Brake until standstill, then off; off at once where there is no bridge to brake with."""
        if self.machine.fault is Fault.BRIDGE:
            self._drive.brake.release()
        bridge = self._drive.braking(now, self.machine.fault)
        if bridge.disabled and self.machine.mode is Mode.STOPPING:
            self.machine.rest()
            self._work.end_stop("stopped")
        return bridge

    def _write(self, bridge: Bridge) -> None:
        try:
            self._axis.write(bridge.duty, bridge.disabled, int(self.machine.light))
        except HardwareError as error:
            if self.machine.mode is not Mode.FAULT:
                self._trip(Finding(Fault.HARDWARE, str(error)))

    # ---- transitions

    def _begin(self, mode: Mode, now: float) -> None:
        self.machine.enter(mode)
        self._drive.prepare()
        self._monitor.clear()
        self._last_sign = max(self._last_sign, now)

    def _begin_brake(self, now: float) -> None:
        self._work.motion, self._drive.setpoint = None, None
        self._drive.brake.begin(now)

    def _trip(self, finding: Finding) -> None:
        """Enter FAULT: end what is in work and brake."""
        self._work.fail(finding.text)
        self.machine.trip(finding)
        self._begin_brake(0.0 if self._now is None else self._now)

    def _telemetry(self, now: float, reading: HardwareReading) -> Telemetry:
        axis, machine, setpoint, command = self._axis, self.machine, self._drive.setpoint, self._work.command
        reference = axis.position if setpoint is None else setpoint.position
        return Telemetry(
            now, machine.homed, axis.position, axis.observer.velocity, axis.observer.acceleration,
            axis.model.force(reading.current, axis.observer.velocity), reference, reference - axis.position,
            axis.output.duty, axis.output.disabled, reading.current, reading.switches, axis.output.light,
            int(machine.mode), int(machine.fault), machine.fault_text, command,
            now - self._work.begun if command else 0.0,
        )  # fmt: skip
