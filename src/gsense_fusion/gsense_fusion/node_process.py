"""What a node's process does from its start to SIGINT or SIGTERM; the same for every node of the package."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gsense_driver.user_input.arguments import without_ros
from gsense_driver.user_input.node_help import node_parser


def run_node(
    name: str,
    about: str,
    make: Callable[[], Node],
    declare: Callable[[Node], None],
    unusable: tuple[type[Exception], ...],
) -> int:
    """Run a node until SIGINT or SIGTERM.

    Args:
        name: stands before the line on stderr.
        about: what it does, for `--help`.
        make: makes the node, after `rclpy.init`.
        declare: declares its parameters, for `--help`.
        unusable: what it raises where parameters or files cannot be used, beside rclpy's own.

    Returns:
        0, or 2 with what is wrong on stderr for arguments, parameters or files that cannot be used.
    """
    node_parser(name, about, declare).parse_args(without_ros(name, sys.argv))
    # A flag, not an exception: launch or an impatient user sends the signal twice; the second finds nothing to break.
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node: Node | None = None
    try:
        try:
            node = make()
        except (ParameterException, *unusable) as error:
            sys.stderr.write(f"{name}: {' '.join(str(error).split())}\n")
            return 2
        # what the libraries made at their import stays: a full collection over it would hold up samples for 0.1 s
        gc.collect()
        gc.freeze()
        executor = _executor()
        executor.add_node(node)
        while rclpy.ok() and not ended.is_set():
            # not spin(): the EventsExecutor of rclpy 7.1 blocks in it, without callbacks and deaf to signals
            executor.spin_once(timeout_sec=0.2)
    except ExternalShutdownException:
        return 0
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)  # while the interpreter ends, it would be the default again
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _executor() -> Any:
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415 # not in every Jazzy
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()
