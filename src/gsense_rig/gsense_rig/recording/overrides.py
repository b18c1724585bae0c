"""The QoS overrides with which `ros2 bag record` keeps every sample: its own subscriptions are only 10 deep."""

from __future__ import annotations

from rosbags.typesys.store import Typestore

DEPTH = 2000
"""Samples: 10 s of a topic at 200 Hz."""
FILTERS = ("complementary", "kalman", "madgwick", "mahony", "vqf", "rig_aided")
_HEAD = """\
# QoS for `ros2 bag record --qos-profile-overrides-path`: deep, so that a stall of the recorder loses no sample.
# Made by `ros2 run gsense_rig record --qos-overrides [NAMESPACE]`.
"""


def topics(store: Typestore) -> list[str]:
    """Every topic of the graph that a bag may hold, relative names (`/diagnostics` is absolute)."""
    names = {name: str(value) for name, _, value in store.fielddefs["gsense_msgs/msg/Topics"][0]}
    sensors = [names[key] for key in ("MPU6050", "BNO055", "LISY300")]
    found = [names[key] for key in names if key.startswith(tuple(f"{s.upper()}_" for s in sensors))]
    found += [names[key] for key in ("BATTERY", "LINK", "DIAGNOSTICS", "RIG_POSE", "RIG_JOINT_STATES", "RIG_STATE")]
    for sensor in sensors:
        found.append(f"{sensor}/{names['RESIDUAL']}")
        for kind in FILTERS:
            found += [f"{sensor}/{kind}{suffix}/{names['IMU']}" for suffix in ("", names["GCOMP_SUFFIX"])]
    return sorted(found)


def overrides(store: Typestore, namespace: str = "/") -> str:
    """Content of the file for a graph under a namespace."""
    prefix = "/" + namespace.strip("/") + ("/" if namespace.strip("/") else "")
    lines = [_HEAD]
    for name in topics(store):
        lines.append(f"{name if name.startswith('/') else prefix + name}:\n")
        lines.append(f"  history: keep_last\n  depth: {DEPTH}\n  reliability: reliable\n  durability: volatile\n")
    return "".join(lines)
