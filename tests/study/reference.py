"""The contract's `rate_rms`, written anew from its words: an oracle for the engine's figures and the true floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .simulator import Session

Array = NDArray[np.float64]
CUTOFF_HZ = 5.0


def brick_wall(series: Array, rate_hz: float) -> Array:
    """Zero-phase low-pass at 5 Hz along the first axis by the FFT."""
    coefficients = np.fft.fft(series, axis=0)
    coefficients[np.abs(np.fft.fftfreq(len(series), 1.0 / rate_hz)) > CUTOFF_HZ] = 0
    return np.asarray(np.fft.ifft(coefficients, axis=0).real)


def held_out_rms(session: Session, errors: Sequence[Array]) -> float:
    """Root mean square over the held-out runs of errors (n, 3), one array a run, after bias and low-pass.

    The session's bias is the mean over its fit runs. One session without long gaps is taken for granted.
    """
    roles = [role for _, role in session.runs]
    bias = np.concatenate([e for e, role in zip(errors, roles, strict=True) if role == "fit"]).mean(axis=0)
    total, count = 0.0, 0
    for truth, error, role in zip(session.truth, errors, roles, strict=True):
        if role != "held_out":
            continue
        step = float(np.median(np.diff(truth.time)))
        grid = np.arange(truth.time[0], truth.time[-1] + step / 2, step)
        even = np.stack([np.interp(grid, truth.time, error[:, i] - bias[i]) for i in range(3)], axis=1)
        smooth = brick_wall(even, 1.0 / step)
        total += float(np.sum(smooth**2))
        count += smooth.size
    return float(np.sqrt(total / count))


def measured_rates(session: Session) -> list[Array]:
    """What the gyro reported, rad/s, one array (n, 3) a run."""
    return [run.imu.angular_rate for run, _ in session.runs]


def true_noise(session: Session) -> list[Array]:
    """What a complete model with one bias a session would leave, rad/s: noise, and earth rate in a turned board."""
    return [truth.noise + truth.drawn + truth.earth for truth in session.truth]
