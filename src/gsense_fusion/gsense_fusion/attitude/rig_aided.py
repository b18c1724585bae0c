"""The bounded-motion filter fed with a specific force that is free of the carriage's acceleration (see `carriage`).

What is left to expect of the velocity is small, so the tilt is followed more closely than in free motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

from .bounded import Bounded, BoundedParameters


@dataclass(frozen=True)
class RigAidedParameters(BoundedParameters):
    """As of the bounded filter; the motion that is left is that of the rail's imperfections."""

    rate_density: float = radians(0.01)
    """rad/s/sqrt(Hz), noise of the gyro at rest."""
    rate_scale: float = 0.001
    """1/sqrt(Hz)."""
    force_density: float = 0.02
    """m/s^2/sqrt(Hz), noise of the accelerometer, and vibration that the encoder does not see."""
    force_scale: float = 0.01
    """1/sqrt(Hz)."""
    bias_density: float = radians(0.001)
    """rad/s/sqrt(s)."""
    velocity_density: float = 0.05
    """m/s sqrt(s): what the encoder's acceleration leaves."""
    rest_rate: float = radians(1.0)
    """rad/s."""
    rest_s: float = 1e9
    """s: in motion at constant speed, nothing tells a still board from one with a bias that acceleration made."""


class RigAided(Bounded):
    """To be fed with the cleaned specific force."""

    name = "rig_aided"
