"""What `colcon test` runs: the generated interfaces can be imported; topics have one place for their names."""

from __future__ import annotations


def test_messages_and_actions() -> None:
    from gsense_msgs.action import Move, Sinusoid
    from gsense_msgs.msg import LinkStatus, RigState, Topics

    assert Sinusoid.Goal(amplitude=0.15, angular_frequency=6.0, cycles=20).cycles == 20
    assert Move.Goal.HOLD != Move.Goal.STEP
    assert len(RigState().switches) == 4
    assert LinkStatus().unit_id == ""
    assert f"{Topics.MPU6050}/{Topics.IMU_RAW}" == Topics.MPU6050_IMU_RAW
