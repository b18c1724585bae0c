"""The three things that the motor can be told in a period: follow a setpoint, brake, be off."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from gsense_rig.control.controllers import Measured, make_controller
from gsense_rig.safety.brake import Brake

if TYPE_CHECKING:
    from gsense_rig.control.references import Setpoint
    from gsense_rig.loop.axis import Axis
    from gsense_rig.loop.parameters import LoopParameters


class Bridge(NamedTuple):
    """What the bridge is told."""

    duty: float  # -1..1
    disabled: bool


OFF = Bridge(0.0, True)


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

    def braking(self, now: float, blind: bool) -> Bridge:
        """Brake until standstill at a time [s], then off; blind: the velocity cannot be trusted."""
        self.setpoint = None
        if self.brake.update(now, self._axis.observer.velocity, blind=blind):
            return Bridge(0.0, False)
        return OFF

    def off(self) -> Bridge:
        """Motor off."""
        self.setpoint = None
        return OFF
