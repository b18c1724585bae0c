"""The fusion node live at 500 Hz: five filters, both outputs; time from a sample to its orientations, samples lost.

./rig bench fusion_live [--seconds 20] [--rate 500]

One process publishes, one is the node, this one listens to all ten topics; over DDS on this machine. The time counts
from just before the sample is published until its orientation has been received here. Beside it the time of the sample
itself on its way here, without the node: what this machine and its load take anyway.
"""

from __future__ import annotations

import argparse
import gc
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

from tests.developer import arguments  # noqa: E402

from gsense_fusion.bags.imu_message import build_imu, parse_imu  # noqa: E402
from gsense_fusion.compensation import CompensationFile, GSensitivity, write_compensation  # noqa: E402

FILTERS = ("complementary", "kalman", "madgwick", "mahony", "vqf")
TOPIC = "mpu6050/imu/data_raw"
CHANNELS = [name + end for name in FILTERS for end in ("", "_gcomp")]


def publish(seconds: float, rate_hz: float) -> None:
    """The publisher's process: samples whose stamp is the time at which they are handed over."""
    import rclpy
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import Imu

    rclpy.init()
    node = rclpy.create_node("sensor")
    publisher = node.create_publisher(Imu, TOPIC, QoSProfile(depth=5000))
    gc.freeze()
    while publisher.get_subscription_count() < 2:
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


def cpu_seconds(process: Any) -> float:
    """Processor time of a running process, s (Linux)."""
    fields = Path(f"/proc/{process.pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def listen(fusion: Any, publisher: Any) -> tuple[dict[str, list[float]], float]:
    """Delays of every channel and of the samples themselves (TOPIC), s, until the publisher has ended.

    Returns:
        The delays, and the processor time (s) that the fusion node took for it, from the first sample on.
    """
    import rclpy
    from rclpy.experimental import EventsExecutor
    from rclpy.qos import QoSProfile
    from sensor_msgs.msg import Imu

    rclpy.init()
    node = rclpy.create_node("listener")
    heard: dict[str, list[float]] = {name: [] for name in (*CHANNELS, TOPIC)}

    def ear(times: list[float]) -> Any:
        return lambda data: times.append((time.time_ns() - parse_imu(data).stamp_ns) * 1e-9)

    for name, times in heard.items():
        topic = name if name == TOPIC else f"mpu6050/{name}/imu/data"
        node.create_subscription(Imu, topic, ear(times), QoSProfile(depth=5000), raw=True)
    gc.freeze()
    executor = EventsExecutor()
    executor.add_node(node)
    start = None
    while publisher.poll() is None:
        executor.spin_once(timeout_sec=0.1)
        if start is None and heard[TOPIC]:
            start = cpu_seconds(fusion)
    used = cpu_seconds(fusion) - (start or 0.0)
    rclpy.shutdown()
    return heard, used


def tell(what: str, seconds: list[float]) -> None:
    if not seconds:
        return
    p = np.percentile(np.array(seconds) * 1e3, [50, 99, 99.9, 100])
    print(f"{what}, ms: median {p[0]:.2f}, p99 {p[1]:.2f}, p99.9 {p[2]:.2f}, longest {p[3]:.2f}")


def main() -> int:
    parser = arguments("./rig bench fusion_live", __doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="of samples")
    parser.add_argument("--rate", type=float, default=500.0, help="samples a second, Hz")
    parser.add_argument("--publish", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    if options.publish:
        publish(options.seconds, options.rate)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        node, publisher = processes(Path(folder), options.seconds, options.rate)
        try:
            heard, cpu = listen(node, publisher)
        finally:
            node.send_signal(signal.SIGINT)
            node.wait(timeout=20)
    sent = int(publisher.stdout.read())
    direct = heard.pop(TOPIC)
    got = [len(values) for values in heard.values()]
    print(f"{options.rate:g} Hz, {len(FILTERS)} filters, both outputs: {sent} samples sent,", end=" ")
    print(f"{sent * len(CHANNELS) - sum(got)} of {sent * len(CHANNELS)} orientations lost")
    print(f"the node: {cpu / sent * 1e6:.0f} us of processor time a sample, {cpu / options.seconds:.0%} of a core")
    # the first second is held back for the start, on purpose
    skip = round(1.5 * options.rate)
    tell("sample to orientation", [v for values in heard.values() for v in values[skip:]])
    tell("the sample itself, without the node", direct[skip:])
    return 0


if __name__ == "__main__":
    sys.exit(main())
