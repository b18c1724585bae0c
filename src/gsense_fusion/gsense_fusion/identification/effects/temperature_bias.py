"""Bias that follows the die's temperature."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, TemplateSpec, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class TemperatureBias(Effect):
    """c (T - T0); the lag of the mechanical element behind the die's thermometer is refined as a template."""

    name = "temperature_bias"
    owner = Owner.SENSOR
    equation = "c (T - T0)"
    source = "InvenSense PS-MPU-6000A-00 rev 3.4: zero-rate output over temperature +-20 deg/s over -40 to 85 degC"
    parameters = spec("c_x c_y c_z", "rad/s/K", 3e-3)
    templates = (
        TemplateSpec("lag_s", "s", "temperature_lag_s", (0.0, 8.0, 25.0, 70.0), 0.0, 120.0, 5.0, optional=True),
    )
    dynamic = False
    slow = True
    separating_run = "temperature_soak"
    every_run = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the die's temperature."""
        return "no temperature topic" if drivers.temperature is None else None

    def design(self, drivers: Drivers) -> Design:
        """Temperature on each axis, shape (n, 3, 3)."""
        temperature = drivers.temperature
        return per_axis(np.zeros(len(drivers)) if temperature is None else temperature)
