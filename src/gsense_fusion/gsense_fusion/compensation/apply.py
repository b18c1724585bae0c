"""Causal compensation of the angular rate: sample by sample for the live node, and the same for whole recordings.

A sample at time t loses, in the order of the file, what each term says; those of the specific force see f(t - tau)
with tau = `gyro_delay_s`. What is unknown is not guessed: no temperature yet, no supply voltage, no carriage or no
specific force, and the term is left out. A negative tau (gyro earlier than the accelerometer) would need the future;
the newest specific force is used then.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, field
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from .kernel import CAPACITY, batch, step
from .model import CompensationFile
from .remembering import MEMORY
from .terms.numbers import ROW

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Series = tuple[IntArray, FloatArray]
"""Stamps (ns, increasing) and values."""


@dataclass
class CompensatorState:
    """What the past has left; a copy of it goes on elsewhere with the identical result."""

    memory: FloatArray
    """Of the terms, shape (terms, MEMORY)."""
    ring: IntArray = field(default_factory=lambda: np.array([-1, 0, 0, 0], dtype=np.int64))
    """Place of the newest force, number of forces, newest stamp (ns), whether there is one."""
    stamps: IntArray = field(default_factory=lambda: np.zeros(CAPACITY, dtype=np.int64))
    forces: FloatArray = field(default_factory=lambda: np.zeros((CAPACITY, 3)))
    """m/s^2, shape (CAPACITY, 3), as far back as delays and derivatives reach."""
    inputs: FloatArray = field(default_factory=lambda: np.full(3, np.nan))
    """New temperature reading (degrees Celsius), supply (V), velocity of the carriage (m/s); NaN where unknown."""

    def copy(self) -> CompensatorState:
        """An independent copy."""
        return deepcopy(self)


class Compensator:
    """Takes the file's terms off one sample after the other."""

    def __init__(self, file: CompensationFile, state: CompensatorState | None = None) -> None:
        self.file = file
        self._kinds = np.array([term.kind for term in file.terms], dtype=np.int64)
        self._rows = np.array([term.row() for term in file.terms]).reshape(-1, ROW)
        self.state = state or CompensatorState(np.zeros((len(file.terms), MEMORY)))
        self._scratch = np.zeros((5, 3))
        self._delay_ns = round(max(file.gyro_delay_s, 0.0) * 1e9)

    def set_temperature(self, celsius: float) -> None:
        """A reading of the die temperature, used with the next sample; what is not a number is ignored."""
        if isfinite(celsius):
            self.state.inputs[0] = celsius

    def set_supply(self, volts: float) -> None:
        """The newest supply voltage; what is not a number is ignored."""
        if isfinite(volts):
            self.state.inputs[1] = volts

    def set_carriage_velocity(self, velocity: float) -> None:
        """The carriage's newest velocity, m/s; NaN where it is not known any more."""
        self.state.inputs[2] = velocity

    def update(self, stamp_ns: int, angular_rate: FloatArray, specific_force: FloatArray) -> FloatArray:
        """Compensated rate of one sample; stamps increase.

        Args:
            stamp_ns: header stamp.
            angular_rate: rad/s, shape (3,).
            specific_force: m/s^2, as measured (not corrected), shape (3,), NaN where not reported.

        Returns:
            rad/s, shape (3,).
        """
        rate = np.array(angular_rate, dtype=np.float64)
        s = self.state
        force = np.ascontiguousarray(specific_force, dtype=np.float64)
        step(
            self._kinds,
            self._rows,
            self._delay_ns,
            s.ring,
            s.stamps,
            s.forces,
            s.memory,
            self._scratch,
            s.inputs,
            stamp_ns,
            force,
            rate,
        )
        return rate

    def batch(
        self, stamp_ns: IntArray, angular_rate: FloatArray, specific_force: FloatArray, inputs: FloatArray
    ) -> FloatArray:
        """`update` over a recording, the identical numbers.

        Args:
            stamp_ns: increasing header stamps, shape (n,).
            angular_rate: rad/s, shape (n, 3).
            specific_force: m/s^2, shape (n, 3); rows of NaN where not reported.
            inputs: what `set_...` would have said before each sample (`gather_inputs`), shape (n, 3).

        Returns:
            rad/s, shape (n, 3).
        """
        rate = np.array(angular_rate, dtype=np.float64, order="C")
        force = np.ascontiguousarray(specific_force, dtype=np.float64)
        stamp = np.ascontiguousarray(stamp_ns, dtype=np.int64)
        values = np.array(inputs, dtype=np.float64, order="C")
        if not rate.shape == force.shape == values.shape == (len(stamp), 3):
            raise ValueError(f"compensation: stamps {stamp.shape}, rate {rate.shape}, force {force.shape}")
        s = self.state
        if len(stamp):
            batch(
                self._kinds,
                self._rows,
                self._delay_ns,
                s.ring,
                s.stamps,
                s.forces,
                s.memory,
                self._scratch,
                values,
                stamp,
                force,
                rate,
            )
            s.inputs[1:] = values[-1, 1:]
        return rate


def gather_inputs(
    stamp_ns: IntArray,
    temperature: Series | None = None,
    supply: Series | None = None,
    carriage: Series | None = None,
) -> FloatArray:
    """What the live node would know at each sample: the newest values that are not younger; shape (n, 3).

    A temperature appears once, at the first sample after its stamp (a reading is evidence, used once); supply and
    velocity stay until the next.
    """
    out = np.full((len(stamp_ns), 3), np.nan)
    for column, series in enumerate((temperature, supply, carriage)):
        if series is None:
            continue
        good = np.isfinite(series[1])
        stamps, values = series[0][good], series[1][good]
        index = np.searchsorted(stamps, stamp_ns, side="right") - 1
        seen = index >= 0
        if column == 0:
            seen &= np.diff(index, prepend=-1) > 0
        out[seen, column] = values[index[seen]]
    return out


def compensate(
    file: CompensationFile,
    stamp_ns: IntArray,
    angular_rate: FloatArray,
    specific_force: FloatArray,
    temperature: Series | None = None,
    supply: Series | None = None,
    carriage: Series | None = None,
) -> FloatArray:
    """Compensated rate of a recording, equal to `Compensator` fed sample by sample.

    Args:
        file: what to take off.
        stamp_ns: increasing header stamps, shape (n,).
        angular_rate: rad/s, shape (n, 3).
        specific_force: m/s^2, shape (n, 3); rows of NaN where not reported.
        temperature: stamps (ns) and degrees Celsius of the die.
        supply: stamps (ns) and volts.
        carriage: stamps (ns) and velocities along the rail, m/s.

    Returns:
        rad/s, shape (n, 3).
    """
    inputs = gather_inputs(stamp_ns, temperature, supply, carriage)
    return Compensator(file).batch(stamp_ns, angular_rate, specific_force, inputs)


def corrected_force(file: CompensationFile, specific_force: FloatArray) -> FloatArray:
    """Specific force with the accelerometer's scale, misalignment and bias taken out, m/s^2, shape (..., 3).

    For attitude filters; the terms of the angular rate are of the uncorrected one.
    """
    c = file.accelerometer
    if c is None:
        return specific_force
    return np.asarray((specific_force - np.array(c.bias)) @ np.array(c.matrix).T)


def corrected_field(file: CompensationFile, field_: FloatArray) -> FloatArray:
    """Magnetic field with hard and soft iron taken out, T, shape (..., 3)."""
    c = file.magnetometer
    if c is None:
        return field_
    return np.asarray((field_ - np.array(c.hard_iron)) @ np.array(c.soft_iron).T)
