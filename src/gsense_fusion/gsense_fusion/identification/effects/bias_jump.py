"""The bias steps once (a background calibration)."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, TemplateSpec, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner

HANDLED = "without a rig a step of the bias cannot be told from what handling the board does"


class BiasJump(Effect):
    """A step of the bias at t0."""

    name = "bias_jump"
    owner = Owner.SENSOR
    equation = "d (t > t0)"
    source = "BNO055 datasheet: background calibration of the gyro's offset"
    parameters = spec("d_x d_y d_z", "rad/s", 1e-2)
    templates = (TemplateSpec("t0", "s", "jump_time_s", (), 0.0, 1e9, 1.0, gaps=True),)
    dynamic = False
    slow = True
    separating_run = "long_rest"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs a board that nobody handles: on the rig."""
        return None if drivers.mounting is not None and drivers.mounting.along is not None else HANDLED

    def design(self, drivers: Drivers) -> Design:
        """Zero before, one after the instant, on each axis, shape (n, 3, 3)."""
        return per_axis((drivers.time > drivers.templates.get("jump_time_s")).astype(float))
