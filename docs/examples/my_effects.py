"""An effect of one's own: `close_loop --effects my_effects.py`. Every subclass of Effect in the file is tried."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, lacks_motion, per_axis, spec
from gsense_fusion.identification.types import FloatArray, Owner


class BearingRumble(Effect):
    """c v^2 on each axis: the bearings' vibration grows with the speed, and the gyro rectifies it."""

    name = "bearing_rumble"
    owner = Owner.SENSOR
    equation = "c v^2"
    source = "vibration rectification; the bearings' vibration is in proportion to the speed"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s)^2", 1e-3)  # the last number: a size that nobody would wonder at

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail; without it, the report says so."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Derivative of the gyro's axes by c_x, c_y, c_z: shape (n, 3, 3)."""
        return per_axis(drivers.kinematics.velocity**2)
