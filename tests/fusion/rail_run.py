"""A bag of a run on the rail with a gyro error of one's own, written message by message."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tests.fusion.bag_data import START_NS, BagWriter, header, imu, message, quaternion

RATE_HZ = 100.0
Error = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def rail_run(folder: Path, number: int, frequency: float, error: Error) -> Path:
    """3 s rest, 24 s of sine (none at frequency 0); a gyro with bias, G and `error` of the velocity (m/s) on y."""
    draw = np.random.default_rng(number)
    bag = BagWriter()
    start = START_NS + number * 40_000_000_000
    t = np.arange(0.0, 30.0, 1 / RATE_HZ)
    phase = frequency * np.clip(t - 3.0, 0.0, 24.0 if frequency else 0.0)
    moving = (t > 3.0) & (t < 27.0)
    s = 0.15 * np.sin(phase)
    v = np.where(moving, 0.15 * frequency * np.cos(phase), 0.0)
    a = np.where(moving, -0.15 * frequency**2 * np.sin(phase), 0.0)
    rates = np.array([0.01, -0.02, 0.005]) + np.outer(a, [2e-4, 1e-4, 0]) + np.outer(error(v), [0, 1, 0])
    for i, at_s in enumerate(t):
        at = start + round(at_s * 1e9)
        force = np.array([a[i], 0.0, 9.81]) + 0.02 * draw.standard_normal(3)
        bag.add("/mpu6050/imu/data_raw", at, imu(at, rates[i] + 6e-4 * draw.standard_normal(3), force))
        position = message("geometry_msgs/msg/Point", x=round(s[i] / 5e-5) * 5e-5)
        pose = message("geometry_msgs/msg/Pose", position=position, orientation=quaternion((1, 0, 0, 0)))
        bag.add("/rig/pose", at, message("geometry_msgs/msg/PoseStamped", header=header(at, "rail"), pose=pose))
    path = folder / f"run_{number}"
    bag.write(path)
    return path
