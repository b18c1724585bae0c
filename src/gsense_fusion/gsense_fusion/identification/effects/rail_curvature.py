"""A bent rail: the carriage truly turns as it moves."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, spec
from gsense_fusion.identification.types import FloatArray, Owner


class RailCurvature(Effect):
    """True rotation theta(s) = t s + u s^2 about the rail's axes, so a true rate theta'(s) v (and gravity tilts)."""

    name = "rail_curvature"
    owner = Owner.RIG
    equation = "R (t + 2 u s) v"
    source = "geometry of a bowed or twisted rail; 0.1 mm sag on 0.6 m is 0.13 deg/m"
    parameters = spec("t_x t_y t_z", "rad/m", 1e-2) + spec("u_x u_y u_z", "rad/m^2", 3e-2)
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        if not drivers.kinematics.velocity.any():
            return "no motion along a rail"
        if drivers.mounting is None or drivers.mounting.sensor_from_rail is None:
            return "no accelerometer: the rail's direction in the sensor's axes is unknown"
        return None

    def design(self, drivers: Drivers) -> FloatArray:
        """Rail-frame rotation rates turned into the sensor's axes, shape (n, 3, 6)."""
        out = np.zeros((len(drivers), 3, 6))
        rotation = None if drivers.mounting is None else drivers.mounting.sensor_from_rail
        if rotation is None:
            return out
        v, s = drivers.kinematics.velocity, drivers.kinematics.position
        out[:, :, :3] = v[:, None, None] * rotation[None]
        out[:, :, 3:] = (2 * s * v)[:, None, None] * rotation[None]
        return out
