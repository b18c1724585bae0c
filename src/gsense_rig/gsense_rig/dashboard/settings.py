"""Parameters of the dashboard."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType

if TYPE_CHECKING:
    from rclpy.node import Node


@dataclass(frozen=True)
class DashboardSettings:
    """The node's parameters."""

    host: str
    port: int
    names: frozenset[str]
    folder: Path
    page_timeout: float
    """s."""


def declare(node: Node) -> DashboardSettings:
    """Declare the node's parameters and read them."""

    def declared(name: str, default: Any, text: str, **more: Any) -> Any:
        return node.declare_parameter(
            name, default, ParameterDescriptor(description=text, read_only=True, **more)
        ).value  # fmt: skip

    names = declared(
        "names", [""], "further host names under which the page is opened", type=ParameterType.PARAMETER_STRING_ARRAY
    )
    ports = [IntegerRange(from_value=0, to_value=65535)]
    patience = [FloatingPointRange(from_value=0.5, to_value=60.0)]
    return DashboardSettings(
        host=declared("host", "127.0.0.1", "address to serve on; 0.0.0.0: to the whole network"),
        port=declared("port", 8077, "TCP port; 0: any that is free", integer_range=ports),
        names=frozenset(name.lower() for name in names if name),
        folder=Path(declared("folder", ".", "where campaigns and reports are looked for")).expanduser().absolute(),
        page_timeout=declared(
            "page_timeout", 3.0, "s of silence after which a page is lost and its motion stopped",
            floating_point_range=patience,
        ),
    )  # fmt: skip
