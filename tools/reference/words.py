"""What the code does not say of its interfaces: rates, meanings. An entry that is missing here stops the generator."""

from __future__ import annotations

from typing import NamedTuple


class Topic(NamedTuple):
    """A topic's rate and content in words."""

    rate: str
    content: str


TOPICS = {
    "mpu6050/imu/data_raw": Topic("200; 500 in the fast profile", "rate and specific force as measured"),
    "bno055/imu/data_raw": Topic("100", "the same; a repeated sample is published and counted"),
    "lisy300/imu/data_raw": Topic("as MPU-6050", "rate about z; x and y zero with variance 1e6; no acceleration"),
    "bno055/imu/data": Topic("100, with `--bno ndof`", "the chip's own fusion; no angular velocity"),
    "bno055/imu/mag": Topic("10 to 20", "field, only when it changed"),
    "mpu6050/temperature": Topic("10", "die temperature"),
    "bno055/temperature": Topic("10", "die temperature"),
    "battery": Topic("1", "the board's cell"),
    "link": Topic("1", "counts of frames since the node's start, rate, clock, `unit_id`"),
    "/diagnostics": Topic("1", "names prefixed by node and namespace"),
    "rig/pose": Topic("200", "encoder pose, frame `rail`; x along the rail"),
    "rig/joint_states": Topic("200", "joint `carriage`: position, velocity, effort (empty where unknown)"),
    "rig/state": Topic("50", "mode, switches, light, duty, current, reference, fault"),
    "<sensor>/<filter>/imu/data": Topic("the sensor's", "orientation without g-compensation"),
    "<sensor>/<filter>_gcomp/imu/data": Topic("the sensor's", "with it; only with a `compensation_file`"),
    "<sensor>/residual": Topic("the sensor's", "measured minus predicted rate"),
    "<sensor>/imu/data_raw": Topic("the sensor's", "rate and specific force of the sensor that is worked on"),
    "<sensor>/imu/mag": Topic("any", "its magnetic field, where it has one"),
    "<sensor>/temperature": Topic("any", "for terms that follow the temperature"),
}

SERVICES = {
    "rig/home": "finds the encoder's zero by the end switches",
    "rig/stop": "ends the motion softly, then the motor is off",
    "rig/reset": "leaves a fault, once at rest",
    "rig/park": "goes to -0.20 m, where the board is turned or changed",
    "rig/tune": "drives for 10 s and identifies the drive",
}

ACTIONS = {
    "rig/sinusoid": "whole cycles of a sine about the centre",
    "rig/move": "hold, step or triangle; [what each does](rig.md#motions)",
}

SCHEMAS = {
    "gsense-accuracy/1": "`replay`: accuracy.json, errors of filters against a reference",
    "gsense-calibration/1": "`calibrate`: calibration.json, [its quantities](calibration.md)",
    "gsense-close-loop/1": "`close_loop`: report.json, [how it comes about](closing-the-loop.md)",
    "gsense-compare/1": "`close_loop --compare`: compare.json",
    "gsense-compensation/1": "compensation.yaml of `close_loop`, `calibrate`, [keys](calibration.md#compensationyaml)",
    "gsense-demo/1": "`demo`: what was hidden, what was found",
    "gsense-drive/1": "drive_file of the rig, written by `rig/tune`",
    "gsense-entry/1": "`close_loop --manifest`: entry.json beside each report, what it rests on",
    "gsense-index/1": "index.yaml of a campaign, [its keys](simulation.md#campaigns)",
    "gsense-many/1": "`close_loop --manifest`: [summary.json](many-campaigns.md#what-it-writes)",
    "gsense-noise/1": "`noise`: noise.json",
    "gsense-raw-log/1": "raw_log of the bridge, [its bytes](driver.md#raw-log)",
    "gsense-truth/1": "truth.yaml of a simulated campaign: what was put in; no analysis reads it",
}

VARIABLES = {
    "GSENSE_CACHE": "where the PIC's tool chain is kept (~/.cache/gsense)",
    "GSENSE_DATA": "folder with recordings from elsewhere, for the tests marked `data`; without it they skip",
    "GSENSE_DEBUG": "a command whose analysis broke down shows where",
    "GSENSE_PYTHON": "interpreter that `./rig` makes its environment of",
    "GSENSE_ROS_PREFIX": "where `./rig` looks for an installed ROS (/opt/ros/jazzy)",
    "GSENSE_UNDERLAY_ONLY": "of the set-up itself: the environment without this workspace",
}
