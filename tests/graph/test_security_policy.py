"""The access policy for SROS2 names what each node really uses, no more and no less."""

from __future__ import annotations

import contextlib
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.graph, pytest.mark.timeout(300)]

POLICY = Path(__file__).parents[2] / "src/gsense_rig/sros2/policy.xml"
NODES = ("rig", "bridge", "fusion", "watch", "record", "campaign", "dashboard", "monitor")
KINDS = (
    ("topics", "publish"),
    ("topics", "subscribe"),
    ("services", "reply"),
    ("services", "request"),
    ("actions", "execute"),
    ("actions", "call"),
)
COMMON = {"/rosout", "/parameter_events"}
"""Of every node, as its first breath and its last."""
PAGES = {"/mpu6050/madgwick/imu/data", "/mpu6050/madgwick_gcomp/imu/data"}
"""What the dashboard hears while a page shows it; here nobody looks."""
Names = dict[tuple[str, str], set[str]]


def written() -> dict[str, Names]:
    """Of each node: (kind, right) -> names."""
    found: dict[str, Names] = {}
    for profile in ET.parse(POLICY).getroot().iter("profile"):
        names: Names = {kind: set() for kind in KINDS}
        for group in profile:
            for right in ("publish", "subscribe", "reply", "request", "execute", "call"):
                if group.get(right) == "ALLOW":
                    names[group.tag, right] |= {str(item.text) for item in group} - COMMON
        if profile.get("node") == "dashboard":
            assert names["topics", "subscribe"] >= PAGES
            names["topics", "subscribe"] -= PAGES
        found[str(profile.get("node"))] = names
    return found


def in_use(node: Any, name: str) -> Names:
    """What the middleware tells of a node."""
    from rclpy.action import get_action_client_names_and_types_by_node, get_action_server_names_and_types_by_node

    found: Names = {
        ("topics", "publish"): _names(node.get_publisher_names_and_types_by_node(name, "/")),
        ("topics", "subscribe"): _names(node.get_subscriber_names_and_types_by_node(name, "/")),
        ("services", "reply"): _names(node.get_service_names_and_types_by_node(name, "/")),
        ("services", "request"): _names(node.get_client_names_and_types_by_node(name, "/")),
        ("actions", "execute"): _names(get_action_server_names_and_types_by_node(node, name, "/")),
        ("actions", "call"): _names(get_action_client_names_and_types_by_node(node, name, "/")),
    }
    # an action's own topics and services are covered by its name
    return {kind: {n for n in names - COMMON if "/_action/" not in n} for kind, names in found.items()}


def _names(pairs: Any) -> set[str]:
    return {name for name, _ in pairs}


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Iterator[dict[str, Names]]:
    pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
    assert os.environ["ROS_DOMAIN_ID"] == str(domain)
    from sensor_msgs.msg import Imu

    from .compensations import compensation
    from .ears import Ears
    from .processes import Graph, parameters

    folder = tmp_path_factory.mktemp("policy")
    file = folder / "compensation.yaml"
    file.write_text(compensation("mpu6050"))
    graph = Graph(folder)
    ears = Ears({"/mpu6050/madgwick/imu/data": Imu})
    try:
        graph.start("rig", "gsense_rig", "rig", *parameters(bus=folder / "bus"))
        graph.start("bridge", "gsense_driver", "bridge", *parameters(port=folder / "none"))
        for name in ("fusion", "watch"):
            graph.start(name, "gsense_fusion", name, *parameters(compensation_file=file))
        graph.start("record", "gsense_rig", "record", *parameters(out=folder / "bag", topics="['link', 'rig/pose']"))
        graph.start("dashboard", "gsense_rig", "dashboard", *parameters(port=0, folder=folder))
        graph.start("monitor", "gsense_driver", "monitor")
        plan = folder / "plan.yaml"
        plan.write_text("runs:\n  - {shape: static, duration: 60, role: fit}\n")
        graph.start("campaign", "gsense_rig", "campaign", str(plan), "--out", str(folder / "campaign"))
        expected = written()
        seen: dict[str, Names] = {}

        def whole() -> bool:
            for name in NODES:
                if seen.get(name) != expected[name]:
                    seen[name] = in_use_quietly(ears.node, name) or seen.get(name, {})
            return seen == expected

        with contextlib.suppress(AssertionError):  # the tests say what differs
            ears.wait(whole, 60.0, "graph as in the policy")
        yield seen
    finally:
        graph.close()
        ears.close()


def in_use_quietly(node: Any, name: str) -> Names:
    from rclpy.node import NodeNameNonExistentError

    try:
        return in_use(node, name)
    except NodeNameNonExistentError:
        return {}


@pytest.mark.parametrize("name", NODES)
def test_policy_is_what_a_node_uses(live: dict[str, Names], name: str) -> None:
    assert live[name] == written()[name]


def test_only_enclaves_stand_between_enclaves() -> None:
    """sros2 takes whatever stands there for an enclave, a comment too, and then writes none."""
    parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
    enclaves = ET.parse(POLICY, parser).getroot().find("enclaves")
    assert enclaves is not None
    assert [child.tag for child in enclaves] == ["enclave"] * len(NODES)
