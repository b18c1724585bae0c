"""The rig's actions: a goal becomes a command of the loop, a cancelled goal a soft stop."""

from __future__ import annotations

from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gsense_msgs.action import Move, Sinusoid
from gsense_msgs.msg import Topics
from rclpy.action import ActionServer, CancelResponse, GoalResponse

from gsense_rig.loop.client import LoopGone
from gsense_rig.loop.messages import DriveMove, DriveSine, Stop

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

    from rclpy.node import Node

    from gsense_rig.loop.client import LoopProcess
    from gsense_rig.loop.messages import Result

_REPLY_TIMEOUT = 5.0  # s; the loop answers within a period, a loaded machine takes longer
_FEEDBACK_INTERVAL = 0.1  # s


@dataclass(frozen=True)
class MotionKind:
    """One action: its type, its name, and the command that a goal is."""

    type: Any
    name: str
    command: Callable[[int, Any], DriveSine | DriveMove]


def _sine(number: int, goal: Any) -> DriveSine:
    return DriveSine(number, goal.amplitude, goal.angular_frequency, goal.cycles)


def _move(number: int, goal: Any) -> DriveMove:
    return DriveMove(number, goal.shape, goal.position, goal.amplitude, goal.angular_frequency, goal.duration)


MOTIONS = (
    MotionKind(Sinusoid, Topics.RIG_SINUSOID, _sine),
    MotionKind(Move, Topics.RIG_MOVE, _move),
)


class MotionServer:
    """Serves one action.

    Args:
        node: its node.
        loop: drives.
        kind: the action.
        refusal: says why a command cannot be driven now, or None.
        group: callback group.
    """

    def __init__(
        self, node: Node, loop: LoopProcess, kind: MotionKind,
        refusal: Callable[[DriveSine | DriveMove], str | None], group: Any,
    ) -> None:  # fmt: skip
        self._node = node
        self._loop = loop
        self._kind = kind
        self._refusal = refusal
        self._server = ActionServer(
            node,
            kind.type,
            kind.name,
            execute_callback=self._drive,
            goal_callback=self._on_goal,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
            callback_group=group,
        )

    def _on_goal(self, goal: Any) -> Any:
        reason = self._refusal(self._kind.command(0, goal))
        if reason is None:
            return GoalResponse.ACCEPT
        self._node.get_logger().warning(f"{self._kind.name} goal rejected: {reason}")
        return GoalResponse.REJECT

    def _drive(self, handle: Any) -> Any:
        command = self._kind.command(self._loop.next_id(), handle.request)
        reply, end = self._loop.request(command)
        result = self._kind.type.Result()
        try:
            answer = reply.result(_REPLY_TIMEOUT)
            if not answer.accepted:
                handle.abort()
                result.message = answer.message
                return result
            outcome = self._follow(handle, command.id, end)
        except (FutureTimeout, LoopGone) as error:
            handle.abort()
            result.message = str(error) or "the loop does not answer"
            return result
        result.success, result.message, result.rms_error = outcome.success, outcome.message, outcome.rms_error
        if outcome.success:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result

    def _follow(self, handle: Any, command: int, end: Future[Result]) -> Result:
        """Give feedback until the motion ends; a cancelled goal is a soft stop."""
        stopped: Future[Result] | None = None
        while True:
            try:
                outcome = end.result(_FEEDBACK_INTERVAL)
                break
            except FutureTimeout:
                pass
            if handle.is_cancel_requested and stopped is None:
                stopped = self._loop.request(Stop(self._loop.next_id()))[1]
            telemetry = self._loop.telemetry
            if telemetry is not None and telemetry.command == command:
                feedback = self._kind.type.Feedback(elapsed=telemetry.elapsed, position=telemetry.position)
                handle.publish_feedback(feedback)
        if stopped is not None:
            stopped.result(_REPLY_TIMEOUT)  # the result says "stopped" when the carriage is
        return outcome
