"""A bag played through DDS into the fusion node gives the numbers of `replay`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.bags.test_regression import COMPENSATION
from tests.bags.test_regression import HERE as BAGS

from gsense_fusion.bags import load_run
from gsense_fusion.bags.imu_message import parse_imu
from gsense_fusion.bags.storage import open_storage
from gsense_fusion.compensation import load_compensation
from gsense_fusion.replay import replay

rclpy = pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
FILTERS = ("complementary", "kalman", "madgwick", "mahony", "vqf", "bounded", "rig_aided")


def _node() -> subprocess.Popen[str]:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    names = f"[{', '.join(FILTERS)}]"
    values = {"sensor": "mpu6050", "filter": names, "compensation_file": str(BAGS / COMPENSATION)}
    words = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
    command = [sys.executable, "-m", "gsense_fusion.fusion_node", "--ros-args", *words]
    return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path}, stderr=subprocess.PIPE, text=True)


def _play(node: Any, spin: Any) -> int:
    """The bag's messages as bytes, in the order and about at the pace of their reception."""
    topics = {"/mpu6050/imu/data_raw": Imu, "/rig/joint_states": JointState}
    publishers = {name: node.create_publisher(kind, name, QoSProfile(depth=5000)) for name, kind in topics.items()}
    with open_storage(BAGS / "rail_7.mcap") as storage:
        raw = storage.read(list(topics))
    messages = [(at, name, data) for name, t in raw.items() for at, data in zip(t.received_ns, t.payloads, strict=True)]
    messages.sort(key=lambda message: message[0])  # those of one instant stay in order
    end = time.monotonic() + 60
    while any(p.get_subscription_count() == 0 for p in publishers.values()):
        assert time.monotonic() < end, "the node did not subscribe"
        spin(0.05)
    begin, first = time.monotonic(), messages[0][0]
    for at, name, data in messages:
        while (wait := (at - first) * 1e-9 - (time.monotonic() - begin)) > 0:
            spin(min(wait, 0.01))
        publishers[name].publish(data)
    return len(raw["/mpu6050/imu/data_raw"].payloads)


def test_a_bag_played_through_dds_gives_the_numbers_of_replay() -> None:
    channels = [name + end for name in FILTERS for end in ("", "_gcomp")]
    heard: dict[str, list[Any]] = {name: [] for name in channels}
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("player", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    for name in channels:
        node.create_subscription(Imu, f"/mpu6050/{name}/imu/data", heard[name].append, QoSProfile(depth=5000), raw=True)
    process = _node()
    try:
        count = _play(node, lambda seconds: executor.spin_once(timeout_sec=seconds))
        end = time.monotonic() + 60
        while any(len(got) < count for got in heard.values()) and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.05)
    finally:
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert "Traceback" not in errors
    run = load_run(BAGS / "rail_7.mcap", "mpu6050")
    expected = replay(run, FILTERS, load_compensation(BAGS / COMPENSATION))
    assert count == len(run.imu)
    for name in channels:
        messages = [parse_imu(data) for data in heard[name]]
        assert [m.stamp_ns for m in messages] == expected.stamp_ns.tolist(), name
        live = Rotation.from_quat([m.values[:4] for m in messages])
        offline = Rotation.from_quat(expected.estimates.quaternion[name][:, [1, 2, 3, 0]])
        apart = np.degrees((live.inv() * offline).magnitude().max())
        # the encoder's positions may come later than the 20 ms that rig_aided waits for, where the machine is loaded
        assert apart < (0.1 if name.startswith("rig_aided") else 1e-6), f"{name}: {apart} deg"
        rates = np.array([m.rate for m in messages])
        np.testing.assert_allclose(rates, expected.estimates.angular_rate[name], rtol=0, atol=1e-12, err_msg=name)
