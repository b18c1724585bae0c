"""A bent rail: the carriage truly turns as it moves."""

from __future__ import annotations

from functools import reduce
from typing import ClassVar

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, spec
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import FloatArray

USUAL_STROKE_M = 0.15
HIGHEST_POWER = 10
"""Of the position: a wave of 10 cm on a stroke of 30 cm; shorter ones are seen as belt_tooth or unexplained."""


class RailCurvature(TrueTurn):
    """True rotation theta(s) = t s + u s^2 about the rail's axes, so a true rate theta'(s) v (and gravity tilts)."""

    name = "rail_curvature"
    equation = "R (t + 2 u s) v"
    source = "geometry of a bowed or twisted rail; 0.1 mm sag on 0.6 m is 0.13 deg/m"
    parameters = spec("t_x t_y t_z", "rad/m", 1e-2)
    along_path = True

    def angle(self, drivers: Drivers) -> FloatArray:
        """The position."""
        return drivers.kinematics.position

    def rate(self, drivers: Drivers) -> FloatArray:
        """The velocity."""
        return drivers.kinematics.velocity


class RailBend(TrueTurn):
    """The part of the rail's rotation that grows with the square of the position."""

    name = "rail_bend"
    equation = "R 2 u s v"
    source = RailCurvature.source
    parameters = spec("u_x u_y u_z", "rad/m^2", 3e-2)
    needs = ("rail_curvature",)
    part_of = "rail_curvature"
    refines = True
    separating_run = None
    along_path = True

    def angle(self, drivers: Drivers) -> FloatArray:
        """The position squared."""
        return drivers.kinematics.position**2

    def rate(self, drivers: Drivers) -> FloatArray:
        """Twice position times velocity."""
        return 2 * drivers.kinematics.position * drivers.kinematics.velocity


class RailWave(TrueTurn):
    """A higher power of the position in the rail's rotation: real rails are uneven over a hand's breadth.

    Each power is in a model only where the search bought it; several may be missing between two that are there.
    """

    equation = "R n w s^(n-1) v"
    source = "straightness of linear rails, which varies over their length; supports a few centimetres apart"
    needs = ("rail_curvature",)
    part_of = "rail_curvature"
    bought = True
    separating_run = None
    along_path = True
    power: ClassVar[int]

    def angle(self, drivers: Drivers) -> FloatArray:
        """The position's power."""
        return _power(drivers.kinematics.position, self.power)

    def rate(self, drivers: Drivers) -> FloatArray:
        """Its derivative by time, as the gyro's filter leaves the high orders that it has."""
        kin = drivers.kinematics
        rate = self.power * kin.velocity * _power(kin.position, self.power - 1)
        if drivers.response is None:
            return rate
        return drivers.response.passed(rate, 1.0 / drivers.step_s)


def _power(series: FloatArray, exponent: int) -> FloatArray:
    """As `**`, which takes logarithms."""
    return reduce(np.multiply, [series] * exponent)


def wave(power: int) -> RailWave:
    """The term of one power.

    Its plausible size is that of the leading coefficient of a ripple (a Chebyshev polynomial) over a usual stroke.
    """
    plausible = 1e-2 * 2 ** (power - 2) / (power * USUAL_STROKE_M ** (power - 1))
    made: type[RailWave] = type(
        f"RailWave{power}",
        (RailWave,),
        {
            "name": f"rail_wave_{power}",
            "parameters": spec(" ".join(f"w{power}_{x}" for x in "xyz"), f"rad/m^{power}", plausible),
            "power": power,
            "__module__": __name__,
        },
    )
    return made()
