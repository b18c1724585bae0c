"""Every filter behind the interface: against its oracle, batch against single updates, cut in two, what it does."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from vqf import VQF

from gsense_fusion.attitude import attitude_at_rest
from gsense_fusion.attitude.bounded import Bounded, BoundedParameters
from gsense_fusion.attitude.complementary import Complementary, ComplementaryParameters
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error
from gsense_fusion.attitude.gyro_only import GyroOnly
from gsense_fusion.attitude.kalman import Kalman, KalmanParameters
from gsense_fusion.attitude.mahony import Mahony, MahonyParameters
from gsense_fusion.attitude.registry import FILTERS
from gsense_fusion.attitude.vqf_library import Vqf

from . import filter_oracles as oracles

FIELD = np.array([0.0, 0.42, -0.91])
G = 9.80665


def wxyz(turn: Rotation) -> Any:
    return turn.as_quat()[..., [3, 0, 1, 2]]


def rough(n: int = 400, mag: str = "none", seed: int = 3) -> tuple[Any, Any, Any, Any]:
    """Any numbers, with samples that are missing."""
    rng = np.random.default_rng(seed)
    dt, rate = rng.uniform(0.002, 0.02, n), rng.normal(size=(n, 3)) * 2
    force = rng.normal(size=(n, 3)) * 0.5 + [0, 0, 9.81]
    force[50], force[60] = 0.0, np.nan
    field = rng.normal(size=(n, 3)) * 0.2 + FIELD
    field[np.arange(n) % (5 if mag == "every fifth" else 1) != 0] = np.nan
    return dt, rate, force, None if mag == "none" else field


@lru_cache(maxsize=4)
def motion(seconds: float, rate_hz: float = 200.0, seed: int = 1, push: float = 0.0) -> tuple[Any, Any, Any, Any, Any]:
    """A true motion: rest for 3 s, then turns with accelerations of `push` m/s^2; (dt, rate, force, field, truth)."""
    n, dt = round(seconds * rate_hz), 1 / rate_hz
    t = np.arange(n) * dt
    rng = np.random.default_rng(seed)
    go = np.clip((t - 3.0) / 0.5, 0, 1)
    f, phase = rng.uniform(0.2, 1.0, 3), rng.uniform(0, 6, 3)
    rate = go[:, None] * np.sin(2 * np.pi * t[:, None] * f + phase) * 1.5
    exact = GyroOnly()
    exact.quaternion = wxyz(Rotation.from_rotvec([0.2, -0.1, 0.4]))
    turn = Rotation.from_quat(exact.batch(np.full(n, dt), rate, rate)[:, [1, 2, 3, 0]])
    acceleration = go[:, None] * push * np.sin(2 * np.pi * t[:, None] * [1.1, 1.7, 0.9])
    force = turn.inv().apply(acceleration + np.array([0, 0, G])) + rng.normal(size=(n, 3)) * 0.02
    field = turn.inv().apply(np.tile(FIELD, (n, 1)))
    field[np.arange(n) % 10 != 0] = np.nan
    return np.full(n, dt), rate + rng.normal(size=(n, 3)) * 1e-3, force, field, wxyz(turn)


START = Rotation.from_quat([0.3, -0.2, 0.5, 0.7])


@pytest.mark.parametrize("mag", ["none", "all", "every fifth"])
@pytest.mark.parametrize("name", ["complementary", "mahony", "kalman"])
def test_compiled_equals_the_oracle(name: str, mag: str) -> None:
    dt, rate, force, field = rough(mag=mag)
    parameters: dict[str, Any] = {
        "complementary": ComplementaryParameters(tau_s=0.3, heading_tau_s=0.5, gate=0.7),
        "mahony": MahonyParameters(kp=1.3, ki=0.4),
        "kalman": KalmanParameters(angle_deviation=0.1, bias_density=0.01),
    }
    compiled = FILTERS[name].make(parameters[name])
    compiled.quaternion = wxyz(START)
    oracle = getattr(oracles, name.capitalize())(START, parameters[name])
    result = compiled.batch(dt, rate, force, field)
    for i in range(len(dt)):
        turn = oracle.step(dt[i], rate[i], force[i], None if field is None else field[i])
        assert total_error(result[i][None], wxyz(turn)[None])[0] < 1e-9, i
    if name == "kalman":
        state = compiled.state
        np.testing.assert_allclose(state.bias, [kf.x[1] for kf in oracle.axes], rtol=0, atol=1e-9)
        np.testing.assert_allclose(state.covariance[:, 1], [kf.P[0, 1] for kf in oracle.axes], rtol=0, atol=1e-9)


def test_kalman_on_one_axis_is_the_thesis_filter_with_its_absolute_angle() -> None:
    rng = np.random.default_rng(2)
    n, dt, p = 4000, 0.005, KalmanParameters(angle_deviation=0.05, bias_density=0.002)
    angle = 0.6 * np.sin(np.arange(n) * 0.003)
    rate = np.gradient(angle, dt) + np.radians(1.0) + rng.normal(size=n) * 0.01
    measured = angle + rng.normal(size=n) * 0.05
    force = G * np.stack([np.zeros(n), np.sin(measured), np.cos(measured)], axis=1)
    out = Kalman(p).batch(np.full(n, dt), np.stack([rate, 0 * rate, 0 * rate], axis=1), force)
    kf = oracles.axis_filter(p)
    for i in range(n):
        oracles.predict(kf, p, dt, rate[i])
        kf.update(measured[i], R=p.angle_deviation**2)
        assert 2 * np.arctan2(out[i, 1], out[i, 0]) == pytest.approx(kf.x[0], abs=1e-9), i
    assert kf.x[1] == pytest.approx(np.radians(1.0), abs=np.radians(0.3))


def test_complementary_on_one_axis_is_equation_5_1() -> None:
    dt, p = 0.01, ComplementaryParameters(tau_s=0.7, gate=1.0)
    ours, angle, alpha = Complementary(p), 0.0, 0.7 / 0.71
    rng = np.random.default_rng(4)
    for w, a in rng.normal(size=(500, 2)) * 0.3:
        q = ours.update(dt, np.array([w, 0.0, 0.0]), G * np.array([0.0, np.sin(a), np.cos(a)]))
        angle = alpha * (angle + w * dt) + (1 - alpha) * a
        assert 2 * np.arctan2(q[1], q[0]) == pytest.approx(angle, abs=1e-12)


def test_complementary_leaves_out_what_is_not_as_long_as_gravity() -> None:
    ours = Complementary(ComplementaryParameters(gate=0.5))
    before = ours.quaternion
    for length in (G - 0.51, G + 0.51):
        ours.update(0.01, np.zeros(3), np.array([0.0, length, 0.0]))
        np.testing.assert_array_equal(ours.quaternion, before)
    ours.update(0.01, np.zeros(3), np.array([0.0, G + 0.49, 0.0]))
    assert total_error(ours.quaternion[None], before[None])[0] > 1e-4


@pytest.mark.parametrize("mag", ["none", "every fifth"])
@pytest.mark.parametrize("name", sorted(FILTERS))
def test_batch_equals_updates_and_a_run_cut_in_two(name: str, mag: str) -> None:
    dt, rate, force, field = rough(mag=mag)
    kind = FILTERS[name]
    whole, one, two = (kind.make(kind.parameters()) for _ in range(3))
    for each in (whole, one, two):
        each.prepare(0.01, 0.05)
        each.quaternion = wxyz(START)
    expected = whole.batch(dt, rate, force, field)
    tolerance = 1e-12 if name == "vqf" else 0.0
    for i in range(200):
        single = one.update(dt[i], rate[i], force[i], None if field is None else field[i])
        np.testing.assert_allclose(single, expected[i], rtol=0, atol=tolerance)
    two.state = one.state
    rest = None if field is None else field[200:]
    np.testing.assert_allclose(
        two.batch(dt[200:], rate[200:], force[200:], rest), expected[200:], rtol=0, atol=tolerance
    )


@pytest.mark.parametrize("mag", [False, True])
@pytest.mark.parametrize("name", sorted(set(FILTERS) - {"gyro_only"}))
def test_follows_a_motion(name: str, mag: bool) -> None:
    if name == "own" and not mag:
        return  # knows nothing without its two directions
    dt, rate, force, field, truth = motion(60.0)
    kind = FILTERS[name]
    ours = kind.make(kind.parameters())
    ours.prepare(0.005, 0.05)
    ours.quaternion = truth[0]
    out = ours.batch(dt, rate + np.radians([0.02, -0.02, 0.02]), force, field if mag else None)
    assert np.degrees(inclination_error(out, truth)[4000:].max()) < 1.0
    if mag:
        assert np.degrees(np.abs(heading_error(out, truth))[4000:].max()) < 3.0


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_bad_shapes_and_quaternions_are_said(name: str) -> None:
    kind = FILTERS[name]
    ours = kind.make(kind.parameters())
    with pytest.raises(ValueError, match="rate"):
        ours.batch(np.zeros(3), np.zeros((2, 3)), np.zeros((3, 3)))
    with pytest.raises(ValueError, match="quaternion"):
        ours.quaternion = np.zeros(4)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ComplementaryParameters(tau_s=0.0), "tau_s"),
        (lambda: MahonyParameters(kp=-1.0), "kp"),
        (lambda: KalmanParameters(angle_deviation=float("nan")), "angle_deviation"),
        (lambda: BoundedParameters(velocity_density=0.0), "velocity_density"),
    ],
)
def test_parameters_out_of_bounds_are_named(make: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("mag", [False, True])
def test_vqf_is_the_library(mag: bool) -> None:
    dt, rate, force, field, _ = motion(20.0)
    field = np.where(np.isnan(field), 0.0, field)
    library = VQF(0.005, magTs=0.05).updateBatch(rate, force, field) if mag else VQF(0.005).updateBatch(rate, force)
    ours = Vqf()
    ours.prepare(0.005, 0.05 if mag else None)
    out = ours.batch(dt, rate, force, np.where(field == 0.0, np.nan, field) if mag else None)
    np.testing.assert_allclose(out, library["quat9D" if mag else "quat6D"], atol=1e-12)


def test_bounded_finds_the_bias_at_rest_and_in_motion_and_withstands_accelerations() -> None:
    dt, rate, force, field, truth = motion(120.0, push=6.0)
    bias = np.radians([0.3, -0.2, 0.0])
    ours, mahony = Bounded(BoundedParameters(rest_s=1e9)), Mahony()
    ours.quaternion = mahony.quaternion = attitude_at_rest(force[0], field[0])
    out = ours.batch(dt, rate + bias, force, field)
    late = slice(12000, None)
    assert np.degrees(inclination_error(out, truth)[late].max()) < 1.0
    np.testing.assert_allclose(np.degrees(ours.state.bias[:2]), [0.3, -0.2], atol=0.06)
    other = inclination_error(mahony.batch(dt, rate + bias, force, field), truth)
    assert np.sqrt(np.mean(inclination_error(out, truth)[late] ** 2)) < 0.5 * np.sqrt(np.mean(other[late] ** 2))


def test_bounded_rejects_a_disturbed_field_and_takes_one_that_stays() -> None:
    n = 200 * 60
    dt, rate, force = np.full(n, 0.005), np.zeros((n, 3)), np.tile([0.0, 0.0, G], (n, 1))
    field = np.full((n, 3), np.nan)
    field[::10] = FIELD
    field[4000:6000:10] = FIELD + np.array([0.5, 0.0, 0.3])  # 10 s
    out = Bounded().batch(dt, rate, force, field)
    assert np.degrees(np.abs(heading_error(out, np.tile([1.0, 0, 0, 0], (n, 1))))[100:].max()) < 0.5
    field[4000::10] = FIELD + np.array([0.5, 0.0, 0.3])
    out = Bounded().batch(dt, rate, force, field)
    assert np.degrees(heading_error(out[-1:], np.array([[1.0, 0, 0, 0]]))[0]) > 10.0
