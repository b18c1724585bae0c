"""The command line's arguments: what is wrong with them in one line."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NoReturn


class ArgumentParser(argparse.ArgumentParser):
    """argparse's own, without the usage before the message: that is for `--help`."""

    def error(self, message: str) -> NoReturn:
        """Exit 2 with one line on stderr."""
        self.exit(2, f"{self.prog}: {message}; {self.prog} --help lists what it takes\n")


def without_ros(program: str, argv: Sequence[str]) -> list[str]:
    """A node's own arguments, without those behind `--ros-args`; exit 2 with one line where ROS cannot use these."""
    from rclpy.utilities import remove_ros_args  # noqa: PLC0415 - of commands without ROS, too, this is the parser

    try:
        return list(remove_ros_args(list(argv))[1:])
    except RuntimeError as error:
        reason = str(error).partition(", at ")[0].removeprefix("Failed to parse ROS arguments: ")
        sys.stderr.write(f"{program}: --ros-args: {' '.join(reason.split())}\n")
        raise SystemExit(2) from None
