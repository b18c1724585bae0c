"""What an IMU's narrow filter makes of the low orders of the drive."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, freqs

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.narrow_filter import RunFelt, through_narrow_filter
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray, Role

RATE_HZ = 200.0
SPEEDS = (2.0, 4.1, 6.2, 8.0)
"""rad/s."""
WAVES = ((1, 0.15, 0.0), (2, 0.0015, 1.0), (3, 0.004, 2.0))
"""Order, m, rad."""
ALONG = np.array([0.0, -1.0, 0.0])
LATE_S = 0.004


def _acceleration(t: FloatArray, w: float, corner_hz: float | None) -> FloatArray:
    out = np.zeros(len(t))
    for order, size, phase in WAVES:
        gain = 1.0 + 0.0j
        if corner_hz is not None:
            gain = freqs(*butter(2, 2 * np.pi * corner_hz, analog=True), worN=[order * w])[1][0]
        out -= size * (order * w) ** 2 * (gain * np.exp(1j * (order * w * t + phase))).imag
    return out


def _felt(w: float, corner_hz: float | None, taken_s: float) -> RunFelt:
    """A run of 30 s of which a delay was taken out already."""
    t = np.arange(0.0, 30.0, 1.0 / RATE_HZ)
    s = sum(size * np.sin(order * w * t + phase) for order, size, phase in WAVES)
    noise = np.random.default_rng(4).normal(0.0, 0.04, (len(t), 3))
    force = np.outer(_acceleration(t - LATE_S, w, corner_hz), ALONG) + np.array([0.0, 0.0, 9.81]) + noise
    run = CleanRun(
        path="run", axes=(0, 1, 2), name="run", role=Role.FIT, sensor="mpu6050", session=0, time=t,
        angular_rate=np.zeros((len(t), 3)), specific_force=force, valid=np.ones(len(t), dtype=bool), rate_hz=RATE_HZ,
        received=len(t), lost=0, pose_time=None, pose=None, temperature=None,
    )  # fmt: skip
    return RunFelt(CarriageMotion(t, np.round(s / 5e-5) * 5e-5), run, ALONG, taken_s)


@pytest.mark.parametrize("corner_hz", [5.0, 10.0])
def test_the_low_orders_pass_through_the_filter_that_all_runs_show(corner_hz: float) -> None:
    taken = LATE_S + np.sqrt(2.0) / (2 * np.pi * corner_hz) + 4e-4
    runs = [_felt(w, corner_hz, taken) for w in SPEEDS]
    moved = through_narrow_filter(runs)
    t = np.arange(2.0, 28.0, 0.01)
    wrong = []
    for w, before, motion in zip(SPEEDS, runs, moved, strict=True):
        assert motion is not None
        assert before.motion is not None
        felt = _acceleration(t - LATE_S, w, corner_hz)
        wrong.append([np.std(m.at(t - taken).acceleration - felt) / np.std(felt) for m in (before.motion, motion)])
        assert np.array_equal(motion.at(t).velocity, before.motion.at(t).velocity)
    assert max(left for _, left in wrong) < 0.004
    assert wrong[-1][1] < 0.4 * wrong[-1][0]


@pytest.mark.parametrize("corner_hz", [None, 44.0])
def test_a_filter_that_leaves_them_changes_nothing(corner_hz: float | None) -> None:
    taken = LATE_S + (0.0 if corner_hz is None else np.sqrt(2.0) / (2 * np.pi * corner_hz))
    runs = [_felt(w, corner_hz, taken) for w in SPEEDS]
    assert all(a is b.motion for a, b in zip(through_narrow_filter(runs), runs, strict=True))
