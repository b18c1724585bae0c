"""The live rig for a campaign: its actions and services, the link, and a recorder in this process."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from gsense_msgs.action import Move, Sinusoid
from gsense_msgs.msg import LinkStatus, RigState, Topics
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.logging import LoggingSeverity
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from gsense_driver.user_input.parameters import refuse_unknown
from gsense_rig.campaign.carriage import STILL_AFTER, STILL_BEFORE
from gsense_rig.campaign.crew import CampaignError, LinkFigures, Operator, RunOutcome, Show
from gsense_rig.campaign.plan import PlanRun
from gsense_rig.recording.recorder_node import RecorderNode
from gsense_rig.recording.spinning import Spinner
from gsense_rig.recording.typestore import typestore
from gsense_rig.recording.writer_thread import Summary

HEARD_WITHIN = 10.0
"""s until rig and link must have been heard."""
ANSWER_WITHIN = 20.0
HOMED_WITHIN = 90.0
BUSY_FOR = 90.0
"""s that a motion which an earlier campaign began may still take."""
LINK_WATCH = 3.5
"""s for which the link is watched before the campaign."""
LINK_SILENT = 4.0
"""s without a LinkStatus, which comes once a second."""
AT_PLACE = 1e-3
"""m."""
NEEDED = (Topics.LINK, Topics.RIG_STATE, Topics.RIG_POSE, Topics.MPU6050_IMU_RAW)
"""Topics that must be in a run's bag before the motion begins."""


