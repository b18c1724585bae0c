"""The complementary filter of the thesis's chapter 5.1: gyro through a high-pass, accelerometer through a low-pass.

    angle = alpha (angle + rate dt) + (1 - alpha) angle of the accelerometer         equation 5.1
    alpha = tau / (tau + dt)                                                         equation 5.2

and, after its figure 5.2, an accelerometer sample counts only while the specific force is as long as gravity.

Equation 5.1 is stated for one angle. Taken for roll and pitch apart it breaks down near the gimbal lock and ignores
that they turn together; here the share 1 - alpha is taken of the whole turn that brings the predicted vertical to the
measured one (its axis is horizontal). On a single axis that is equation 5.1. The heading is treated alike, with a
time constant of its own and the time since the last field, which comes more seldom than the rate.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, require_not_negative, require_positive, unit_quaternion
from .entries import entries
from .interface import FloatArray
from .kernels import (
    SIGNATURE_STEP,
    heading_error,
    length,
    tilt_error,
    turn,
    turn_earth,
)


@dataclass(frozen=True)
class ComplementaryParameters:
    """Gains of the filter."""

    tau_s: float = 5.0
    """s, time constant of equation 5.2. Small: follows the accelerometer at once, and with it every linear
    acceleration; large: the gyro's drift shows."""
    heading_tau_s: float = 5.0
    """s, the same for the magnetometer."""
    gate: float = 0.5
    """m/s^2: a specific force whose length differs from gravity by more is not used (figure 5.2). Small: few samples
    are left under vibration, and those that pass in motion are just as wrong; large: no gate."""
    gravity: float = 9.80665
    """m/s^2."""

    def __post_init__(self) -> None:
        require_positive("complementary", tau_s=self.tau_s, heading_tau_s=self.heading_tau_s, gravity=self.gravity)
        require_not_negative("complementary", gate=self.gate)


@dataclass
class ComplementaryState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""
    field_age_s: float = 0.0
    """Time since the last magnetic field, s."""


_AGE, _TAU, _HEADING_TAU, _GATE, _GRAVITY = 4, 5, 6, 7, 8


@kernel(SIGNATURE_STEP)
def _step(m, q, dt, rate, force, mag, has_field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    q = turn(q, dt, rate)
    m[_AGE] += dt
    norm = length(force)
    if norm > 0.0 and abs(norm - m[_GRAVITY]) <= m[_GATE]:  # figure 5.2
        share = dt / (m[_TAU] + dt)  # 1 - alpha, equation 5.2
        rx, ry, _ = tilt_error(q, force)
        q = turn_earth(q, (share * rx, share * ry, 0.0))  # equation 5.1
    if has_field and length(mag) > 0.0:
        q = turn_earth(q, (0.0, 0.0, m[_AGE] / (m[_HEADING_TAU] + m[_AGE]) * heading_error(q, mag)))
        m[_AGE] = 0.0
    return q


_ENTRIES = entries(_step, "complementary")


class Complementary(CompiledFilter):
    """The complementary filter, compiled."""

    name = "complementary"
    _imu = staticmethod(_ENTRIES.imu)
    _field = staticmethod(_ENTRIES.field)
    _batch = staticmethod(_ENTRIES.batch)

    def __init__(
        self, parameters: ComplementaryParameters | None = None, state: ComplementaryState | None = None
    ) -> None:
        super().__init__(np.zeros(9))
        self.parameters = p = parameters or ComplementaryParameters()
        self._memory[_TAU:] = p.tau_s, p.heading_tau_s, p.gate, p.gravity
        self.state = state or ComplementaryState()

    @property
    def state(self) -> ComplementaryState:
        """What the filter remembers, a copy."""
        return ComplementaryState(self.quaternion, float(self._memory[_AGE]))

    @state.setter
    def state(self, value: ComplementaryState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
        self._memory[_AGE] = value.field_age_s
