"""What the board's firmware reads from the simulated chips, and when: its slots, its clock and the driver's stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.sensors.constants import STEP
from gsense_rig.sensors.layout import Registers

Array = npt.NDArray[np.float64]
MPU_PERIOD = 0.005
BNO_PERIOD = 0.010
BNO_PHASE = 0.0025
"""s of board time: the firmware's slots."""
STAMP_ERROR = 50e-6
"""s: standard deviation of the driver's clock model."""
STAMP_ERROR_TIME = 2.0
"""s: how fast that error wanders."""
AGE_ERROR = 150e-6
"""s: the board knows a BNO sample's age only from looking for changes."""

LOSS_LENGTH = 2.0
"""Frames that are lost in a row, on average."""


@dataclass(frozen=True)
class Reads:
    """One chip's reads in a run."""

    time: Array
    """(n,) true times, s of the session."""
    stamp: Array
    """(n,) what the driver takes them for."""
    index: npt.NDArray[np.int64]
    """(n,) rows of the run's registers that were read."""
    lost: int = 0
    """Reads beside these that never arrived."""


class BoardClock:
    """The board's oscillator against the host's, and the error of the driver's model of it."""

    def __init__(self, skew: float, seed: int, error: float = 0.0, lost: float = 0.0) -> None:
        """`error`: by how much (relative) the stamps run faster than the host's clock; `lost`: part of the frames."""
        self.skew = skew
        self._error_rate, self._lost = error, lost
        self._loss_rng = np.random.default_rng([seed, 0x6C6F7373])
        self._rng = np.random.default_rng([seed, 0x636C6F63])
        # Half a chip's sample between its renewal and the board's read, so that the two seldom meet.
        self._start = 0.5 * MPU_PERIOD

    def reads(self, registers: Registers, period: float, phase: float = 0.0) -> Reads:
        """The reads of a slot that fall into the time of these registers (1 kHz)."""
        first, last = float(registers.time[0]), float(registers.time[-1])
        origin = self._start + phase
        low = np.ceil((first - origin) * (1.0 + self.skew) / period + 1e-9)
        high = np.floor((last - origin) * (1.0 + self.skew) / period)
        time = origin + np.arange(low, high + 1) * period / (1.0 + self.skew)
        index = np.clip(np.floor((time - first) / STEP + 1e-6).astype(np.int64), 0, registers.time.shape[0] - 1)
        stamp = time * (1.0 + self._error_rate) + self._error(time.shape[0], period)
        kept = self._arrives(time.shape[0])
        return Reads(time[kept], stamp[kept], index[kept], int(np.count_nonzero(~kept)))

    def bno_age(self, registers: Registers, reads: Reads) -> Array:
        """Age of the gyro's sample at each read as the board reports it, s."""
        true = reads.time - registers.bno_time[reads.index]
        return np.clip(true + self._rng.normal(0.0, AGE_ERROR, true.shape), 0.0, 0.065535)

    def latency(self, n: int, mean: float) -> Array:
        """Time that a message takes to the recorder: radio, line and graph; s."""
        return mean * (0.6 + 0.4 * self._rng.exponential(1.0, n))

    def board_latency(self, stamp: Array, mean: float) -> Array:
        """The same counted from the board's stamp, which a clock that runs too fast puts too late."""
        return self.latency(stamp.shape[0], mean) - stamp * self._error_rate

    def _arrives(self, n: int) -> npt.NDArray[np.bool_]:
        """Which of n frames arrive: losses come alone or a few in a row (two-state chain, two frames on average)."""
        kept = np.ones(n, dtype=np.bool_)
        if self._lost == 0.0:
            return kept
        begin = self._lost / (1.0 - self._lost) / LOSS_LENGTH
        draws = self._loss_rng.random(n)
        good = True
        for k in range(n):
            good = draws[k] >= begin if good else draws[k] < 1.0 / LOSS_LENGTH
            kept[k] = good
        return kept

    def _error(self, n: int, period: float) -> Array:
        """First-order process, so that neighbouring stamps keep their distance."""
        keep = np.exp(-period / STAMP_ERROR_TIME)
        drive = self._rng.normal(0.0, STAMP_ERROR * np.sqrt(1.0 - keep**2), n)
        error = np.empty(n)
        value = self._rng.normal(0.0, STAMP_ERROR)
        for k in range(n):
            value = keep * value + drive[k]
            error[k] = value
        return error
