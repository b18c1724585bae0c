"""The belt pulls above the centre of the carriage: it truly tilts with the acceleration."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, about_rail_axes, lacks_direction, spec
from gsense_fusion.identification.types import FloatArray, Owner


class BeltTilt(Effect):
    """True tilt c a about the rail's axes, so a true rate c j."""

    name = "belt_tilt"
    owner = Owner.RIG
    equation = "R c j"
    source = "statics of a carriage on elastic bearings pulled beside its centre of mass"
    parameters = spec("c_x c_y c_z", "rad/(m/s^2)", 1e-5)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Jerk about the rail's axes, shape (n, 3, 3)."""
        return about_rail_axes(drivers, drivers.kinematics.jerk)
