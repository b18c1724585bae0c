"""Launch files and parameter files name only what there is; where Jazzy's own launch is installed, it reads them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import yaml

rclpy = pytest.importorskip("rclpy", reason="no ROS here: run by ./rig test")

from gsense_driver.bridge_node import Bridge  # noqa: E402
from gsense_fusion.fusion_node import FusionNode  # noqa: E402
from gsense_rig import rig_settings  # noqa: E402
from gsense_rig.dashboard.node import DashboardNode  # noqa: E402

SOURCE = Path(__file__).parents[2] / "src"
LAUNCH = sorted((SOURCE / "gsense_rig/launch").glob("*.launch.xml"))
VARIABLE = re.compile(r"\$\(var (\w+)\)")


def rig():
    node = rclpy.create_node("rig")
    rig_settings.declare(node)
    return node


NODES = {"rig": rig, "bridge": Bridge, "fusion": FusionNode, "dashboard": DashboardNode}
OTHERS = ("robot_state_publisher", "rviz2")
FILES = {
    "gsense_rig/config/rig.yaml": "rig",
    "gsense_rig/config/demo.yaml": "rig",
    "gsense_driver/config/bridge.yaml": "bridge",
    "gsense_fusion/config/fusion.yaml": "fusion",
}


@pytest.fixture(scope="module")
def declared() -> dict[str, dict[str, object]]:
    """Names and defaults of each node's parameters."""
    rclpy.init(domain_id=97)
    found = {}
    for name, make in NODES.items():
        node = make()
        found[name] = {key: parameter.value for key, parameter in node.get_parameters_by_prefix("").items()}
        node.destroy_node()
    rclpy.shutdown()
    return found


def flat(tree: dict, prefix: str = "") -> dict[str, object]:
    pairs: dict[str, object] = {}
    for key, value in tree.items():
        pairs |= flat(value, f"{prefix}{key}.") if isinstance(value, dict) else {f"{prefix}{key}": value}
    return pairs


@pytest.mark.parametrize("path", FILES)
def test_parameter_files_hold_the_nodes_parameters(path: str, declared) -> None:
    given = flat(yaml.safe_load((SOURCE / path).read_text())["/**"]["ros__parameters"])
    known = declared[FILES[path]]
    for name, value in given.items():
        assert name in known, f"{path}: {name} is no parameter of {FILES[path]}"
        assert type(value) is type(known[name]) or known[name] is None, f"{path}: {name}: {value!r}"


def test_what_may_start_again_by_itself_does() -> None:
    """Nothing that moves the carriage, and no recorder, whose bag is there already."""
    nodes = [node for path in LAUNCH for node in ET.parse(path).getroot().iter("node")]
    again = {node.get("exec") for node in nodes if node.get("respawn") == "$(var respawn)"}
    assert again == {"board", "bridge", "fusion", "watch", "dashboard"}
    assert {node.get("exec") for node in nodes} - again == {"rig", "record", *("rviz2", "robot_state_publisher")}


@pytest.mark.parametrize("path", LAUNCH, ids=lambda path: path.name)
def test_launch_files_name_what_there_is(path: Path, declared) -> None:
    root = ET.parse(path).getroot()
    arguments = {item.get("name") for item in root.findall("arg")}
    assert set(VARIABLE.findall(path.read_text())) <= arguments
    assert all(item.get("description") for item in root.findall("arg"))
    for node in root.iter("node"):
        if node.get("pkg") in OTHERS:
            assert node.get("if"), f"{node.get('pkg')} is not ours: only where it is asked for"
            continue
        scripts = (SOURCE / str(node.get("pkg")) / "setup.py").read_text()
        assert f'"{node.get("exec")} = ' in scripts
        names = declared.get(str(node.get("exec")))
        assert names is None or {p.get("name") for p in node.findall("param") if p.get("name")} <= set(names)
    for include in root.iter("include"):
        included = LAUNCH[0].parent / Path(str(include.get("file"))).name
        known = {item.get("name") for item in ET.parse(included).getroot().findall("arg")}
        assert {item.get("name") for item in include.findall("arg")} <= known


@pytest.mark.parametrize("path", LAUNCH, ids=lambda path: path.name)
def test_launch_itself_reads_them(path: Path) -> None:
    frontend = pytest.importorskip("launch.frontend", reason="no launch here: it comes with an installed ROS only")
    root, parser = frontend.Parser.load(str(path))
    assert parser.parse_description(root).entities


def test_the_robots_description_is_one_tree_with_the_messages_frames() -> None:
    root = ET.parse(SOURCE / "gsense_rig/urdf/rig.urdf").getroot()
    links = {str(link.get("name")) for link in root.findall("link")}
    children = [str(joint.find("child").get("link")) for joint in root.findall("joint")]  # type: ignore[union-attr]
    assert links - set(children) == {"rail"}
    assert len(children) == len(set(children)) == len(links) - 1
    assert {"mpu6050_link", "bno055_link"} <= links
    moving = [joint for joint in root.findall("joint") if joint.get("type") != "fixed"]
    assert [joint.get("name") for joint in moving] == ["carriage"]
