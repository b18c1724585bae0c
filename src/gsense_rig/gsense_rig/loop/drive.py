"""The three things that the motor can be told in a period: follow a setpoint, brake, be off."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from gsense_rig.control.controllers import Measured, make_controller
from gsense_rig.safety.brake import Brake
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from gsense_rig.control.references import Setpoint
    from gsense_rig.loop.axis import Axis
    from gsense_rig.loop.parameters import LoopParameters


class Bridge(NamedTuple):
    """What the bridge is told."""

    duty: float  # -1..1
    disabled: bool


OFF = Bridge(0.0, True)
BLIND = (Fault.ENCODER, Fault.HARDWARE)  # faults after which the encoder cannot tell that the carriage stands


class Drive:
    """Controller and brake of one axis.

    Attributes:
        setpoint: what is followed in this period; None: nothing is controlled.
        brake: the stop that ends in DIS.
    """

    def __init__(self, axis: Axis, parameters: LoopParameters) -> None:
        self.setpoint: Setpoint | None = None
        self.brake = Brake(parameters.brake)
        self._axis = axis
        self._period = parameters.period
        self._controller = make_controller(parameters.controller, parameters.model, parameters.tuned)

    def use_model(self, parameters: LoopParameters) -> None:
        """Take over another belief about the drive."""
        self._controller = make_controller(parameters.controller, parameters.model, parameters.tuned)

    def prepare(self) -> None:
        """Begin a motion: no brake, no memory of the last one."""
        self.brake.release()
        self._controller.reset()

    def follow(self, setpoint: Setpoint) -> Bridge:
        """Control towards a setpoint."""
        self.setpoint = setpoint
        axis = self._axis
        measured = Measured(axis.position, axis.observer.position, axis.observer.velocity)
        return Bridge(axis.model.duty(self._controller.voltage(setpoint, measured, self._period)), False)

    def braking(self, now: float, fault: Fault) -> Bridge:
        """Brake until standstill at a time [s], then off; which speeds are trusted depends on the fault."""
        self.setpoint = None
        axis, drive = self._axis, self._axis.model.drive
        if not self.brake.update(now, axis.observer.velocity, blind=fault in BLIND):
            return OFF
        voltage = self.brake.voltage(now, self._speeds(fault), drive.force_constant, drive.resistance)
        return Bridge(axis.model.duty(voltage), False)

    def _speeds(self, fault: Fault) -> tuple[float, ...]:
        """Speed by the encoder and by the motor's back EMF [m/s], as far as the fault leaves them trustworthy."""
        encoder, emf = self._axis.observer.velocity, self._axis.emf_speed
        if fault is Fault.ENCODER:
            return () if emf is None else (emf,)
        if fault in (Fault.OVERCURRENT, Fault.HARDWARE) or emf is None:
            return (encoder,)
        return (encoder, emf)

    def off(self) -> Bridge:
        """Motor off."""
        self.setpoint = None
        return OFF
