"""The compiled Madgwick filter against its oracle, and as a filter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gsense_fusion.attitude import Madgwick, MadgwickParameters, MadgwickState
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error
from gsense_fusion.attitude.registry import UnknownFilterError, filter_kind

from . import madgwick_oracle as oracle

FIELD = np.array([0.0, 0.42, -0.91])  # east, north, up: 65 degrees down, as in central Europe


def _motion(n: int = 400, mag: str = "none", seed: int = 3) -> tuple[Any, Any, Any, Any]:
    rng = np.random.default_rng(seed)
    dt = rng.uniform(0.002, 0.02, n)
    rate = rng.normal(size=(n, 3)) * 2
    force = rng.normal(size=(n, 3)) * 3 + [0, 0, 9.81]
    force[50] = 0.0
    force[60] = np.nan
    field = rng.normal(size=(n, 3)) * 0.2 + FIELD
    if mag == "none":
        return dt, rate, force, None
    if mag == "every fifth":
        field[np.arange(n) % 5 != 0] = np.nan
    return dt, rate, force, field


def _random_filter(seed: int = 1) -> Madgwick:
    q = np.random.default_rng(seed).normal(size=4)
    return Madgwick(MadgwickParameters(0.3, 0.5), MadgwickState(q / np.linalg.norm(q)))


@pytest.mark.parametrize("mag", ["none", "all", "every fifth"])
def test_compiled_equals_the_oracle(mag: str) -> None:
    dt, rate, force, field = _motion(mag=mag)
    fast = _random_filter()
    q = fast.quaternion
    result = fast.batch(dt, rate, force, field)
    for i in range(len(dt)):
        q = oracle.step(q, dt[i], rate[i], force[i], None if field is None else field[i], (0.3, 0.5))
        np.testing.assert_allclose(result[i], q, atol=1e-11)


@pytest.mark.parametrize("mag", ["none", "every fifth"])
def test_batch_equals_updates_and_a_run_cut_in_two(mag: str) -> None:
    dt, rate, force, field = _motion(mag=mag)
    whole = _random_filter().batch(dt, rate, force, field)
    one, two = _random_filter(), Madgwick(MadgwickParameters(0.3, 0.5))
    for i in range(200):
        single = one.update(dt[i], rate[i], force[i], None if field is None else field[i])
        np.testing.assert_array_equal(single, whole[i])
    two.state = one.state
    rest = None if field is None else field[200:]
    np.testing.assert_array_equal(two.batch(dt[200:], rate[200:], force[200:], rest), whole[200:])


def test_jacobian_of_the_oracle_is_the_derivative_of_its_objective() -> None:
    rng = np.random.default_rng(5)
    q, earth, body = rng.normal(size=4), rng.normal(size=3), rng.normal(size=3)
    numeric = np.empty((3, 4))
    for i in range(4):
        e = 1e-6 * np.eye(4)[i]
        numeric[:, i] = (oracle.objective(q + e, earth, body) - oracle.objective(q - e, earth, body)) / 2e-6
    np.testing.assert_allclose(oracle.jacobian(q, earth), numeric, atol=1e-8)


def test_gyro_alone_follows_the_exact_turn() -> None:
    rate, n, dt = np.array([3.0, -2.0, 5.0]), 1000, 0.01
    madgwick = Madgwick(MadgwickParameters(0.0, 0.0))
    out = madgwick.batch(np.full(n, dt), np.tile(rate, (n, 1)), np.tile([0.0, 0.0, 9.81], (n, 1)))
    x, y, z, w = Rotation.from_rotvec(rate * n * dt).as_quat()
    assert total_error(out[-1:], np.array([[w, x, y, z]]))[0] < 1e-9


def _still(truth: Any, n: int, with_field: bool) -> tuple[Any, Any, Any]:
    down = Rotation.from_quat(truth[[1, 2, 3, 0]]).inv()
    force = np.tile(down.apply([0.0, 0.0, 9.81]), (n, 1))
    return np.zeros((n, 3)), force, np.tile(down.apply(FIELD * 4.9e-5), (n, 1)) if with_field else None


@pytest.mark.parametrize("with_field", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_converges_to_the_truth_at_rest(seed: int, with_field: bool) -> None:
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=4)
    truth /= np.linalg.norm(truth)
    axis = rng.normal(size=3)
    error = Rotation.from_rotvec(np.radians(70) * axis / np.linalg.norm(axis))
    x, y, z, w = (error * Rotation.from_quat(truth[[1, 2, 3, 0]])).as_quat()
    n, dt, beta = 6000, 0.005, 0.2
    madgwick = Madgwick(MadgwickParameters(beta, beta), MadgwickState(np.array([w, x, y, z])))
    out = madgwick.batch(np.full(n, dt), *_still(truth, n, with_field))
    assert np.degrees(total_error(out[:1], truth)[0]) > 65
    limit = 3 * 2 * beta * dt  # one step is the size of the last wobble
    assert inclination_error(out[-1:], truth)[0] < limit
    if with_field:
        assert abs(heading_error(out[-1:], truth)[0]) < limit
        assert total_error(out[-1:], truth)[0] < limit


def test_field_brings_the_heading_north() -> None:
    truth = np.array([1.0, 0.0, 0.0, 0.0])
    start = np.array([np.cos(0.4), 0.0, 0.0, np.sin(0.4)])  # 0.8 rad of heading, upright
    n, dt = 4000, 0.005
    madgwick = Madgwick(MadgwickParameters(0.1, 0.1), MadgwickState(start))
    out = madgwick.batch(np.full(n, dt), *_still(truth, n, True))
    heading = heading_error(out, truth)
    assert heading[0] > 0.79
    assert abs(heading[-1]) < 0.003
    assert inclination_error(out, truth)[-1] < 0.003


def test_speed_of_the_correction_is_beta() -> None:
    """A quaternion rate of beta is a turn of 2 beta (less far from the truth: the gradient is not tangential there)."""
    truth = np.array([1.0, 0.0, 0.0, 0.0])
    start = np.array([np.cos(0.1), np.sin(0.1), 0.0, 0.0])
    madgwick = Madgwick(MadgwickParameters(0.1, 0.1), MadgwickState(start))
    out = madgwick.batch(np.full(100, 0.005), *_still(truth, 100, False))
    turned = inclination_error(out[:1], truth)[0] - inclination_error(out[-1:], truth)[0]
    assert turned == pytest.approx(2 * 0.1 * 99 * 0.005, rel=0.02)


def test_refusals() -> None:
    with pytest.raises(ValueError, match="beta_imu must be a number of 0 or more"):
        MadgwickParameters(beta_imu=-0.1)
    with pytest.raises(ValueError, match="madgwick: dt"):
        Madgwick().batch(np.zeros(4), np.zeros((4, 3)), np.zeros((3, 3)))
    with pytest.raises(UnknownFilterError, match=r"no filter 'mad'; there are: .*madgwick"):
        filter_kind("mad")


@pytest.mark.parametrize(("pitch", "least", "most"), [(0.0, 0.0, 0.3), (90.0, 1.5, 6.0)])
def test_an_oscillating_acceleration_tilts_it_where_it_stands_on_end(pitch: float, least: float, most: float) -> None:
    """The published gradient has a part along the quaternion, which the step's normalisation counts and the unit
    quaternion drops; on end it depends on the error's sign, so a swing to and fro does not average out."""
    n, hz = 3000, 100.0
    start = Rotation.from_euler("Y", pitch, degrees=True).as_quat()[[3, 0, 1, 2]]
    along = 7.35 * np.sin(7.0 * np.arange(n) / hz)
    earth = np.stack([along, np.zeros(n), np.full(n, 9.81)], axis=1)
    to_body = Rotation.from_quat(start[[1, 2, 3, 0]]).inv()
    force, up = np.ascontiguousarray(to_body.apply(earth)), to_body.apply([0.0, 0.0, 1.0])
    found = Madgwick(MadgwickParameters(), MadgwickState(start)).batch(np.full(n, 1 / hz), np.zeros((n, 3)), force)
    projected = [start]
    for f in force:
        projected.append(oracle.step(projected[-1], 1 / hz, np.zeros(3), f, None, (0.033, 0.041), projected=True))

    def mean_tilt(quaternions: Any) -> float:
        """Along the acceleration over the last periods, deg."""
        turn = Rotation.from_quat(np.array(quaternions)[-1795:, [1, 2, 3, 0]])  # 20 periods
        return abs(float(np.degrees(turn.apply(up)[:, 0].mean())))

    assert least <= mean_tilt(found) < most
    assert mean_tilt(projected) < 0.3
