"""A bent rail: the carriage truly turns as it moves."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, about_rail_axes, lacks_direction, spec
from gsense_fusion.identification.types import FloatArray, Owner


class RailCurvature(Effect):
    """True rotation theta(s) = t s + u s^2 about the rail's axes, so a true rate theta'(s) v (and gravity tilts)."""

    name = "rail_curvature"
    owner = Owner.RIG
    equation = "R (t + 2 u s) v"
    source = "geometry of a bowed or twisted rail; 0.1 mm sag on 0.6 m is 0.13 deg/m"
    parameters = spec("t_x t_y t_z", "rad/m", 1e-2)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Velocity about the rail's axes, shape (n, 3, 3)."""
        return about_rail_axes(drivers, drivers.kinematics.velocity)


class RailBend(Effect):
    """The part of the rail's rotation that grows with the square of the position."""

    name = "rail_bend"
    owner = Owner.RIG
    equation = "R 2 u s v"
    source = RailCurvature.source
    parameters = spec("u_x u_y u_z", "rad/m^2", 3e-2)
    needs = ("rail_curvature",)
    part_of = "rail_curvature"

    def missing(self, drivers: Drivers) -> str | None:
        """What the rail's curvature needs."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Twice position times velocity about the rail's axes, shape (n, 3, 3)."""
        kin = drivers.kinematics
        return about_rail_axes(drivers, 2 * kin.position * kin.velocity)
