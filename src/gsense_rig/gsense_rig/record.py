"""`record`: records the live graph into a rosbag2 bag (MCAP), for machines without `ros2 bag`.

Parameters: `out`, the bag's folder (default: named by the time); `topics`, names to record (default: all);
`max_bag_size`, bytes of a storage file (default 0: one file); `max_queue`, bytes that may wait for the disk (default
268435456). Ends on SIGINT or SIGTERM: the bag is closed, its path, its counts and what could not be kept are printed,
exit 0. Exit 2 where the bag cannot be made, 1 where the disk became full.

`record --repair BAG` repairs the bag of a recorder that was killed: what had reached the disk, all but the last second.
`record --qos-overrides [NAMESPACE]` prints the QoS file with which `ros2 bag record` loses nothing.
"""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.signals import SignalHandlerOptions
from rosbags.rosbag2 import ReaderError, WriterError

from gsense_driver.user_input.arguments import ArgumentParser, without_ros
from gsense_rig.recording.overrides import overrides
from gsense_rig.recording.recorder_node import RecorderNode
from gsense_rig.recording.repair import RepairError, repair
from gsense_rig.recording.spinning import make_executor
from gsense_rig.recording.typestore import DefinitionError, typestore
from gsense_rig.recording.writer_thread import Summary

POLL = 0.05
"""s after which a signal is seen at the latest."""


def main() -> int:
    """Runs until a signal or an error; with an option of its own, does that."""
    if own := without_ros("record", sys.argv):
        return _without_graph(own)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    try:
        store = typestore()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = RecorderNode(store)
        print(f"recording to {node.begin()}", flush=True)
    except (WriterError, DefinitionError, ParameterException, OSError) as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    _spin(node, stop)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # while the interpreter ends, it would be the default again
    summary = node.finish()
    _report(summary, node)
    node.destroy_node()
    rclpy.try_shutdown()
    return 1 if summary.error else 0


def _spin(node: RecorderNode, stop: threading.Event) -> None:
    executor = make_executor()
    executor.add_node(node)
    try:
        while not stop.is_set() and node.error is None:
            executor.spin_once(timeout_sec=POLL)
        _drain(executor)
    except ExternalShutdownException:
        pass
    finally:
        executor.remove_node(node)


def _drain(executor: Any) -> None:
    """Takes what has already arrived."""
    for _ in range(2000):
        executor.spin_once(timeout_sec=0.0)


def _report(summary: Summary, node: RecorderNode) -> None:
    print(f"{sum(summary.counts.values())} messages in {summary.bag}")
    for name, count in sorted(summary.counts.items()):
        print(f"  {count:8d}  {name}")
    for name, count in sorted(summary.overflow.items()):
        print(f"record: {name}: {count} messages dropped, the disk was too slow", file=sys.stderr)
    for name, count in sorted(node.lost.items()):
        print(f"record: {name}: {count} messages lost on their way here", file=sys.stderr)
    for name in node.never_seen:
        print(f"record: {name}: nobody published it", file=sys.stderr)
    for name in node.skipped:
        print(f"record: {name}: not recorded, its type is not installed here", file=sys.stderr)
    if summary.error:
        print(f"record: {summary.error}; {summary.unwritten} messages are not in the bag", file=sys.stderr)
    sys.stdout.flush()


def _without_graph(arguments: Sequence[str]) -> int:
    """What needs no graph: --repair, --qos-overrides, --help."""
    usage = (
        "record [--ros-args -p out:=BAG -p NAME:=VALUE ...]\n       record --repair BAG | --qos-overrides [NAMESPACE]"
    )
    parser = ArgumentParser("record", usage, description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--repair", type=Path, metavar="BAG", help="repair this bag")
    what.add_argument(
        "--qos-overrides",
        nargs="?",
        const="/",
        metavar="NAMESPACE",
        help="print the QoS file, of a rig in a namespace (default: /)",
    )
    options = parser.parse_args(arguments)
    if options.repair is not None:
        return _repair(options.repair.absolute())
    print(overrides(typestore(), options.qos_overrides), end="")
    return 0


def _repair(bag: Path) -> int:
    try:
        files = repair(bag, typestore())
    except (RepairError, DefinitionError, WriterError, ReaderError, OSError) as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    for file in files:
        end = "had been closed" if file.left_out is None else f"{file.left_out} bytes of a half-written end left out"
        print(f"{file.name}: {file.kept} messages, {end}")
    print(bag)
    return 0


if __name__ == "__main__":
    sys.exit(main())
