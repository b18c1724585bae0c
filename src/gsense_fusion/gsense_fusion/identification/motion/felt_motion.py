"""A motion that is no steady sine, from the accelerometer where the encoder shows it badly.

An encoder that is read ten times a second, or whose stamps jitter, knows the position and not the acceleration: its
error grows with the square of frequency. No harmonics average it out here, and what G f then lacks looks like an
effect. What the accelerometer feels along the rail and the encoder does not show is added where it is clearly more than
the accelerometer's own noise: at low frequencies and with a good encoder that is nothing. The directions in which the
carriage does not move tell the noise. Slow turns of gravity stay out.
"""

from __future__ import annotations

import copy

import numpy as np
from scipy.ndimage import uniform_filter1d

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.splined import Splined
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import BoolArray, FloatArray

BAND_HZ = (0.5, 60.0)
"""Under its lower end gravity turns; a start from rest has kicks to its upper one."""
SCALE_HZ = (0.3, 2.0)
"""Where any encoder knows the acceleration: the accelerometer's scale is told here."""
SCALE_OFF = 0.03
CLEARLY = 4.0
"""Times the accelerometer's noise power."""
SMOOTH_HZ = 0.5
TAPER_S = 0.5
SHORTEST_S = 4.0


def with_felt_motion(
    motion: CarriageMotion | None, run: CleanRun, along: FloatArray | None, delay_s: float
) -> CarriageMotion | None:
    """The motion with what the accelerometer feels beyond the encoder; the same where that is its noise.

    Args:
        motion: Of the carriage by the encoder.
        run: The sensor's samples.
        along: The rail's direction in the sensor's axes, shape (3,); None where nothing tells it.
        delay_s: How much later than the encoder's the samples are.

    """
    if motion is None or motion.moving is None or motion.harmonics is not None or along is None:
        return motion
    time = run.time - delay_s
    inside = (time > motion.covered.start) & (time < motion.covered.stop)
    force = run.specific_force[inside]
    if inside.sum() < SHORTEST_S * run.rate_hz or not np.isfinite(force).all():
        return motion
    force = force - force.mean(axis=0)
    unit = along / np.linalg.norm(along)
    felt = force @ unit
    heard = run.valid[inside] & motion.heard_at(time[inside])
    extra = _beyond(felt, motion.at(time[inside]).acceleration, force - felt[:, None] * unit, run.rate_hz, heard)
    if extra is None:
        return motion
    out = copy.copy(motion)
    out.beyond = Splined.of(time[inside], extra)
    return out


def _beyond(
    felt: FloatArray, known: FloatArray, across: FloatArray, rate_hz: float, heard: BoolArray
) -> FloatArray | None:
    """Position, speed, acceleration and jerk (n, 4) to be added; None where it is nothing.

    Args:
        felt: Specific force along the rail without its mean, m/s^2, shape (n,).
        known: The encoder's acceleration, shape (n,).
        across: Specific force without that along the rail, shape (n, 3).
        rate_hz: Of the samples.
        heard: Where there is a sample and the encoder speaks, shape (n,).

    """
    n = len(felt)
    frequency = np.fft.rfftfreq(n, 1 / rate_hz)
    ends = np.minimum(np.arange(n), np.arange(n)[::-1]) / (TAPER_S * rate_hz)
    taper = 0.5 * (1 - np.cos(np.pi * np.clip(ends, 0.0, 1.0)))
    own, shown = np.fft.rfft(felt * taper), np.fft.rfft((known - known.mean()) * taper)
    slow = (frequency > SCALE_HZ[0]) & (frequency < SCALE_HZ[1])
    scale = float(np.vdot(shown[slow], own[slow]).real / max(float(np.vdot(shown[slow], shown[slow]).real), 1e-300))
    scale = float(np.clip(scale, 1 - SCALE_OFF, 1 + SCALE_OFF))
    lacking = np.fft.rfft(np.where(heard, felt / scale - (known - known.mean()), 0.0) * taper)
    width = max(3, round(SMOOTH_HZ * n / rate_hz))
    power = uniform_filter1d(np.abs(lacking) ** 2, width)
    noise = uniform_filter1d(np.sum(np.abs(np.fft.rfft(across * taper[:, None], axis=0)) ** 2, axis=1) / 2, width)
    top = min(BAND_HZ[1], 0.4 * rate_hz)
    used = (power > CLEARLY * noise) & (frequency > BAND_HZ[0]) & (frequency < top)
    if not used.any():
        return None
    share = uniform_filter1d(np.where(used, 1.0 - noise / np.maximum(power, 1e-300), 0.0), width)
    share[(frequency <= BAND_HZ[0]) | (frequency >= top)] = 0.0
    turning = 2j * np.pi * np.maximum(frequency, BAND_HZ[0])
    return np.stack([np.fft.irfft(share * lacking * turning**k, n) for k in (-2, -1, 0, 1)], axis=1)
