"""Which topics of a bag belong to a sensor: by the names of the contract, under any namespace prefix."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from .cdr import LINK_STATUS, RIG_STATE
from .storage import BagError

IMU = "sensor_msgs/msg/Imu"
_POSE = "geometry_msgs/msg/PoseStamped"
_FIELD = "sensor_msgs/msg/MagneticField"
_TEMPERATURE = "sensor_msgs/msg/Temperature"
_RAW = "imu/data_raw"
_MAG = "imu/mag"


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
    mag_beside: str | None
    reference: str | None
    own: str | None
    link: str | None
    state: str | None

    def all(self) -> list[str]:
        """Every topic that is there."""
        values = [getattr(self, item.name) for item in fields(self) if item.name not in ("sensor", "notes")]
        return list(dict.fromkeys(value for value in values if value is not None))


def sensor_name(sensor: str) -> str:
    """What a sensor is called in files: the name before `imu/data_raw`; else as it was given, a whole topic too."""
    name = sensor.strip().rstrip("/")
    return name.removesuffix("/" + _RAW).rpartition("/")[2] if name.endswith("/" + _RAW) else name


def raw_topic(sensor: str) -> str:
    """The topic of a sensor's samples: a whole topic is that itself."""
    name = sensor.strip().rstrip("/")
    return name if name.startswith("/") else f"/{name}/{_RAW}"


def find_names(path: Path, topics: dict[str, str], sensor: str, reference: str | None = None) -> Names:
    """Topics of `sensor` among those of a bag.

    Args:
        path: the bag, for messages.
        topics: topic name -> message type.
        sensor: a sensor's name or a whole topic.
        reference: whole topic of the attitude to judge by; None: `reference/pose`, where there is one.

    Raises:
        BagError: no such sensor, several under different prefixes, or no such reference.
    """
    imu = _imu_topic(path, topics, sensor)
    name = imu.lstrip("/")
    prefix, short = "/", imu
    if name.endswith("/" + _RAW):
        base = imu[: -len("/" + _RAW)]
        prefix, short = base[: base.rfind("/") + 1] or "/", base[base.rfind("/") + 1 :]
    notes: list[str] = []
    foreign = short == imu

    def find(tail: str, msgtype: str) -> str | None:
        return _beside(topics, prefix, tail, msgtype, notes)

    def of_sensor(tail: str, msgtype: str) -> str | None:
        return find(f"{own}/{tail}", msgtype) or (_sibling(topics, imu, msgtype) if foreign else None)

    own = short.strip("/")
    mag = of_sensor(_MAG, _FIELD)
    mag_beside = None if mag or foreign else _field_beside(topics, prefix)
    return Names(
        sensor=short,
        imu=imu,
        pose=find("rig/pose", _POSE),
        joint=find("rig/joint_states", "sensor_msgs/msg/JointState"),
        temperature=of_sensor("temperature", _TEMPERATURE),
        battery=find("battery", "sensor_msgs/msg/BatteryState"),
        mag=mag,
        mag_beside=mag_beside,
        reference=_reference(path, topics, reference) if reference else find("reference/pose", _POSE),
        own=find(f"{own}/imu/data", IMU),
        link=find("link", LINK_STATUS),
        state=find("rig/state", RIG_STATE) if mag or mag_beside else None,
        notes=tuple(notes),
    )


def imus_beside(topics: dict[str, str], imu: str) -> list[str]:
    """Raw topics of the other IMUs under the sensor's own prefix: sensors of one board."""
    prefix = imu.removesuffix("/" + _RAW).rpartition("/")[0] + "/"
    others = {name for name, kind in topics.items() if kind == IMU and name.endswith("/" + _RAW)} - {imu}
    return sorted((n for n in others if n.removesuffix("/" + _RAW).rpartition("/")[0] + "/" == prefix), reverse=True)


def _field_beside(topics: dict[str, str], prefix: str) -> str | None:
    """The only magnetometer of another sensor under the same prefix: it rides on the same board."""
    tail = "/" + _MAG
    found = [n for n, kind in topics.items() if kind == _FIELD and n.endswith(tail)]
    found = [n for n in found if n.removesuffix(tail).rpartition("/")[0] + "/" == prefix]
    return found[0] if len(found) == 1 else None


def _sibling(topics: dict[str, str], imu: str, msgtype: str) -> str | None:
    """The only topic of a type that has the same parent: how drivers of other sensors name their topics."""
    parent = imu.rpartition("/")[0]
    found = [name for name, kind in topics.items() if kind == msgtype and name.rpartition("/")[0] == parent]
    return found[0] if len(found) == 1 else None


def _reference(path: Path, topics: dict[str, str], wanted: str) -> str:
    name = "/" + wanted.strip().strip("/")
    usable = sorted(topic for topic, kind in topics.items() if kind in (IMU, _POSE))
    if name not in usable:
        raise BagError(f"{path}: no reference {name}; Imu and PoseStamped topics there: {', '.join(usable) or 'none'}")
    return name


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
