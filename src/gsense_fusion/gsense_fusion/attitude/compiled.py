"""What the compiled filters have in common: a memory of floats that the kernels work on, checked input, the calls.

A filter is a file with its equations as three kernels (one sample without field, one with, many) and two dataclasses.
The memory holds the quaternion, what else the filter remembers, and its gains, so that a call from Python hands over
as few arguments as it can: that, not the arithmetic, is the cost of a call.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from .interface import FloatArray

_EMPTY = np.empty((0, 3))


class CompiledFilter:
    """Base of the compiled filters; see `AttitudeFilter` for what the methods do."""

    name: ClassVar[str]
    parameters: Any
    _imu: ClassVar[Any]
    _field: ClassVar[Any]
    _batch: ClassVar[Any]

    update: Callable[..., FloatArray]
    """One sample; see `AttitudeFilter.update`. Arrays are C-contiguous float64."""

    def __init__(self, memory: FloatArray) -> None:
        self._memory = memory
        self._quaternion = memory[:4]
        self.update = _updater(memory, self._imu, self._field)

    def __deepcopy__(self, _: Any) -> CompiledFilter:
        """A filter of its own with the same parameters and state (`update` is bound to the memory)."""
        twin = type(self)(self.parameters)
        twin._memory[:] = self._memory  # noqa: SLF001
        return twin

    @property
    def quaternion(self) -> FloatArray:
        """Attitude, body -> ENU, shape (4,), a copy."""
        return self._quaternion.copy()

    @quaternion.setter
    def quaternion(self, value: FloatArray) -> None:
        self._quaternion[:] = unit_quaternion(value)

    def prepare(self, period_s: float, field_period_s: float | None) -> None:
        """Nothing to do: every step takes its own interval."""

    def batch(
        self, dt: FloatArray, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """Many samples; see `AttitudeFilter.batch`."""
        steps, rate, force, fields = checked(self.name, dt, angular_rate, specific_force, field)
        return np.asarray(self._batch(self._memory, steps, rate, force, fields), dtype=np.float64)


def _updater(memory: FloatArray, imu: Any, with_field: Any) -> Callable[..., FloatArray]:
    """`update` of one filter; a closure, since looking up methods would cost as much as the filter."""
    quaternion = memory[:4].copy  # of a view: each call copies what the memory holds then

    def update(
        dt: float, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        if field is None:
            imu(memory, dt, angular_rate, specific_force)
        else:
            with_field(memory, dt, angular_rate, specific_force, field)
        return quaternion()

    return update


def unit_quaternion(value: FloatArray) -> FloatArray:
    """The quaternion scaled to length 1, shape (4,); one that is of length 1 but for rounding stays as it is.

    Raises:
        ValueError: not four finite numbers, or all zero.
    """
    array = np.array(value, dtype=np.float64)
    norm = float(np.linalg.norm(array)) if array.shape == (4,) else 0.0
    if not (np.isfinite(norm) and norm > 0):
        raise ValueError(f"a quaternion (w, x, y, z) is needed, not {value}")
    return array if abs(norm - 1.0) < 1e-12 else np.asarray(array / norm, dtype=np.float64)


def checked(
    name: str, dt: FloatArray, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The arrays of a batch as the kernels want them; no field is an array of no rows.

    Raises:
        ValueError: shapes that do not fit together.
    """
    steps = np.ascontiguousarray(dt, dtype=np.float64)
    rate = np.ascontiguousarray(angular_rate, dtype=np.float64)
    force = np.ascontiguousarray(specific_force, dtype=np.float64)
    fields = _EMPTY if field is None else np.ascontiguousarray(field, dtype=np.float64)
    shape = (len(steps), 3)
    if steps.ndim != 1 or rate.shape != shape or force.shape != shape or (field is not None and fields.shape != shape):
        raise ValueError(f"{name}: dt {steps.shape}, rate {rate.shape}, force {force.shape}, field {fields.shape}")
    return steps, rate, force, fields


def require_positive(name: str, **values: float) -> None:
    """Raise ValueError for a parameter that is not a finite number above zero."""
    for key, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name}: {key} must be a number above 0, not {value}")


def require_not_negative(name: str, **values: float) -> None:
    """Raise ValueError for a parameter that is not a finite number of zero or more."""
    for key, value in values.items():
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"{name}: {key} must be a number of 0 or more, not {value}")
