"""Whether the live run's bag is closed and whole: topics, counts, and gaps in the stamps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.typesys import Stores, get_typestore

from gsense_rig.demonstration.processes import DemoError


@dataclass(frozen=True)
class BagCheck:
    """What the bag holds."""

    messages: int
    topics: int
    samples: int
    """Of the sensor's raw topic."""
    missing: int
    """Samples for which its stamps have room."""
    seconds: float
    """From the first to the last sample."""


def check_bag(bag: Path, topic: str) -> BagCheck:
    """Reads a bag back.

    Raises:
        DemoError: it is not closed, cannot be read, or lacks the topic.
    """
    try:
        yaml.safe_load((bag / "metadata.yaml").read_text(encoding="utf-8"))
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            counts = {connection.topic: connection.msgcount for connection in reader.connections}
            wanted = [connection for connection in reader.connections if connection.topic == topic]
            stamps = np.array([header_stamp(raw) for _, _, raw in reader.messages(wanted)] if wanted else [])
    except (OSError, yaml.YAMLError, AnyReaderError) as error:
        raise DemoError(f"{bag}: cannot be read back: {' '.join(str(error).split())}") from error
    if stamps.size < 2:
        raise DemoError(f"{bag}: holds no samples of {topic}")
    steps = np.diff(np.sort(stamps))
    missing = int(np.rint(steps / np.median(steps) - 1.0).clip(0).sum())
    return BagCheck(sum(counts.values()), len(counts), stamps.size, missing, float(stamps.max() - stamps.min()))


def header_stamp(raw: bytes | memoryview) -> float:
    """Stamp in s of a serialized message with a header in front (CDR: 4 bytes of encapsulation, sec, nanosec)."""
    order = "<" if raw[1] & 1 else ">"
    seconds, nanoseconds = np.frombuffer(raw, dtype=f"{order}u4", count=2, offset=4)
    return float(seconds) + float(nanoseconds) * 1e-9
