"""The last half minute: residual, specific force and encoder, and what the carriage did meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.motion.carriage import CarriageMotion, Interval
from gsense_fusion.identification.motion.mounting import Mounting, force_geometry
from gsense_fusion.identification.types import FloatArray

MIN_PERIODS = 4.0
MIN_STEADY_S = 6.0
EDGE_S = 0.2
SAME_UP_RAD = 0.09
"""A board whose gravity turned by more (5 degrees) was mounted anew."""


@dataclass(frozen=True)
class Samples:
    """What came in; n samples of the IMU, m of the encoder; rows in the order of their stamps."""

    time: FloatArray
    """s, shape (n,)."""
    residual: FloatArray
    """rad/s, shape (n, 3)."""
    specific_force: FloatArray
    """m/s^2, shape (n, 3); NaN where not reported."""
    encoder_time: FloatArray
    """s, shape (m,)."""
    position: FloatArray
    """m, shape (m,)."""


@dataclass(frozen=True)
class Steady:
    """A stretch of the window in which the carriage swings steadily, or stands."""

    time: FloatArray
    """s, shape (k,), evenly spaced as far as nothing is lost."""
    residual: FloatArray
    """rad/s, shape (k, 3), less the rig's true rotations that the file knows."""
    angular_frequency: float | None
    """Of the drive, rad/s; None: at rest."""
    drivers: Drivers
    up: FloatArray | None
    """Direction of the specific force without the drive, sensor axes; None without accelerometer."""

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return 1.0 / float(np.median(np.diff(self.time)))

    @property
    def moving(self) -> bool:
        """Whether the carriage swings."""
        return self.angular_frequency is not None

    @property
    def duration(self) -> float:
        """Length in s."""
        return float(self.time[-1] - self.time[0])


def steady_part(samples: Samples) -> Steady | None:
    """The steady motion or the rest that reaches to the window's end; None in ramps and where too little came."""
    if len(samples.encoder_time) < 50 or len(samples.time) < 100:
        return None
    motion = CarriageMotion(samples.encoder_time, samples.position)
    end = min(float(samples.encoder_time[-1]), float(samples.time[-1]))
    if motion.harmonics is not None and motion.steady is not None:
        needed = max(MIN_STEADY_S, MIN_PERIODS * 2 * np.pi / motion.harmonics.angular_frequency)
        if motion.steady.duration >= needed and motion.steady.stop > end - 1.0:
            return _moving(samples, motion, motion.steady)
    still = [i for i in motion.still if i.duration >= MIN_STEADY_S and i.stop > end - 1.0]
    return _resting(samples, motion, still[-1].start, still[-1].stop) if still else None


def _moving(samples: Samples, motion: CarriageMotion, steady: Interval) -> Steady | None:
    geometry = force_geometry(samples.time, samples.specific_force, motion)
    late = 0.0 if geometry.delay is None else geometry.delay.value
    inside = _between(samples.time, steady.start + late + EDGE_S, steady.stop + late - EDGE_S)
    if inside.sum() < 100:
        return None
    time = samples.time[inside]
    kinematics = motion.at(time - late)
    mounting = None
    force = None
    if np.isfinite(geometry.mean_force).all():
        norm = float(np.linalg.norm(geometry.mean_force))
        along = None if geometry.along is None else geometry.along / np.linalg.norm(geometry.along)
        mounting = Mounting(geometry.mean_force / norm, along, norm)
        force = np.repeat(geometry.mean_force[None], len(time), axis=0)
        if along is not None:
            force = force + kinematics.acceleration[:, None] * along
    drivers = Drivers(kinematics, mounting, force, None, time)
    up = None if mounting is None else mounting.up
    return Steady(time, samples.residual[inside], motion.angular_frequency, drivers, up)


def _resting(samples: Samples, motion: CarriageMotion, start: float, stop: float) -> Steady | None:
    inside = _between(samples.time, start + EDGE_S, stop - EDGE_S)
    if inside.sum() < 100:
        return None
    time = samples.time[inside]
    force = samples.specific_force[inside].mean(axis=0)
    norm = float(np.linalg.norm(force))
    up = force / norm if np.isfinite(norm) and norm > 1.0 else None
    mounting = None if up is None else Mounting(up, None, norm)
    drivers = Drivers(motion.at(time), mounting, None, None, time)
    return Steady(time, samples.residual[inside], None, drivers, up)


def _between(time: FloatArray, start: float, stop: float) -> FloatArray:
    return np.asarray((time >= start) & (time <= stop))


def same_mounting(a: FloatArray | None, b: FloatArray | None) -> bool:
    """Whether two directions of gravity are of one mounting."""
    if a is None or b is None:
        return True
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)) < SAME_UP_RAD
