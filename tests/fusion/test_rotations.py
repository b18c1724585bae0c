"""Chapters 2 and 4: against scipy, against each other, and where the thesis is wrong (thesis-errata.md)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gsense_fusion.rotations import (
    EARTH_RATE,
    GimbalLockError,
    dcm_from_euler,
    dcm_rate,
    earth_rate,
    ecef_to_enu,
    ecef_to_ned,
    eci_to_ecef,
    enu_to_ned,
    euler_from_dcm,
    euler_from_quaternion,
    euler_rates,
    quaternion_from_axis,
    quaternion_from_euler,
    quaternion_product,
    quaternion_rate,
    rate_from_euler_rates,
    skew,
    transform_from_vectors,
)

angle = st.floats(-3.1, 3.1)
tilt = st.floats(-1.55, 1.55)
vectors = st.tuples(*[st.floats(-5, 5)] * 3).map(np.array)
quick = settings(max_examples=60, deadline=None)


def rotation(roll: float, pitch: float, yaw: float) -> Rotation:
    """Body -> reference, one turn after the other about the axes of the reference."""
    x, y, z = (Rotation.from_rotvec(a * e) for a, e in zip((roll, pitch, yaw), np.eye(3), strict=True))
    return z * y * x


@quick
@given(angle, tilt, angle)
def test_dcm_euler_and_quaternion_are_one_rotation(roll: float, pitch: float, yaw: float) -> None:
    turn = rotation(roll, pitch, yaw)
    c, q = dcm_from_euler(roll, pitch, yaw), quaternion_from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(c, turn.as_matrix().T, atol=1e-12)
    np.testing.assert_allclose(Rotation.from_quat(q[[1, 2, 3, 0]]).as_matrix(), c.T, atol=1e-12)
    np.testing.assert_allclose(euler_from_dcm(c), [roll, pitch, yaw], atol=1e-6)
    np.testing.assert_allclose(euler_from_quaternion(q), [roll, pitch, yaw], atol=1e-6)


@quick
@given(vectors, vectors)
def test_skew_is_the_cross_product(a: Any, b: Any) -> None:
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-9)
    np.testing.assert_array_equal(skew(a), -skew(a).T)


@quick
@given(angle, tilt, angle, vectors)
def test_the_kinematic_equations_agree(roll: float, pitch: float, yaw: float, rate: Any) -> None:
    """4.1, 4.5 and 4.11 against the turn itself, by differences, and 4.5 against its inverse."""
    turn, h = rotation(roll, pitch, yaw), 1e-6
    after, before = (turn * Rotation.from_rotvec(rate * s) for s in (h, -h))
    c_rate = (after.as_matrix().T - before.as_matrix().T) / (2 * h)
    np.testing.assert_allclose(dcm_rate(turn.as_matrix().T, rate), c_rate, atol=1e-8)
    q = quaternion_from_euler(roll, pitch, yaw)
    near = [r.as_quat()[[3, 0, 1, 2]] for r in (after, before)]
    near = [n if n @ q > 0 else -n for n in near]
    np.testing.assert_allclose(quaternion_rate(q, rate), (near[0] - near[1]) / (2 * h), atol=1e-8)
    rates = euler_rates(roll, pitch, rate)
    np.testing.assert_allclose(rate_from_euler_rates(roll, pitch, rates), rate, atol=1e-8)
    moved = rotation(*(np.array([roll, pitch, yaw]) + rates * h * 1e-2))
    small = (turn.inv() * moved).as_rotvec() / (h * 1e-2)
    np.testing.assert_allclose(small, rate, atol=1e-3 * (1 + np.abs(rates).max() ** 2))


def test_all_three_integrate_to_the_same_attitude() -> None:
    def rate(t: float) -> Any:
        return np.array([np.sin(t), 0.7 * np.cos(2 * t), 0.3])

    start, options = (0.3, -0.2, 0.5), {"rtol": 1e-10, "atol": 1e-12}
    e = solve_ivp(lambda t, y: euler_rates(y[0], y[1], rate(t)), (0, 2), start, **options).y[:, -1]
    q = solve_ivp(lambda t, y: quaternion_rate(y, rate(t)), (0, 2), quaternion_from_euler(*start), **options).y[:, -1]
    c = solve_ivp(
        lambda t, y: dcm_rate(y.reshape(3, 3), rate(t)).ravel(), (0, 2), dcm_from_euler(*start).ravel(), **options
    ).y[:, -1]
    np.testing.assert_allclose(euler_from_quaternion(q), e, atol=1e-8)
    np.testing.assert_allclose(c.reshape(3, 3), dcm_from_euler(*e), atol=1e-8)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-5])
def test_gimbal_lock_is_an_error_that_says_what_to_do(pitch: float) -> None:
    for call in (
        lambda: euler_rates(0.1, pitch, [1, 2, 3]),
        lambda: euler_from_dcm(dcm_from_euler(0.1, pitch, 0.2)),
        lambda: euler_from_quaternion(quaternion_from_euler(0.1, pitch, 0.2)),
    ):
        with pytest.raises(GimbalLockError, match=r"gimbal lock: pitch is -?(90\.000|89\.999) .* use the quaternion"):
            call()


@quick
@given(vectors, angle, vectors, angle)
def test_products_and_axes(a: Any, alpha: float, b: Any, beta: float) -> None:
    if min(np.linalg.norm(a), np.linalg.norm(b)) < 1e-3:
        return
    p, q = quaternion_from_axis(a, alpha), quaternion_from_axis(b, beta)
    expected = Rotation.from_rotvec(a / np.linalg.norm(a) * alpha) * Rotation.from_rotvec(b / np.linalg.norm(b) * beta)
    ours = Rotation.from_quat(quaternion_product(p, q)[[1, 2, 3, 0]])
    assert (ours.inv() * expected).magnitude() < 1e-9


def test_an_axis_needs_a_length() -> None:
    with pytest.raises(ValueError, match="axis"):
        quaternion_from_axis([0, 0, 0], 1.0)


def test_units_of_quaternions() -> None:
    """Equation 4.8."""
    i, j, k = np.eye(4)[1:]
    for unit in (i, j, k, quaternion_product(quaternion_product(i, j), k)):
        product = quaternion_product(unit, unit) if unit[0] == 0 else unit
        np.testing.assert_array_equal(product, [-1, 0, 0, 0])


def test_earth_turns_once_in_a_sidereal_day() -> None:
    assert pytest.approx(7.292115e-5, rel=2e-7) == EARTH_RATE
    np.testing.assert_allclose(eci_to_ecef(86164.0905), np.eye(3), atol=2e-5)
    h = 1.0
    change = (eci_to_ecef(1000 + h) - eci_to_ecef(1000 - h)) / (2 * h)
    np.testing.assert_allclose(change, -skew(earth_rate()) @ eci_to_ecef(1000), atol=1e-12)


@quick
@given(st.floats(-1.5, 1.5), angle)
def test_local_frames(latitude: float, longitude: float) -> None:
    ned, enu = ecef_to_ned(latitude, longitude), ecef_to_enu(latitude, longitude)
    for c in (ned, enu, enu_to_ned()):
        np.testing.assert_allclose(c @ c.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(c) == pytest.approx(1.0)
    up = np.array([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    np.testing.assert_allclose(enu @ up, [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(ned @ up, [0, 0, -1], atol=1e-12)
    north = ned @ np.array([0.0, 0.0, 1.0])
    assert north[0] == pytest.approx(np.cos(latitude))
    assert north[1] == 0.0
    # aircraft's turns: roll, pitch, yaw of a body against NED are those against ENU with yaw from north
    np.testing.assert_allclose(enu_to_ned() @ enu, ned, atol=1e-15)


@quick
@given(angle, tilt, angle, st.lists(vectors, min_size=2, max_size=5))
def test_transform_from_vectors(roll: float, pitch: float, yaw: float, seen: list[Any]) -> None:
    source = np.array(seen)
    if np.linalg.matrix_rank(source, tol=0.1) < 2:
        return
    c = dcm_from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(transform_from_vectors(source, source @ c.T), c, atol=1e-5)


# What docs/thesis-errata.md claims: the equations as printed, and what they do.


def printed_4_4(roll: float, pitch: float, yaw: float) -> Any:
    (sf, st_, sp), (cf, ct, cp) = np.sin([roll, pitch, yaw]), np.cos([roll, pitch, yaw])
    return np.array(
        [
            [cp * ct, cf * sp + cp * sf * st_, sf * sp + cp * cf * st_],
            [-sp * ct, cp * cf - sp * sf * st_, sf * cp + sp * cf * st_],
            [st_, -sf * ct, cf * ct],
        ]
    )


def test_errata_4_4_is_no_rotation() -> None:
    c = printed_4_4(0.3, 0.4, 0.5)
    assert np.abs(c @ c.T - np.eye(3)).max() > 0.1
    # with one sign changed it is a rotation, but of the turns in the order X Y Z, not Z Y X
    c[0, 2] = np.sin(0.3) * np.sin(0.5) - np.cos(0.5) * np.cos(0.3) * np.sin(0.4)
    np.testing.assert_allclose(c @ c.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(c, Rotation.from_euler("XYZ", [0.3, 0.4, 0.5]).as_matrix().T, atol=1e-12)
    assert np.abs(c - dcm_from_euler(0.3, 0.4, 0.5)).max() > 0.1


def test_errata_4_4_does_not_fit_4_5() -> None:
    """4.5 is of yaw, pitch, roll; moved by its rates, the corrected 4.4 (X Y Z) turns by another rate."""
    e, rate, h = np.array([0.3, 0.4, 0.5]), np.array([0.2, -0.5, 0.7]), 1e-6
    moved = e + h * euler_rates(e[0], e[1], rate)
    turned = (Rotation.from_euler("XYZ", e).inv() * Rotation.from_euler("XYZ", moved)).as_rotvec() / h
    assert np.abs(turned - rate).max() > 0.1
    turned = (rotation(*e).inv() * rotation(*moved)).as_rotvec() / h
    np.testing.assert_allclose(turned, rate, atol=1e-5)


def test_errata_4_6_is_of_other_angles_than_4_5() -> None:
    roll, pitch, yaw = 0.3, 0.4, 0.5
    r, p, y = 0.2, -0.5, 0.7
    printed = np.array(
        [
            p * np.cos(yaw) + r * np.sin(pitch) * np.sin(yaw),
            -p * np.sin(yaw) + r * np.sin(pitch) * np.cos(yaw),
            y + r * np.cos(pitch),
        ]
    )
    # precession, nutation, spin: z, x, z
    before, after = (
        Rotation.from_euler("ZXZ", np.array([roll, pitch, yaw]) + s * np.array([r, p, y])) for s in (0.0, 1e-6)
    )
    np.testing.assert_allclose((before.inv() * after).as_rotvec() / 1e-6, printed, atol=1e-5)
    assert np.abs(printed - rate_from_euler_rates(roll, pitch, [r, p, y])).max() > 0.1


def test_errata_4_7_divides_rates_and_gives_no_yaw() -> None:
    """As printed it is built of angular rates: at rest it is 0/0, and scaling the turn does not scale the angle."""
    roll, pitch = 0.3, 0.4

    def printed(w: Any) -> float:
        return float(
            np.arctan2(
                w[0] * np.cos(roll) + w[2] * np.sin(roll),
                w[1] * np.cos(pitch) + w[0] * np.sin(roll) * np.sin(pitch) - w[2] * np.cos(roll) * np.sin(pitch),
            )
        )

    still = [printed(rate) for rate in ([1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0])]
    assert np.ptp(still) > 0.5  # one attitude, three yaws
    # meant is the compass: the same form with the magnetic field, levelled by roll and pitch
    yaw = 0.5
    m = dcm_from_euler(roll, pitch, yaw) @ np.array([0.4, 0.0, -0.9])
    level = dcm_from_euler(roll, pitch, 0.0).T @ m
    assert np.arctan2(-level[1], level[0]) == pytest.approx(yaw)


def test_errata_4_12_needs_both_arguments_of_the_arc_tangent() -> None:
    q = quaternion_from_euler(2.5, 0.2, -2.8)
    w, x, y, z = q
    printed = np.arctan(2 * (w * x + y * z) / (1 - 2 * (x * x + y * y)))
    assert printed == pytest.approx(2.5 - np.pi)
    np.testing.assert_allclose(euler_from_quaternion(q), [2.5, 0.2, -2.8], atol=1e-9)


def test_errata_2_5_is_of_rank_one() -> None:
    turn = rotation(0.3, 0.4, 0.5).as_matrix()
    a = np.array([1.0, 2.0, -0.5])
    printed = np.outer(turn @ a, a) / (a @ a)
    np.testing.assert_allclose(printed @ a, turn @ a, atol=1e-12)
    assert np.linalg.matrix_rank(printed) == 1
    with pytest.raises(ValueError, match="one direction"):
        transform_from_vectors(a[None], (turn @ a)[None])


def test_errata_7_2_and_7_3_lack_the_amplitude() -> None:
    w, t, h = 4.0, 0.3, 1e-4
    s = [0.15 * np.sin(w * (t + k * h)) for k in (-1, 0, 1)]
    assert (s[2] - s[0]) / (2 * h) == pytest.approx(0.15 * w * np.cos(w * t), rel=1e-6)
    assert (s[2] - 2 * s[1] + s[0]) / h**2 == pytest.approx(-0.15 * w**2 * np.sin(w * t), rel=1e-6)
