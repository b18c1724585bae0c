"""Vibration rectification: the mean rate and the second order follow the square of the acceleration."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class GSquared(Effect):
    """c a^2, the same whichever way the board is turned: mean and second order of the drive."""

    name = "g_squared"
    owner = Owner.SENSOR
    equation = "c a^2"
    source = "IEEE Std 1431: g^2 sensitivity (vibration rectification); 0.0004 to 0.1 deg/s/g^2"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^2)^2", 2e-5)
    separating_run = "small_stroke"
    slow = True
    memoryless = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Squared acceleration on each axis, shape (n, 3, 3)."""
        return per_axis(drivers.acceleration**2)
