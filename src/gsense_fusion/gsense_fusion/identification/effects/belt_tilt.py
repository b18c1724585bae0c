"""The belt pulls above the centre of the carriage: it truly tilts with the acceleration."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, spec
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import FloatArray


class BeltTilt(TrueTurn):
    """True tilt c a about the rail's axes, so a true rate c j."""

    name = "belt_tilt"
    equation = "R c j"
    source = "statics of a carriage on elastic bearings pulled beside its centre of mass"
    parameters = spec("c_x c_y c_z", "rad/(m/s^2)", 1e-5)

    def angle(self, drivers: Drivers) -> FloatArray:
        """The acceleration: what the accelerometer feels of it, its own misalignment can imitate."""
        return drivers.kinematics.acceleration

    def rate(self, drivers: Drivers) -> FloatArray:
        """The jerk."""
        return drivers.kinematics.jerk
