"""Commands of pages to the rig's node: its services and actions, and nothing else. Awaited in the server's loop."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from gsense_msgs.action import Move as MoveAction
from gsense_msgs.action import Sinusoid as SinusoidAction
from gsense_msgs.msg import Topics
from rcl_interfaces.msg import Log
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from gsense_rig.dashboard.motions import Outcome, Refused
from gsense_rig.dashboard.protocol import Move, Sine

if TYPE_CHECKING:
    from gsense_rig.dashboard.node import DashboardNode

SERVICES = {
    "home": (Topics.RIG_HOME, 90.0),
    "stop": (Topics.RIG_STOP, 10.0),
    "reset": (Topics.RIG_RESET, 10.0),
    "park": (Topics.RIG_PARK, 90.0),
}
"""Topic, and s within which an answer must come."""
JUDGED_WITHIN = 10.0  # s; the rig's node judges a goal at once, a loaded machine takes longer
CANCELLED_WITHIN = 2.0  # s
REASON_WITHIN = 0.5  # s that the log's line may come after the rejection
GONE_POLL = 1.0  # s


class Pilot:
    """See `motions.Pilot`. To be made, and used, in the running loop's thread.

    Args:
        node: gives the clients; its callbacks come in another thread.
    """

    def __init__(self, node: DashboardNode) -> None:
        self._node = node
        self._loop = asyncio.get_running_loop()
        self._services = {name: node.create_client(Trigger, topic) for name, (topic, _) in SERVICES.items()}
        self._sine = ActionClient(node, SinusoidAction, Topics.RIG_SINUSOID)
        self._move = ActionClient(node, MoveAction, Topics.RIG_MOVE)
        self._rejections: deque[tuple[float, str, str]] = deque(maxlen=20)
        node.create_subscription(Log, "/rosout", self._on_log, 100)

    def refusal(self) -> str | None:
        """A campaign has the rig for itself: only stop is taken meanwhile."""
        return "a campaign is using the rig; stop works" if self._node.campaign_runs else None

    async def call(self, name: str) -> Outcome:
        """One of SERVICES."""
        topic, limit = SERVICES[name]
        client = self._services[name]
        if not client.service_is_ready():
            raise Refused(f"nobody serves {topic}: is the rig's node running?")
        try:
            answer = await asyncio.wait_for(self._wait(client.call_async(Trigger.Request())), limit)
        except asyncio.TimeoutError:
            return Outcome(False, f"no answer of {topic} within {limit:g} s")
        return Outcome(answer.success, answer.message)

    async def drive(self, goal: Sine | Move) -> RigDrive:
        """Send a goal and wait for the rig's judgement."""
        if isinstance(goal, Sine):
            client, name = self._sine, Topics.RIG_SINUSOID
            request = _filled(SinusoidAction.Goal(), goal)
        else:
            client, name = self._move, Topics.RIG_MOVE
            request = _filled(MoveAction.Goal(), goal)
        if not client.server_is_ready():
            raise Refused(f"nobody serves {name}: is the rig's node running?")
        drive = RigDrive(self, client)
        sent_at = time.monotonic()
        sending = self._wait(client.send_goal_async(request, feedback_callback=drive.on_feedback))
        done, _ = await asyncio.wait([sending], timeout=JUDGED_WITHIN)
        if not done:
            sending.add_done_callback(drive.take_too_late)
            raise Refused(f"no answer of {name} within {JUDGED_WITHIN:g} s; should it come, the goal is cancelled")
        handle = sending.result()
        if not handle.accepted:
            raise Refused(await self._reason(name, sent_at))
        drive.accept(handle)
        return drive

    def _wait(self, future: Any) -> asyncio.Future[Any]:
        """An rclpy future in this loop."""
        made: asyncio.Future[Any] = self._loop.create_future()

        def settle(done: Any) -> None:
            if made.done():
                return
            error = done.exception()
            if error is None:
                made.set_result(done.result())
            else:
                made.set_exception(Refused(str(error)))

        future.add_done_callback(lambda done: self._loop.call_soon_threadsafe(settle, done))
        return made

    def _on_log(self, message: Any) -> None:
        """Actions tell no reason with a rejection; the rig's log does."""
        name, found, reason = message.msg.partition(" goal rejected: ")
        own = self._node.get_namespace().strip("/").replace("/", ".")
        if found and message.name == (f"{own}.rig" if own else "rig"):
            self._rejections.append((time.monotonic(), name, reason))

    async def _reason(self, name: str, since: float) -> str:
        end = time.monotonic() + REASON_WITHIN
        while True:
            for heard, action, reason in reversed(self._rejections):
                if heard >= since and action == name:
                    return reason
            if time.monotonic() > end:
                return "the rig rejects it; the rig node's log says why"
            await asyncio.sleep(0.02)


def _filled(request: Any, goal: Sine | Move) -> Any:
    for name in request.get_fields_and_field_types():
        setattr(request, name, getattr(goal, name))
    return request


class RigDrive:
    """An accepted goal; see `motions.Drive`."""

    def __init__(self, pilot: Pilot, client: Any) -> None:
        self._pilot = pilot
        self._client = client
        self._handle: Any = None
        self._result: asyncio.Future[Any] | None = None
        self.elapsed = 0.0

    def accept(self, handle: Any) -> None:
        """The rig drives."""
        self._handle = handle
        self._result = self._pilot._wait(handle.get_result_async())  # noqa: SLF001 - two halves of one thing

    def take_too_late(self, sending: asyncio.Future[Any]) -> None:
        """The goal was given up, and now the rig has answered after all."""
        if not sending.cancelled() and sending.exception() is None and sending.result().accepted:
            sending.result().cancel_goal_async()

    def on_feedback(self, message: Any) -> None:
        """From the executor's thread."""
        self.elapsed = message.feedback.elapsed

    async def result(self) -> Outcome:
        """The end, or that the rig's node has gone."""
        assert self._result is not None  # noqa: S101 - drive() gives accepted ones only
        while True:
            done, _ = await asyncio.wait([self._result], timeout=GONE_POLL)
            if done:
                break
            if not self._client.server_is_ready():
                return Outcome(False, "the rig's node is gone")
        outcome = self._result.result().result
        error = f"; tracking error {outcome.rms_error * 1e3:.2f} mm rms" if outcome.success else ""
        return Outcome(outcome.success, (outcome.message or ("done" if outcome.success else "ended early")) + error)

    async def cancel(self) -> bool:
        """A soft stop of this goal alone."""
        if self._result is not None and self._result.done():
            return True
        try:
            answer = await asyncio.wait_for(self._pilot._wait(self._handle.cancel_goal_async()), CANCELLED_WITHIN)  # noqa: SLF001
        except (asyncio.TimeoutError, Refused):
            return False
        return bool(answer.goals_canceling) or (self._result is not None and self._result.done())
