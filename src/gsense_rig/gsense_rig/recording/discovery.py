"""Which topics of the graph to record, and with what quality of service."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

DEPTH = 4000
"""Samples that a subscription keeps: several seconds of every topic together, so that no stall loses one."""
_NS = 1_000_000_000
_FOREVER = QosTime(9223372036, 854775807)
_FOREVER_NS = 9223372036854775807


@dataclass(frozen=True)
class Wanted:
    """Topics to record: all that are not hidden, or those named."""

    names: frozenset[str]
    """Resolved names; empty: all."""

    @classmethod
    def resolve(cls, node: Any, names: Sequence[str]) -> Wanted:
        """Names as given on the command line, resolved in the node's namespace."""
        return cls(frozenset(node.resolve_topic_name(name) for name in names if name))

    def __contains__(self, name: object) -> bool:
        """Whether to record a topic."""
        if self.names:
            return name in self.names
        return not any(part.startswith("_") for part in str(name).split("/"))


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
