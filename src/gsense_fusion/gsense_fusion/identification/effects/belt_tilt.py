"""The belt pulls above the centre of the carriage: it truly tilts with the acceleration."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, spec
from gsense_fusion.identification.effects.fast_mode import fast_jerk, fast_response, mode_fields, mode_templates
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import ComplexArray, FloatArray


class BeltTilt(TrueTurn):
    """True tilt c a about the rail's axes, so a true rate c j."""

    name = "belt_tilt"
    equation = "R c j"
    source = "statics of a carriage on elastic bearings pulled beside its centre of mass"
    parameters = spec("c_x c_y c_z", "rad/(m/s^2)", 1e-5)
    fields = mode_fields(name)
    family = "fast"

    def angle(self, drivers: Drivers) -> FloatArray:
        """The acceleration: what the accelerometer feels of it, its own misalignment can imitate."""
        return drivers.kinematics.acceleration

    def rate(self, drivers: Drivers) -> FloatArray:
        """The jerk, with the belt's ringing, through the bearings' mode where the model has it."""
        return fast_jerk(self.name, drivers)

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray | None:
        """What it makes of a vibration along the rail."""
        mounting = drivers.mounting
        if mounting is None or mounting.sensor_from_rail is None:
            return None
        return np.asarray(fast_response(self.name, drivers, frequency_hz)[:, None, None] * mounting.sensor_from_rail)


class BearingMode(Shape):
    """The carriage rings on its bearings: the tilt's own column goes through the mode.

    What the accelerometer feels of the tilt, at the drive's first orders, changes too little to need it.
    """

    name = "belt_tilt_mode"
    shaped = BeltTilt
    equation = "the tilt through 1 / (1 + i w lag - (f / f0)^2)"
    source = "a carriage of a kilogram on preloaded bearings: 30 to 50 Hz"
    templates = mode_templates(BeltTilt.name)
