"""Cubic g-sensitivity: first and third order of the drive, in phase with the acceleration."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, along_sign, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class GCubed(Effect):
    """c a^3, with the sign of the acceleration in the sensor's axes."""

    name = "g_cubed"
    memoryless = True
    owner = Owner.SENSOR
    equation = "c a^3"
    source = "IEEE Std 1431: odd higher orders of acceleration sensitivity"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^2)^3", 2e-6)
    separating_run = "small_stroke"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Cubed acceleration on each axis, shape (n, 3, 3)."""
        return per_axis(along_sign(drivers) * drivers.acceleration**3)
