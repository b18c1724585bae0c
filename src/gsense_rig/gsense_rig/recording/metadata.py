"""`metadata.yaml` of a bag, version 9, as rosbag2 writes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import yaml
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2.metadata import dump_qos_v9

VERSION: Final = 9
METADATA = "metadata.yaml"
_EMPTY_START = 2**63 - 1


@dataclass(frozen=True)
class FilePart:
    """One storage file of a bag."""

    name: str
    start: int = _EMPTY_START
    """ns of the first message."""
    end: int = 0
    """ns of the last message."""
    count: int = 0

    def to_dict(self) -> dict[str, Any]:
        """Its entry under `files`."""
        return {"path": self.name, **_span(self.start, self.end), "message_count": self.count}


@dataclass(frozen=True)
class BagInformation:
    """What `metadata.yaml` says of a bag."""

    parts: Sequence[FilePart]
    connections: Sequence[Connection]
    counts: Mapping[int, int]
    """Messages by connection id."""
    custom: Mapping[str, str]

    def to_dict(self) -> dict[str, Any]:
        """Content of `rosbag2_bagfile_information`."""
        start = min((part.start for part in self.parts), default=_EMPTY_START)
        end = max((part.end for part in self.parts), default=0)
        return {
            "version": VERSION,
            "storage_identifier": "mcap",
            **_span(start, end),
            "message_count": sum(part.count for part in self.parts),
            "topics_with_message_count": [self._topic(connection) for connection in self.connections],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [part.name for part in self.parts],
            "files": [part.to_dict() for part in self.parts],
            "custom_data": dict(self.custom) or None,
            "ros_distro": "jazzy",
        }

    def text(self) -> str:
        """The same as YAML, as it stands in a storage file."""
        return _dump(self.to_dict()).strip()

    def write(self, bag: Path) -> None:
        """Writes `bag/metadata.yaml` whole or not at all."""
        temporary = bag / f".{METADATA}.tmp"
        temporary.write_text(_dump({"rosbag2_bagfile_information": self.to_dict()}), encoding="utf-8")
        temporary.replace(bag / METADATA)

    def _topic(self, connection: Connection) -> dict[str, Any]:
        extension = connection.ext
        assert isinstance(extension, ConnectionExtRosbag2)  # noqa: S101 - of a rosbag2 bag
        return {
            "topic_metadata": {
                "name": connection.topic,
                "type": connection.msgtype,
                "serialization_format": extension.serialization_format,
                "offered_qos_profiles": dump_qos_v9(extension.offered_qos_profiles),
                "type_description_hash": connection.digest,
            },
            "message_count": self.counts.get(connection.id, 0),
        }


def _span(start: int, end: int) -> dict[str, Any]:
    return {
        "duration": {"nanoseconds": max(0, end - start)},
        "starting_time": {"nanoseconds_since_epoch": start},
    }


def _dump(data: dict[str, Any]) -> str:
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=False)
