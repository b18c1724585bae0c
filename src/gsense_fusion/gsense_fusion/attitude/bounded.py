"""A filter of our own: error-state Kalman filter for motion that stays in its place.

What an accelerometer low-pass (VQF, complementary) assumes is that accelerations average out. What makes them average
out is that velocity stays bounded: a hand, a head, a carriage on a rail does not leave. So the specific force is turned
into the earth frame and integrated to a velocity, and the velocity is expected to be about zero. A tilt error makes it
grow steadily, motion does not; the filter finds the tilt and the gyro's bias from the difference. In still stretches
the rate itself measures the bias.

Error state: tilt about east and north, bias (3, body), velocity (3, earth); the heading is not observable from gravity
and is no state. Between samples the attitude follows the gyro; the covariance and the corrections go in steps of
`step_s`. The noise of the rate grows with the rate (scale, misalignment), that of the specific force with the
acceleration. The equations are those of an inertial navigation system aided by zero velocity (P. Groves, "Principles
of GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd ed., chapters 5, 14 and 15), with an expectation
in place of a known standstill.

The heading is an angle between the filter's earth frame and ENU, which follows the horizontal field with a time
constant (faster at first); fields whose strength or dip are off are not used, until they stay.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import radians

import numpy as np

from . import bounded_kernels as kernels
from .bounded_memory import Cell
from .compiled import CompiledFilter, require_not_negative, require_positive, unit_quaternion
from .interface import FloatArray


@dataclass(frozen=True)
class BoundedParameters:
    """Noise of sensor and motion.

    The seven densities and scales are what a search chooses on simulated motion (`tests/study/bounded.py`); they are
    larger or smaller than the sensor's own where they also stand for what the model lacks.
    """

    rate_density: float = radians(0.08)
    """rad/s/sqrt(Hz), noise of the gyro at rest."""
    rate_scale: float = 0.00045
    """1/sqrt(Hz): the same per rad/s of rate (scale error, misalignment)."""
    force_density: float = 0.003
    """m/s^2/sqrt(Hz), noise of the accelerometer at rest."""
    force_scale: float = 0.0006
    """1/sqrt(Hz): the same per m/s^2 of acceleration."""
    bias_density: float = radians(0.003)
    """rad/s/sqrt(s): how fast the bias wanders."""
    velocity_density: float = 0.25
    """m/s sqrt(s): how bounded the motion is. Small: trusts that it is (hand, rail); large: for what travels."""
    rest_bias_density: float = radians(0.002)
    """rad/s sqrt(s): how well the mean rate in a still stretch is the bias."""
    rest_rate: float = radians(2.0)
    """rad/s: a stretch is still while the rate stays this near to its low-pass."""
    rest_force: float = 0.5
    """m/s^2: and the specific force to its own."""
    rest_s: float = 1.5
    """s: and both for this long."""
    step_s: float = 0.019
    """s, least time between two corrections."""
    gravity: float = 9.81
    """m/s^2; what the accelerometer itself reads in still stretches takes its place."""
    initial_tilt_deviation: float = radians(0.5)
    """rad."""
    initial_bias_deviation: float = radians(0.1)
    """rad/s."""
    heading_tau_s: float = 9.0
    """s, time constant of the heading's correction."""
    field_strength: float = 0.1
    """Largest relative difference of an undisturbed field's strength from its reference."""
    field_dip: float = radians(10.0)
    """rad, the same for its dip."""
    field_new_s: float = 20.0
    """s: a field that is off for this long, and steady, becomes the new reference."""

    def __post_init__(self) -> None:
        values = {item.name: float(getattr(self, item.name)) for item in fields(self)}
        positive = ("velocity_density", "rest_bias_density", "gravity", "heading_tau_s", "field_new_s")
        require_positive("bounded", **{key: values.pop(key) for key in positive})
        require_not_negative("bounded", **values)


@dataclass
class BoundedState:
    """What the filter remembers: one array, whose cells `bounded_memory.Cell` names."""

    memory: FloatArray

    @property
    def bias(self) -> FloatArray:
        """rad/s, shape (3,): what is left of the gyro's bias in the rate handed over."""
        return self.memory[Cell.BIAS : Cell.BIAS + 3].copy()

    @property
    def velocity(self) -> FloatArray:
        """m/s in the filter's earth frame, shape (3,)."""
        return self.memory[Cell.VELOCITY : Cell.VELOCITY + 3].copy()

    @property
    def still(self) -> bool:
        """Whether the newest sample belongs to a still stretch."""
        return bool(self.memory[Cell.STILL_FOR] >= self.memory[Cell.REST_S])


class Bounded(CompiledFilter):
    """Bounded-motion error-state Kalman filter, compiled."""

    name = "bounded"
    _imu = staticmethod(kernels.imu)
    _field = staticmethod(kernels.field)
    _batch = staticmethod(kernels.batch)

    def __init__(self, parameters: BoundedParameters | None = None, state: BoundedState | None = None) -> None:
        super().__init__(np.zeros(Cell.END))
        self.parameters = parameters or BoundedParameters()
        self._set_gains()
        self._start([1.0, 0.0, 0.0, 0.0])
        if state is not None:
            self.state = state

    def _set_gains(self) -> None:
        p = self.parameters
        self._memory[Cell.GAINS : Cell.GAINS + 14] = (
            p.rate_density**2,
            p.rate_scale**2,
            p.force_density**2,
            p.force_scale**2,
            p.bias_density**2,
            p.velocity_density**2,
            p.rest_bias_density**2,
            p.rest_rate**2,
            p.rest_force**2,
            p.rest_s,
            p.step_s,
            p.heading_tau_s,
            p.field_strength,
            p.field_dip,
        )
        self._memory[Cell.FIELD_NEW_S] = p.field_new_s

    def _start(self, quaternion: FloatArray | list[float]) -> None:
        """Attitude known to the initial deviation, no velocity, bias kept."""
        p, m = self.parameters, self._memory
        bias = m[Cell.BIAS : Cell.BIAS + 3].copy()
        m[: Cell.GAINS] = 0.0
        m[Cell.KALMAN : Cell.KALMAN + 4] = m[:4] = unit_quaternion(np.asarray(quaternion))
        m[Cell.BIAS : Cell.BIAS + 3] = bias
        deviations = [p.initial_tilt_deviation] * 2 + [p.initial_bias_deviation] * 3 + [0.05] * 3
        m[Cell.COVARIANCE : Cell.COVARIANCE + 64] = np.diag(np.square(deviations)).ravel()
        m[Cell.GRAVITY] = p.gravity

    @property
    def quaternion(self) -> FloatArray:
        """Attitude, body -> ENU, shape (4,), a copy."""
        return self._quaternion.copy()

    @quaternion.setter
    def quaternion(self, value: FloatArray) -> None:
        self._start(value)

    @property
    def state(self) -> BoundedState:
        """What the filter remembers, a copy."""
        return BoundedState(self._memory.copy())

    @state.setter
    def state(self, value: BoundedState) -> None:
        if value.memory.shape != self._memory.shape:
            raise ValueError(f"bounded: a state of {Cell.END} numbers is needed, not {value.memory.shape}")
        self._memory[:] = value.memory
        self._set_gains()
