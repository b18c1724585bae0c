"""What a recorder takes of a graph in which other rigs publish, too."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

from gsense_rig.recording.discovery import Wanted

SHARED = ("/diagnostics", "/tf", "/tf_static", "/reference/pose", "/vectornav/imu", "/rosout")
RIG = (
    "bridge/transition_event",
    "mpu6050/imu/data_raw",
    "bno055/madgwick_gcomp/imu/data",
    "link",
    "battery",
    "rig/pose",
    "rig/state",
    "rig/joint_states",
)


@pytest.mark.parametrize("name", RIG)
def test_in_a_namespace_other_rigs_are_left_out(name: str) -> None:
    wanted = Wanted(frozenset(), "/lab/a")
    assert f"/lab/a/{name}" in wanted
    for other in ("", "/lab", "/b", "/lab/ab"):
        assert f"{other}/{name}" not in wanted


def test_what_all_share_is_recorded() -> None:
    for wanted in (Wanted(frozenset()), Wanted(frozenset(), "/a")):
        assert all(name in wanted for name in SHARED)
        assert "/a/_hidden" not in wanted


def test_without_a_namespace_all_is_recorded_and_names_are_taken_as_given() -> None:
    assert all(f"/b/{name}" in Wanted(frozenset()) for name in RIG)
    assert "/b/link" in Wanted(frozenset(["/b/link"]), "/a")
    assert "/a/link" not in Wanted(frozenset(["/b/link"]), "/a")
