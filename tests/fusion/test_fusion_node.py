"""The fusion node as a process, over DDS, fed by a small publisher."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gsense_fusion.compensation import CompensationFile, GSensitivity, write_compensation

rclpy = pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import Imu, MagneticField, Temperature  # noqa: E402

from gsense_fusion import fusion_node  # noqa: E402

from .bag_data import ROOT  # noqa: E402

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain")]

QOS = QoSProfile(depth=2000)
COUNT, STEP_NS, START_NS = 500, 5_000_000, 1_760_000_000_000_000_000
AT_ONCE = 300  # samples: more than the node waits for before its first output
K = 0.001


def _environment() -> dict[str, str]:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path}


def _command(**parameters: Any) -> list[str]:
    values = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
    return [sys.executable, "-m", "gsense_fusion.fusion_node", "--ros-args", *values]


class Bench:
    """A publisher of one still sensor and a listener to all that the node says."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("bench", context=self.context)
        self.executor = rclpy.executors.SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.imu = self.node.create_publisher(Imu, "mpu6050/imu/data_raw", QOS)
        self.mag = self.node.create_publisher(MagneticField, "mpu6050/imu/mag", QOS)
        self.temperature = self.node.create_publisher(Temperature, "mpu6050/temperature", QOS)
        self.heard: dict[str, list[Any]] = {}
        self.own = self.node.create_publisher(Imu, "mpu6050/imu/data", QOS)
        for name in ("madgwick", "madgwick_gcomp", "own"):
            self._listen(Imu, f"mpu6050/{name}/imu/data")
        self._listen(DiagnosticArray, "/diagnostics")

    def _listen(self, kind: Any, topic: str) -> None:
        self.heard[topic] = []
        self.node.create_subscription(kind, topic, self.heard[topic].append, QOS)

    def spin_until(self, done: Any, seconds: float = 60.0) -> bool:
        end = time.monotonic() + seconds
        while not done() and time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.05)
        return bool(done())

    def publish(self, count: int) -> None:
        """Faster than a sensor, slower than a burst, and no faster than the node takes it."""
        got = self.heard["mpu6050/madgwick/imu/data"]
        for i in range(count):
            stamp = START_NS + i * STEP_NS
            message = Imu()
            message.header.frame_id = "imu_link"
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
            force = message.linear_acceleration
            force.x, force.y, force.z = 0.0, 0.0, 9.81
            rate = message.angular_velocity
            rate.x, rate.y, rate.z = 0.01, 0.02 + K * 9.81, 0.03
            message.angular_velocity_covariance[0] = 1e-6
            message.orientation_covariance[0] = -1.0
            if i % 10 == 0:
                field = MagneticField(header=message.header)
                field.magnetic_field.x, field.magnetic_field.z = 2e-5, -4e-5
                self.mag.publish(field)
                own = Imu(header=message.header)
                own.orientation.x, own.orientation.w = 0.6, 0.8
                self.own.publish(own)
            self.imu.publish(message)
            if i % 20 == 19:
                self.spin_until(lambda: False, 0.03)
                assert self.spin_until(lambda i=i: len(got) >= i - AT_ONCE)

    def subscribed(self) -> bool:
        return self.imu.get_subscription_count() > 0 and self.mag.get_subscription_count() > 0

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def _stop(process: subprocess.Popen[str], number: int) -> str:
    process.send_signal(number)
    try:
        _, errors = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    return errors


@pytest.mark.parametrize(("compensated", "number"), [(False, signal.SIGINT), (True, signal.SIGTERM)])
def test_topics_stamps_and_contents(bench: Bench, tmp_path: Path, compensated: bool, number: int) -> None:
    parameters = {}
    if compensated:
        file = tmp_path / "compensation.yaml"
        write_compensation(file, CompensationFile("mpu6050", terms=(GSensitivity(k=K),)))
        parameters["compensation_file"] = file
    process = subprocess.Popen(_command(**parameters), env=_environment(), stderr=subprocess.PIPE, text=True)
    try:
        assert bench.spin_until(bench.subscribed), "the node did not subscribe"
        raw, comp = bench.heard["mpu6050/madgwick/imu/data"], bench.heard["mpu6050/madgwick_gcomp/imu/data"]
        assert bench.spin_until(lambda: bench.heard["/diagnostics"])  # its topic is made last
        assert bench.node.count_publishers("mpu6050/madgwick/imu/data") == 1
        bench.publish(COUNT)
        wanted = COUNT if compensated else 0
        assert bench.spin_until(lambda: len(raw) >= COUNT and len(comp) >= wanted)
        assert bench.spin_until(lambda: _running(bench))
        advertised = bench.node.count_publishers("mpu6050/madgwick_gcomp/imu/data")
    finally:
        errors = _stop(process, number)
    assert process.returncode == 0
    assert "Traceback" not in errors
    assert advertised == int(compensated)
    stamps = [START_NS + i * STEP_NS for i in range(COUNT)]
    assert [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in raw] == stamps
    _check_contents(raw[-1], 0.02 + K * 9.81)
    assert len(comp) == wanted
    if compensated:
        assert [m.header.stamp for m in comp] == [m.header.stamp for m in raw]
        _check_contents(comp[-1], 0.02)


