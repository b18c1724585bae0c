"""The demonstration's own eyes and hands in the live graph: homes, drives, listens."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from gsense_msgs.action import Sinusoid
from gsense_msgs.msg import LinkStatus, RigState, Topics
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

from gsense_rig.demonstration.orientation import Array, Track
from gsense_rig.demonstration.processes import DemoError


class LiveGraph:
    """A node of one domain. Single-threaded: whoever waits here, spins here.

    Args:
        domain: ROS domain of the graph.
        meanwhile: called about ten times a second while waiting; raises what shall end the wait.
    """

    def __init__(self, domain: int, meanwhile: Callable[[], None]) -> None:
        self.link: Any = None
        self.state: Any = None
        self._meanwhile = meanwhile
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = rclpy.create_node("demo", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(LinkStatus, Topics.LINK, self._on_link, 10)
        self._node.create_subscription(RigState, Topics.RIG_STATE, self._on_state, 10)
        self._home = self._node.create_client(Trigger, Topics.RIG_HOME)
        self._drive = ActionClient(self._node, Sinusoid, Topics.RIG_SINUSOID)

    def close(self) -> None:
        """Leaves the graph."""
        self._executor.shutdown(timeout_sec=1.0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def wait(self, done: Callable[[], bool], timeout: float, what: str) -> None:
        """Spins until `done`.

        Raises:
            DemoError: that takes longer than `timeout` s; the message names `what`.
        """
        end = time.monotonic() + timeout
        told = 0.0
        while not done():
            now = time.monotonic()
            if now > end:
                raise DemoError(f"no {what} within {timeout:.0f} s")
            if now - told > 0.1:
                told = now
                self._meanwhile()
            self._executor.spin_once(timeout_sec=0.05)

    def rest(self, seconds: float) -> None:
        """Spins for a while."""
        end = time.monotonic() + seconds
        self.wait(lambda: time.monotonic() >= end, seconds + 60.0, "rest")

    def wait_for_sample(self, topic: str, timeout: float) -> None:
        """Waits for a message on an Imu topic."""
        got: list[Any] = []
        subscription = self._node.create_subscription(Imu, topic, got.append, QoSProfile(depth=10))
        try:
            self.wait(lambda: bool(got), timeout, f"message on {topic}")
        finally:
            self._node.destroy_subscription(subscription)

    def wait_for_subscriber(self, topic: str, node: str, timeout: float) -> None:
        """Waits until a node listens to a topic."""

        def listens() -> bool:
            return any(info.node_name == node for info in self._node.get_subscriptions_info_by_topic(topic))

        self.wait(listens, timeout, f"subscription of {node} to {topic}")

    def home(self, timeout: float) -> None:
        """Homes the rig; raises DemoError where it refuses."""
        self.wait(self._home.service_is_ready, timeout, f"service {Topics.RIG_HOME}")
        future = self._home.call_async(Trigger.Request())
        self.wait(future.done, timeout, "end of homing")
        if not future.result().success:
            raise DemoError(f"homing failed: {future.result().message}")

    def drive(
        self, amplitude: float, angular_frequency: float, cycles: int, feedback: Callable[[float, float], None]
    ) -> float:
        """Drives a sinusoid to its end; returns the tracking error's root mean square in m.

        Args:
            amplitude: m.
            angular_frequency: rad/s.
            cycles: whole cycles.
            feedback: called with elapsed time in s and position in m.

        Raises:
            DemoError: the rig refuses or stops.
        """
        self.wait(self._drive.server_is_ready, 20.0, f"action {Topics.RIG_SINUSOID}")
        goal = Sinusoid.Goal(amplitude=amplitude, angular_frequency=angular_frequency, cycles=cycles)

        def on_feedback(message: Any) -> None:
            feedback(message.feedback.elapsed, message.feedback.position)

        sent = self._drive.send_goal_async(goal, feedback_callback=on_feedback)
        self.wait(sent.done, 20.0, "answer to the goal")
        handle = sent.result()
        if not handle.accepted:
            raise DemoError("the rig rejects the motion; its log says why")
        result = handle.get_result_async()
        self.wait(result.done, cycles * 2 * np.pi / angular_frequency + 60.0, "end of the motion")
        outcome = result.result().result
        if not outcome.success:
            raise DemoError(f"the motion ended early: {outcome.message}")
        return float(outcome.rms_error)

    def listen(self, topics: tuple[str, ...]) -> Listener:
        """Collects Imu messages until the listener is closed."""
        return Listener(self._node, topics)

    def _on_link(self, message: Any) -> None:
        self.link = message

    def _on_state(self, message: Any) -> None:
        self.state = message


class Listener:
    """Imu messages by topic, and the carriage's motion."""

    def __init__(self, node: Any, topics: tuple[str, ...]) -> None:
        self._node = node
        self.messages: dict[str, list[Any]] = {topic: [] for topic in topics}
        self._joints: list[Any] = []
        deep = QoSProfile(depth=2000)
        self._subscriptions = [
            *(node.create_subscription(Imu, topic, self.messages[topic].append, deep) for topic in topics),
            node.create_subscription(JointState, Topics.RIG_JOINT_STATES, self._joints.append, deep),
        ]

    def close(self) -> None:
        """Ends the subscriptions."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def count(self) -> int:
        """Messages on the topic that has fewest."""
        return min(len(messages) for messages in self.messages.values())

    def track(self, topic: str, epoch: float) -> Track:
        """The messages of a topic as arrays; times in s since `epoch` (s since 1970)."""
        messages = self.messages[topic]
        return Track(
            time=_times(messages, epoch),
            rate=np.array([(m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z) for m in messages]),
            quaternion=np.array([(q.w, q.x, q.y, q.z) for q in (m.orientation for m in messages)]),
        )

    def motion(self, epoch: float) -> tuple[Array, Array, Array]:
        """Time in s since `epoch`, position in m and velocity in m/s of the carriage, each of shape (n,)."""
        values = np.array([(m.position[0], m.velocity[0]) for m in self._joints]).reshape(-1, 2)
        return _times(self._joints, epoch), values[:, 0], values[:, 1]


def _times(messages: list[Any], epoch: float) -> Array:
    return np.array([m.header.stamp.sec - epoch + m.header.stamp.nanosec * 1e-9 for m in messages])
