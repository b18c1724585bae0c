"""The fusion node live at 500 Hz: five filters, both outputs; time from a sample to its orientations, samples lost.

./rig bench fusion_live [--seconds 20] [--rate 500]

One process publishes, one is the node, this one listens to all ten topics; over DDS on this machine. The time counts
from just before the sample is published until its orientation has been received here.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from gsense_fusion.bags.imu_message import build_imu, parse_imu  # noqa: E402
from gsense_fusion.compensation import CompensationFile, GSensitivity, write_compensation  # noqa: E402

FILTERS = ("complementary", "kalman", "madgwick", "mahony", "bounded")
CHANNELS = [name + end for name in FILTERS for end in ("", "_gcomp")]


def publish(seconds: float, rate_hz: float) -> None:
    """The publisher's process: samples whose stamp is the time at which they are handed over."""
    import rclpy
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import Imu

    rclpy.init()
    node = rclpy.create_node("sensor")
    publisher = node.create_publisher(Imu, "mpu6050/imu/data_raw", QoSProfile(depth=5000))
    while publisher.get_subscription_count() == 0:
        time.sleep(0.05)
    time.sleep(2.0)  # and the outputs have found their listener
    zero = (0.0,) * 9
    begin = time.monotonic()
    for i in range(round(seconds * rate_hz)):
        wait = begin + i / rate_hz - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        body = (0.0, 0.0, 0.0, 1.0, -1.0, *zero[1:], 0.001, 0.002, 0.003, *zero, 0.0, 0.1, 9.81, *zero)
        publisher.publish(build_imu(time.time_ns(), b"imu\0", *body))
    print(round(seconds * rate_hz), flush=True)
    time.sleep(3.0)
    rclpy.shutdown()


def processes(folder: Path, seconds: float, rate_hz: float) -> tuple[Any, Any]:
    file = folder / "compensation.yaml"
    write_compensation(file, CompensationFile("mpu6050", terms=(GSensitivity(k=1.8e-4),)))
    path = os.pathsep.join([str(ROOT / "src" / "gsense_fusion"), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": path}
    values = {"filter": f"[{', '.join(FILTERS)}]", "compensation_file": str(file)}
    words = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
    node = subprocess.Popen([sys.executable, "-m", "gsense_fusion.fusion_node", "--ros-args", *words], env=environment)
    command = [sys.executable, __file__, "--publish", "--seconds", str(seconds), "--rate", str(rate_hz)]
    return node, subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def listen(publisher: Any) -> dict[str, list[float]]:
    """Delays of every channel, s, until the publisher has ended."""
    import rclpy
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import Imu

    rclpy.init()
    node = rclpy.create_node("listener")
    heard: dict[str, list[float]] = {name: [] for name in CHANNELS}

    def ear(times: list[float]) -> Any:
        return lambda data: times.append((time.time_ns() - parse_imu(data).stamp_ns) * 1e-9)

    for name in CHANNELS:
        node.create_subscription(Imu, f"mpu6050/{name}/imu/data", ear(heard[name]), QoSProfile(depth=5000), raw=True)
    executor = EventsExecutor()
    executor.add_node(node)
    while publisher.poll() is None:
        executor.spin_once(timeout_sec=0.1)
    rclpy.shutdown()
    return heard


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rate", type=float, default=500.0)
    parser.add_argument("--publish", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    if options.publish:
        publish(options.seconds, options.rate)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        node, publisher = processes(Path(folder), options.seconds, options.rate)
        try:
            heard = listen(publisher)
        finally:
            node.send_signal(signal.SIGINT)
            node.wait(timeout=20)
    sent = int(publisher.stdout.read())
    usage = [len(values) for values in heard.values()]
    # the first second is held back for the start, on purpose
    late = np.array([v for values in heard.values() for v in values[round(1.5 * options.rate) :]]) * 1e3
    print(f"{options.rate:g} Hz, {len(FILTERS)} filters, both outputs: {sent} samples sent,", end=" ")
    print(f"{sent * len(CHANNELS) - sum(usage)} of {sent * len(CHANNELS)} orientations lost")
    if len(late):
        p = np.percentile(late, [50, 99, 99.9])
        print(
            f"sample to orientation, ms: median {p[0]:.2f}, p99 {p[1]:.2f}, p99.9 {p[2]:.2f}, longest {late.max():.2f}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
