"""True turns of the carriage: one angle makes the gyro's rate and turns gravity in the accelerometer.

A pick-up in the gyro does the first without the second: that tells the two apart without turning the board.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, about_rail_axes, lacks_direction
from gsense_fusion.identification.effects.design import Design, Mixed
from gsense_fusion.identification.types import FloatArray, Owner


class TrueTurn(Effect):
    """The carriage turns about the rail's axes by a parameter times one angle."""

    owner = Owner.RIG
    separating_run: ClassVar[str | None] = "board_turned_180"
    along_path: ClassVar[bool] = False
    """The turn is that of the carriage's path (a bent rail): then the path's curvature is felt as well."""

    @abstractmethod
    def angle(self, drivers: Drivers) -> FloatArray:
        """Turn per unit of the parameters, rad, shape (n,); any constant may be added."""

    @abstractmethod
    def rate(self, drivers: Drivers) -> FloatArray:
        """Derivative of the angle by time, rad/s per unit, shape (n,)."""

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> Design:
        """The rate about the rail's axes, shape (n, 3, 3)."""
        return about_rail_axes(drivers, self.rate(drivers))

    def felt(self, drivers: Drivers) -> Mixed | None:
        """Change of the specific force by turns about the rail's axes, shape (n, 3, 3).

        In the turned carriage gravity's reaction g is g - theta x g. Along a bent path the carriage's own x axis stays
        tangent; the acceleration towards the centre of the bend, (theta' x e_x) v^2, is new. Off the path the turned
        acceleration is a product of motions, which levers and the sensor's own squares make too: not used.
        """
        mounting, kin = drivers.mounting, drivers.kinematics
        if mounting is None or mounting.along is None or mounting.sensor_from_rail is None:
            return None
        series = [self.angle(drivers)]
        spread = [np.cross(mounting.gravity * mounting.up, mounting.sensor_from_rail, axisb=0).T]
        if self.along_path:
            series.append(self.rate(drivers) * kin.velocity)
            spread.append(np.cross(mounting.sensor_from_rail, mounting.along, axisa=0).T)
        return Mixed(np.stack(series), np.stack(spread))
