"""The interfaces of a node, noted while it is built without a graph: nothing is started, published or subscribed."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

from rcl_interfaces.msg import ParameterDescriptor

from gsense_driver.user_input.node_help import Parameter

SENSOR = "mpu6050"
FILTER = "madgwick"
_COMPENSATION = (
    f"schema: gsense-compensation/1\nsensor: {SENSOR}\nunit_id: null\n"
    "bias: {value: [0.0, 0.0, 0.0], unit: rad/s}\nterms: []\ntiming: {gyro_delay_s: 0.0}\nreference: []\n"
)


@dataclass(frozen=True)
class Endpoint:
    """A publisher or subscription."""

    name: str
    type: str
    qos: str


@dataclass
class Notes:
    """What a node declared, in its order."""

    parameters: list[Parameter] = field(default_factory=list)
    publishes: list[Endpoint] = field(default_factory=list)
    subscribes: list[Endpoint] = field(default_factory=list)
    services: list[tuple[str, str]] = field(default_factory=list)
    actions: list[tuple[str, str]] = field(default_factory=list)


def nodes() -> dict[str, Notes]:
    """Every node of the graph by `PACKAGE EXECUTABLE`."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "compensation.yaml"
        file.write_text(_COMPENSATION, encoding="utf-8")
        given = {"compensation_file": str(file)}
        return {
            "gsense_driver bridge": _bridge(),
            "gsense_rig rig": _rig(),
            "gsense_rig record": _record(),
            "gsense_rig dashboard": _dashboard(),
            "gsense_fusion fusion": _fusion(given),
            "gsense_fusion watch": _watch(given),
        }


def _bridge() -> Notes:
    from gsense_driver.bridge_node import Bridge  # noqa: PLC0415  (each node imports much; only where it is noted)
    from gsense_driver.messages import Messages  # noqa: PLC0415
    from gsense_driver.settings import LIVE  # noqa: PLC0415

    with _taking_notes({}) as notes:
        node = Bridge()
        for parameter in notes.parameters:  # the others wait for a node that is not configured
            parameter.descriptor.read_only = parameter.name not in LIVE
        Messages(node.create_lifecycle_publisher)
    return notes


def _rig() -> Notes:
    from gsense_rig import rig_actions, rig_node  # noqa: PLC0415

    with _taking_notes({}) as notes, ExitStack() as stack:

        def action(_node: object, type_: type, name: str, **_: object) -> None:
            notes.actions.append((name, _type_name(type_)))

        stack.enter_context(mock.patch.object(rig_node, "LoopProcess"))
        stack.enter_context(mock.patch.object(rig_actions, "ActionServer", action))
        rig_node.RigNode(mock.Mock()).serve()
    return notes


def _record() -> Notes:
    from gsense_rig.recording.recorder_node import RecorderNode  # noqa: PLC0415

    with _taking_notes({}) as notes:
        RecorderNode(mock.Mock())
    return notes


def _dashboard() -> Notes:
    from gsense_rig.dashboard.node import DashboardNode  # noqa: PLC0415

    with _taking_notes({}) as notes:
        DashboardNode()
    return notes


def _fusion(given: dict[str, Any]) -> Notes:
    from gsense_fusion.fusion_node import FusionNode  # noqa: PLC0415

    with _taking_notes(given) as notes:
        FusionNode()
    return notes


def _watch(given: dict[str, Any]) -> Notes:
    from gsense_fusion.watch_node import WatchNode  # noqa: PLC0415

    with _taking_notes(given) as notes:
        WatchNode()
    return notes


@contextmanager
def _taking_notes(given: dict[str, Any]) -> Iterator[Notes]:
    """Replace what a node does with the graph; parameters have their defaults but for those given."""
    notes, values = Notes(), {}

    def declare(_: object, name: str, default: Any = None, descriptor: Any = None) -> Any:
        notes.parameters.append(Parameter(name, default, descriptor or ParameterDescriptor()))
        values[name] = SimpleNamespace(value=given.get(name, default))
        return values[name]

    def publish(_: object, type_: type, name: str, qos: Any) -> Any:
        notes.publishes.append(Endpoint(name, _type_name(type_), _qos(qos)))
        return mock.MagicMock()

    def subscribe(_: object, type_: type, name: str, _callback: object, qos: Any, **_more: object) -> Any:
        notes.subscribes.append(Endpoint(name, _type_name(type_), _qos(qos)))
        return mock.MagicMock()

    def serve(_: object, type_: type, name: str, *_more: object, **_options: object) -> None:
        notes.services.append((name, _type_name(type_)))

    replaced = {
        "__init__": lambda *_, **__: None,
        "declare_parameter": declare,
        "get_parameter": lambda _, name: values[name],
        "get_parameters_by_prefix": lambda *_: values,
        "create_publisher": publish,
        "create_subscription": subscribe,
        "create_service": serve,
        "create_timer": mock.MagicMock(),
        "get_logger": mock.MagicMock(),
        "add_on_set_parameters_callback": mock.MagicMock(),
    }
    with ExitStack() as stack:
        for name, function in replaced.items():
            stack.enter_context(mock.patch(f"rclpy.node.Node.{name}", function))
        for name, function in (("__init__", replaced["__init__"]), ("create_lifecycle_publisher", publish)):
            stack.enter_context(mock.patch(f"rclpy.lifecycle.LifecycleNode.{name}", function))
        stack.enter_context(mock.patch("rclpy.node.Node._parameter_overrides", {}, create=True))
        yield notes


def _type_name(type_: type) -> str:
    return f"{type_.__module__.split('.')[0]}/{type_.__name__}"


def _qos(qos: Any) -> str:
    if isinstance(qos, int):
        return f"reliable, last {qos}"
    return f"{qos.reliability.name.lower().replace('_', ' ')}, last {qos.depth}"
