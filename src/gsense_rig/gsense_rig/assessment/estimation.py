"""Velocity and acceleration by the thesis's way and by the observer, against the carriage's truth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.assessment.sine_run import phasor
from gsense_rig.control.estimators import DerivativeEstimator

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gsense_rig.assessment.sine_run import SineRun

    Array = NDArray[np.float64]

CUTOFFS = (3.0, 6.0, 12.0, 25.0, 50.0, 100.0)  # Hz; the thesis does not say which it used


@dataclass(frozen=True)
class Estimate:
    """Errors of one estimator in one run."""

    cutoff: float | None  # Hz; None: the observer
    velocity: float  # m/s rms
    acceleration: float  # m/s^2 rms
    velocity_lag: float  # ms behind the truth, at the drive's frequency


def observer(run: SineRun) -> Estimate:
    """The observer as the loop ran it."""
    return _compared(run, None, run.loop[:, 3], run.loop[:, 4])


def thesis(run: SineRun, period: float) -> Estimate:
    """Derivative and first-order low-pass with the cut-off that suits this run best in acceleration."""
    return min((_thesis_at(run, period, cutoff) for cutoff in CUTOFFS), key=lambda e: e.acceleration)


def _thesis_at(run: SineRun, period: float, cutoff: float) -> Estimate:
    estimator = DerivativeEstimator(period, cutoff)
    values = []
    for position in np.concatenate([run.loop[:, 1], run.loop[:, 1]]).tolist():  # the first round swings in
        estimator.update(position)
        values.append((estimator.velocity, estimator.acceleration))
    second = np.array(values[len(values) // 2 :])
    return _compared(run, cutoff, second[:, 0], second[:, 1])


def _compared(run: SineRun, cutoff: float | None, velocity: Array, acceleration: Array) -> Estimate:
    true_v, true_a = run.truth[:, 0], run.truth[:, 1]
    w, time = run.angular_frequency, run.loop[:, 0]
    turn = phasor(w, time, velocity) / phasor(w, time, true_v)
    return Estimate(
        cutoff,
        float(np.sqrt(np.mean((velocity - true_v) ** 2))),
        float(np.sqrt(np.mean((acceleration - true_a) ** 2))),
        -math.atan2(turn.imag, turn.real) / w * 1e3,
    )
