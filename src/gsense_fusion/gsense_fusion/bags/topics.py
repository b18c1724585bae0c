"""Which topics of a bag belong to a sensor: by the names of the contract, under any namespace prefix."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from .cdr import LINK_STATUS, RIG_STATE
from .storage import BagError

IMU = "sensor_msgs/msg/Imu"
_POSE = "geometry_msgs/msg/PoseStamped"
_RAW = "imu/data_raw"


@dataclass(frozen=True)
class Names:
    """Topics of one sensor and of the rig beside it; None where the bag has none."""

    sensor: str
    imu: str
    notes: tuple[str, ...]
    pose: str | None
    joint: str | None
    temperature: str | None
    battery: str | None
    mag: str | None
    reference: str | None
    own: str | None
    link: str | None
    state: str | None

    def all(self) -> list[str]:
        """Every topic that is there."""
        values = [getattr(self, item.name) for item in fields(self) if item.name not in ("sensor", "notes")]
        return list(dict.fromkeys(value for value in values if value is not None))


def find_names(path: Path, topics: dict[str, str], sensor: str) -> Names:
    """Topics of `sensor` among those of a bag.

    Args:
        path: the bag, for messages.
        topics: topic name -> message type.
        sensor: a sensor's name or a whole topic.

    Raises:
        BagError: no such sensor, or several under different prefixes.
    """
    imu = _imu_topic(path, topics, sensor)
    name = imu.lstrip("/")
    prefix, short = "/", imu
    if name.endswith("/" + _RAW):
        base = imu[: -len("/" + _RAW)]
        prefix, short = base[: base.rfind("/") + 1] or "/", base[base.rfind("/") + 1 :]
    notes: list[str] = []

    def find(tail: str, msgtype: str) -> str | None:
        return _beside(topics, prefix, tail, msgtype, notes)

    own = short.strip("/")
    mag = find(f"{own}/imu/mag", "sensor_msgs/msg/MagneticField")
    return Names(
        sensor=short,
        imu=imu,
        pose=find("rig/pose", _POSE),
        joint=find("rig/joint_states", "sensor_msgs/msg/JointState"),
        temperature=find(f"{own}/temperature", "sensor_msgs/msg/Temperature"),
        battery=find("battery", "sensor_msgs/msg/BatteryState"),
        mag=mag,
        reference=find("reference/pose", _POSE),
        own=find(f"{own}/imu/data", IMU),
        link=find("link", LINK_STATUS),
        state=find("rig/state", RIG_STATE) if mag else None,
        notes=tuple(notes),
    )


def imus_beside(topics: dict[str, str], imu: str) -> list[str]:
    """Raw topics of the other IMUs under the sensor's own prefix: sensors of one board."""
    prefix = imu.removesuffix("/" + _RAW).rpartition("/")[0] + "/"
    others = {name for name, kind in topics.items() if kind == IMU and name.endswith("/" + _RAW)} - {imu}
    return sorted((n for n in others if n.removesuffix("/" + _RAW).rpartition("/")[0] + "/" == prefix), reverse=True)


def _imu_topic(path: Path, topics: dict[str, str], sensor: str) -> str:
    imus = sorted(name for name, msgtype in topics.items() if msgtype == IMU)
    wanted = sensor.strip()
    exact = wanted if wanted.startswith("/") else "/" + wanted
    if exact in imus:
        return exact
    tail = f"{exact.rstrip('/')}/{_RAW}"
    found = [name for name in imus if name.endswith(tail)]
    if len(found) == 1:
        return found[0]
    if found:
        raise BagError(f"{path}: several topics of sensor {sensor!r}; give one whole topic of {', '.join(found)}")
    if exact in topics:
        raise BagError(f"{path}: {exact} is a {topics[exact]}, not a {IMU}; IMU topics: {', '.join(imus) or 'none'}")
    if not imus:
        have = ", ".join(sorted(topics)) or "none at all"
        raise BagError(f"{path}: no {IMU} topic in this bag (topics: {have})")
    raise BagError(f"{path}: no sensor {sensor!r} in this bag; IMU topics there: {', '.join(imus)}")


def _beside(topics: dict[str, str], prefix: str, tail: str, msgtype: str, notes: list[str]) -> str | None:
    """The topic `tail` under the sensor's own prefix; else the only one under another."""
    found = sorted(name for name, kind in topics.items() if kind == msgtype and name.endswith("/" + tail))
    if prefix + tail in found:
        return prefix + tail
    if len(found) > 1:
        # the nearest namespace: the one that shares most of the sensor's prefix
        found.sort(key=lambda name: (-_shared(name, prefix), name))
        notes.append(f"several topics end in {tail}; {found[0]} is used")
    return found[0] if found else None


def _shared(name: str, prefix: str) -> int:
    count = 0
    for left, right in zip(name.split("/"), prefix.split("/"), strict=False):
        if left != right:
            break
        count += 1
    return count
