"""A late gyro on runs whose speed wanders: what the accelerometer feels there is not late."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import ImuSeries, PoseSeries, Run
from gsense_fusion.identification.engine import close_loop
from gsense_fusion.identification.types import Role

from .sessions import SETTINGS, G, finding, names

RATE_HZ = 100.0
DELAY_S = 0.03
PAUSE_S = 3.0
RUN_S = 26.0


def _position(t: np.ndarray, w: float) -> np.ndarray:
    """A sine whose phase wanders by half a radian, at rest before and after."""
    inside = np.clip(np.minimum(t - PAUSE_S, RUN_S - PAUSE_S - t) / 3.0, 0.0, 1.0)
    return np.asarray(0.15 * inside**3 * (10 - 15 * inside + 6 * inside**2) * np.sin(w * t + 0.5 * np.sin(0.31 * t)))


def _run(number: int, w: float, rng: np.random.Generator) -> Run:
    t = 40.0 * number + np.arange(0.0, RUN_S, 1.0 / RATE_HZ)
    local, h = t - t[0], 1e-3

    def force(at: np.ndarray) -> np.ndarray:
        along = (_position(at + h, w) - 2 * _position(at, w) + _position(at - h, w)) / h**2 if w else np.zeros(len(at))
        return np.asarray(np.column_stack([along, np.zeros(len(at)), np.full(len(at), 9.80665)]))

    rate = force(local - DELAY_S) @ np.array(G).T + 0.005 * DEG * np.sqrt(RATE_HZ / 2) * rng.standard_normal(
        (len(t), 3)
    )
    felt = force(local) + 0.004 * np.sqrt(RATE_HZ / 2) * rng.standard_normal((len(t), 3))
    stamp = 10**18 + np.round(t * 1e9).astype(np.int64)
    encoder = np.round((_position(local, w) if w else np.zeros(len(t))) / 5e-5) * 5e-5
    name = f"run {number}"
    imu = ImuSeries(stamp, stamp, rate, felt, (True, True, True))
    return Run(Path(name), name, "mpu6050", "mpu6050/imu/data_raw", imu, pose=PoseSeries(stamp, encoder))


@pytest.mark.slow
def test_a_delay_leaves_nothing_on_runs_without_a_steady_drive() -> None:
    rng = np.random.default_rng(31)
    speeds = (0.0, 5.0, 8.0, 3.1, 6.5, 0.0, 7.2, 4.2)
    roles = (Role.HELD_OUT if w in (3.1, 7.2) else Role.FIT for w in speeds)
    result = close_loop(
        [(_run(i, w, rng), role) for i, (w, role) in enumerate(zip(speeds, roles, strict=True))], SETTINGS
    )
    assert result.unexplained is None, result.unexplained
    assert names(result) == ["time_offset"]
    tau = finding(result, "time_offset").parameters["tau"]
    assert tau.value == pytest.approx(DELAY_S, abs=3 * tau.stderr)
