"""Viscous drag tilts the carriage: a true tilt in proportion to the speed."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, spec
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import FloatArray


class ViscousTilt(TrueTurn):
    """True tilt c v about the rail's axes, so a true rate c a: in one mounting the gyro alone takes it for G."""

    name = "viscous_tilt"
    equation = "R c a"
    source = "lubricated bearings of a carriage that is pulled beside its drag"
    parameters = spec("c_x c_y c_z", "rad/(m/s)", 3e-4)
    rarity = 10.0
    family = "fast"
    separates = MappingProxyType({"g_sensitivity": "board_turned_180"})

    def angle(self, drivers: Drivers) -> FloatArray:
        """The velocity."""
        return drivers.kinematics.velocity

    def rate(self, drivers: Drivers) -> FloatArray:
        """The acceleration that G has too, with what rings above the drive: else that would tell the two apart."""
        mounting, force = drivers.mounting, drivers.specific_force
        if mounting is None or mounting.along is None or force is None:
            return drivers.kinematics.acceleration
        return np.asarray((force - mounting.gravity * mounting.up) @ mounting.along)