def test_the_chips_own_attitude_stands_beside_the_filters(bench: Bench) -> None:
    process = subprocess.Popen(
        _command(filter="[madgwick, own]"), env=_environment(), stderr=subprocess.PIPE, text=True
    )
    try:
        assert bench.spin_until(bench.subscribed), "the node did not subscribe"
        assert bench.spin_until(lambda: bench.heard["/diagnostics"])
        bench.publish(COUNT)
        own = bench.heard["mpu6050/own/imu/data"]
        assert bench.spin_until(lambda: len(own) >= COUNT)
    finally:
        errors = _stop(process, signal.SIGINT)
    assert "Traceback" not in errors
    turn = own[-1].orientation
    np.testing.assert_allclose([turn.w, turn.x, turn.y, turn.z], [0.8, 0.6, 0.0, 0.0], atol=1e-3)


def _check_contents(message: Any, rate_y: float) -> None:
    turn, rate = message.orientation, message.angular_velocity
    # x points to magnetic north: a quarter turn from east
    np.testing.assert_allclose([turn.w, turn.x, turn.y, turn.z], [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=2e-3)
    np.testing.assert_allclose([rate.x, rate.y, rate.z], [0.01, rate_y, 0.03], atol=1e-12)
    assert message.linear_acceleration.z == 9.81
    assert message.header.frame_id == "imu_link"
    assert message.angular_velocity_covariance[0] == 1e-6
    assert message.orientation_covariance[0] > 0
    assert message.orientation_covariance[8] < 1


def _running(bench: Bench) -> bool:
    for message in bench.heard["/diagnostics"]:
        for status in message.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == "fusion: mpu6050" and values["samples"] == str(COUNT):
                assert status.level == b"\0", status.message
                assert (values["gaps"], values["out_of_order"], values["magnetometer"]) == ("0", "0", "used")
                return True
    return False


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"filter": "kalmann"}, "no filter 'kalmann'; there are: "),
        ({"filter": "[madgwick, x]"}, "no filter 'x'; there are: "),
        ({"filter": "7"}, "parameter filter: a name or a list of names"),
        ({"compensation_file": "/nowhere/c.yaml"}, "/nowhere/c.yaml: cannot be read"),
        ({"compensation_file": "BAD"}, "terms[0].effect: 'magic' is not known"),
        ({"compensation_file": "OTHER"}, "is for 'bno055', this node runs 'mpu6050'"),
        ({"sensor": "5"}, "'sensor'"),
        ({"beta": "-1.0"}, "beta out of range"),
        ({"use_mag": "maybe"}, "parameter use_mag: true, false or auto"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_2(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    parameters: dict[str, str],
    words: str,
) -> None:
    bad, other = tmp_path / "bad.yaml", tmp_path / "other.yaml"
    bad.write_text("schema: gsense-compensation/1\nsensor: mpu6050\nterms: [{effect: magic}]\n")
    write_compensation(other, CompensationFile("bno055"))
    files = {"BAD": str(bad), "OTHER": str(other)}
    parameters = {name: files.get(value, value) for name, value in parameters.items()}
    monkeypatch.setattr(sys, "argv", ["fusion", *_command(**parameters)[3:]])
    assert fusion_node.main() == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert words in lines[0]


def test_exit_code_of_the_process() -> None:
    done = subprocess.run(
        _command(filter="none"), env=_environment(), capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert done.stderr.startswith("fusion: no filter 'none'")
    assert len(done.stderr.strip().splitlines()) == 1
