"""ROS messages into the state. Only reads fields."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gsense_rig.dashboard.attitude import Quaternion
from gsense_rig.dashboard.state import BatterySeen, LinkSeen, Note, RigSeen, in_namespace

if TYPE_CHECKING:
    from gsense_rig.dashboard.state import GraphState, Vector


def seconds(stamp: Any) -> float:
    """A stamp in s since the epoch."""
    return float(stamp.sec + stamp.nanosec * 1e-9)


def rig(message: Any) -> RigSeen:
    """A gsense_msgs/RigState."""
    return RigSeen(
        mode=message.mode,
        switches=tuple(bool(pressed) for pressed in message.switches),
        light=message.light,
        duty=message.duty,
        current=message.current,
        tracking_error=message.tracking_error,
        fault=message.fault,
        fault_text=message.fault_text,
    )


def link(message: Any, before: LinkSeen | None) -> LinkSeen:
    """A gsense_msgs/LinkStatus; a driver that started anew counts from zero."""
    fresh = before is None or message.received < before.received
    return LinkSeen(
        unit_id=message.unit_id,
        received=message.received,
        lost=message.lost,
        corrupt=message.corrupt,
        restarts=message.restarts,
        rate_hz=message.rate_hz,
        clock_offset_s=message.clock_offset_s,
        clock_skew_ppm=message.clock_skew_ppm,
        uptime_s=message.uptime_s,
        lost_lately=0 if before is None or fresh else max(0, message.lost - before.lost),
    )


def battery(message: Any) -> BatterySeen:
    """A sensor_msgs/BatteryState."""
    return BatterySeen(message.voltage, message.percentage)


def take_joint(state: GraphState, message: Any) -> None:
    """A sensor_msgs/JointState of the carriage."""
    if message.position and message.velocity:
        state.take_joint(seconds(message.header.stamp), message.position[0], message.velocity[0])


def _vector(message: Any) -> Vector:
    return message.x, message.y, message.z


def take_imu(state: GraphState, sensor: str, message: Any, now: float) -> None:
    """A raw sensor_msgs/Imu; element 0 of a covariance is -1 where the field is not reported (REP-145)."""
    if message.angular_velocity_covariance[0] == -1.0:
        return
    force = None if message.linear_acceleration_covariance[0] == -1.0 else _vector(message.linear_acceleration)
    state.take_imu(sensor, seconds(message.header.stamp), _vector(message.angular_velocity), force, now)


def take_orientation(state: GraphState, sensor: str, name: str, message: Any, now: float) -> None:
    """A filter's sensor_msgs/Imu."""
    if message.orientation_covariance[0] == -1.0:
        return
    q = message.orientation
    quaternion = Quaternion.of(q.w, q.x, q.y, q.z)
    state.take_orientation(sensor, name, seconds(message.header.stamp), quaternion, now)


def take_diagnostics(state: GraphState, message: Any, namespace: str, now: float) -> None:
    """A diagnostic_msgs/DiagnosticArray: the statuses of nodes in this namespace."""
    for status in message.status:
        if in_namespace(status.name, namespace):
            level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
            state.take_note(status.name, Note(min(3, level), status.message), now)
