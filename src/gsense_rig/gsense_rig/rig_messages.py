"""The rig's telemetry as ROS messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from gsense_msgs.msg import RigState, Topics
from sensor_msgs.msg import JointState

from gsense_rig.safety.modes import Fault, Light, Mode

if TYPE_CHECKING:
    from gsense_rig.loop.messages import Telemetry
    from gsense_rig.loop.pacing import LoopHealth

JOINT = "carriage"


def stamp(nanoseconds: int) -> Any:
    """ROS time of nanoseconds since the epoch."""
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def pose(telemetry: Telemetry, time: Any) -> Any:
    """Encoder pose along the rail, as read (steps of 50 um), frame `rail`."""
    message = PoseStamped()
    message.header.stamp = time
    message.header.frame_id = Topics.RAIL_FRAME
    message.pose.position.x = telemetry.position
    return message


def joint_states(telemetry: Telemetry, time: Any) -> Any:
    """Encoder position, observer's velocity, drive's force on the belt from the motor's current."""
    message = JointState()
    message.header.stamp = time
    message.header.frame_id = Topics.RAIL_FRAME
    message.name = [JOINT]
    message.position = [telemetry.position]
    message.velocity = [telemetry.velocity]
    message.effort = [] if math.isnan(telemetry.force) else [telemetry.force]
    return message


def rig_state(telemetry: Telemetry, time: Any) -> Any:
    """Modes, switches, drive."""
    message = RigState()
    message.header.stamp = time
    message.header.frame_id = Topics.RAIL_FRAME
    message.mode = telemetry.mode
    message.switches = list(telemetry.switches)
    message.light = telemetry.light
    message.duty = telemetry.duty
    message.current = telemetry.current
    message.reference = telemetry.reference
    message.tracking_error = telemetry.tracking_error
    message.fault = telemetry.fault
    message.fault_text = telemetry.fault_text
    return message


def diagnostics(node: str, telemetry: Telemetry, health: LoopHealth, hardware: str, time: Any) -> Any:
    """Rig and loop as two statuses."""
    message = DiagnosticArray()
    message.header.stamp = time
    message.status = [_rig_status(node, telemetry, hardware), _loop_status(node, health, hardware)]
    return message


def _rig_status(node: str, telemetry: Telemetry, hardware: str) -> Any:
    mode, fault = Mode(telemetry.mode), Fault(telemetry.fault)
    status = DiagnosticStatus(name=f"{node}: rig", hardware_id=hardware)
    if fault is not Fault.NONE:
        status.level, status.message = DiagnosticStatus.ERROR, f"{fault.name}: {telemetry.fault_text}"
    elif mode is Mode.UNHOMED:
        status.level, status.message = DiagnosticStatus.WARN, "not homed: call rig/home"
    else:
        status.level, status.message = DiagnosticStatus.OK, mode.name.lower()
    status.values = [
        KeyValue(key="mode", value=mode.name),
        KeyValue(key="fault", value=fault.name),
        KeyValue(key="light", value=Light(telemetry.light).name),
        KeyValue(key="position_m", value=f"{telemetry.position:.5f}"),
        KeyValue(key="current_a", value=f"{telemetry.current:.2f}"),
    ]
    return status


def _loop_status(node: str, health: LoopHealth, hardware: str) -> Any:
    status = DiagnosticStatus(name=f"{node}: loop", hardware_id=hardware)
    status.level, status.message = DiagnosticStatus.OK, "on time"
    if health.dropped:
        status.level, status.message = DiagnosticStatus.WARN, f"{health.dropped} telemetry messages lost"
    status.values = [
        KeyValue(key="ticks", value=str(health.ticks)),
        KeyValue(key="overruns", value=str(health.overruns)),
        KeyValue(key="late_mean_us", value=f"{health.mean_late * 1e6:.0f}"),
        KeyValue(key="late_p99_us", value=f"{health.p99_late * 1e6:.0f}"),
        KeyValue(key="late_max_us", value=f"{health.max_late * 1e6:.0f}"),
        KeyValue(key="cost_mean_us", value=f"{health.mean_cost * 1e6:.0f}"),
    ]
    return status
