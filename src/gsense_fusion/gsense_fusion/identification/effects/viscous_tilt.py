"""Viscous drag tilts the carriage: a true tilt in proportion to the speed."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, about_rail_axes, lacks_direction, spec
from gsense_fusion.identification.types import FloatArray, Owner


class ViscousTilt(Effect):
    """True tilt c v about the rail's axes, so a true rate c a: in one mounting it hides wholly in G."""

    name = "viscous_tilt"
    owner = Owner.RIG
    equation = "R c a"
    source = "lubricated bearings of a carriage that is pulled beside its drag"
    parameters = spec("c_x c_y c_z", "rad/(m/s)", 3e-4)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Acceleration about the rail's axes, shape (n, 3, 3)."""
        return about_rail_axes(drivers, drivers.kinematics.acceleration)
