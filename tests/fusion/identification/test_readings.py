"""Encoder readings whose stamps jitter: the drive under them is still the steady sine that it is."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.readings import lasting_rms, smoothed

AMPLITUDE = 0.15
DURATION_S = 30.0


def readings(
    w: float, rate_hz: float, jitter_s: float, wander: float = 0.0, seed: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps (s) and positions (m) of a sine between two rests, each reading stamped early or late by itself."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, DURATION_S, 1 / rate_hz)
    ramp = np.clip(np.minimum(time - 2.0, DURATION_S - 2.0 - time), 0.0, 1.0)
    size = AMPLITUDE * (1.0 + wander * np.sin(0.37 * w * time))
    position = np.round(size * ramp**2 * (3 - 2 * ramp) * np.sin(w * time) * 2e4) / 2e4
    stamps = time + jitter_s * rng.standard_normal(len(time))
    order = np.argsort(stamps)
    return stamps[order], position[order]


@pytest.mark.parametrize("w", [2.0, 4.6, 8.0])
@pytest.mark.parametrize(("rate_hz", "jitter_s"), [(200.0, 5e-4), (200.0, 2.5e-3), (500.0, 1e-3)])
def test_stamps_that_jitter_leave_the_drive_a_steady_sine(w: float, rate_hz: float, jitter_s: float) -> None:
    motion = CarriageMotion(*readings(w, rate_hz, jitter_s))
    assert motion.harmonics is not None
    assert motion.steady is not None
    assert motion.angular_frequency == pytest.approx(w, rel=1e-4)
    assert motion.amplitude == pytest.approx(AMPLITUDE, rel=2e-3)
    assert motion.steady.duration > DURATION_S - 8.0
    assert motion.steady.start > 2.5
    assert motion.steady.stop < DURATION_S - 2.5
    time = np.linspace(5.0, 25.0, 2000)
    acceleration = -AMPLITUDE * w**2 * np.sin(w * time)
    assert np.std(motion.at(time).acceleration - acceleration) < 3e-3 * np.std(acceleration)


@pytest.mark.parametrize("jitter_s", [0.0, 1e-3])
def test_a_drive_that_wanders_is_no_steady_sine(jitter_s: float) -> None:
    assert CarriageMotion(*readings(8.0, 200.0, jitter_s, wander=0.02)).harmonics is None


def test_what_lasts_is_told_from_what_each_reading_has_by_itself() -> None:
    rng = np.random.default_rng(2)
    period, noise = 150.0, rng.standard_normal(4000)
    slow = np.sqrt(2.0) * 0.5 * np.sin(2 * np.pi * np.arange(4000) / period)
    assert lasting_rms(noise, period) < 0.1
    assert lasting_rms(slow, period) == pytest.approx(0.5, rel=0.1)
    assert lasting_rms(noise + slow, period) == pytest.approx(0.5, rel=0.15)
    assert lasting_rms(noise, 10.0) == pytest.approx(1.0, rel=0.05)  # too few readings a period to tell
    assert np.std(smoothed(noise, period)) == pytest.approx(1 / np.sqrt(6), rel=0.1)
    assert np.std(smoothed(slow, period) - slow) < 0.02
