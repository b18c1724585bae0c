"""`board`: starts the firmware's host board (package gsense_firmware) in this process's place."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

_PACKAGE = "gsense_firmware"
_BINARY = "gsense_board"


def find_board(environment: Mapping[str, str]) -> Path | None:
    """The host board's binary under one of the prefixes in AMENT_PREFIX_PATH, or None."""
    for prefix in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        binary = Path(prefix) / "lib" / _PACKAGE / _BINARY
        if prefix and os.access(binary, os.X_OK):
            return binary
    return None


def own_arguments(arguments: Sequence[str]) -> list[str]:
    """The arguments without those for ROS (`--ros-args` up to `--` or the end)."""
    own: list[str] = []
    for_ros = False
    for argument in arguments:
        if argument == "--ros-args":
            for_ros = True
        elif for_ros and argument == "--":
            for_ros = False
        elif not for_ros:
            own.append(argument)
    return own


def main() -> int:
    """Replace this process by the host board; 2 where it is not installed."""
    binary = find_board(os.environ)
    if binary is not None:
        os.execv(binary, [str(binary), *own_arguments(sys.argv[1:])])  # noqa: S606 - the point of this command
    print(
        f"board: lib/{_PACKAGE}/{_BINARY} is in no prefix of AMENT_PREFIX_PATH; build and source the workspace",
        file=sys.stderr,
    )
    return 2


if __name__ == "__main__":
    sys.exit(main())
