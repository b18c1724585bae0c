"""The fusion node's parameters with their descriptions and ranges."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor

from .attitude.registry import FILTERS

if TYPE_CHECKING:
    from rclpy.node import Node


def declare(node: Node) -> None:
    """Declare the parameters of `fusion`."""

    def text(words: str, **more: Any) -> ParameterDescriptor:
        return ParameterDescriptor(description=words, read_only=True, **more)

    gain = [FloatingPointRange(from_value=0.0, to_value=10.0)]
    deviation = [FloatingPointRange(from_value=0.0, to_value=10.0)]
    node.declare_parameter(
        "sensor", "mpu6050", text("the sensor's name, first part of its topics; or a whole topic (/imu)")
    )
    node.declare_parameter(
        "filter", "madgwick", text(f"one filter or a list of them, of {', '.join(FILTERS)}", dynamic_typing=True)
    )
    node.declare_parameter("compensation_file", "", text("compensation.yaml; empty: no compensated output"))
    node.declare_parameter(
        "use_mag",
        "auto",
        text("true or false; auto: as soon as <sensor>/imu/mag has messages", dynamic_typing=True),
    )
    node.declare_parameter(
        "beta",
        0.0,
        text("Madgwick's gain, rad/s; 0: its author's, 0.033 without and 0.041 with field", floating_point_range=gain),
    )
    node.declare_parameter(
        "inclination_stddev", 0.02, text("published uncertainty of the tilt, rad", floating_point_range=deviation)
    )
    node.declare_parameter(
        "heading_stddev", 0.1, text("of the heading with a magnetometer, rad", floating_point_range=deviation)
    )
