"""`monitor`: rates, loss, clock, battery, last values and the diagnostics' reasons, live in the terminal.

Without a terminal (a pipe, a log file) it prints one line a second; with `--once` one line, exit code 1 where no driver
reports. `--ros-args -r __ns:=/NAME` looks into a namespace.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from gsense_msgs.msg import LinkStatus, Topics
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rich.console import Console
from rich.live import Live
from sensor_msgs.msg import BatteryState, Imu, MagneticField, Temperature

from gsense_driver.messages import qos
from gsense_driver.monitor_state import Link, MonitorState, Verdict, own_task, since
from gsense_driver.monitor_view import line, view
from gsense_driver.samples import BNO, MPU, SENSORS
from gsense_driver.user_input.arguments import ArgumentParser, without_ros
from gsense_driver.user_input.parameters import refuse_unknown

_TASKS = frozenset({"link", "clock", "raw_log", *SENSORS})
_RAW = tuple(f"{sensor}/{Topics.IMU_RAW}" for sensor in SENSORS)
_COUNTS = ("received", "lost", "corrupt", "duplicate", "reordered", "restarts")
_FIGURES = ("rate_hz", "clock_offset_s", "clock_skew_ppm", "uptime_s")
_FRAMES_PER_S = 4


class Monitor(Node):
    """Subscribes to what a bridge publishes in this node's namespace."""

    def __init__(self, **options: Any) -> None:
        super().__init__("monitor", **options)
        refuse_unknown(self)
        self.state = MonitorState((*_RAW, Topics.BNO055_IMU, Topics.BNO055_IMU_MAG))
        subscribe = self.create_subscription
        for topic in (*_RAW, Topics.BNO055_IMU):
            subscribe(Imu, topic, self._sample(topic, imu_words), qos_profile_sensor_data)
        subscribe(
            MagneticField,
            Topics.BNO055_IMU_MAG,
            self._sample(Topics.BNO055_IMU_MAG, field_words),
            qos_profile_sensor_data,
        )
        for sensor in (MPU, BNO):
            subscribe(Temperature, f"{sensor}/{Topics.TEMPERATURE}", self._temperature(sensor), qos(10))
        subscribe(BatteryState, Topics.BATTERY, self._battery, qos(10))
        subscribe(LinkStatus, Topics.LINK, self._link, qos(10))
        subscribe(DiagnosticArray, Topics.DIAGNOSTICS, self._diagnostics, qos(20))

    def _sample(self, topic: str, words: Callable[[Any], str]) -> Callable[[Any], None]:
        return lambda message: self.state.take_sample(topic, words(message), time.monotonic())

    def _temperature(self, sensor: str) -> Callable[[Any], None]:
        return lambda message: self.state.temperatures.update({sensor: message.temperature})

    def _battery(self, message: Any) -> None:
        self.state.battery_v = message.voltage

    def _link(self, message: Any) -> None:
        counts = {name: getattr(message, name) for name in _COUNTS}
        figures = {name: getattr(message, name) for name in _FIGURES}
        lost, corrupt = since(counts, self.state.link)
        link = Link(message.unit_id, **counts, **figures, lost_since=lost, corrupt_since=corrupt)
        self.state.take_link(link, time.monotonic())

    def _diagnostics(self, message: Any) -> None:
        for status in message.status:
            task = own_task(status.name, self.get_namespace(), _TASKS)
            if task is not None:
                self.state.verdicts[task] = Verdict(min(3, status.level[0]), status.message)


def imu_words(message: Any) -> str:
    """Reported fields of an Imu message."""
    parts = []
    if message.angular_velocity_covariance[0] >= 0:
        parts.append(_vector("rate", message.angular_velocity, 4, "rad/s"))
    if message.linear_acceleration_covariance[0] >= 0:
        parts.append(_vector("force", message.linear_acceleration, 3, "m/s^2"))
    return "  ".join(parts)


def field_words(message: Any) -> str:
    """A MagneticField message."""
    return _vector("field", message.magnetic_field, 2, "uT", 1e6)


def _vector(name: str, v: Any, digits: int, unit: str, scale: float = 1.0) -> str:
    return f"{name} {scale * v.x:+.{digits}f} {scale * v.y:+.{digits}f} {scale * v.z:+.{digits}f} {unit}"


def _spin(node: Monitor, seconds: float) -> None:
    end = time.monotonic() + seconds
    while rclpy.ok() and (left := end - time.monotonic()) > 0:
        rclpy.spin_once(node, timeout_sec=left)


def _once(node: Monitor, patience_s: float) -> int:
    end = time.monotonic() + patience_s
    while rclpy.ok() and time.monotonic() < end and not (node.state.link and node.state.verdicts):
        _spin(node, 0.1)
    print(line(node.state, time.monotonic()), flush=True)  # noqa: T201 - the command's output
    return 0 if node.state.link else 1


def _lines(node: Monitor) -> None:
    while rclpy.ok():
        _spin(node, 1.0)
        print(line(node.state, time.monotonic()), flush=True)  # noqa: T201 - the command's output


def _live(node: Monitor, console: Console) -> None:
    title = f"gsense {node.get_namespace()}"
    with Live(console=console, screen=False, auto_refresh=False) as live:
        while rclpy.ok():
            _spin(node, 1.0 / _FRAMES_PER_S)
            live.update(view(node.state, time.monotonic(), title), refresh=True)


def main(args: list[str] | None = None) -> int:
    """Show the driver's state until SIGINT; with `--once` one line, and 1 where no driver reports."""
    arguments = sys.argv if args is None else ["monitor", *args]
    parser = ArgumentParser(prog="monitor", description=__doc__)
    parser.add_argument("--once", action="store_true", help="print one line and end; 1 where no driver reports")
    parser.add_argument("--wait", type=float, default=5.0, help="with --once: seconds to wait for a driver (5)")
    options = parser.parse_args(without_ros("monitor", arguments))
    rclpy.init(args=arguments)
    try:
        node = Monitor()
        console = Console()
        if options.once:
            return _once(node, options.wait)
        if console.is_terminal:
            _live(node, console)
        else:
            _lines(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except ParameterException as error:
        print(f"monitor: {error}", file=sys.stderr)  # noqa: T201 - there is no node to log by
        return 2
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
