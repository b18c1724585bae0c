"""A sensor by its name or by a whole topic: the same for nodes, bags and files."""

from __future__ import annotations

from pathlib import Path

import pytest

from gsense_fusion.bags import BagError
from gsense_fusion.bags.topics import find_names, raw_topic, sensor_name
from gsense_fusion.sensor_topics import SensorTopics

IMU, POSE = "sensor_msgs/msg/Imu", "geometry_msgs/msg/PoseStamped"
FIELD, TEMPERATURE = "sensor_msgs/msg/MagneticField", "sensor_msgs/msg/Temperature"
VECTORNAV = {
    "/vectornav/imu": IMU,
    "/vectornav/imu_uncompensated": IMU,
    "/vectornav/magnetic": FIELD,
    "/vectornav/temperature": TEMPERATURE,
    "/vectornav/pose": POSE,
}


def test_topics_that_a_node_listens_to() -> None:
    ours = SensorTopics.of("mpu6050")
    assert (ours.name, ours.imu, ours.own) == ("mpu6050", "mpu6050/imu/data_raw", "mpu6050/imu/data")
    assert SensorTopics.of("/a/mpu6050/imu/data_raw").mag == "/a/mpu6050/imu/mag"
    foreign = SensorTopics.of("/vectornav/imu")
    assert (foreign.imu, foreign.own) == ("/vectornav/imu", "/vectornav/imu")
    assert (foreign.mag, foreign.temperature) == ("/vectornav/mag", "/vectornav/temperature")
    standard = SensorTopics.of("/imu/data_raw")  # of the drivers that feed imu_tools
    assert (standard.name, standard.mag) == ("/imu/data_raw", "/imu/mag")
    for nothing in ("", "/", " "):
        with pytest.raises(ValueError, match="sensor"):
            SensorTopics.of(nothing)


def test_names_in_files() -> None:
    assert sensor_name("/a/mpu6050/imu/data_raw") == sensor_name("mpu6050") == "mpu6050"
    assert sensor_name("/vectornav/imu") == "/vectornav/imu"
    assert raw_topic("mpu6050") == "/mpu6050/imu/data_raw"
    assert raw_topic("/vectornav/imu") == "/vectornav/imu"


def test_what_lies_beside_a_whole_topic_is_found_by_its_type() -> None:
    names = find_names(Path("bag"), VECTORNAV, "/vectornav/imu")
    assert (names.mag, names.temperature, names.reference) == ("/vectornav/magnetic", "/vectornav/temperature", None)
    assert find_names(Path("bag"), VECTORNAV | {"/vectornav/b": FIELD}, "/vectornav/imu").mag is None
    beside = find_names(Path("bag"), VECTORNAV | {"/mpu6050/imu/data_raw": IMU}, "mpu6050")
    assert (beside.mag, beside.temperature) == (None, None)


def test_a_reference_is_named() -> None:
    names = find_names(Path("bag"), VECTORNAV, "/vectornav/imu", "vectornav/pose")
    assert names.reference == "/vectornav/pose"
    with pytest.raises(BagError, match="no reference /vectornav/temperature; Imu and PoseStamped topics there"):
        find_names(Path("bag"), VECTORNAV, "/vectornav/imu", "/vectornav/temperature")
