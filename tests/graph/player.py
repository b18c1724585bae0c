"""A bag played through DDS into a fusion node of its own, and what that node publishes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from gsense_fusion.bags.storage import open_storage

ROOT = Path(__file__).resolve().parents[2]


def played(
    bag: Path, compensation: Path, filters: Sequence[str], channels: Sequence[str]
) -> tuple[int, dict[str, list[bytes]]]:
    """Play a bag's MPU-6050 and encoder; returns the number of samples and each channel's messages as bytes."""
    import rclpy
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import Imu, JointState

    qos = QoSProfile(depth=5000)
    heard: dict[str, list[bytes]] = {name: [] for name in channels}
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("player", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    for name in channels:
        node.create_subscription(Imu, f"/mpu6050/{name}/imu/data", heard[name].append, qos, raw=True)
    topics = {"/mpu6050/imu/data_raw": Imu, "/rig/joint_states": JointState}
    publishers = {name: node.create_publisher(kind, name, qos) for name, kind in topics.items()}
    process = _node(compensation, filters)
    try:
        count = _play(bag, publishers, lambda seconds: executor.spin_once(timeout_sec=seconds))
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
    return count, heard


def _node(compensation: Path, filters: Sequence[str]) -> subprocess.Popen[str]:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    values = {"sensor": "mpu6050", "filter": f"[{', '.join(filters)}]", "compensation_file": str(compensation)}
    words = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
    command = [sys.executable, "-m", "gsense_fusion.fusion_node", "--ros-args", *words]
    return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path}, stderr=subprocess.PIPE, text=True)


def _play(bag: Path, publishers: dict[str, Any], spin: Any) -> int:
    """The bag's messages as bytes, in the order and about at the pace of their reception."""
    with open_storage(bag) as storage:
        raw = storage.read(list(publishers))
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
