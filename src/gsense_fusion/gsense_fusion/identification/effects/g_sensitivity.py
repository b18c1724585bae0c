"""Linear g-sensitivity of the gyro."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, spec
from gsense_fusion.identification.effects.design import Design, Mixed, RailForce
from gsense_fusion.identification.types import Owner

EACH_AXIS = np.eye(9).reshape(3, 3, 9).transpose(1, 0, 2)
"""Force j makes g_ij of axis i, shape (3 forces, 3 axes, 9)."""


class GSensitivity(Effect):
    """G f: angular rate in proportion to the specific force (thesis ch. 3.10; its eq. 7.4 is one constrained G)."""

    name = "g_sensitivity"
    owner = Owner.SENSOR
    equation = "G f"
    source = "thesis eq. 7.4; Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation, ch. 4"
    parameters = spec("g_xx g_xy g_xz g_yx g_yy g_yz g_zx g_zy g_zz", "(rad/s)/(m/s^2)", 3e-4)
    separating_run = "board_turned_180"
    every_run = True
    slow = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the accelerometer, for the mounting."""
        return "no accelerometer: the direction of the specific force is unknown" if drivers.force is None else None

    def design(self, drivers: Drivers) -> Design:
        """Row i of G times the specific force, shape (n, 3, 9)."""
        force = drivers.force
        if isinstance(force, RailForce):
            return Mixed(force.series, np.tensordot(force.spread, EACH_AXIS, axes=1))
        series = np.zeros((3, len(drivers))) if force is None else np.ascontiguousarray(force.T)
        return Mixed(series, EACH_AXIS)
