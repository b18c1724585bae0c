"""High orders of the acceleration, which the encoder's counts do not show and a gyro of large g-sensitivity does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.felt_harmonics import with_felt_orders
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray, Role

from .sessions import BASE, analysed, names

W = 6.0
KICKS = {5: 0.15, 7: 0.12, 9: 0.10, 31: 0.20}
"""m/s^2 by order of the drive; order 31 is a belt that rings at 29.6 Hz."""
ALONG = np.array([0.8, 0.6, 0.0])
LATE_S = 0.005


def _acceleration(t: FloatArray, kicks: dict[int, float] = KICKS) -> FloatArray:
    return np.asarray(sum((a * np.sin(h * W * t + h) for h, a in kicks.items()), -0.15 * W**2 * np.sin(W * t)))


def _encoder() -> CarriageMotion:
    t = np.arange(0.0, 24.0, 0.005)
    s = 0.15 * np.sin(W * t) - sum(a / (h * W) ** 2 * np.sin(h * W * t + h) for h, a in KICKS.items())
    return CarriageMotion(t, np.round(s / 5e-5) * 5e-5)


def _imu(rate_hz: float, force: FloatArray, t: FloatArray) -> CleanRun:
    noise = 4e-3 * np.sqrt(rate_hz / 2) * np.random.default_rng(3).standard_normal((len(t), 3))
    zero = np.zeros((len(t), 3))
    return CleanRun(
        path="run", axes=(0, 1, 2), name="run", role=Role.FIT, sensor="mpu6050", session=0, time=t, angular_rate=zero,
        specific_force=force + noise, valid=np.ones(len(t), dtype=bool), rate_hz=rate_hz, received=len(t), lost=0,
        pose_time=None, pose=None, temperature=None,
    )  # fmt: skip


def _felt(rate_hz: float, scale: float = 1.0, kicks: dict[int, float] = KICKS) -> tuple[CarriageMotion, FloatArray]:
    t = np.arange(0.0, 24.0, 1.0 / rate_hz)
    force = np.outer(_acceleration(t - LATE_S, kicks), scale * ALONG) + np.array([0.1, -0.2, 9.81])
    found = with_felt_orders(_encoder(), _imu(rate_hz, force, t), scale * ALONG, LATE_S)
    assert found is not None
    return found, t[(t > 1.0) & (t < 23.0)]


def _known(motion: CarriageMotion, t: FloatArray) -> FloatArray:
    return motion.at(t).acceleration + motion.ringing_at(t)[[0, 2]].sum(axis=0)


@pytest.mark.parametrize(("rate_hz", "scale"), [(200.0, 1.0), (200.0, 1.03), (100.0, 1.0), (49.0, 1.0)])
def test_what_the_encoder_misses_comes_from_the_accelerometer(rate_hz: float, scale: float) -> None:
    """At 49 Hz the ringing of the belt is folded; at the samples it is what it is."""
    found, t = _felt(rate_hz, scale)
    error = _known(found, t - LATE_S) - _acceleration(t - LATE_S)
    blind = _encoder().at(t - LATE_S).acceleration - _acceleration(t - LATE_S)
    assert np.std(blind) > 0.1
    assert np.std(error) < 0.01


def test_orders_that_gaps_leave_unknown_stay_the_encoders() -> None:
    """A part of every period is lost: a sum of many orders can be anything there."""
    t = np.arange(0.0, 24.0, 0.005)
    run = _imu(200.0, np.outer(_acceleration(t), ALONG), t)
    run = replace(run, valid=(W * t) % (2 * np.pi) < 4.5)
    found = with_felt_orders(_encoder(), run, ALONG, 0.0)
    assert found is not None
    inside = (t > 1.0) & (t < 23.0)
    assert np.abs(_known(found, t[inside]) - _acceleration(t[inside])).max() < sum(KICKS.values())


def test_position_and_speed_stay_the_encoders_and_a_ringing_belt_moves_no_carriage() -> None:
    found, t = _felt(200.0)
    motion, encoder = found.at(t), _encoder().at(t)
    assert np.array_equal(motion.position, encoder.position)
    assert np.array_equal(motion.velocity, encoder.velocity)
    rigid = {h: a for h, a in KICKS.items() if h * W < 2 * np.pi * 20.0}
    assert np.std(motion.acceleration - _acceleration(t, rigid)) < 0.01


def test_the_low_orders_stay_the_encoders_where_gravity_turns() -> None:
    found, t = _felt(200.0, kicks=KICKS | {2: 0.5, 3: 0.3})
    assert np.std(_known(found, t) - _acceleration(t)) < 0.01


def test_where_the_accelerometer_says_nothing_the_motion_is_the_encoders() -> None:
    motion = _encoder()
    t = np.arange(0.0, 24.0, 0.005)
    run = _imu(200.0, np.zeros((len(t), 3)), t)
    assert with_felt_orders(None, run, ALONG, 0.0) is None
    assert with_felt_orders(motion, run, None, 0.0) is motion
    deaf = replace(run, specific_force=np.full_like(run.specific_force, np.nan))
    assert with_felt_orders(motion, deaf, ALONG, 0.0) is motion


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [62.5, 200.0])
def test_a_large_g_sensitivity_is_no_undeclared_effect(rate_hz: float) -> None:
    g = np.random.default_rng(8).normal(0.0, 0.7 * DEG / 9.80665, (3, 3))
    matrix = tuple((float(x), float(y), float(z)) for x, y, z in g)
    chain = ChainParameters(rate_hz=rate_hz, filter_hz=min(42.0, 0.32 * rate_hz))
    result = analysed(base=replace(BASE, g_matrix=matrix, chain=chain))
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
