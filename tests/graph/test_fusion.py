"""The fusion nodes in the graph: with a compensation file both outputs, without it only the plain one."""

from __future__ import annotations

import numpy as np
import pytest

from .compensations import K

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]


def test_compensated_topic_needs_a_file(told):
    assert "/bno055/madgwick_gcomp/imu/data" in told.advertised
    assert "/mpu6050/madgwick/imu/data" in told.advertised
    assert "/mpu6050/madgwick_gcomp/imu/data" not in told.advertised


@pytest.mark.parametrize("topic", ["/mpu6050/madgwick/imu/data", "/bno055/madgwick_gcomp/imu/data"])
def test_orientation_is_upright_and_says_how_sure(told, topic):
    for message in told.ears.messages(topic, told.ears.heard[topic][-50:]):
        q = message.orientation
        assert np.linalg.norm([q.w, q.x, q.y, q.z]) == pytest.approx(1.0, abs=1e-6)
        assert 1 - 2 * (q.x**2 + q.y**2) > 0.98  # the board lies flat
        assert message.orientation_covariance[0] > 0.0
        assert message.header.frame_id.endswith("_link")


def test_every_sample_has_its_orientation(told):
    for raw, fused in (("mpu6050/imu/data_raw", "mpu6050/madgwick"), ("bno055/imu/data_raw", "bno055/madgwick_gcomp")):
        assert set(told.inside(f"/{raw}")) == set(told.inside(f"/{fused}/imu/data"))


def test_compensation_is_equation_7_4(told):
    """The published rate less k times the cyclic [a_y, a_z, a_x] of the same sample."""
    plain = {_stamp(m): m for m in told.ears.messages("/bno055/madgwick/imu/data")}
    checked = 0
    for message in told.ears.messages("/bno055/madgwick_gcomp/imu/data"):
        other = plain.get(_stamp(message))
        if other is None:
            continue
        a = other.linear_acceleration
        removed = _rate(other) - _rate(message)
        assert removed == pytest.approx(K * np.array([a.y, a.z, a.x]), abs=1e-12)
        checked += 1
    assert checked > 500


def _stamp(message) -> tuple[int, int]:
    return message.header.stamp.sec, message.header.stamp.nanosec


def _rate(message) -> np.ndarray:
    rate = message.angular_velocity
    return np.array([rate.x, rate.y, rate.z])
