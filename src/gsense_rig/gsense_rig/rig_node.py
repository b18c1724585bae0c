"""`ros2 run gsense_rig rig`: the rail as a ROS node. Only wiring: the loop runs in a process of its own."""

from __future__ import annotations

import sys
import threading
import time
from concurrent.futures import TimeoutError as FutureTimeout
from typing import TYPE_CHECKING, Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from gsense_msgs.msg import RigState, Topics
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from gsense_driver.user_input.arguments import without_ros
from gsense_driver.user_input.node_help import node_parser
from gsense_driver.user_input.parameters import refuse_unknown
from gsense_rig import drive_file, rig_messages, rig_settings
from gsense_rig.control.tuning import TuneError, identify
from gsense_rig.ending import Ending
from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.admission import refuse_motion
from gsense_rig.loop.client import LoopGone, LoopProcess
from gsense_rig.loop.clock import HostTime, measured_offset_ns
from gsense_rig.loop.messages import (
    Command,
    DriveMove,
    DriveSine,
    Home,
    Park,
    Reset,
    Result,
    Stop,
    Telemetry,
    Tune,
    UseModel,
)
from gsense_rig.loop.pacing import LoopHealth
from gsense_rig.rig_actions import MOTIONS, MotionServer
from gsense_rig.safety.modes import Mode

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_REPLY_TIMEOUT = 5.0  # s; the loop answers within a period, a loaded machine takes longer
_HOMING_TIMEOUT = 60.0  # s
_START_TIMEOUT = 60.0  # s until the loop must tick
_MOTION_TIMEOUT = 60.0  # s; parking takes 2, tuning 11
_STATE_EVERY = 4  # poses to one state: 50 Hz


def _qos(depth: int) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE,
    )


class RigNode(Node):
    """Publishes the loop's telemetry from the thread that receives it; services and action turn into commands."""

    def __init__(self, ended: threading.Event) -> None:
        super().__init__("rig")
        self.settings = rig_settings.declare(self)
        refuse_unknown(self)
        self._ended = ended
        self._spec = self.settings.process_spec()
        self._host_time = HostTime(measured_offset_ns())
        self._count = 0
        self._telemetry: Telemetry | None = None
        self._pose = self.create_publisher(PoseStamped, Topics.RIG_POSE, _qos(400))
        self._joints = self.create_publisher(JointState, Topics.RIG_JOINT_STATES, _qos(400))
        self._state = self.create_publisher(RigState, Topics.RIG_STATE, _qos(100))
        self._diagnostics = self.create_publisher(DiagnosticArray, Topics.DIAGNOSTICS, _qos(10))
        self.loop = LoopProcess(self._spec, self._publish, self._publish_diagnostics, self._loop_ended)

    def serve(self) -> None:
        """Offer services and action; the loop runs."""
        group = ReentrantCallbackGroup()
        for name, callback in (
            (Topics.RIG_HOME, self._on_home),
            (Topics.RIG_STOP, self._on_stop),
            (Topics.RIG_RESET, self._on_reset),
            (Topics.RIG_PARK, self._on_park),
            (Topics.RIG_TUNE, self._on_tune),
        ):
            self.create_service(Trigger, name, callback, callback_group=group)
        self._actions = [MotionServer(self, self.loop, kind, self._refusal, group) for kind in MOTIONS]
        self.add_on_set_parameters_callback(self._on_parameters)
        if self.settings.autohome:
            self.loop.request(Home(self.loop.next_id()))

    # ---- the loop's thread

    def _publish(self, telemetry: Telemetry) -> None:
        self._telemetry = telemetry
        time_ = rig_messages.stamp(self._host_time.stamp_ns(telemetry.time))
        self._pose.publish(rig_messages.pose(telemetry, time_))
        self._joints.publish(rig_messages.joint_states(telemetry, time_))
        if self._count % _STATE_EVERY == 0:
            self._state.publish(rig_messages.rig_state(telemetry, time_))
        self._count += 1

    def _publish_diagnostics(self, health: LoopHealth) -> None:
        if self._host_time.check(measured_offset_ns()):
            self.get_logger().warning("the system clock was stepped; stamps follow")
        if self._telemetry is None:
            return
        time_ = rig_messages.stamp(self._host_time.stamp_ns(time.monotonic()))
        name = self.get_fully_qualified_name().lstrip("/")
        self._diagnostics.publish(
            rig_messages.diagnostics(name, self._telemetry, health, self.settings.hardware, time_)
        )

    def _loop_ended(self) -> None:
        self.get_logger().error("the loop process ended; ending too")
        self._ended.set()

    # ---- services

    def _on_home(self, _request: Any, response: Any) -> Any:
        return self._trigger(Home(self.loop.next_id()), response, _HOMING_TIMEOUT)

    def _on_stop(self, _request: Any, response: Any) -> Any:
        return self._trigger(Stop(self.loop.next_id()), response, _REPLY_TIMEOUT)

    def _on_reset(self, _request: Any, response: Any) -> Any:
        return self._trigger(Reset(self.loop.next_id()), response, _REPLY_TIMEOUT)

    def _on_park(self, _request: Any, response: Any) -> Any:
        return self._trigger(Park(self.loop.next_id()), response, _MOTION_TIMEOUT)

    def _on_tune(self, _request: Any, response: Any) -> Any:
        result = self._run(Tune(self.loop.next_id()), _MOTION_TIMEOUT)
        if result.success and result.record is not None:
            result = self._take_over(result, result.record)
        response.success, response.message = result.success, result.message
        self.get_logger().info(f"tune: {result.message}")
        return response

    def _take_over(self, moved: Result, record: NDArray[np.float64]) -> Result:
        """Identify the drive from a tune move and have the loop use it."""
        nominal = self._spec.parameters.model
        try:
            tuning = identify(record, self._spec.parameters.period, nominal)
            if self.settings.drive_file is not None:
                drive_file.write(self.settings.drive_file, tuning.drive)
        except (TuneError, OSError) as error:
            return moved._replace(success=False, message=str(error))
        used = self._run(UseModel(self.loop.next_id(), tuning.drive), _REPLY_TIMEOUT)
        return used._replace(message=tuning.text(nominal)) if used.success else used

    def _refusal(self, command: DriveSine | DriveMove) -> str | None:
        """Why a goal is rejected, from what is known here; the loop judges again."""
        telemetry = self._telemetry
        if telemetry is None:
            return "the loop has not run yet"
        return refuse_motion(
            command, Mode(telemetry.mode), telemetry.fault_text, telemetry.switches, self._spec.parameters
        )

    def _trigger(self, command: Command, response: Any, timeout: float) -> Any:
        result = self._run(command, timeout)
        response.success, response.message = result.success, result.message
        return response

    def _run(self, command: Command, timeout: float) -> Result:
        """Send a command and wait for its end."""
        reply, end = self.loop.request(command)
        try:
            answer = reply.result(_REPLY_TIMEOUT)
            if not answer.accepted:
                return Result(command.id, False, answer.message)
            return end.result(timeout)
        except FutureTimeout:
            return Result(command.id, False, f"no result within {timeout:g} s")
        except LoopGone as error:
            return Result(command.id, False, str(error))

    def _on_parameters(self, parameters: list[Any]) -> Any:
        """Turn the simulated board: the only parameter that may change."""
        mode = Mode(self._telemetry.mode) if self._telemetry is not None else Mode.UNHOMED
        for parameter in parameters:
            if parameter.name != "mounting":
                continue
            reason = rig_settings.refuse_mounting(self.settings.hardware, mode, str(parameter.value))
            if reason:
                return SetParametersResult(successful=False, reason=reason)
            self.loop.mount(str(parameter.value))
        return SetParametersResult(successful=True)


