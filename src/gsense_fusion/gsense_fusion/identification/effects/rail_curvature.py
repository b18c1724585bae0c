"""A bent rail: the carriage truly turns as it moves."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, spec
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import FloatArray


class RailCurvature(TrueTurn):
    """True rotation theta(s) = t s + u s^2 about the rail's axes, so a true rate theta'(s) v (and gravity tilts)."""

    name = "rail_curvature"
    equation = "R (t + 2 u s) v"
    source = "geometry of a bowed or twisted rail; 0.1 mm sag on 0.6 m is 0.13 deg/m"
    parameters = spec("t_x t_y t_z", "rad/m", 1e-2)
    along_path = True

    def angle(self, drivers: Drivers) -> FloatArray:
        """The position."""
        return drivers.kinematics.position

    def rate(self, drivers: Drivers) -> FloatArray:
        """The velocity."""
        return drivers.kinematics.velocity


class RailBend(TrueTurn):
    """The part of the rail's rotation that grows with the square of the position."""

    name = "rail_bend"
    equation = "R 2 u s v"
    source = RailCurvature.source
    parameters = spec("u_x u_y u_z", "rad/m^2", 3e-2)
    needs = ("rail_curvature",)
    part_of = "rail_curvature"
    separating_run = None
    along_path = True

    def angle(self, drivers: Drivers) -> FloatArray:
        """The position squared."""
        return drivers.kinematics.position**2

    def rate(self, drivers: Drivers) -> FloatArray:
        """Twice position times velocity."""
        return 2 * drivers.kinematics.position * drivers.kinematics.velocity
