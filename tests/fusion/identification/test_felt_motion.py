"""A motion that is no sine, where the encoder shows its acceleration badly and the accelerometer feels it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import ImuSeries, PoseSeries, Run
from gsense_fusion.identification.engine import analyse
from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.felt_motion import with_felt_motion
from gsense_fusion.identification.motion.mounting import run_geometry
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray, Role
from gsense_fusion.identification.verdict.residual import residuals

from .sessions import SETTINGS, G

ALONG = np.array([0.6, -0.8, 0.0])
LATE_S = 0.004
SINES = ((0.06, 2.1, 0.3), (0.04, 5.3, 1.7), (0.012, 11.9, 0.9), (0.004, 22.3, 2.2))
"""Pushed by hand: amplitude in m, rad/s, phase."""
STEP_S = 1.3
DWELL_S = 0.9


def pushed(t: FloatArray) -> FloatArray:
    """Position in m; at rest for 3 s before and after."""
    inside = np.clip(np.minimum(t - 3.0, 27.0 - t) / 2.0, 0.0, 1.0)
    return np.asarray(inside**3 * (10 - 15 * inside + 6 * inside**2) * sum(a * np.sin(w * t + p) for a, w, p in SINES))


def stepped(t: FloatArray) -> FloatArray:
    """To and fro between 4 and 26 s, with a dwell after each step."""
    local = np.clip(t - 4.0, 0.0, 22.0)
    number, part = np.divmod(local, STEP_S + DWELL_S)
    x = np.clip(part / STEP_S, 0.0, 1.0)
    there = x**3 * (10 - 15 * x + 6 * x**2)
    return np.asarray(0.2 * np.where(number % 2 == 0, there, 1.0 - there))


def acceleration(t: FloatArray) -> FloatArray:
    """Of the push, m/s^2."""
    h = 1e-3
    return (pushed(t + h) - 2 * pushed(t) + pushed(t - h)) / h**2


def encoder(rate_hz: float, jitter_s: float) -> CarriageMotion:
    t = np.arange(0.0, 30.0, 1 / rate_hz)
    stamps = t + jitter_s * np.random.default_rng(4).standard_normal(len(t))
    order = np.argsort(stamps)
    return CarriageMotion(stamps[order], np.round(pushed(t) / 5e-5)[order] * 5e-5)


def imu(rate_hz: float = 200.0, turning: float = 0.0) -> CleanRun:
    t = np.arange(0.0, 30.0, 1 / rate_hz)
    noise = 4e-3 * np.sqrt(rate_hz / 2) * np.random.default_rng(3).standard_normal((len(t), 3))
    along = 1.01 * acceleration(t - LATE_S) + turning * np.sin(0.25 * 2 * np.pi * t)
    return CleanRun(
        path="run", axes=(0, 1, 2), name="run", role=Role.FIT, sensor="mpu6050", session=0, time=t,
        angular_rate=np.zeros((len(t), 3)), specific_force=np.outer(along, ALONG) + np.array([0.1, -0.2, 9.81]) + noise,
        valid=np.ones(len(t), dtype=bool), rate_hz=rate_hz, received=len(t), lost=0, pose_time=None, pose=None,
        temperature=None,
    )  # fmt: skip


def error(motion: CarriageMotion | None) -> float:
    """Of the acceleration, as a part of it."""
    assert motion is not None
    t = np.arange(4.0, 26.0, 0.01)
    return float(np.std(motion.at(t).acceleration - acceleration(t)) / np.std(acceleration(t)))


@pytest.mark.parametrize(("rate_hz", "jitter_s"), [(10.0, 0.0), (200.0, 2e-3)])
@pytest.mark.parametrize("imu_hz", [100.0, 200.0])
def test_what_the_encoder_shows_badly_comes_from_the_accelerometer(
    rate_hz: float, jitter_s: float, imu_hz: float
) -> None:
    motion = encoder(rate_hz, jitter_s)
    assert motion.harmonics is None
    assert error(motion) > 0.05
    felt = with_felt_motion(motion, imu(imu_hz), ALONG, LATE_S)
    assert error(felt) < 0.02
    t = np.arange(4.0, 26.0, 0.01)
    assert felt is not None
    speed = np.gradient(pushed(t), t)
    assert np.std(felt.at(t).velocity - speed) < 0.5 * np.std(motion.at(t).velocity - speed)


def test_a_good_encoder_stays_and_so_do_slow_turns_of_gravity() -> None:
    motion = encoder(200.0, 0.0)
    t = np.arange(4.0, 26.0, 0.01)
    felt = with_felt_motion(motion, imu(turning=0.3), ALONG, LATE_S)
    assert felt is not None
    added = felt.at(t).acceleration - motion.at(t).acceleration
    assert np.std(added) < 0.01 * np.std(acceleration(t))


def test_a_direction_that_is_not_known_changes_nothing() -> None:
    motion = encoder(10.0, 0.0)
    assert with_felt_motion(motion, imu(), None, LATE_S) is motion


def test_the_direction_of_the_rail_is_found_through_an_encoder_of_much_noise() -> None:
    found = run_geometry(imu(), encoder(200.0, 4e-3))
    assert found.heading is not None
    assert found.heading.along == pytest.approx(ALONG, abs=0.02)


def test_dwells_between_steps_are_part_of_the_motion() -> None:
    t = np.arange(0.0, 30.0, 0.005)
    motion = CarriageMotion(t, stepped(t))
    assert motion.harmonics is None
    assert motion.moving is not None
    assert motion.moving.duration > 20.0
    assert len(motion.still) == 2
    assert all(i.stop < 4.5 or i.start > 24.5 for i in motion.still)


def pushed_run(number: int, still: bool, rng: np.random.Generator) -> Run:
    """A run of 30 s (60 s at rest) whose encoder stamps jitter; the gyro shows G f and noise alone."""
    t = 70.0 * number + np.arange(0.0, 60.0 if still else 30.0, 5e-3)
    local = t - t[0]
    size = 0.0 if still else 0.4 + 0.2 * number
    along = size * acceleration(local) if not still else 0.0 * t
    force = np.outer(along, [1.0, 0.0, 0.0]) + np.array([0.0, 0.0, 9.81])
    rate = force @ np.array(G).T + 0.05 * DEG * rng.standard_normal((len(t), 3))
    stamps = np.round(t * 1e9).astype(np.int64)
    heard = np.sort(t + 1.5e-3 * rng.standard_normal(len(t)))
    series = ImuSeries(stamps, stamps, rate, force + 0.04 * rng.standard_normal((len(t), 3)), (True, True, True))
    pose = PoseSeries(np.round(heard * 1e9).astype(np.int64), size * pushed(local))
    return Run(Path(f"run{number}"), f"run{number}", "mpu6050", "/mpu6050/imu/data_raw", series, pose=pose)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_nothing_is_found_behind_stamps_that_jitter_under_a_push(seed: int) -> None:
    """Along the rail nothing is felt beyond the motion, not even noise: at rest no response to that is taken off."""
    rng = np.random.default_rng(seed)
    runs = [(pushed_run(i, i in (0, 7), rng), Role.FIT) for i in range(8)]
    found = analyse(runs, SETTINGS, lambda _text, _part: None)
    assert not found.claims.names
    assert not found.claims.symptoms
    left = residuals(found.likelihood, found.claims.full, found.campaign.fit)
    rest = [w for w in left if not w.window.moving]
    for low in np.arange(6.0, 24.0, 2.0):
        power = [w.power[(w.frequency >= low) & (w.frequency < low + 2.0)] for w in rest]
        assert np.concatenate(power).mean(axis=0) == pytest.approx(1.0, abs=0.35)