def main() -> None:
    """Run the node until SIGINT or SIGTERM; exit 2 with one line where it cannot start."""
    node_parser("rig", "The rail as a ROS node.", rig_settings.declare).parse_args(without_ros("rig", sys.argv))
    ended = threading.Event()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    ending = Ending(ended)
    code = 0
    node = None
    try:
        node = RigNode(ended)
        if _ready(node, ended):
            node.serve()
            code = _spin(node, ended)
    except (HardwareError, FutureTimeout, ParameterException) as error:
        print(f"rig: {error or 'the loop did not start in time'}", file=sys.stderr)  # noqa: T201
        code = 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    ending.over()
    if node is not None:
        node.loop.close()
        node.destroy_node()
    rclpy.try_shutdown()
    sys.exit(code)


def _ready(node: RigNode, ended: threading.Event) -> bool:
    """Wait for the loop; False where the node is told to end before."""
    patience = time.monotonic() + _START_TIMEOUT
    while not ended.is_set():
        try:
            node.loop.wait_ready(0.2)
        except FutureTimeout:
            if time.monotonic() > patience:
                raise
        else:
            return True
    return False


def _spin(node: RigNode, ended: threading.Event) -> int:
    """Serve until told to end; 1 where the loop died unasked."""
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    spinner = threading.Thread(target=executor.spin, name="executor", daemon=True)
    spinner.start()
    node.get_logger().info(
        f"rig on {node.settings.hardware}, {node.settings.controller} control, loop pid {node.loop.pid}"
    )
    while not ended.wait(0.2):
        pass
    code = node.loop.close()
    executor.shutdown(timeout_sec=1.0)
    spinner.join(2.0)
    return 0 if code == 0 else 1


if __name__ == "__main__":
    main()
