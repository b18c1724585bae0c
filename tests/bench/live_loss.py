"""Frames lost in the live graph at 200 Hz: rig, board, bridge, fusion and recorder as processes over DDS.

./rig bench live_loss [--seconds 60]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.developer import arguments  # noqa: E402
from tests.domains import own_domain  # noqa: E402
from tests.graph.ears import stamp_ns  # noqa: E402
from tests.graph.processes import Graph, parameters  # noqa: E402

TYPES = get_typestore(Stores.ROS2_JAZZY)
RATES = {
    "/mpu6050/imu/data_raw": 200,
    "/lisy300/imu/data_raw": 200,
    "/bno055/imu/data_raw": 100,
    "/rig/pose": 200,
    "/mpu6050/madgwick/imu/data": 200,
}


def main() -> int:
    parser = arguments("./rig bench live_loss", __doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of the live graph")
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory(prefix="gsense-live-loss-") as name, own_domain():
        folder = Path(name)
        graph = Graph(folder)
        try:
            bag = record(graph, folder, seconds)
        finally:
            graph.close()
        return tell(bag, seconds)


def record(graph: Graph, folder: Path, seconds: float) -> Path:
    bus = folder / "bus"
    graph.start("rig", "gsense_rig", "rig", *parameters(bus=bus, autohome=True))
    port = graph.start_board("board", "--bus", str(bus), "--no-bench")
    graph.start("bridge", "gsense_driver", "bridge", *parameters(port=port))
    graph.start("fusion", "gsense_fusion", "fusion", *parameters(sensor="mpu6050"))
    while "mpu6050: " not in graph.log("fusion") or "rig on sim" not in graph.log("rig"):
        graph.check()
        time.sleep(0.1)
    graph.start("record", "gsense_rig", "record", *parameters(out=folder / "bag"))
    while "recording /mpu6050/imu/data_raw" not in graph.log("record"):
        graph.check()
        time.sleep(0.1)
    end = time.monotonic() + seconds + 2.0
    while time.monotonic() < end:
        graph.check()
        time.sleep(0.2)
    assert graph.end("record") == 0
    return folder / "bag"


def tell(bag: Path, seconds: float) -> int:
    missing_of_all = 0
    print(f"live graph, {seconds:.0f} s at 200 Hz, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    with AnyReader([bag], default_typestore=TYPES) as reader:
        for topic, rate in RATES.items():
            wanted = [c for c in reader.connections if c.topic == topic]
            stamps = np.sort([stamp_ns(bytes(raw)) for _, _, raw in reader.messages(wanted)]) * 1e-9
            stamps = stamps[stamps < stamps[0] + seconds]
            if rate == 100:  # stamps are the chip's own instants, which wander against the frames: only counted
                missing = max(0, round((stamps[-1] - stamps[0]) * rate) - len(stamps))
            else:
                missing = int(np.rint(np.diff(stamps) * rate - 1).clip(0).sum())
            missing_of_all += missing
            print(f"  {topic:32} {len(stamps):6d} messages, {missing} missing")
        wanted = [c for c in reader.connections if c.topic == "/link"]
        raws = [reader_message(raw) for _, _, raw in reader.messages(wanted)]
    lost = raws[-1]["lost"] - raws[0]["lost"]
    received = raws[-1]["received"] - raws[0]["received"]
    print(f"  {'/link':32} {received:6d} frames received, {lost} lost, {raws[-1]['corrupt']} corrupt")
    print(f"frames lost: {lost}")
    return 0 if lost == 0 and missing_of_all == 0 else 1


def reader_message(raw: bytes | memoryview) -> dict[str, int]:
    from gsense_msgs.msg import LinkStatus
    from rclpy.serialization import deserialize_message

    message = deserialize_message(bytes(raw), LinkStatus)
    return {name: getattr(message, name) for name in ("received", "lost", "corrupt")}


if __name__ == "__main__":
    sys.exit(main())
