"""The stand-in for the BNO055's own fusion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from scipy.spatial.transform import Rotation

from gsense_rig.campaign.plan import Plan, PlanRun
from gsense_rig.campaign.session import SessionSpec
from gsense_rig.campaign.simulate import simulate_campaign
from gsense_rig.sensors.ndof import LSB, ndof, reported_force


def test_follows_a_turn_and_holds_the_linear_acceleration_apart() -> None:
    n, step = 1500, 0.01
    stamp = np.arange(n) * step
    rate = np.tile([0.2, -0.1, 0.3], (n, 1)) * (stamp > 2.0)[:, None]
    turns = [Rotation.from_euler("ZYX", [30.0, 10.0, -20.0], degrees=True)]
    for w in rate[1:]:
        turns.append(turns[-1] * Rotation.from_rotvec(w * step))
    truth = Rotation.concatenate(turns)
    acceleration = np.outer(2.0 * np.sin(5.0 * stamp) * (stamp > 2.0), [1.0, 0.0, 0.0])
    force = truth.inv().apply(acceleration + np.array([0.0, 0.0, 9.81]))
    found = ndof(stamp, rate, force, truth.inv().apply([0.0, 2e-5, -4.4e-5]))
    off = (Rotation.from_quat(found) * truth.inv()).magnitude()
    assert np.degrees(off[:200].max()) < 0.1
    assert np.degrees(off.max()) < 4.0
    np.testing.assert_allclose(found / LSB, np.rint(found / LSB), atol=1e-9)
    np.testing.assert_allclose(reported_force(found, force), force, atol=0.006)


def test_a_bag_has_it_only_when_asked_for(tmp_path: Path) -> None:
    plan = Plan("still", (PlanRun("static", 2.0),))
    topics = []
    for ask in (False, True):
        simulate_campaign(plan, tmp_path / str(ask), SessionSpec(ndof=ask))
        with AnyReader([tmp_path / str(ask) / "run_00"]) as reader:
            topics.append({c.topic: c.msgcount for c in reader.connections})
            if ask:
                own = [c for c in reader.connections if c.topic == "/bno055/imu/data"]
                message = next(reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(own))
    assert set(topics[1]) - set(topics[0]) == {"/bno055/imu/data"}
    assert topics[1]["/bno055/imu/data"] == topics[1]["/bno055/imu/data_raw"]
    q = message.orientation
    assert abs(np.linalg.norm([q.x, q.y, q.z, q.w]) - 1.0) < 1e-3
    assert message.angular_velocity_covariance[0] == -1.0
    assert message.orientation_covariance[0] >= 0.0
