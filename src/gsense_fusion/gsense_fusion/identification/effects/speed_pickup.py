"""The motor's back-EMF gets into the measuring chain."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class SpeedPickup(Effect):
    """c v on each axis, with no real rotation; it does not turn with the board."""

    name = "speed_pickup"
    owner = Owner.CHAIN
    equation = "c v"
    source = "back-EMF of a DC motor through a shared supply or ground"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s)", 3e-3)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Velocity on each axis, shape (n, 3, 3)."""
        return per_axis(drivers.kinematics.velocity)
