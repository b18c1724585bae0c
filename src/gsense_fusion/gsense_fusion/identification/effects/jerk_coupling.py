"""The gyro feels the rate of change of the specific force."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, along_sign, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.effects.fast_mode import fast_jerk, fast_response, mode_fields, mode_templates
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.types import ComplexArray, FloatArray, Owner


class JerkCoupling(Effect):
    """K_j f': a coupling through capacitances or a fast mode of the element; it turns with the board."""

    name = "jerk_coupling"
    owner = Owner.SENSOR
    equation = "K_j df/dt"
    source = "first order of any fast linear response to acceleration"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^3)", 1e-5)
    fields = mode_fields(name)
    family = "fast"
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Jerk on each axis, through the fast mode where the model has it, shape (n, 3, 3)."""
        return per_axis(along_sign(drivers) * fast_jerk(self.name, drivers))

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray:
        """What it makes of a vibration along the rail."""
        answer = along_sign(drivers) * fast_response(self.name, drivers, frequency_hz)
        return np.asarray(answer[:, None, None] * np.eye(3))


class FastMode(Shape):
    """The coupling is late or has a corner: its own column goes through a mode."""

    name = "jerk_coupling_mode"
    shaped = JerkCoupling
    equation = "df/dt through 1 / (1 + i w lag - (f / f0)^2)"
    source = "second order of the same response"
    templates = mode_templates(JerkCoupling.name)
