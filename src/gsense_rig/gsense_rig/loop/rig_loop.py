"""The control loop of the rail: one tick reads, judges, controls and writes. Pure but for the hardware it is given."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gsense_rig.control.controllers import Measured, make_controller
from gsense_rig.control.estimators import DriveObserver
from gsense_rig.control.model import DriveModel
from gsense_rig.control.references import Setpoint, Sine, SoftStop
from gsense_rig.hardware.interface import HardwareError, HardwareReading, MotorOutput
from gsense_rig.loop.admission import busy_text, refuse_drive
from gsense_rig.loop.messages import Command, DriveSine, Home, Reply, Reset, Result, Stop, Telemetry
from gsense_rig.loop.motion import Motion
from gsense_rig.safety.brake import Brake
from gsense_rig.safety.homing import Homing, Phase
from gsense_rig.safety.modes import KEEPS_POSITION, LIGHTS, Fault, Mode
from gsense_rig.safety.monitor import FaultMonitor, Finding, Observation

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import RailHardware
    from gsense_rig.loop.parameters import LoopParameters


NOT_RUN = "the loop has not run yet"


class RigLoop:
    """State machine and control of the rail.

    Call `tick(now)` once a period with a steadily growing time; `submit` commands in between; `take_results` hands out
    the ends of commands. The motor is off (DIS) in UNHOMED and IDLE, under control in HOMING, RUNNING and STOPPING; in
    FAULT it brakes to standstill and then goes off, at once where the bridge is broken.
    """

    def __init__(self, hardware: RailHardware, parameters: LoopParameters) -> None:
        self.parameters = parameters
        self.mode = Mode.UNHOMED
        self.fault = Fault.NONE
        self.fault_text = ""
        self.homed = False
        self._hardware = hardware
        self._model = DriveModel(parameters.model)
        self._controller = make_controller(parameters.controller, parameters.model)
        self._observer = DriveObserver(parameters.model, parameters.period)
        self._monitor = FaultMonitor(parameters.safety, parameters.model, parameters.motion.soft_limit)
        self._zero_counts = 0.0
        self._now: float | None = None
        self._last_sign = 0.0
        self._position = 0.0
        self._reading: HardwareReading | None = None
        self._setpoint: Setpoint | None = None
        self._output = MotorOutput(0.0, True, 0)
        self._motion: Motion | None = None
        self._stop_command = 0
        self._homing: Homing | None = None
        self._homing_command = 0
        self._begun = 0.0
        self._brake = Brake(parameters.brake)
        self._results: list[Result] = []

    # ---- commands

    def sign_of_life(self, now: float) -> None:
        """Note that the command source is alive."""
        self._last_sign = now

    def submit(self, command: Command) -> Reply:
        """Accept or refuse a command; refusals say why."""
        if isinstance(command, Home):
            return self._home(command)
        if isinstance(command, Stop):
            return self._stop(command)
        if isinstance(command, Reset):
            return self._reset(command)
        return self._drive(command)

    def abort(self, fault: Fault, text: str) -> None:
        """Enter FAULT on a finding from outside (the command source is gone)."""
        if self.mode is not Mode.FAULT:
            self._trip(Finding(fault, text))

    @property
    def at_rest(self) -> bool:
        """Whether the motor is off and nothing is in work."""
        return self._output.disabled and self.mode in (Mode.UNHOMED, Mode.IDLE, Mode.FAULT)

    def take_results(self) -> list[Result]:
        """Results since the last call."""
        results, self._results = self._results, []
        return results

    def _home(self, command: Home) -> Reply:
        if self.mode not in (Mode.UNHOMED, Mode.IDLE):
            return Reply(command.id, False, busy_text(self.mode, self.fault_text))
        if self._reading is None or self._now is None:
            return Reply(command.id, False, NOT_RUN)
        left, _, right, _ = self._reading.switches
        self._homing, self._homing_command = Homing(self.parameters.homing), command.id
        self._homing.begin(self._now, self._position, left, right)
        self._begin(Mode.HOMING)
        self.homed = False
        return Reply(command.id, True, "homing")

    def _drive(self, command: DriveSine) -> Reply:
        if self._reading is None or self._now is None:
            return Reply(command.id, False, NOT_RUN)
        p = self.parameters
        reason = refuse_drive(command, self.mode, self.fault_text, self._reading.switches, p)
        if reason is not None:
            return Reply(command.id, False, reason)
        sine = Sine(command.amplitude, command.angular_frequency, command.cycles)
        self._motion = Motion.sine(command.id, sine, self._position, p.settle, self._now)
        self._begin(Mode.RUNNING)
        return Reply(command.id, True, f"{sine.duration:.1f} s of motion")

    def _stop(self, command: Stop) -> Reply:
        if self._now is None:
            return Reply(command.id, False, NOT_RUN)
        if self.mode is Mode.RUNNING and self._motion is not None:
            self._finish(self._motion.command, False, "stopped", self._motion.rms_error)
            start = self._setpoint or Setpoint(self._position, 0.0, 0.0)
            self._motion = Motion(command.id, [SoftStop(start)], self._now)
            self._stop_command = command.id
            self.mode = Mode.STOPPING
        elif self.mode is Mode.HOMING:
            self._finish(self._homing_command, False, "stopped")
            self._homing = None
            self._begin_brake()
            self._stop_command = command.id
            self.mode = Mode.STOPPING
        elif self.mode is Mode.STOPPING:
            self._finish(self._stop_command, True, "stopping, again")
            self._stop_command = command.id
        else:
            self._finish(command.id, True, "the motor is off already")
        return Reply(command.id, True, "stopping")

    def _reset(self, command: Reset) -> Reply:
        if self.mode is not Mode.FAULT:
            return Reply(command.id, False, "no fault to reset")
        if self._brake.active:
            return Reply(command.id, False, "still braking")
        keeps = self.homed and self.fault in KEEPS_POSITION
        self.homed = keeps
        self.mode = Mode.IDLE if keeps else Mode.UNHOMED
        self.fault, self.fault_text = Fault.NONE, ""
        self._monitor.clear()
        self._finish(command.id, True, "idle" if keeps else "not homed: call rig/home")
        return Reply(command.id, True, "reset")

    # ---- the period

    def tick(self, now: float) -> Telemetry:
        """Run one period of the loop at a time [s] of its clock."""
        period = self.parameters.period if self._now is None else now - self._now
        if self._now is None:
            self._last_sign = now
        first = self._now is None
        finding: Finding | None
        try:
            reading = self._hardware.read()
        except HardwareError as error:
            if self._reading is None:
                raise
            reading = self._reading
            finding = Finding(Fault.HARDWARE, str(error))
        else:
            self._read(reading, first)
            finding = self._monitor.check(self._observe(now, period, reading))
        self._now = now
        if finding is not None and self.mode is not Mode.FAULT:
            self._trip(finding)
        duty, disabled = self._act(now, reading)
        self._write(duty, disabled)
        return self._telemetry(now, reading)

    def _read(self, reading: HardwareReading, first: bool) -> None:
        self._reading = reading
        self._position = (reading.counts - self._zero_counts) / self._hardware.counts_per_metre
        if first:
            self._observer.reset(self._position)
        self._observer.update(self._position, self._voltage())

    def _voltage(self) -> float | None:
        return None if self._output.disabled else self._model.duty_voltage(self._output.duty)

    def _observe(self, now: float, period: float, reading: HardwareReading) -> Observation:
        reference = None if self._setpoint is None else self._setpoint.position
        return Observation(
            now, period, self.mode, self.homed, reading, self._position, reference, self._voltage(),
            self._brake.active, now - self._last_sign,
        )  # fmt: skip

    def _act(self, now: float, reading: HardwareReading) -> tuple[float, bool]:
        """Duty and DIS of this period."""
        if self._homing is not None:
            return self._act_homing(self._homing, now, reading)
        if self._brake.active:
            return self._act_braking(now)
        if self._motion is not None:
            return self._act_motion(self._motion, now)
        self._setpoint = None
        return 0.0, True

    def _act_motion(self, motion: Motion, now: float) -> tuple[float, bool]:
        setpoint = motion.setpoint(now)
        if setpoint is None:
            self._motion, self._setpoint = None, None
            if self.mode is Mode.STOPPING:
                self._begin_brake()
                return self._act_braking(now)
            self._finish(motion.command, True, "done", motion.rms_error)
            self.mode = Mode.IDLE
            return 0.0, True
        motion.note_error(now, setpoint.position - self._position)
        return self._control(setpoint), False

    def _act_homing(self, homing: Homing, now: float, reading: HardwareReading) -> tuple[float, bool]:
        before = homing.reference
        homing.update(now, self._position, reading.switches[0], reading.switches[2])
        if homing.failure is not None:
            self._trip(Finding(homing.failure.fault, homing.failure.text))
            return self._act_braking(now)
        if homing.phase is Phase.DONE:
            return self._homing_done(homing)
        if homing.reference is None:
            self._setpoint = None
            self._brake.begin(now)
            return 0.0, False
        if homing.reference is not before:
            self._controller.reset()
            self._brake.release()
        return self._control(homing.reference.at(now - homing.started)), False

    def _homing_done(self, homing: Homing) -> tuple[float, bool]:
        self._zero_counts += homing.zero * self._hardware.counts_per_metre
        self._observer.shift(homing.zero)
        self._position -= homing.zero
        self._monitor.shift(homing.zero)
        self.homed, self.mode = True, Mode.IDLE
        self._homing, self._setpoint = None, None
        self._brake.release()
        self._finish(self._homing_command, True, f"homed; the carriage is at {self._position * 1e3:+.2f} mm")
        return 0.0, True

    def _act_braking(self, now: float) -> tuple[float, bool]:
        """Brake until standstill, then off; off at once where there is no bridge to brake with."""
        self._setpoint = None
        if self.fault is Fault.BRIDGE:
            self._brake.release()
        if self._brake.update(now, self._observer.velocity, blind=self.fault in (Fault.ENCODER, Fault.HARDWARE)):
            return 0.0, False
        if self.mode is Mode.STOPPING:
            self.mode = Mode.IDLE if self.homed else Mode.UNHOMED
            self._finish(self._stop_command, True, "stopped")
        return 0.0, True

    def _control(self, setpoint: Setpoint) -> float:
        self._setpoint = setpoint
        measured = Measured(self._position, self._observer.position, self._observer.velocity)
        voltage = self._controller.voltage(setpoint, measured, self.parameters.period)
        return self._model.duty(voltage)

    def _write(self, duty: float, disabled: bool) -> None:
        self._output = MotorOutput(duty, disabled, int(LIGHTS[self.mode]))
        try:
            self._hardware.write(self._output)
        except HardwareError as error:
            if self.mode is not Mode.FAULT:
                self._trip(Finding(Fault.HARDWARE, str(error)))

    # ---- transitions

    def _begin(self, mode: Mode) -> None:
        self.mode, self._begun = mode, self._last_tick()
        self._brake.release()
        self._controller.reset()
        self._monitor.clear()
        self._last_sign = max(self._last_sign, self._begun)

    def _last_tick(self) -> float:
        return 0.0 if self._now is None else self._now

    def _begin_brake(self) -> None:
        self._motion, self._setpoint = None, None
        self._brake.begin(self._last_tick())

    def _trip(self, finding: Finding) -> None:
        """Enter FAULT: end what is in work and brake."""
        for command in {self._active_command(), self._stop_command if self.mode is Mode.STOPPING else 0} - {0}:
            self._finish(command, False, finding.text)
        self.mode, self.fault, self.fault_text = Mode.FAULT, finding.fault, finding.text
        self._homing = None
        self._begin_brake()

    def _finish(self, command: int, success: bool, message: str, rms_error: float = 0.0) -> None:
        self._results.append(Result(command, success, message, rms_error))

    def _active_command(self) -> int:
        if self._motion is not None:
            return self._motion.command
        return self._homing_command if self._homing is not None else 0

    def _telemetry(self, now: float, reading: HardwareReading) -> Telemetry:
        setpoint, position = self._setpoint, self._position
        reference = position if setpoint is None else setpoint.position
        command = self._active_command()
        return Telemetry(
            now, self.homed, position, self._observer.velocity, self._observer.acceleration,
            self._model.force(reading.current, self._observer.velocity), reference, reference - position,
            self._output.duty, self._output.disabled, reading.current, reading.switches, self._output.light,
            int(self.mode), int(self.fault), self.fault_text, command, now - self._begun if command else 0.0,
        )  # fmt: skip
