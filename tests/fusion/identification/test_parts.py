"""The engine's parts against known truths: motion, delay, grid and sessions, rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.study.simulator import PlannedRun
from tests.study.simulator.carriage import drive
from tests.study.simulator.parameters import ChainParameters

from gsense_fusion.bags.run import ImuSeries, JointSeries, PoseSeries, Run
from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.effects.g_resonance import resonant
from gsense_fusion.identification.effects.reversals import Travel
from gsense_fusion.identification.effects.speed_noise import _slope
from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.recording.integrity import clean_runs, clipped
from gsense_fusion.identification.recording.stamps import grid_index
from gsense_fusion.identification.recording.stillness import distinct_poses, expand_still, still_stretches
from gsense_fusion.identification.types import IdentificationError, Role

from .sessions import BASE, made


def _imu(time: np.ndarray, rate: np.ndarray, force: np.ndarray, name: str = "run") -> Run:
    stamps = 10**18 + np.round(time * 1e9).astype(np.int64)
    imu = ImuSeries(stamps, stamps, rate, force, (True, True, True))
    return Run(Path(name), name, "mpu6050", "mpu6050/imu/data_raw", imu)


@pytest.mark.parametrize("w", [1.3, 4.0, 8.0])
def test_motion_of_a_known_sine_with_a_third_harmonic(w: float) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0, 24, 0.005) + rng.normal(0, 2e-5, 4800)
    exact = [0.15, 0.004]
    s = exact[0] * np.sin(w * t) + exact[1] * np.cos(3 * w * t + 0.4)
    motion = CarriageMotion(t, np.round(s / 5e-5) * 5e-5)
    assert motion.angular_frequency == pytest.approx(w, rel=1e-5)
    assert motion.amplitude == pytest.approx(0.15, rel=1e-3)
    at = np.linspace(3, 21, 997)
    kin = motion.at(at)
    a = -exact[0] * w**2 * np.sin(w * at) - exact[1] * 9 * w**2 * np.cos(3 * w * at + 0.4)
    v = exact[0] * w * np.cos(w * at) - exact[1] * 3 * w * np.sin(3 * w * at + 0.4)
    j = -exact[0] * w**3 * np.cos(w * at) + exact[1] * 27 * w**3 * np.sin(3 * w * at + 0.4)
    for got, true, part in ((kin.velocity, v, 1e-3), (kin.acceleration, a, 2e-3), (kin.jerk, j, 5e-3)):
        assert np.max(np.abs(got - true)) < part * np.max(np.abs(true))


def _below_5_hz(series: np.ndarray, rate_hz: float) -> np.ndarray:
    spectrum = np.fft.rfft(series * np.hanning(len(series)))
    spectrum[np.fft.rfftfreq(len(series), 1 / rate_hz) > 5.0] = 0
    return np.fft.irfft(spectrum, len(series))


@pytest.mark.parametrize("w", [1.0, 3.0, 8.0])
def test_motion_of_a_real_carriage(w: float) -> None:
    """With friction, belt and ramps; quantised to 50 um. Below 5 Hz: what the belt rings at is beyond the encoder."""
    travel = drive(PlannedRun(w, 26.0), 2.5)
    motion = CarriageMotion(travel.time[::5], np.round(travel.position[::5] / 5e-5) * 5e-5)
    assert motion.steady is not None
    assert motion.angular_frequency == pytest.approx(w, rel=1e-4)
    inside = (travel.time > motion.steady.start + 0.2) & (travel.time < motion.steady.stop - 0.2)
    assert motion.steady.duration > 17.0
    kin = motion.at(travel.time[inside])
    assert np.std(kin.position - travel.position[inside]) < 2e-5
    for got, true in ((kin.velocity, travel.velocity[inside]), (kin.acceleration, travel.acceleration[inside])):
        assert np.std(_below_5_hz(got - true, 1000.0)) < 0.01 * np.std(_below_5_hz(true, 1000.0))
    assert len(motion.still) == 2
    assert motion.still[0].stop == pytest.approx(2.0, abs=0.8)


def test_delay_of_the_imu_to_a_tenth_of_a_millisecond() -> None:
    """A second-order low-pass of 42 Hz and Q = 0.707 is sqrt(2) / w late at low frequencies."""
    session = made(base=replace(BASE, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0)))
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in session.runs]))
    true = np.sqrt(2.0) / (2 * np.pi * 42.0)
    assert campaign.delay.value == pytest.approx(true, abs=1e-4)
    assert campaign.delay.stderr < 1e-4


def test_mounting() -> None:
    session = made()
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in session.runs]))
    assert len(campaign.mountings) == 1
    rotation = campaign.mountings[0].sensor_from_rail
    assert rotation is not None
    off = Rotation.from_matrix(rotation.T @ session.sensor_from_carriage).magnitude()
    assert np.degrees(off) < 3.0  # the accelerometer's bias of 0.2 m/s^2 is 1.2 degrees


def test_turned_board_is_a_second_mounting() -> None:
    plan = (PlannedRun(4.0, 16.0), PlannedRun(6.0, 16.0, turned=True), PlannedRun(5.0, 16.0), PlannedRun(0.0, 10.0))
    session = made(base=replace(BASE, plan=plan))
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in session.runs]))
    assert len(campaign.mountings) == 2
    assert campaign.runs[0].mounting_number == campaign.runs[2].mounting_number != campaign.runs[1].mounting_number


def test_grid_with_gaps_and_jitter() -> None:
    rng = np.random.default_rng(4)
    ticks = np.delete(np.arange(5000), [10, 11, 12, 400, *range(2000, 2100)])
    stamps = np.round(ticks * 5e6 * (1 + 4e-5) + rng.normal(0, 5e4, len(ticks))).astype(np.int64)
    index, period = grid_index(stamps)
    assert np.array_equal(index, ticks)
    assert period == pytest.approx(5e-3 * (1 + 4e-5), rel=1e-6)


def test_sessions_and_losses() -> None:
    t = np.arange(0, 10, 0.01)
    rng = np.random.default_rng(5)
    rate, force = 1e-4 * rng.standard_normal((1000, 3)), rng.normal([0, 0, 9.8], 0.01, (1000, 3))
    keep = np.ones(1000, dtype=bool)
    keep[[100, 101, 500]] = False
    starts = (0.0, 65.0, 135.5, 160.0)  # gaps of 55, 60.5 and 14.5 s
    runs = [(_imu(t[keep] + s, rate[keep], force[keep], f"r{s:g}"), Role.FIT) for s in starts]
    clean = clean_runs(list(reversed(runs)))
    assert [c.session for c in clean] == [0, 0, 1, 1]
    assert [c.lost for c in clean] == [3] * 4
    assert np.array_equal(np.flatnonzero(~clean[0].valid), [100, 101, 500])


def test_the_encoder_is_read_from_the_pose_or_else_from_the_joint() -> None:
    t = np.arange(0, 10, 0.01)
    run = _imu(t, np.zeros((1000, 3)), np.tile([0.0, 0.0, 9.8], (1000, 1)))
    stamps, place = run.imu.stamp_ns, 0.1 * np.sin(t)
    gap = np.where(np.arange(1000) < 10, np.nan, place)
    joint = JointSeries(stamps, gap, np.full(1000, np.nan), np.full(1000, np.nan))
    nowhere = replace(joint, position=np.full(1000, np.nan))
    both, alone, none = (
        clean_runs([(replace(run, pose=pose, joint=state), Role.FIT)])[0]
        for pose, state in ((PoseSeries(stamps, place), nowhere), (None, joint), (None, nowhere))
    )
    assert both.pose is not None
    assert np.array_equal(both.pose, place)
    assert alone.pose is not None
    assert np.array_equal(alone.pose, place[10:])
    assert not none.has_rig


def test_too_short_a_run_is_refused_by_name() -> None:
    t = np.arange(0, 1, 0.01)
    with pytest.raises(IdentificationError, match=r"stub.*samples"):
        clean_runs([(_imu(t, np.zeros((100, 3)), np.ones((100, 3)), "stub"), Role.FIT)])


def _poses(tremor: float, count: int = 8) -> Run:
    """Poses of four seconds with a second of turning between; `tremor` in rad/s."""
    rng = np.random.default_rng(6)
    rate, force = [], []
    for turn in Rotation.random(count, random_state=2):
        up = turn.inv().apply([0, 0, 9.81])
        rate.append(
            2e-3 * rng.standard_normal((400, 3)) + tremor * np.cumsum(rng.standard_normal((400, 3)), axis=0) / 5
        )
        force.append(up + 0.02 * rng.standard_normal((400, 3)))
        rate.append(1.5 * rng.standard_normal((100, 3)))
        force.append(up + 3.0 * rng.standard_normal((100, 3)))
    total = np.concatenate(rate)
    return _imu(np.arange(len(total)) * 0.01, total, np.concatenate(force), "poses")


def test_still_stretches_are_the_poses() -> None:
    clean = clean_runs([(_poses(0.0), Role.FIT)])[0]
    stretches = still_stretches(clean)
    assert len(stretches) == 8
    assert all(2.5 < len(s) / s.rate_hz < 4.0 for s in stretches)
    assert distinct_poses(stretches) == 8
    for stretch in stretches:  # nothing of the turning is in them
        assert np.max(np.abs(stretch.angular_rate)) < 0.02


def test_hand_held_poses_and_too_few_are_refused() -> None:
    with pytest.raises(IdentificationError, match="still"):
        expand_still(clean_runs([(_poses(0.4), Role.FIT)]))
    with pytest.raises(IdentificationError, match="4 distinct still poses"):
        expand_still(clean_runs([(_poses(0.0, 4), Role.FIT)]))


def test_an_encoder_that_is_silent_for_a_while() -> None:
    t = np.arange(0.0, 30.0, 0.005)
    heard = (t < 14.0) | (t > 15.5)
    s = 0.15 * np.sin(5.0 * t)
    motion = CarriageMotion(t[heard], np.round(s[heard] / 5e-5) * 5e-5)
    assert motion.steady is not None  # the harmonics go on through it
    assert motion.steady.duration > 28.0
    assert np.abs(motion.at(t[~heard]).acceleration + 25.0 * s[~heard]).max() < 0.01
    session = made()
    run, role = next((r, role) for r, role in session.runs if r.pose is not None and np.ptp(r.pose.position) > 0.1)
    assert run.pose is not None
    stamp, n = run.pose.stamp_ns, len(run.pose.stamp_ns)
    chirp = 0.1 * np.sin(2.0 * (1e-9 * (stamp - stamp[0])) ** 1.3)
    keep = np.r_[0 : n // 2, n // 2 + round(0.08 * n) : n]
    clean = clean_runs([(replace(run, joint=None, pose=PoseSeries(stamp[keep], chirp[keep])), role)])
    (data,) = build_campaign(clean).runs
    assert data.motion is not None
    (gap,) = data.motion.silent
    moving = [w for w in data.windows if w.moving]
    assert len(moving) == 2, "a window ends where the encoder is silent and the motion is not periodic"
    assert data.run.time[moving[0].stop - 1] <= gap.start + 0.1
    assert data.run.time[moving[1].start] >= gap.stop - 0.1


def test_clipping_is_seen_at_a_full_scale_only() -> None:
    rate = np.radians(400.0) * np.sin(np.linspace(0, 60, 3000))[:, None] * np.array([1.0, 2.0, 0.1])
    force = np.tile([0.0, 0.0, 9.81], (3000, 1))
    limit = np.radians(500.0)
    found = clipped(np.clip(rate, -limit, limit), force, (0, 1, 2))
    assert [(c.effect, c.axis, c.unit) for c in found] == [("gyro_clipping", 1, "rad/s")]
    assert found[0].level == pytest.approx(limit)
    assert not clipped(rate, force, (0, 1, 2))
    assert clipped(rate, np.clip(force * 3, -2 * 9.80665, 2 * 9.80665), (0,))[0].effect == "accel_clipping"


def test_a_flat_top_is_clipping_at_any_level() -> None:
    r = np.random.default_rng(3)
    motion = 9.0 * np.sin(np.linspace(0, 200, 7000))
    force = np.column_stack([motion, 0 * motion, 9.81 + 0 * motion]) + 0.03 * r.standard_normal((7000, 3))
    rate = 1e-3 * r.standard_normal((7000, 3))
    lattice = 9.80665 / 8192
    found = clipped(rate, np.rint(np.minimum(force, 8.0) / lattice) * lattice, (0, 1, 2))
    assert [(c.effect, c.axis) for c in found] == [("accel_clipping", 0)]
    assert found[0].level == pytest.approx(8.0, abs=lattice)
    for step in (lattice, 0.05, 0.5, 2.0):  # as fine or as coarse as it may be, noisy or not
        assert not clipped(rate, np.rint(force / step) * step, (0, 1, 2))
        assert not clipped(rate, np.rint(motion / step)[:, None] * step * np.ones(3), (0, 1, 2))
        assert not clipped(np.rint(rate / step * 1e3) * step / 1e3, force, (0, 1, 2))


def test_an_axis_that_stands_still_while_the_others_do_not_is_beyond_its_range() -> None:
    rate = 1e-3 * np.random.default_rng(4).standard_normal((4000, 3)) + np.array([0.05, 0.0, -0.01])
    force = np.tile([0.0, 0.0, 9.81], (4000, 1))
    (found,) = clipped(np.rint(np.clip(rate, -0.03, 0.03) / 2.5e-4) * 2.5e-4, force, (0, 1, 2))
    assert (found.effect, found.axis, found.samples) == ("gyro_clipping", 0, 4000)
    assert found.level == pytest.approx(0.03)
    coarse = np.rint(rate / 0.05) * 0.05  # all of them stand still
    coarse[:, 1] = 0.05 * np.rint(4.0 * np.sin(np.linspace(0, 100, 4000)))  # a signal crosses steps, noise does not
    assert not clipped(coarse, force, (0, 1, 2))


def test_a_resonance_far_above_the_drive_is_the_acceleration_itself() -> None:
    t = np.arange(0, 20, 0.005)
    a = np.sin(2 * np.pi * t) * np.hanning(len(t))
    assert np.abs(resonant(t, a, 45.0, 0.1) - a).max() < 0.01
    quarter = resonant(t, a, 1.0, 0.5)  # at the resonance: a quarter of a period late, 1 / (2 damping) as large
    assert np.corrcoef(quarter[400:-400], np.roll(a, 50)[400:-400])[0, 1] > 0.995


def test_a_reversal_turns_by_twice_the_play() -> None:
    t = np.arange(0, 30, 0.01)
    s, v = 0.15 * np.sin(2 * t), 0.3 * np.cos(2 * t)
    angle = np.cumsum(Travel.of(t, s, v).rate(3e-4)) * 0.01
    between = angle[(np.abs(s) < 0.1) & (t > 1)]
    assert np.ptp(between) == pytest.approx(2.0, abs=0.05)
    assert np.abs(np.abs(between - between.mean()) - 1.0).max() < 0.1


def test_which_driver_the_noise_follows_is_told_by_likelihood() -> None:
    rng = np.random.default_rng(10)
    v = np.sin(np.linspace(0, 400, 6000))
    power = (1 + 1.5 * v**2)[:, None] * rng.exponential(size=(6000, 3))
    (slope, error, square), (_, _, modulus), (_, _, none) = (_slope(x, power) for x in (v**2, np.abs(v), np.ones(6000)))
    assert np.abs(slope - 1.5).max() < 4 * error.max()
    assert 2 * (square - modulus) > 10 > none