class LiveRig:
    """A `Crew`: the graph of ROS_DOMAIN_ID. Its executor has a thread; the caller's thread waits."""

    def __init__(self, check: Callable[[], None] = lambda: None) -> None:
        """`check` is called while waiting; it raises what shall end the wait."""
        self._check = check
        self._link: Any = None
        self._link_heard = 0.0
        self._state: Any = None
        self.operator: Operator | None = None
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node("campaign", context=self._context)
        refuse_unknown(self.node)
        self._store = typestore()
        self.node.create_subscription(LinkStatus, Topics.LINK, self._on_link, 10)
        self.node.create_subscription(RigState, Topics.RIG_STATE, self._on_state, 100)
        self._home = self.node.create_client(Trigger, Topics.RIG_HOME)
        self._park = self.node.create_client(Trigger, Topics.RIG_PARK)
        self._stop = self.node.create_client(Trigger, Topics.RIG_STOP)
        self._sine = ActionClient(self.node, Sinusoid, Topics.RIG_SINUSOID)
        self._move = ActionClient(self.node, Move, Topics.RIG_MOVE)
        self._moving = False
        self._spinner = Spinner(self._context)
        self._spinner.add(self.node)

    def close(self) -> None:
        """Stops a motion that was begun here, and leaves the graph."""
        if self._moving and self._stop.service_is_ready():
            stopped = self._stop.call_async(Trigger.Request())
            end = time.monotonic() + 5.0
            while not stopped.done() and time.monotonic() < end:
                time.sleep(0.02)
        self._spinner.close()
        self.node.destroy_node()
        self._context.try_shutdown()

    # ---- who is there

    def hears_rig(self, within: float) -> bool:
        """Whether a rig publishes its state."""
        end = time.monotonic() + within
        while self._state is None and time.monotonic() < end:
            time.sleep(0.05)
        return self._state is not None

    def wait(self, done: Callable[[], Any], timeout: float, what: str) -> None:
        """Waits for `done`; raises CampaignError that names `what`."""
        end = time.monotonic() + timeout
        while not done():
            if time.monotonic() > end:
                raise CampaignError(f"{what} within {timeout:.0f} s")
            self._check()
            time.sleep(0.02)

    def unit_id(self) -> str:
        """Of the link's newest status."""
        self.wait(lambda: self._state is not None, HEARD_WITHIN, f"no {Topics.RIG_STATE}: start the rig node; nothing")
        self.wait(lambda: self._link is not None, HEARD_WITHIN, f"no {Topics.LINK}: start the bridge; nothing")
        return str(self._link.unit_id)

    def link_figures(self) -> LinkFigures:
        """Frames and losses over some seconds."""
        before, begun = self._fresh_link(), time.monotonic()
        self._pause(LINK_WATCH)
        after = self._fresh_link()
        return LinkFigures(_since(before, after, "received"), _since(before, after, "lost"), time.monotonic() - begun)

    # ---- motion

    def ready(self) -> None:
        """Homes the rig where its zero is not known."""
        self.wait(
            self._resting, BUSY_FOR, f"the rig is busy with another motion (call {Topics.RIG_STOP}); no end of it"
        )
        mode = self._state.mode
        if mode == RigState.FAULT:
            raise CampaignError(f"the rig is in a fault ({self._state.fault_text}): mend it and call rig/reset")
        if mode == RigState.IDLE:
            return
        if self.operator is not None:
            self.operator.confirm("The carriage will seek its zero. Is the rail free?")
        self.wait(self._home.service_is_ready, ANSWER_WITHIN, f"no service {Topics.RIG_HOME}")
        self._call(self._home, "homing", HOMED_WITHIN)
        # the answer may be here before the state that the rig node judges by: it would not turn the board yet
        known = (RigState.IDLE, RigState.FAULT)
        self.wait(lambda: self._state.mode in known, ANSWER_WITHIN, "the rig says that it is homed; no state that does")

    def turn(self, mounting: str) -> None:
        """By whoever turns boards here; parked for a person."""
        if self.operator is None:
            return
        if self.operator.at_hand and self._park.service_is_ready():
            self._call(self._park, "parking", ANSWER_WITHIN)
        self.operator.turn(mounting)

    def make_run(self, run: PlanRun, bag: Path, show: Show) -> RunOutcome:
        """Rest, motion, rest, with the recorder running; a static run is rest alone."""
        show("to its place")
        self._go_to(-run.amplitude if run.shape == "triangle" else run.position)
        recorder = self._begin_recording(bag)
        try:
            before = self._fresh_link()
            error = None
            if run.shape == "static":
                show("at rest")
                self._pause(run.duration)
            else:
                show("at rest before the motion")
                self._pause(STILL_BEFORE)
                show("in motion")
                error = self._perform(run)
                show("at rest after the motion")
                self._pause(STILL_AFTER)
            after = self._fresh_link()
        finally:
            self._spinner.remove(recorder)
            summary = recorder.finish()
            unkept = summary.unwritten + sum(summary.overflow.values()) + sum(recorder.lost.values())
            recorder.destroy_node()
        return self._outcome(summary, unkept, before, after, error)

    def _outcome(self, summary: Summary, unkept: int, before: Any, after: Any, error: float | None) -> RunOutcome:
        if summary.error:
            raise CampaignError(summary.error)
        frames, lost = _since(before, after, "received"), _since(before, after, "lost")
        if not frames or after.received < before.received:
            raise CampaignError("the bridge was restarted during the run; the same command makes it again")
        return RunOutcome(sum(summary.counts.values()), frames, lost, unkept, error, _interruption(before, after))

    def _begin_recording(self, bag: Path) -> RecorderNode:
        """A recorder that hears all that a run needs."""
        overrides = [Parameter("out", value=str(bag))]
        recorder = RecorderNode(self._store, context=self._context, parameter_overrides=overrides)
        recorder.get_logger().set_level(LoggingSeverity.WARN)  # the progress display says what goes on
        recorder.begin()
        self._spinner.add(recorder)
        names = {self.node.resolve_topic_name(name): name for name in NEEDED}

        def missing() -> list[str]:
            return [name for full, name in names.items() if not recorder.heard[full]]

        try:
            self.wait(lambda: not missing(), HEARD_WITHIN, "not every topic of a run could be recorded")
        except CampaignError as error:
            self._spinner.remove(recorder)
            recorder.finish()
            recorder.destroy_node()
            raise CampaignError(f"{error}: {', '.join(missing())}") from None
        return recorder

    def _call(self, client: Any, what: str, within: float) -> None:
        """A service that moves the carriage."""
        future = client.call_async(Trigger.Request())
        self.wait(future.done, within, f"{what} did not end")
        if not future.result().success:
            raise CampaignError(f"{what} failed: {future.result().message}")

    def _resting(self) -> bool:
        return self._state.mode in (RigState.IDLE, RigState.UNHOMED, RigState.FAULT)

    def _go_to(self, position: float) -> None:
        pose = self._state.reference  # the position, where nothing is controlled
        if abs(pose - position) > AT_PLACE:
            self._drive(self._move, Move.Goal(shape=Move.Goal.HOLD, position=position), 30.0, Topics.RIG_MOVE)

    def _perform(self, run: PlanRun) -> float:
        """The motion, whole cycles; returns its tracking error in m."""
        period = 2.0 * math.pi / run.angular_frequency
        cycles = max(1, math.ceil(run.duration / period - 1e-9))
        limit = cycles * period + 60.0
        if run.shape == "sine":
            goal = Sinusoid.Goal(amplitude=run.amplitude, angular_frequency=run.angular_frequency, cycles=cycles)
            return self._drive(self._sine, goal, limit, Topics.RIG_SINUSOID)
        goal = Move.Goal(
            shape=Move.Goal.TRIANGLE,
            amplitude=run.amplitude,
            angular_frequency=run.angular_frequency,
            duration=cycles * period,
        )
        return self._drive(self._move, goal, limit, Topics.RIG_MOVE)

    def _drive(self, client: Any, goal: Any, limit: float, name: str) -> float:
        self.wait(client.server_is_ready, ANSWER_WITHIN, f"the rig offers no {name}")
        sent = client.send_goal_async(goal)
        self.wait(sent.done, ANSWER_WITHIN, f"no answer of {name}")
        handle = sent.result()
        if not handle.accepted:
            raise CampaignError(f"the rig rejects the motion ({name}): {self._why()}")
        self._moving = True
        result = handle.get_result_async()
        self.wait(lambda: result.done() or self._silent(), limit, "the motion did not end")
        if not result.done():
            raise CampaignError(f"no {Topics.LINK} for {LINK_SILENT:.0f} s; look after the bridge and the board")
        self._moving = False
        outcome = result.result().result
        if not outcome.success:
            raise CampaignError(f"the motion ended early: {outcome.message}")
        return float(outcome.rms_error)

    # ---- waiting and watching

    def _pause(self, seconds: float) -> None:
        """Time passes; the rig must stay in order and the link alive."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._check()
            if self._state.mode == RigState.FAULT:
                raise CampaignError(f"the rig is in a fault: {self._why()}")
            if self._silent():
                raise CampaignError(f"no {Topics.LINK} for {LINK_SILENT:.0f} s; look after the bridge and the board")
            time.sleep(min(0.05, max(0.0, end - time.monotonic())))

    def _fresh_link(self) -> Any:
        """The next status of the link."""
        former = self._link
        self.wait(lambda: self._link is not former, LINK_SILENT, f"no {Topics.LINK}: look after the bridge; nothing")
        return self._link

    def _silent(self) -> bool:
        return time.monotonic() - self._link_heard > LINK_SILENT

    def _why(self) -> str:
        return str(self._state.fault_text) or "the rig node's log says why"

    def _on_link(self, message: Any) -> None:
        self._link, self._link_heard = message, time.monotonic()

    def _on_state(self, message: Any) -> None:
        self._state = message


def _interruption(before: Any, after: Any) -> str:
    """What stays uncounted: frames that a board without power never sent, and those after the last one that came."""
    if _since(before, after, "restarts"):
        return "the board started anew in mid-run"
    if after.rate_hz < 0.5 * before.rate_hz:
        return f"frames came at {before.rate_hz:.0f} Hz when the run began and at {after.rate_hz:.0f} Hz at its end"
    return ""


def _since(before: Any, after: Any, name: str) -> int:
    return int(getattr(after, name)) - int(getattr(before, name))
