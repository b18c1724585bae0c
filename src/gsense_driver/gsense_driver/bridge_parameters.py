"""The bridge's parameters with their descriptions and ranges."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from gsense_driver.settings import (
    PARAMETERS,
    TRANSPORT_DELAY,
    TRANSPORT_DELAY_TEXT,
    Parameter,
    default_transport_delay,
)

if TYPE_CHECKING:
    from rclpy.node import Node


def declare(node: Node) -> None:
    """Declare the node's parameters."""
    for parameter in PARAMETERS:
        node.declare_parameter(parameter.name, parameter.default, _descriptor(parameter))
    port, baud = node.get_parameter("port").value, node.get_parameter("baud").value
    delay = default_transport_delay(os.path.realpath(port) if "://" not in port else port, baud)
    text = ParameterDescriptor(
        description=TRANSPORT_DELAY_TEXT,
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=0.1)],
    )
    node.declare_parameter(TRANSPORT_DELAY, delay, text)
    autostart = ParameterDescriptor(description="configure and activate without being asked", read_only=True)
    node.declare_parameter("autostart", True, autostart)


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=parameter.description)
    if parameter.choices:
        descriptor.additional_constraints = "one of " + ", ".join(str(choice) for choice in parameter.choices)
    if parameter.low is not None and parameter.high is not None:
        if isinstance(parameter.default, int):
            low, high = int(parameter.low), int(parameter.high)
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high, step=0)]
        else:
            low_high = FloatingPointRange(from_value=parameter.low, to_value=parameter.high)
            descriptor.floating_point_range = [low_high]
    return descriptor
