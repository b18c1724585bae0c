"""Derivatives of an encoder's record by a low-pass: for what is no harmonic of a drive."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.types import FloatArray

COARSE_S = 0.02
"""Between readings: from here on splines of position and speed tell different motions."""
OF_RATE = 0.4
"""Of the readings' rate: what lies above half of it is not to be had from them."""


def _dense(time: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Equidistant readings close enough that a spline through a derivative's is that derivative in between."""
    finer = int(np.ceil((time[1] - time[0]) / COARSE_S - 1e-6))
    if finer <= 1 or len(time) < 4:
        return time, position
    grid = np.linspace(time[0], time[-1], finer * (len(time) - 1) + 1)
    return grid, CubicSpline(time, position)(grid)


class BandLimited:
    """Derivatives of the whole record by a low-pass in the frequency domain, ends continued by odd reflection."""

    def __init__(self, time: FloatArray, position: FloatArray, cutoff_hz: float) -> None:
        """Differentiate the record.

        Args:
            time: s, equidistant, shape (m,).
            position: m, shape (m,).
            cutoff_hz: Where the derivatives begin to fade; no more than the readings can show.

        """
        cutoff_hz = min(cutoff_hz, OF_RATE / float(time[1] - time[0]))
        time, position = _dense(time, position)
        n = len(time)
        pad = min(n - 1, round(4.0 / (time[1] - time[0])))
        left = 2 * position[0] - position[pad:0:-1]
        right = 2 * position[-1] - position[-2 : -pad - 2 : -1]
        extended = np.concatenate([left, position, right])
        trend = np.linspace(extended[0], extended[-1], len(extended))
        step = float(time[1] - time[0])
        w = 2 * np.pi * np.fft.rfftfreq(len(extended), step)
        roll = np.clip((1.5 * cutoff_hz - w / (2 * np.pi)) / (0.5 * cutoff_hz), 0.0, 1.0)
        spectrum = np.fft.rfft(extended - trend) * 0.5 * (1 - np.cos(np.pi * roll))
        slope = (trend[1] - trend[0]) / step
        offsets = (trend, slope, 0.0, 0.0)
        parts = [np.fft.irfft(spectrum * (1j * w) ** k, len(extended)) + offsets[k] for k in range(4)]
        self._start, self._stop = float(time[0]), float(time[-1])
        self._spline = CubicSpline(time, np.stack([part[pad : pad + n] for part in parts], axis=1))

    def at(self, time: FloatArray) -> Kinematics:
        """Motion at the times; beyond the record the carriage is taken to stay where it was."""
        clipped = np.clip(time, self._start, self._stop)
        position, velocity, acceleration, jerk = np.ascontiguousarray(self._spline(clipped).T)
        outside = (time < self._start) | (time > self._stop)
        for series in (velocity, acceleration, jerk):
            series[outside] = 0.0
        return Kinematics(position, velocity, acceleration, jerk)
