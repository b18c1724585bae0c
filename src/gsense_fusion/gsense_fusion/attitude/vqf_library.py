"""VQF by its authors' library `vqf`.

Source: D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias estimation and magnetic
disturbance rejection", Information Fusion 91, 2023.

The library's coefficients rest on a fixed rate. Here each interval is its own: the rate is scaled so that the library's
fixed interval makes the turn of the true one. Fields that come more seldom are handed over as they come, with their
own usual interval.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np
from vqf import VQF

from .compiled import checked, require_positive, unit_quaternion
from .interface import FloatArray


@dataclass(frozen=True)
class VqfParameters:
    """The library's most important parameters; the others are its defaults."""

    tau_acc: float = 3.0
    """s, time constant of the low-pass on the specific force in the earth frame."""
    tau_mag: float = 9.0
    """s, time constant of the heading's correction."""
    period_s: float = 0.005
    """s, usual interval of the samples; `prepare` sets the true one."""
    field_period_s: float | None = None
    """s, the same of the fields; None: as the samples."""

    def __post_init__(self) -> None:
        require_positive("vqf", tau_acc=self.tau_acc, tau_mag=self.tau_mag, period_s=self.period_s)
        if self.field_period_s is not None:
            require_positive("vqf", field_period_s=self.field_period_s)


@dataclass
class VqfState:
    """What the filter remembers: the library's own state, and whether a field has been seen."""

    library: dict[str, Any]
    field_seen: bool = False
    period_s: float = 0.005
    field_period_s: float | None = None
    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU after the last sample, (w, x, y, z), shape (4,)."""


class Vqf:
    """VQF; heading from the field once there is one, else counted from the start."""

    def __init__(self, parameters: VqfParameters | None = None, state: VqfState | None = None) -> None:
        self.parameters = parameters or VqfParameters()
        self._field_seen = False
        self._make(self.parameters.period_s, self.parameters.field_period_s)
        if state is not None:
            self.state = state

    def _make(self, period_s: float, field_period_s: float | None) -> None:
        self._period, self._field_period = period_s, field_period_s
        self._vqf = VQF(
            period_s,
            magTs=-1.0 if field_period_s is None else field_period_s,
            tauAcc=self.parameters.tau_acc,
            tauMag=self.parameters.tau_mag,
        )

    def prepare(self, period_s: float, field_period_s: float | None) -> None:
        """Start anew with these intervals; the attitude stays."""
        quaternion = self.quaternion
        self._make(period_s, field_period_s)
        self._field_seen = False
        self.quaternion = quaternion

    @property
    def state(self) -> VqfState:
        """What the filter remembers, a copy."""
        return VqfState(self._vqf.state, self._field_seen, self._period, self._field_period, self.quaternion)

    @state.setter
    def state(self, value: VqfState) -> None:
        self._make(value.period_s, value.field_period_s)
        self._vqf.state = value.library
        self._field_seen = value.field_seen

    @property
    def quaternion(self) -> FloatArray:
        """Attitude, body -> ENU, shape (4,), a copy."""
        # the library makes a new array in each call
        quaternion: FloatArray = self._vqf.getQuat9D() if self._field_seen else self._vqf.getQuat6D()
        return quaternion

    @quaternion.setter
    def quaternion(self, value: FloatArray) -> None:
        state = self._vqf.state
        state["gyrQuat"] = unit_quaternion(value).tolist()
        state["accQuat"] = [1.0, 0.0, 0.0, 0.0]
        state["delta"] = 0.0
        # the low-pass remembers specific forces in the old frame: it begins anew
        state["accLpState"] = np.full(6, np.nan).tolist()
        state["lastAccLp"] = [0.0, 0.0, 0.0]
        self._vqf.state = state

    def update(
        self, dt: float, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """One sample; see `AttitudeFilter.update`."""
        self._vqf.updateGyr(angular_rate * (dt / self._period))
        if isfinite(specific_force.dot(specific_force)):  # a quarter of the time of numpy's isfinite and all
            self._vqf.updateAcc(specific_force)
        if field is not None and np.isfinite(field).all():
            self._vqf.updateMag(field)
            self._field_seen = True
        return self.quaternion

    def batch(
        self, dt: FloatArray, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """Many samples; see `AttitudeFilter.batch`."""
        steps, rate, force, fields = checked("vqf", dt, angular_rate, specific_force, field)
        rate = rate * (steps / self._period)[:, None]
        force = _zero_where_missing(force)  # the library skips vectors of zero
        if field is None or not np.isfinite(fields).all(axis=1).any():
            result = self._vqf.updateBatch(rate, force)
            return self._with_heading(result["quat6D"])
        fields = _zero_where_missing(fields)
        first = int(np.argmax(np.any(fields != 0.0, axis=1))) if not self._field_seen else 0
        result = self._vqf.updateBatch(rate, force, fields)
        self._field_seen = True
        quaternion = np.array(result["quat9D"], dtype=np.float64)
        quaternion[:first] = result["quat6D"][:first]
        return quaternion

    def _with_heading(self, quaternion: FloatArray) -> FloatArray:
        """The 6D attitudes turned by the heading that the fields have given so far."""
        if not self._field_seen:
            return np.array(quaternion, dtype=np.float64)
        half = 0.5 * self._vqf.getDelta()
        c, s = np.cos(half), np.sin(half)
        w, x, y, z = np.asarray(quaternion).T
        return np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], axis=1)


def _zero_where_missing(rows: FloatArray) -> FloatArray:
    missing = ~np.isfinite(rows).all(axis=1)
    if not missing.any():
        return rows
    rows = rows.copy()
    rows[missing] = 0.0
    return rows
