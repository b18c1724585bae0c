"""What the page knows of the graph: the last of everything, and rolling records for the charts. Pure; SI units."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from gsense_rig.dashboard.attitude import Quaternion
from gsense_rig.dashboard.trace import Trace


@dataclass(frozen=True)
class RigSeen:
    """The last rig/state."""

    mode: int
    switches: tuple[bool, ...]
    """Left, centre, right, optical."""
    light: int
    duty: float
    current: float
    tracking_error: float
    """Reference minus position, m; 0 where nothing is controlled."""
    fault: int
    fault_text: str


@dataclass(frozen=True)
class LinkSeen:
    """The last LinkStatus; `lost_lately`: frames lost since the one before."""

    unit_id: str
    received: int
    lost: int
    corrupt: int
    restarts: int
    rate_hz: float
    clock_offset_s: float
    clock_skew_ppm: float
    uptime_s: float
    lost_lately: int = 0

    @property
    def loss(self) -> float:
        """Share of the frames that did not arrive, 0 to 1."""
        total = self.received + self.lost + self.corrupt
        return (self.lost + self.corrupt) / total if total else 0.0


@dataclass(frozen=True)
class BatterySeen:
    """The last BatteryState: V; share 0 to 1, NaN where unknown."""

    voltage: float
    percentage: float


@dataclass(frozen=True)
class Note:
    """One status of /diagnostics; level OK 0, WARN 1, ERROR 2, STALE 3."""

    level: int
    text: str


@dataclass
class Sensor:
    """One sensor's raw topic."""

    trace: Trace = field(default_factory=lambda: Trace(6))
    """Rate about x, y, z (rad/s); specific force (m/s^2)."""
    has_force: bool = True
    temperature: float | None = None  # degrees Celsius
    heard: float = -1e9


@dataclass
class Orientation:
    """One output of a filter."""

    quaternion: Quaternion | None = None
    tilt: Trace = field(default_factory=lambda: Trace(1))
    """Inclination, degrees."""
    heard: float = -1e9


@dataclass
class GraphState:
    """All of it. Times `now` are of any steady clock, s."""

    rig: RigSeen | None = None
    rig_heard: float = -1e9
    position: float | None = None
    velocity: float | None = None
    carriage: Trace = field(default_factory=lambda: Trace(2))
    """Position, reference; m."""
    link: LinkSeen | None = None
    link_heard: float = -1e9
    battery: BatterySeen | None = None
    notes: dict[str, tuple[Note, float]] = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=lambda: defaultdict(Sensor))
    orientations: dict[tuple[str, str], Orientation] = field(default_factory=lambda: defaultdict(Orientation))
    """By sensor and the topic's name of the filter: `madgwick`, `madgwick_gcomp`."""
    filters: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """By sensor, the filters that publish now."""

    @property
    def reference(self) -> float | None:
        """Where the carriage should be now, m. From its error: rig/state's own reference is up to 20 ms (24 mm) old."""
        if self.rig is None or self.position is None:
            return None
        return self.position + self.rig.tracking_error

    def take_rig(self, rig: RigSeen, now: float) -> None:
        """A rig/state."""
        self.rig, self.rig_heard = rig, now

    def take_joint(self, stamp: float, position: float, velocity: float) -> None:
        """A rig/joint_states."""
        self.position, self.velocity = position, velocity
        self.carriage.add(stamp, (position, position if self.reference is None else self.reference))

    def take_imu(self, sensor: str, stamp: float, rate: Vector, force: Vector | None, now: float) -> None:
        """A raw sample; `force` None where the sensor does not report it."""
        seen = self.sensors[sensor]
        seen.has_force = force is not None
        seen.trace.add(stamp, (*rate, *(force or (0.0, 0.0, 0.0))))
        seen.heard = now

    def take_orientation(
        self, sensor: str, name: str, stamp: float, quaternion: Quaternion | None, now: float
    ) -> None:  # fmt: skip
        """A filter's output."""
        seen = self.orientations[sensor, name]
        seen.quaternion, seen.heard = quaternion, now
        if quaternion is not None:
            seen.tilt.add(stamp, (quaternion.inclination(),))

    def take_link(self, link: LinkSeen, now: float) -> None:
        """A LinkStatus."""
        self.link, self.link_heard = link, now

    def take_note(self, name: str, note: Note, now: float) -> None:
        """A status of /diagnostics; one that is no longer repeated is forgotten."""
        self.notes[name] = (note, now)


Vector = tuple[float, float, float]


def in_namespace(status_name: str, namespace: str) -> bool:
    """Whether a status of /diagnostics ("rig1/bridge: link") is of a node directly in `namespace` ("/rig1")."""
    parent = status_name.partition(":")[0].strip().strip("/").rpartition("/")[0]
    return parent == namespace.strip("/")


def sensor_and_filter(topic: str, namespace: str) -> tuple[str, str] | None:
    """`mpu6050` and `vqf_gcomp` of `NAMESPACE/mpu6050/vqf_gcomp/imu/data`; None of other topics."""
    prefix = "/" + f"{namespace.strip('/')}/".lstrip("/")
    parts = topic.removeprefix(prefix).split("/")
    if topic.startswith(prefix) and len(parts) == 4 and parts[2:] == ["imu", "data"]:
        return parts[0], parts[1]
    return None


def raw_sensor(topic: str, namespace: str) -> str | None:
    """`mpu6050` of `NAMESPACE/mpu6050/imu/data_raw`; None of other topics."""
    prefix = "/" + f"{namespace.strip('/')}/".lstrip("/")
    parts = topic.removeprefix(prefix).split("/")
    if topic.startswith(prefix) and len(parts) == 3 and parts[1:] == ["imu", "data_raw"]:
        return parts[0]
    return None
