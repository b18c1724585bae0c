"""The gyro's samples are later than the accelerometer's."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, TemplateSpec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner


class TimeOffset(Effect):
    """G f(t - tau): everything that the gyro shows of the motion comes tau later than in the accelerometer.

    It has no regressors of its own: tau shifts those of the other effects. A delay common to the whole IMU is not a
    finding.
    """

    name = "time_offset"
    owner = Owner.CHAIN
    equation = "G f(t - tau)"
    source = "unequal filters, FIFO ages or bus reads of gyro and accelerometer; 0.4 to 40 ms"
    parameters = ()
    templates = (
        TemplateSpec(
            "tau",
            "s",
            "gyro_delay_s",
            (-0.02, 0.0, 0.02, 0.06),
            -0.05,
            0.15,
            0.02,
            owns_effect=True,
        ),
    )
    needs = ("g_sensitivity",)
    family = "fast"
    separating_run = None

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion, and the accelerometer as the other clock."""
        if not drivers.kinematics.velocity.any():
            return "no motion along a rail"
        return "no accelerometer: nothing to compare the gyro's time with" if drivers.force is None else None

    def design(self, drivers: Drivers) -> Design:
        """No columns, shape (n, 3, 0)."""
        return np.zeros((len(drivers), 3, 0))
