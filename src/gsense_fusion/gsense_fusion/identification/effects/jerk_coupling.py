"""The gyro feels the rate of change of the specific force."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, along_sign, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class JerkCoupling(Effect):
    """K_j f': a coupling through capacitances or a fast mode of the element; it turns with the board."""

    name = "jerk_coupling"
    owner = Owner.SENSOR
    equation = "K_j df/dt"
    source = "first order of any fast linear response to acceleration"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^3)", 1e-5)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Jerk on each axis, shape (n, 3, 3)."""
        return per_axis(along_sign(drivers) * drivers.kinematics.jerk)
