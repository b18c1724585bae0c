"""Causal compensation of the angular rate: sample by sample for the live node, and the same for whole recordings.

A sample at time t loses, in the order of the file, `G f(t - tau)` (tau: `gyro_delay_s`) and `c (T'(t) - T0)`, where T'
is the newest temperature at t through a first-order lag that starts settled. What is unknown is not guessed: no
temperature yet, or no specific force, and the term is left out. A negative tau (gyro earlier than the accelerometer)
would need the future; the newest specific force is used then.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from math import expm1, isfinite

import numpy as np
from numpy.typing import NDArray

from .model import CompensationFile, GSensitivity, TemperatureBias

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass
class CompensatorState:
    """What the past has left; read it and set it to go on elsewhere with the identical result."""

    forces: deque[tuple[int, FloatArray]] = field(default_factory=deque)
    """Stamps (ns) and specific forces (m/s^2) as far back as the delay reaches."""
    stamp_ns: int | None = None
    temperature: float | None = None
    """Newest temperature, degrees Celsius."""
    lagged: dict[int, float] = field(default_factory=dict)
    """Number of the term -> its lagged temperature."""


class Compensator:
    """Takes the file's terms off one sample after the other."""

    def __init__(self, file: CompensationFile, state: CompensatorState | None = None) -> None:
        self.file = file
        self.state = state or CompensatorState()
        self._delay_ns = round(max(file.gyro_delay_s, 0.0) * 1e9)
        self._matrices = {
            i: np.array(term.full_matrix) for i, term in enumerate(file.terms) if isinstance(term, GSensitivity)
        }

    @property
    def needs_temperature(self) -> bool:
        """Whether a term uses the die temperature."""
        return any(isinstance(term, TemperatureBias) for term in self.file.terms)

    def set_temperature(self, celsius: float) -> None:
        """The newest die temperature; what is not a number is ignored."""
        if isfinite(celsius):
            self.state.temperature = celsius

    def update(self, stamp_ns: int, angular_rate: FloatArray, specific_force: FloatArray) -> FloatArray:
        """Compensated rate of one sample; stamps increase.

        Args:
            stamp_ns: header stamp.
            angular_rate: rad/s, shape (3,).
            specific_force: m/s^2, shape (3,), NaN where not reported.

        Returns:
            rad/s, shape (3,).
        """
        state = self.state
        dt = 0.0 if state.stamp_ns is None else (stamp_ns - state.stamp_ns) * 1e-9
        state.stamp_ns = stamp_ns
        force = self._delayed(stamp_ns, specific_force)
        rate = np.array(angular_rate, dtype=np.float64)
        for i, term in enumerate(self.file.terms):
            if isinstance(term, TemperatureBias):
                temperature = self._lagged(i, term.lag_s, dt)
                if temperature is not None:
                    rate -= np.array(term.c) * (temperature - term.reference)
            elif np.isfinite(force).all():
                rate -= self._matrices[i] @ force  # with k: equation 7.4
        return rate

    def _delayed(self, stamp_ns: int, force: FloatArray) -> FloatArray:
        """Specific force at `stamp_ns` minus the delay, linear between samples; the oldest where none is so old."""
        if self._delay_ns == 0:
            return force
        forces = self.state.forces
        forces.append((stamp_ns, np.array(force, dtype=np.float64)))
        wanted = stamp_ns - self._delay_ns
        while len(forces) > 2 and forces[1][0] <= wanted:
            forces.popleft()
        (t0, f0) = forces[0]
        if len(forces) == 1 or wanted <= t0:
            return f0
        (t1, f1) = forces[1]
        return f0 + (f1 - f0) * (min(wanted - t0, t1 - t0) / (t1 - t0))

    def _lagged(self, number: int, lag_s: float, dt: float) -> float | None:
        newest = self.state.temperature
        if newest is None:
            return None
        before = self.state.lagged.get(number, newest)
        value = newest if lag_s == 0.0 else before - expm1(-dt / lag_s) * (newest - before)
        self.state.lagged[number] = value
        return value


def compensate(
    file: CompensationFile,
    stamp_ns: IntArray,
    angular_rate: FloatArray,
    specific_force: FloatArray,
    temperature: tuple[IntArray, FloatArray] | None = None,
) -> FloatArray:
    """Compensated rate of a recording, equal to `Compensator` fed sample by sample.

    Args:
        file: what to take off.
        stamp_ns: increasing header stamps, shape (n,).
        angular_rate: rad/s, shape (n, 3).
        specific_force: m/s^2, shape (n, 3); rows of NaN where not reported.
        temperature: stamps (ns) and degrees Celsius; a sample uses the newest one that is not younger than itself.

    Returns:
        rad/s, shape (n, 3).
    """
    rate = np.array(angular_rate, dtype=np.float64)
    force = _delayed_all(stamp_ns, specific_force, file.gyro_delay_s)
    usable = np.isfinite(force).all(axis=1)
    for term in file.terms:
        if isinstance(term, TemperatureBias):
            rise = _lagged_all(stamp_ns, temperature, term.lag_s) - term.reference
            rate -= np.where(np.isfinite(rise)[:, None], rise[:, None] * np.array(term.c), 0.0)
        else:
            rate[usable] -= force[usable] @ np.array(term.full_matrix).T
    return rate


def _delayed_all(stamp_ns: IntArray, force: FloatArray, delay_s: float) -> FloatArray:
    if delay_s <= 0.0 or len(stamp_ns) == 0:
        return np.asarray(force, dtype=np.float64)
    t = (stamp_ns - stamp_ns[0]).astype(np.float64)
    return np.stack([np.interp(t - round(delay_s * 1e9), t, force[:, i]) for i in range(3)], axis=1)


def _lagged_all(stamp_ns: IntArray, temperature: tuple[IntArray, FloatArray] | None, lag_s: float) -> FloatArray:
    """Lagged newest temperature at each sample, NaN before the first."""
    out = np.full(len(stamp_ns), np.nan)
    if temperature is None:
        return out
    stamps, values = (array[np.isfinite(temperature[1])] for array in temperature)
    index = np.searchsorted(stamps, stamp_ns, side="right") - 1
    known = index >= 0
    out[known] = values[index[known]]
    if lag_s == 0.0 or not known.any():
        return out
    start = int(np.argmax(known))
    keep = -np.expm1(-np.diff(stamp_ns, prepend=stamp_ns[:1]) * 1e-9 / lag_s)
    value = out[start]
    for i in range(start + 1, len(out)):
        value += keep[i] * (out[i] - value)
        out[i] = value
    return out
