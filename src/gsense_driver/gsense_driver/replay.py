"""`replay FILE`: publishes what a raw log holds, through the live bridge's own pipeline, bit for bit the same."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.node import Node

from gsense_driver.errors import RawLogError, SettingError
from gsense_driver.messages import Messages
from gsense_driver.raw_log import (
    Kind,
    RawLogHeader,
    Record,
    decode_lost,
    decode_report,
    decode_settings,
    decode_wall,
    read_header,
    read_records,
)
from gsense_driver.session import Outlet, Session
from gsense_driver.settings import PARAMETERS, make_settings
from gsense_driver.user_input.arguments import ArgumentParser, without_ros
from gsense_driver.user_input.parameters import refuse_unknown

_FAST_HZ = 5000.0  # readings per second with --fast: ten times the board's
_BURST_S = 0.01  # of readings that may come at once
_SETTLE_S = 1.0  # without another subscriber found: all are
_TAKE_S = 20.0  # for subscribers to take the last messages, at most; the transport repairs losses every 3 s


def make_session(header: RawLogHeader, outlet: Outlet, prefix: str) -> Session:
    """Session as the log's header describes it; raises SettingError where its parameters cannot be used."""
    return Session(make_settings(_complete(header.parameters)), header.wall_offset_ns, outlet, prefix)


def apply(session: Session, record: Record) -> None:
    """Make the call that a record stands for; raises RawLogError, SettingError."""
    kind, time_ns, payload = record
    if kind is Kind.DATA:
        session.feed(payload, time_ns)
    elif kind is Kind.OPENED:
        session.opened(time_ns)
    elif kind is Kind.WALL:
        session.set_wall_offset(decode_wall(payload), time_ns)
    elif kind is Kind.SETTINGS:
        session.configure(make_settings(_complete(decode_settings(payload))), time_ns)
    elif kind is Kind.REPORT:
        session.report(time_ns, *decode_report(payload))


def play(
    session: Session,
    records: Iterable[Record],
    pace: Callable[[int], bool],
    warn: Callable[[str], object],
) -> None:
    """Apply all records; `pace` takes a record's time and returns False to stop."""
    ended = False
    for record in records:
        if not pace(record.time_ns):
            return
        if record.kind is Kind.LOST:
            lost, size = decode_lost(record.payload)
            warn(f"{lost} records ({size} bytes) are missing here: the disk was too slow when the log was written")
        ended = record.kind is Kind.END
        apply(session, record)
    if not ended:
        warn("the log has no end: its writer was killed; all that it wrote was played")


class Pace:
    """Waits until a record's time has come, `rate` times as fast as it was; never in fast mode."""

    def __init__(self, rate: float | None) -> None:
        self._rate = rate
        self._begin: tuple[int, int] | None = None

    def __call__(self, time_ns: int) -> bool:
        """Wait; False when ROS was shut down meanwhile."""
        if self._rate is None:
            return bool(rclpy.ok())
        now = time.monotonic_ns()
        if self._begin is None:
            self._begin = (now, time_ns)
        due = self._begin[0] + (time_ns - self._begin[1]) / self._rate
        while rclpy.ok() and due > now:
            time.sleep(min(0.2, (due - now) * 1e-9))
            now = time.monotonic_ns()
        return bool(rclpy.ok())


class Throttle(Messages):
    """Messages of a fast replay: not faster than a subscriber in Python takes them."""

    def __init__(self, create: Callable[..., Any]) -> None:
        super().__init__(create)
        self._due = 0.0

    def publish(self, reading: Any) -> None:
        """Publish one reading, when its turn has come."""
        super().publish(reading)
        now = time.monotonic()
        self._due = max(self._due, now - _BURST_S) + 1.0 / _FAST_HZ
        if self._due > now:
            time.sleep(self._due - now)


def _await_subscribers(messages: Messages, patience_s: float) -> None:
    """Wait until no more subscribers are found; `patience_s` at most for the first one."""
    found, end = 0, time.monotonic() + patience_s
    while rclpy.ok() and time.monotonic() < end:
        now_found = _subscribers(messages)
        if now_found != found:
            found, end = now_found, time.monotonic() + _SETTLE_S
        time.sleep(0.05)


def _subscribers(messages: Messages) -> int:
    return sum(publisher.get_subscription_count() for publisher in messages.publishers)


def _flush(messages: Messages) -> None:
    """Wait until every reliable subscriber has what was published, `_TAKE_S` at most."""
    end = time.monotonic() + _TAKE_S
    for publisher in messages.publishers:
        left = max(0.0, end - time.monotonic())
        publisher.wait_for_all_acked(rclpy.duration.Duration(nanoseconds=int(left * 1e9)))


def _complete(values: Any) -> dict[str, Any]:
    """Parameters of a log, those that its version did not know by their defaults."""
    return {**{parameter.name: parameter.default for parameter in PARAMETERS}, "transport_delay": 0.0, **values}


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = ArgumentParser(prog="replay", description=__doc__)
    parser.add_argument("file", type=Path, help="a raw_log of the bridge")
    parser.add_argument("--rate", type=float, default=1.0, help="times as fast as it was (1)")
    parser.add_argument(
        "--fast", action="store_true", help="ten times as fast as the board, or faster where it was slow"
    )
    parser.add_argument("--wait", type=float, default=3.0, help="seconds to wait for a first subscriber (3)")
    options = parser.parse_args(arguments)
    if not options.rate > 0:
        parser.error("--rate: give a number above 0")
    return options


def _run(node: Node, options: argparse.Namespace) -> None:
    name = str(options.file)
    with options.file.open("rb") as stream:
        header = read_header(stream, name)
        messages = (Throttle if options.fast else Messages)(node.create_publisher)
        session = make_session(header, messages, node.get_fully_qualified_name().lstrip("/"))
        _await_subscribers(messages, options.wait)
        pace = Pace(None if options.fast else options.rate)
        play(session, read_records(stream, name), pace, lambda line: node.get_logger().warning(f"{name}: {line}"))
        _flush(messages)
    counts = session.pipeline.link.counts
    print(f"{name}: {counts.received} frames, {counts.lost} lost, {counts.corrupt} corrupt, {counts.restarts} restarts")


def main(args: list[str] | None = None) -> int:
    """Publish a raw log; 0, or 2 with one line where it cannot be read."""
    arguments = sys.argv if args is None else ["replay", *args]
    options = _options(without_ros("replay", arguments))
    rclpy.init(args=arguments)
    try:
        node = Node("bridge")  # it stands in the bridge's place: `/diagnostics` carries the node's name
        refuse_unknown(node)
        _run(node, options)
    except KeyboardInterrupt:
        return 130
    except (ParameterException, RawLogError, SettingError) as error:
        print(f"replay: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"replay: {options.file}: {error.strerror or error}", file=sys.stderr)
        return 2
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
