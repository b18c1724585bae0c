"""The layouts for RViz, Foxglove and PlotJuggler name topics of the graph, and fields that their messages have."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yaml

from gsense_rig.plant.parameters import TrackParameters
from gsense_rig.recording.overrides import topics
from gsense_rig.recording.typestore import DefinitionError, typestore

PACKAGE = Path(__file__).parents[2] / "src" / "gsense_rig"
BESIDE = {"/robot_description": "std_msgs/msg/String"}
"""Of robot_state_publisher."""
KINDS = {
    r"/imu/data(_raw)?$": "sensor_msgs/msg/Imu",
    r"/imu/mag$": "sensor_msgs/msg/MagneticField",
    r"/temperature$": "sensor_msgs/msg/Temperature",
    r"/residual$": "geometry_msgs/msg/Vector3Stamped",
    r"^/battery$": "sensor_msgs/msg/BatteryState",
    r"^/link$": "gsense_msgs/msg/LinkStatus",
    r"^/diagnostics$": "diagnostic_msgs/msg/DiagnosticArray",
    r"^/rig/pose$": "geometry_msgs/msg/PoseStamped",
    r"^/rig/joint_states$": "sensor_msgs/msg/JointState",
    r"^/rig/state$": "gsense_msgs/msg/RigState",
}


@pytest.fixture(scope="module")
def store() -> Any:
    try:
        return typestore()
    except DefinitionError:
        pytest.skip("gsense_msgs is not installed: run by ./rig test")


@pytest.fixture(scope="module")
def graph(store: Any) -> dict[str, str]:
    """Topic -> message type, root namespace."""
    names = [name if name.startswith("/") else f"/{name}" for name in topics(store)]
    found = {name: next(kind for pattern, kind in KINDS.items() if re.search(pattern, name)) for name in names}
    return found | BESIDE


def assert_field(store: Any, kind: str, path: str) -> None:
    for part in path.split("."):
        fields = dict(store.fielddefs[kind][1])
        assert part in fields, f"{kind} has no {part} ({path})"
        kind = fields[part][1] if isinstance(fields[part][1], str) else ""
    assert kind == "", f"{path} is no number"


def test_foxglove(store: Any, graph: dict[str, str]) -> None:
    layout = json.loads((PACKAGE / "layouts/foxglove.json").read_text())
    panels = layout["configById"]
    paths = [item["value"] for name, panel in panels.items() if name.startswith("Plot!") for item in panel["paths"]]
    assert len(paths) > 15
    for path in paths:
        topic, _, field = path.partition(".")
        assert_field(store, graph[topic], field)
    assert set(panels["3D!gsense"]["topics"]) <= set(graph)
    assert graph[panels["RawMessages!state"]["topicPath"]]
    assert graph[panels["DiagnosticSummary!gsense"]["topicToRender"]]
    assert sorted(_leaves(layout["layout"])) == sorted(panels)


def _leaves(node: Any) -> list[str]:
    return [node] if isinstance(node, str) else [*_leaves(node["first"]), *_leaves(node["second"])]


def test_plotjuggler(store: Any, graph: dict[str, str]) -> None:
    root = ET.parse(PACKAGE / "layouts/plotjuggler.xml").getroot()
    selected = {str(item.get("name")) for item in root.iter("topic")}
    assert selected <= set(graph)
    curves = [str(item.get("name")) for item in root.iter("curve")]
    assert len(curves) > 15
    for curve in curves:
        topic = max((name for name in selected if curve.startswith(f"{name}/")), key=len)
        assert_field(store, graph[topic], curve.removeprefix(f"{topic}/").replace("/", "."))
    for splitter in root.iter("DockSplitter"):
        assert int(str(splitter.get("count"))) == len(splitter) == len(str(splitter.get("sizes")).split(";"))


def test_rviz(graph: dict[str, str]) -> None:
    manager = yaml.safe_load((PACKAGE / "rviz/gsense.rviz").read_text())["Visualization Manager"]
    classes = {
        "rviz_default_plugins/Pose": "geometry_msgs/msg/PoseStamped",
        "rviz_imu_plugin/Imu": "sensor_msgs/msg/Imu",
        "rviz_default_plugins/RobotModel": "std_msgs/msg/String",
    }
    shown = set()
    for display in manager["Displays"]:
        topic = display.get("Topic", display.get("Description Topic"))
        if topic is not None:
            assert graph[topic["Value"]] == classes[display["Class"]]
            shown.add(display["Class"])
    assert shown == set(classes)
    frames = {str(link.get("name")) for link in ET.parse(PACKAGE / "urdf/rig.urdf").getroot().findall("link")}
    assert manager["Global Options"]["Fixed Frame"] in frames


def test_joint_and_frame_are_those_of_the_messages(store: Any) -> None:
    constants = {name: str(value) for name, _, value in store.fielddefs["gsense_msgs/msg/Topics"][0]}
    root = ET.parse(PACKAGE / "urdf/rig.urdf").getroot()
    joint = root.find(f"joint[@name='{constants['CARRIAGE_JOINT']}']")
    assert joint is not None
    assert joint.get("type") == "prismatic"
    assert str(joint.find("parent").get("link")) == constants["RAIL_FRAME"]  # type: ignore[union-attr]
    assert str(joint.find("axis").get("xyz")) == "1 0 0"  # type: ignore[union-attr]
    assert not list(root.iter("mesh"))


def test_the_urdf_is_one_tree_within_the_rail() -> None:
    """What `check_urdf` asks for: one root, each other link the child of one joint, materials that are defined."""
    root = ET.parse(PACKAGE / "urdf/rig.urdf").getroot()
    links = [str(link.get("name")) for link in root.findall("link")]
    joints = root.findall("joint")
    parents = {str(j.find("child").get("link")): str(j.find("parent").get("link")) for j in joints}  # type: ignore[union-attr]
    assert len(set(links)) == len(links)
    assert len({str(joint.get("name")) for joint in joints}) == len(parents) == len(joints) == len(links) - 1
    (first,) = set(links) - set(parents)
    for link in parents:
        above = [link]
        while above[-1] in parents:
            above.append(parents[above[-1]])
            assert len(above) <= len(links), f"{link} hangs on itself"
        assert above[-1] == first
    defined = {str(material.get("name")) for material in root.findall("material")}
    assert {str(material.get("name")) for material in root.iterfind("link/visual/material")} <= defined
    limit = root.find("joint[@type='prismatic']/limit")
    assert limit is not None
    stop = TrackParameters().end_stop
    assert (float(str(limit.get("lower"))), float(str(limit.get("upper")))) == (-stop, stop)
