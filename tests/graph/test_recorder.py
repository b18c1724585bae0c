"""The recorder in the full graph: closed on SIGINT and on SIGTERM, with every message that was published."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]


def _stamps(bag, topic):
    from .ears import stamp_ns

    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        wanted = [c for c in reader.connections if c.topic == topic]
        return np.array([stamp_ns(bytes(raw)) for _, _, raw in reader.messages(wanted)])


@pytest.mark.parametrize("label", ["bag_int", "bag_term"])
@pytest.mark.parametrize("topic", ["/mpu6050/imu/data_raw", "/rig/pose"])
def test_bag_is_closed_and_has_all_messages(told, label, topic):
    assert told.exit_codes[label] == 0
    metadata = yaml.safe_load((told.bags[label] / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert metadata["message_count"] == sum(t["message_count"] for t in metadata["topics_with_message_count"])
    in_bag = _stamps(told.bags[label], topic)
    heard = told.inside(topic)
    assert len(heard) > 1000
    assert np.isin(heard, in_bag).all()


def test_records_what_is_there_and_only_what_is_wanted(told):
    names = {}
    for label, bag in told.bags.items():
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            names[label] = {c.topic for c in reader.connections}
    assert names["bag_term"] == {"/mpu6050/imu/data_raw", "/rig/pose"}
    assert {"/mpu6050/temperature", "/link", "/rig/state", "/lisy300/imu/data_raw", "/other/link"} <= names["bag_int"]


def test_the_qos_file_for_rosbag2_names_every_topic(told):
    root = Path(__file__).resolve().parents[2]
    named = yaml.safe_load((root / "src/gsense_rig/config/record_qos.yaml").read_text())
    heard = {name for name in told.ears.types if not name.startswith("/other/")}
    assert heard <= set(named)
