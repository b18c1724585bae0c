"""Makes the small bags of this folder and the bounds that they are held to. For people; the tests only read.

./rig exec python -m tests.bags.make [--bags]     without --bags: only bounds.yaml, from the bags as they are

rail_7.mcap is simulated (`gsense_rig simulate`, seed 11): the carriage at 7 rad/s for 12 s between rests, the rail
along the sensor's y axis, g-sensitivity 0.1 deg/s/g in the pattern of the thesis's equation 7.4.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from tests.developer import arguments

from gsense_fusion.bags import load_run
from gsense_fusion.compensation import CompensationFile, GSensitivity, load_compensation, write_compensation

from .segments import errors
from .test_regression import BOUNDS, COMPENSATION, HERE, RECORDED, SIMULATED, home

K = float(np.radians(0.1) / 9.80665)
TOPICS = (
    "/mpu6050/imu/data_raw",
    "/bno055/imu/data_raw",
    "/bno055/imu/data",
    "/bno055/imu/mag",
    "/rig/pose",
    "/rig/joint_states",
)
SLACK, LEAST = 1.15, 0.01
"""A bound is the error of today times this, and this many degrees more."""


def make_bag() -> None:
    """Simulate, and keep what the filters need."""
    run = {
        "shape": "sine",
        "amplitude": 0.15,
        "angular_frequency": 7.0,
        "duration": 12.0,
        "mounting": "90",
        "role": "fit",
    }
    store = get_typestore(Stores.ROS2_JAZZY)
    with tempfile.TemporaryDirectory() as folder:
        plan = Path(folder, "plan.yaml")
        plan.write_text(yaml.safe_dump({"runs": [run]}))
        command = [
            sys.executable,
            "-m",
            "gsense_rig.simulate",
            str(plan),
            "--out",
            f"{folder}/out",
            "--seed",
            "11",
            "--ndof",
        ]
        subprocess.run([*command, "--effect", f"g_sensitivity={K}"], check=True)
        writer = Writer(Path(folder, "small"), version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with Reader(Path(folder, "out", "run_00")) as reader, writer:
            kept = {c.id: c for c in reader.connections if c.topic in TOPICS}
            made = {c.id: writer.add_connection(c.topic, c.msgtype, typestore=store) for c in kept.values()}
            for connection, stamp, data in reader.messages(list(kept.values())):
                writer.write(made[connection.id], stamp, data)
        (HERE / "rail_7.mcap").write_bytes(Path(folder, "small", "small.mcap").read_bytes())
    write_compensation(HERE / COMPENSATION, CompensationFile("mpu6050", terms=(GSensitivity(k=K),)))


def bound(value: float) -> float:
    return round(value * SLACK + LEAST, 4)


def make_bounds() -> None:
    stored = {}
    for bag, sensor, compensation in (*SIMULATED, *RECORDED):
        path = home() / "broad" / bag if sensor == "broad" else HERE / bag
        if not path.exists():
            raise SystemExit(f"{path} is not here: set GSENSE_DATA, or the bounds would lose it")
        file = load_compensation(HERE / compensation) if compensation else None
        found = errors(load_run(path, sensor), file)
        stored[f"{bag} {sensor}"] = {
            channel: {part: {name: bound(v) for name, v in values.items()} for part, values in parts.items()}
            for channel, parts in found.items()
        }
    BOUNDS.write_text("# deg rms; made by make.py\n" + yaml.safe_dump(stored, sort_keys=False, default_flow_style=None))


if __name__ == "__main__":
    parser = arguments("./rig exec python -m tests.bags.make", __doc__)
    parser.add_argument("--bags", action="store_true", help="the bags, too, not the bounds alone")
    if parser.parse_args().bags:
        make_bag()
    make_bounds()
