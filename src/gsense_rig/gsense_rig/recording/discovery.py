"""Which topics of the graph to record, and with what quality of service."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from gsense_msgs.msg import Topics
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

DEPTH = 4000
"""Samples that a subscription keeps: several seconds of every topic together, so that no stall loses one."""
_SENSORS = (Topics.MPU6050, Topics.BNO055, Topics.LISY300)
_NAMES = (
    *(Topics.LINK, Topics.BATTERY, Topics.RIG_POSE, Topics.RIG_STATE, Topics.RIG_JOINT_STATES),
    *("robot_description", "bridge/transition_event"),
)
_TAILS = tuple(f"/{name}" for name in _NAMES)
_NS = 1_000_000_000
_FOREVER = QosTime(9223372036, 854775807)
_FOREVER_NS = 9223372036854775807


@dataclass(frozen=True)
class Wanted:
    """Topics to record: those named; else all that are not hidden and no other rig's.

    In a namespace, topics that are called as this graph's are, under another prefix, are another rig's. Without a
    namespace all are recorded: a recorder by the side of a rig in `/a` need not be told so.
    """

    names: frozenset[str]
    """Resolved names; empty: all."""
    namespace: str = "/"
    """Of the recorder."""

    @classmethod
    def resolve(cls, node: Any, names: Sequence[str]) -> Wanted:
        """Names as given on the command line, resolved in the node's namespace."""
        return cls(frozenset(node.resolve_topic_name(name) for name in names if name), node.get_namespace())

    def __contains__(self, name: object) -> bool:
        """Whether to record a topic."""
        if self.names:
            return name in self.names
        hidden = any(part.startswith("_") for part in str(name).split("/"))
        return not hidden and not self._is_of_another_rig(str(name))

    def _is_of_another_rig(self, name: str) -> bool:
        if self.namespace == "/" or name.startswith(f"{self.namespace}/"):
            return False
        return name.endswith(_TAILS) or any(f"/{sensor}/" in name for sensor in _SENSORS)


def message_class(msgtype: str) -> Any:
    """The Python class of `package/msg/Name`; None where its package is not installed."""
    package, kind, name = msgtype.split("/")
    try:
        return getattr(import_module(f"{package}.{kind}"), name, None)
    except ImportError:
        return None


def subscription_qos(publishers: Iterable[Any]) -> QoSProfile:
    """The strongest that every publisher offers, and deep."""
    profiles = [publisher.qos_profile for publisher in publishers]
    reliable = all(profile.reliability == ReliabilityPolicy.RELIABLE for profile in profiles)
    transient = all(profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for profile in profiles)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if transient else DurabilityPolicy.VOLATILE,
    )


def recorded_qos(profile: QoSProfile) -> Qos:
    """A publisher's profile for metadata.yaml; what the middleware does not tell is said so."""
    return Qos(
        history=_named(QosHistory, profile.history, HistoryPolicy, QosHistory.UNKNOWN),
        depth=profile.depth,
        reliability=_named(QosReliability, profile.reliability, ReliabilityPolicy, QosReliability.UNKNOWN),
        durability=_named(QosDurability, profile.durability, DurabilityPolicy, QosDurability.UNKNOWN),
        deadline=_time(profile.deadline.nanoseconds),
        lifespan=_time(profile.lifespan.nanoseconds),
        liveliness=_named(QosLiveliness, profile.liveliness, LivelinessPolicy, QosLiveliness.UNKNOWN),
        liveliness_lease_duration=_time(profile.liveliness_lease_duration.nanoseconds),
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def _named(target: Any, value: Any, policy: Any, default: Any) -> Any:
    return getattr(target, policy(value).name, default)


def _time(nanoseconds: int) -> QosTime:
    if nanoseconds in (0, _FOREVER_NS):
        return _FOREVER
    return QosTime(nanoseconds // _NS, nanoseconds % _NS)
