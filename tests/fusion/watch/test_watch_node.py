"""The watch node as a process, over DDS: something enters in mid-run, and a diagnostic names it."""

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

from gsense_fusion.compensation import CompensationFile, write_compensation

rclpy = pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from geometry_msgs.msg import Vector3Stamped  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain")]

ROOT = Path(__file__).resolve().parents[3]
QOS = QoSProfile(depth=2000)
START_NS, STEP_NS, STEP_S = 1_760_000_000_000_000_000, 5_000_000, 5e-3
REST_S, ONSET_S, END_S, LAST_S = 4.0, 24.0, 44.0, 120.0
W, STROKE, BIAS = 6.0, 0.15, 0.02


def node(*parameters: str) -> subprocess.Popen[str]:
    """The node as a process."""
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "gsense_fusion.watch_node", "--ros-args"]
    command += [word for parameter in parameters for word in ("-p", parameter)]
    return subprocess.Popen(command, env=os.environ | {"PYTHONPATH": path}, stderr=subprocess.PIPE, text=True)


def spin_until(executor: Any, done: Any, seconds: float = 60.0) -> bool:
    end = time.monotonic() + seconds
    while not done() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)
    return bool(done())


def warned(statuses: list[Any]) -> bool:
    return bool(statuses) and statuses[-1].level == DiagnosticStatus.WARN


def sample(i: int, rng: np.random.Generator) -> tuple[Any, Any]:
    """A board on a swinging carriage whose gyro begins to feel the square of the acceleration."""
    t = i * STEP_NS * 1e-9
    swing = max(t - REST_S, 0.0) * W
    acceleration = -STROKE * W**2 * np.sin(swing) if swing else 0.0
    imu, joint = Imu(), JointState(name=["carriage"])
    imu.header.stamp.sec, imu.header.stamp.nanosec = divmod(START_NS + i * STEP_NS, 10**9)
    joint.header.stamp = imu.header.stamp
    imu.linear_acceleration.x, imu.linear_acceleration.z = acceleration + 0.05 * rng.standard_normal(), 9.81
    rate = BIAS + 1e-3 * rng.standard_normal(3)
    if t > ONSET_S:
        rate[1] += 4e-5 * acceleration**2
    imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z = rate.tolist()
    imu.angular_velocity_covariance[0] = imu.linear_acceleration_covariance[0] = 1e-6
    joint.position = [round(STROKE * np.sin(swing) * 20000) / 20000]
    joint.velocity = [STROKE * W * np.cos(swing) if swing else 0.0]
    return imu, joint


@pytest.mark.timeout(600)
def test_an_effect_that_enters_is_named_in_diagnostics(tmp_path: Path) -> None:
    write_compensation(tmp_path / "c.yaml", CompensationFile("mpu6050"))
    context = rclpy.Context()
    rclpy.init(context=context)
    bench = rclpy.create_node("bench", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(bench)
    residuals: list[Any] = []
    statuses: list[Any] = []
    bench.create_subscription(Vector3Stamped, "mpu6050/residual", residuals.append, QOS)
    bench.create_subscription(DiagnosticArray, "/diagnostics", lambda m: statuses.extend(m.status), QOS)
    imus = bench.create_publisher(Imu, "mpu6050/imu/data_raw", QOS)
    joints = bench.create_publisher(JointState, "rig/joint_states", QOS)
    process = node(f"compensation_file:={tmp_path / 'c.yaml'}")
    try:
        assert spin_until(
            executor, lambda: imus.get_subscription_count() and joints.get_subscription_count() and statuses
        )
        rng, count = np.random.default_rng(1), 0
        while count * STEP_S < END_S or (count * STEP_S < LAST_S and not warned(statuses)):
            imu, joint = sample(count, rng)
            joints.publish(joint)
            imus.publish(imu)
            count += 1
            if (
                count % 20 == 0
            ):  # a few times faster than a rig, and no faster than the node: it tests beside the samples
                spin_until(executor, lambda: False, 0.04)
                assert spin_until(executor, lambda due=count - 200: len(residuals) >= due)
            if count * STEP_S < ONSET_S:
                assert all(status.level == DiagnosticStatus.OK for status in statuses)
        assert spin_until(executor, lambda: len(residuals) == count)
        assert spin_until(executor, lambda: warned(statuses))
    finally:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=60)
        bench.destroy_node()
        rclpy.shutdown(context=context)
    assert process.returncode == 0
    assert "order 2 of the drive" in errors
    values = {pair.key: pair.value for pair in statuses[-1].values}
    assert values["suspects"].split()[0] == "g_squared"
    assert statuses[-1].name == "watch: mpu6050"
    before = np.array([r.vector.x for r in residuals[400:3000]])
    assert abs(before.mean()) < 3e-4  # the bias is that of the first second at rest
    assert before.std() == pytest.approx(1e-3, rel=0.2)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [((), "compensation_file"), (("compensation_file:=/no/such.yaml",), "/no/such.yaml: cannot be read")],
)
def test_what_it_cannot_use_is_one_line_and_exit_2(parameters: tuple[str, ...], words: str) -> None:
    process = node(*parameters)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 2
    assert words in errors
    assert len(errors.strip().splitlines()) == 1
