"""What one bag holds, as arrays: the form in which every analysis sees a run.

All times are integers, nanoseconds of the clock that stamped the headers. Series are sorted by `stamp_ns`, which
increases strictly.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class ImuSeries:
    """Samples of one `sensor_msgs/Imu` topic, in the sensor's own axes (REP-145)."""

    stamp_ns: IntArray
    """Header stamps, shape (n,)."""
    received_ns: IntArray
    """When the recorder received each sample, shape (n,)."""
    angular_rate: FloatArray
    """rad/s, shape (n, 3); NaN where the message says "not reported"."""
    specific_force: FloatArray
    """m/s^2, +g on the axis that points up at rest, shape (n, 3); NaN where not reported."""
    rate_axes: tuple[bool, bool, bool]
    """Which gyro axes exist: False where every sample has a variance of 1e6 or more (the LISY300's x and y)."""
    frame_id: str = ""
    """`header.frame_id` of the first message."""
    rate_covariance: tuple[float, ...] = (0.0,) * 9
    """Of the angular velocity, in the first message, row by row."""
    force_covariance: tuple[float, ...] = (0.0,) * 9
    """Of the specific force."""
    orientation: FloatArray | None = None
    """The sensor's own attitude, (w, x, y, z), shape (n, 4), NaN where not reported; None where it never is."""

    def __len__(self) -> int:
        return len(self.stamp_ns)

    @property
    def seconds(self) -> FloatArray:
        """Time since the first sample in s, shape (n,)."""
        return np.asarray((self.stamp_ns - self.stamp_ns[0]) * 1e-9, dtype=np.float64)

    @property
    def rate_hz(self) -> float:
        """Sample rate from the median interval (losses do not lower it); NaN with fewer than two samples."""
        if len(self.stamp_ns) < 2:
            return float("nan")
        return float(1e9 / np.median(np.diff(self.stamp_ns)))


@dataclass(frozen=True)
class PoseSeries:
    """`rig/pose`: the encoder's position along the rail."""

    stamp_ns: IntArray
    position: FloatArray
    """m, shape (n,)."""


@dataclass(frozen=True)
class JointSeries:
    """`rig/joint_states` of the joint `carriage`; NaN where a quantity is not in the message."""

    stamp_ns: IntArray
    position: FloatArray
    """m, shape (n,)."""
    velocity: FloatArray
    """m/s, shape (n,)."""
    effort: FloatArray
    """N, shape (n,)."""


@dataclass(frozen=True)
class ScalarSeries:
    """Die temperature (degrees Celsius), cell voltage (V) or motor current (A)."""

    stamp_ns: IntArray
    value: FloatArray


@dataclass(frozen=True)
class MagSeries:
    """Magnetic field in the sensor's axes."""

    stamp_ns: IntArray
    field: FloatArray
    """T, shape (n, 3)."""


@dataclass(frozen=True)
class ReferencePose:
    """`/reference/pose`: optical truth, body in an east-north-up earth frame."""

    stamp_ns: IntArray
    position: FloatArray
    """m, shape (n, 3)."""
    orientation: FloatArray
    """Unit quaternions body -> earth, w, x, y, z, shape (n, 4)."""


@dataclass(frozen=True)
class LinkCounts:
    """Frames between the first and the last `link` message of the bag (the driver's counters run since its start)."""

    received: int
    lost: int
    corrupt: int
    duplicate: int
    reordered: int
    restarts: int


@dataclass(frozen=True)
class Run:
    """One bag, one run."""

    path: Path
    name: str
    """Name of the bag, for messages and reports."""
    sensor: str
    """`mpu6050` for a topic `.../mpu6050/imu/data_raw`; else the whole topic."""
    topic: str
    imu: ImuSeries
    beside: ImuSeries | None = None
    """Another IMU of the same board, where the sensor itself has no accelerometer (the LISY300)."""
    pose: PoseSeries | None = None
    joint: JointSeries | None = None
    motor_current: ScalarSeries | None = None
    """A, from `rig/state`; read where the board has a magnetometer, which feels it."""
    temperature: ScalarSeries | None = None
    battery: ScalarSeries | None = None
    mag: MagSeries | None = None
    mag_beside: MagSeries | None = None
    """Of another sensor on the same board, where the sensor has none: the rig bends its field as well."""
    reference: ReferencePose | None = None
    own: ImuSeries | None = None
    """What the sensor's own fusion says (`<sensor>/imu/data`)."""
    link: LinkCounts | None = None
    unit_id: str | None = None
    notes: tuple[str, ...] = ()
    """What was odd in the bag and what was done about it, a line each."""

    @property
    def encoder(self) -> PoseSeries | None:
        """Position along the rail: `rig/pose`, else `rig/joint_states`; None where neither tells it."""
        if self.pose is not None or self.joint is None:
            return self.pose
        known = np.isfinite(self.joint.position)
        return PoseSeries(self.joint.stamp_ns[known], self.joint.position[known]) if known.any() else None
