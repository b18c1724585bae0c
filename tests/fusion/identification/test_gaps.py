"""What was not measured is no error of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.errors.predict import bridged
from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.harmonics import fit_harmonics
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import Role

from .sessions import SETTINGS, analysed, changed, made

GAPS_S = ((5.0, 5.6), (9.2, 9.9))


def _with_gaps(run: Run, role: str) -> tuple[Run, str]:
    if role != "held_out":
        return run, role
    imu = run.imu
    kept = ~np.any([(imu.seconds > start) & (imu.seconds < stop) for start, stop in GAPS_S], axis=0)
    series = {name: getattr(imu, name)[kept] for name in ("stamp_ns", "received_ns", "angular_rate", "specific_force")}
    return replace(run, imu=replace(imu, **series)), role


@pytest.mark.slow
def test_gaps_of_held_out_runs_leave_the_error_after_as_it_is() -> None:
    whole, holed = analysed().rate_rms, analyse(changed(made(), _with_gaps), SETTINGS).rate_rms
    assert whole.declared < 0.5 * whole.raw
    assert holed.declared == pytest.approx(whole.declared, rel=0.1)


def test_a_line_through_a_long_gap_does_not_carry_single_samples_noise() -> None:
    noise = np.random.default_rng(1).standard_normal((24000, 3))
    places = np.arange(len(noise))
    for length, most in ((1, 1.0), (400, 0.1)):
        known = places % 1200 < 1200 - length
        line = bridged(noise, known)
        assert np.array_equal(line[known], noise[known])
        assert np.sqrt(np.mean(line[~known] ** 2)) < most


def test_a_gap_at_an_end_goes_on_level() -> None:
    ramp = np.repeat(np.arange(10.0)[:, None], 3, axis=1)
    line = bridged(ramp, np.arange(10) < 8)
    assert np.array_equal(line[8:], np.full((2, 3), 6.5))


@pytest.mark.parametrize("start_s", [6.0, 6.9, 8.0])
def test_a_slow_sine_is_found_beside_a_gap_of_the_encoder(start_s: float) -> None:
    """A line through half a period bends the spectrum's peak, and its small steps are no counts of the encoder."""
    t = np.arange(0.0, 14.0, 0.005)
    rise = np.clip(np.minimum(t - 2.0, 13.0 - t) / 1.5, 0.0, 1.0) ** 2
    position = np.round(0.14 * rise * np.sin(3.67 * (t - 2.0)) / 5e-5) * 5e-5
    kept = (t < start_s) | (t > start_s + 2.0)
    motion = CarriageMotion(t[kept], position[kept])
    assert motion.angular_frequency == pytest.approx(3.67, abs=2e-3)
    assert motion.amplitude == pytest.approx(0.14, rel=1e-3)


def test_harmonics_of_a_part_of_the_period_stay_small() -> None:
    t = np.arange(0.0, 24.0, 0.005)
    t = t[(1.5 * t) % (2 * np.pi) < 4.5]
    noise = 2e-5 * np.random.default_rng(2).standard_normal(len(t))
    found = fit_harmonics(t, 0.15 * np.sin(1.5 * t) + noise, 1.5)
    everywhere = np.arange(0.0, 24.0, 0.005)
    assert np.abs(found.position_at(everywhere) - 0.15 * np.sin(1.5 * everywhere)).max() < 1e-3


def test_the_bend_at_a_gap_of_the_encoder_is_not_taken_for_motion() -> None:
    """A line through a gap of a motion that is no steady sine has bends, which no carriage made."""
    t = np.arange(0.0, 24.0, 0.005)
    rise = np.clip(np.minimum(t - 2.0, 22.0 - t) / 2.0, 0.0, 1.0)
    position = 0.14 * rise**2 * (3 - 2 * rise) * np.sin(2.5 * t + 0.9 * np.sin(0.37 * t))
    acceleration = np.gradient(np.gradient(position, t), t)
    heard = (t < 10.0) | (t > 12.0)
    force = np.outer(acceleration, [1.0, 0.0, 0.0]) + np.array([0.0, 0.0, 9.81])
    run = CleanRun(
        path="run", axes=(0, 1, 2), name="run", role=Role.FIT, sensor="mpu6050", session=0, time=t,
        angular_rate=np.zeros((len(t), 3)), specific_force=force, valid=np.ones(len(t), dtype=bool), rate_hz=200.0,
        received=len(t), lost=0, pose_time=t[heard], pose=position[heard], temperature=None,
    )  # fmt: skip
    (data,) = build_campaign([run]).runs
    assert data.motion is not None
    assert data.motion.angular_frequency is None
    error = np.abs(data.motion.at(t).acceleration - acceleration)
    moving = [w for w in data.windows if w.moving]
    assert len(moving) == 2
    assert max(error[w.start : w.stop].max() for w in moving) < 0.1 < error.max()
