"""The predicted rate: what the compensation file says, plus the bias that rest shows."""

from __future__ import annotations

import numpy as np

from gsense_fusion.attitude.interface import FloatArray
from gsense_fusion.attitude.rest import is_rest
from gsense_fusion.compensation import CompensationFile, Compensator

REST_S = 1.0


class Prediction:
    """Residual of one sample after the other: measured minus predicted rate.

    The bias is the file's until a second at rest has been seen, then that second's, for the whole session.
    """

    def __init__(self, file: CompensationFile) -> None:
        self.compensator = Compensator(file)
        self.bias = np.array(file.bias, dtype=np.float64)
        """rad/s, shape (3,)."""
        self.bias_from_rest = False
        self._held: list[tuple[int, FloatArray, FloatArray]] = []

    def residual(self, stamp_ns: int, angular_rate: FloatArray, specific_force: FloatArray) -> FloatArray:
        """Measured minus predicted rate of a sample, rad/s, shape (3,); stamps increase."""
        rate = self.compensator.update(stamp_ns, angular_rate, specific_force)
        if not self.bias_from_rest:
            self._look_for_rest(stamp_ns, rate, specific_force)
        return np.asarray(rate - self.bias)

    def _look_for_rest(self, stamp_ns: int, rate: FloatArray, force: FloatArray) -> None:
        self._held.append((stamp_ns, rate, force))
        if abs(stamp_ns - self._held[0][0]) < REST_S * 1e9:  # a clock that is set back would never come there
            return
        rates = np.array([r for _, r, _ in self._held])
        if is_rest(rates, np.array([f for _, _, f in self._held])):
            self.bias, self.bias_from_rest = rates.mean(axis=0), True
        self._held.clear()
