"""The node `bridge`: serial port in, topics out. Lifecycle node that configures and activates itself (`autostart`)."""

from __future__ import annotations

import signal
import sys
import threading
import time
from typing import Any

import rclpy
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.signals import SignalHandlerOptions

from gsense_driver.bridge_parameters import declare
from gsense_driver.diagnostics import raw_log_health
from gsense_driver.errors import SettingError
from gsense_driver.messages import Messages
from gsense_driver.port import Connection, SerialPort
from gsense_driver.raw_log_writer import RawLogWriter
from gsense_driver.session import Session, header_of
from gsense_driver.settings import (
    LIVE,
    PARAMETERS,
    TRANSPORT_DELAY,
    Settings,
    make_settings,
)
from gsense_driver.user_input.arguments import without_ros
from gsense_driver.user_input.node_help import node_parser
from gsense_driver.user_input.parameters import refuse_unknown

_STEP_NS = 1_000_000  # a wall clock that moves by more against the steady one was set; smaller is its slewing
_REPORT_PERIOD_S = 1.0


class Bridge(LifecycleNode):
    """Wires port, pipeline and publishers; the logic is in the pure modules."""

    def __init__(self, **options: Any) -> None:
        super().__init__("bridge", **options)
        declare(self)
        refuse_unknown(self)
        self._settings: Settings | None = None
        self._messages: Messages | None = None
        self._session: Session | None = None
        self._connection: Connection | None = None
        self._raw_log: RawLogWriter | None = None
        self._timer: Any = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._reconfigure = threading.Event()
        self.add_on_set_parameters_callback(self._on_parameters)

    # Parameters

    def _values(self) -> dict[str, Any]:
        names = [parameter.name for parameter in PARAMETERS] + [TRANSPORT_DELAY]
        return {name: self.get_parameter(name).value for name in names}

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
        values = self._values()
        for parameter in parameters:
            if parameter.name not in values:
                continue
            if self._settings is not None and parameter.name not in LIVE:
                reason = f"{parameter.name} takes effect at configuring: deactivate and clean the node up first"
                return SetParametersResult(successful=False, reason=reason)
            values[parameter.name] = parameter.value
        try:
            settings = make_settings(values)
        except SettingError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if self._settings is not None:
            self._settings = settings
            self._reconfigure.set()  # the reading thread takes it up: it owns the pipeline
        return SetParametersResult(successful=True)

    # Lifecycle

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check the parameters, make publishers and pipeline."""
        del state
        try:
            settings = make_settings(self._values())
        except SettingError as error:
            self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        wall_offset_ns = _wall_offset_ns()
        if settings.raw_log and not self._open_raw_log(settings, wall_offset_ns):
            return TransitionCallbackReturn.FAILURE
        self._settings = settings
        if self._messages is None:
            self._messages = Messages(self.create_lifecycle_publisher)
        prefix = self.get_fully_qualified_name().lstrip("/")
        self._session = Session(settings, wall_offset_ns, self._messages, prefix, self._raw_log)
        self._connection = Connection(lambda: SerialPort(settings.port, settings.baud), self._stop.wait, self._say)
        self._reconfigure.clear()
        return TransitionCallbackReturn.SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start to read and to publish."""
        result = super().on_activate(state)
        self._stop.clear()
        self._thread = threading.Thread(target=self._read, name="serial", daemon=True)
        self._thread.start()
        self._timer = self.create_timer(_REPORT_PERIOD_S, self._report)
        return result

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop reading and close the port."""
        self.stop_reading()
        return super().on_deactivate(state)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Forget the settings, so that every parameter may change; close the raw log."""
        del state
        self._drop()
        return TransitionCallbackReturn.SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop reading, whatever the state."""
        del state
        self.close()
        return TransitionCallbackReturn.SUCCESS

    def close(self) -> None:
        """Stop reading and close port and raw log, from any state and any number of times."""
        self.stop_reading()
        self._drop()

    def stop_reading(self) -> None:
        """End the reading thread and close the port."""
        self._stop.set()
        if self._timer is not None:
            self.destroy_timer(self._timer)
            self._timer = None
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._thread = None
        if self._connection is not None:
            self._connection.close()

    def _drop(self) -> None:
        if self._raw_log is not None:
            self._raw_log.close()
            self._raw_log = None
        self._session = None
        self._settings = None

    def _open_raw_log(self, settings: Settings, wall_offset_ns: int) -> bool:
        try:
            self._raw_log = RawLogWriter(settings.raw_log, header_of(settings, wall_offset_ns))
        except SettingError as error:
            self.get_logger().error(str(error))
            return False
        self.get_logger().info(f"raw log: {self._raw_log.path}")
        return True

    # Work

    def _read(self) -> None:
        """Body of the reading thread: bytes in, messages out."""
        try:
            while not self._stop.is_set():
                self._read_once()
        except Exception as error:  # a thread that dies unseen would leave a silent node
            if not self._stop.is_set() and rclpy.ok():
                self.get_logger().fatal(f"reading stopped by an error of the driver itself: {error!r}")
                raise

    def _read_once(self) -> None:
        connection, session = self._connection, self._session
        if connection is None or session is None:
            return
        data = connection.read()
        arrival_ns = time.monotonic_ns()
        if data is None:
            session.opened(arrival_ns)
        elif data:
            session.feed(data, arrival_ns)
        settings = self._settings
        if self._reconfigure.is_set() and settings is not None:
            self._reconfigure.clear()
            session.configure(settings, arrival_ns)

    def _report(self) -> None:
        """Once a second: wall clock, `link`, `/diagnostics`."""
        session, connection = self._session, self._connection
        if session is None or connection is None:
            return
        offset, was = _wall_offset_ns(), session.pipeline.wall_offset_ns
        now_ns = time.monotonic_ns()
        if abs(offset - was) > _STEP_NS:
            self.get_logger().warning(f"the host's clock was set by {(offset - was) * 1e-6:+.1f} ms; stamps follow it")
            session.set_wall_offset(offset, now_ns)
        log = self._raw_log
        more = () if log is None else (raw_log_health(str(log.path), log.written, log.lost_records, log.problem),)
        session.report(now_ns, self.get_clock().now().nanoseconds, connection.problem, more)

    def _say(self, line: str, warning: bool) -> None:
        settings = self._settings
        text = f"{settings.port if settings else ''}: {line}"
        if warning:
            self.get_logger().warning(text)
        else:
            self.get_logger().info(text)


def _wall_offset_ns() -> int:
    """Wall clock minus steady clock; of three readings the one that was interrupted least."""
    readings = []
    for _ in range(3):
        before = time.monotonic_ns()
        wall = time.time_ns()
        after = time.monotonic_ns()
        readings.append((after - before, wall - (before + after) // 2))
    return min(readings)[1]


def make_executor() -> Any:
    """EventsExecutor where this rclpy has it (less CPU and latency), else SingleThreadedExecutor."""
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415 - not in every Jazzy
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


def main(args: list[str] | None = None) -> int:
    """Run the bridge until SIGINT or SIGTERM; 0 then, 2 where its parameters cannot be used."""
    given = without_ros("bridge", sys.argv if args is None else args)
    node_parser("bridge", "The board's serial line on ROS topics.", declare).parse_args(given)
    # A flag, not an exception: launch or an impatient user sends the signal twice; the second finds nothing to break.
    ended = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    node: Bridge | None = None
    try:
        node = Bridge()
        if node.get_parameter("autostart").value and not _start(node):
            return 2
        executor = make_executor()
        executor.add_node(node)
        while rclpy.ok() and not ended.is_set():
            # not spin(): that of 7.1's EventsExecutor runs no callback and is deaf to signals
            executor.spin_once(timeout_sec=0.2)
    except ExternalShutdownException:
        pass
    except rclpy.exceptions.ParameterException as error:
        print(f"bridge: {error}", file=sys.stderr)  # noqa: T201 - there is no node to log by
        return 2
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)  # while the interpreter ends, it would be the default again
        if node is not None:
            node.close()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _start(node: Bridge) -> bool:
    done = TransitionCallbackReturn.SUCCESS
    return bool(node.trigger_configure() == done and node.trigger_activate() == done)


if __name__ == "__main__":
    sys.exit(main())
