"""Madgwick on measured motion with optical truth: the figures are printed (pytest -s) and bounded.

Bounds: 1.3 times the figure of the day this was written; all below 3.65 deg, what another library's Madgwick filter has
on fast translation.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from gsense_fusion.attitude import Madgwick, attitude_at_rest
from gsense_fusion.attitude.errors import heading_error, inclination_error
from gsense_fusion.bags import Run, load_run

from .bag_data import recordings


@lru_cache(maxsize=1)
def _load(trial: str) -> Run:
    return load_run(recordings("broad", trial), "broad")


@pytest.mark.data
@pytest.mark.parametrize(
    ("trial", "with_field", "largest"),
    [
        ("10_undisturbed_slow_translation_A", False, 1.3),
        ("10_undisturbed_slow_translation_A", True, 1.45),
        ("15_undisturbed_fast_translation_A", False, 3.4),
        ("24_disturbed_tapping_A", False, 0.85),
    ],
)
def test_inclination(trial: str, with_field: bool, largest: float) -> None:
    run = _load(trial)
    assert run.reference is not None
    assert run.mag is not None
    imu = run.imu
    start = imu.seconds < 1.0
    bias = imu.angular_rate[start].mean(axis=0)
    field = None
    if with_field:
        assert np.array_equal(run.mag.stamp_ns, imu.stamp_ns)
        field = run.mag.field
    madgwick = Madgwick()
    madgwick.quaternion = attitude_at_rest(
        imu.specific_force[start].mean(axis=0), None if field is None else field[start].mean(axis=0)
    )
    estimate = madgwick.batch(np.diff(imu.seconds, prepend=0.0), imu.angular_rate - bias, imu.specific_force, field)
    _, at, seen = np.intersect1d(imu.stamp_ns, run.reference.stamp_ns, return_indices=True)
    moving = imu.seconds[at] > _first_motion(imu.seconds, imu.angular_rate)
    e, r = estimate[at][moving], run.reference.orientation[seen][moving]
    inclination = _rms(inclination_error(e, r))
    print(f"{trial} field {with_field}: inclination {inclination:.2f} deg, heading {_rms(heading_error(e, r)):.2f} deg")
    assert inclination < largest


def _first_motion(seconds: np.ndarray, rate: np.ndarray) -> float:
    fast = np.linalg.norm(rate, axis=1) > np.radians(20)
    return float(seconds[np.argmax(fast)])


def _rms(angle: np.ndarray) -> float:
    return float(np.degrees(np.sqrt(np.mean(angle**2))))
