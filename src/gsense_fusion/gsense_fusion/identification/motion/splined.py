"""A motion known at instants, and in between by a spline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.types import FloatArray


@dataclass(frozen=True, eq=False)
class Splined:
    """Position, speed, acceleration and jerk along the rail; all of them zero beyond the record."""

    start: float
    stop: float
    """s."""
    spline: CubicSpline
    """Of the four, over time in s."""

    @classmethod
    def of(cls, time: FloatArray, series: FloatArray) -> Splined:
        """Through the four series (n, 4) at the times (n,) in s, increasing."""
        return cls(float(time[0]), float(time[-1]), CubicSpline(time, series))

    def added_to(self, motion: Kinematics, time: FloatArray) -> Kinematics:
        """The motion at the times (n,) with this one on top."""
        inside = (time >= self.start) & (time <= self.stop)
        mine = np.where(inside[:, None], self.spline(np.clip(time, self.start, self.stop)), 0.0).T
        own = (motion.position, motion.velocity, motion.acceleration, motion.jerk)
        return Kinematics(*(a + b for a, b in zip(own, mine, strict=True)))
