"""What pages have set going, and what becomes of it when a page is lost: it is stopped."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, Protocol

from gsense_rig.dashboard.protocol import SHAPES, Call, Command, Move, Sine

Tell = Callable[[str, str], None]
"""Takes a state (`accepted`, `refused`, `done`, `failed`) and its words."""


@dataclass(frozen=True)
class Outcome:
    """How a command ended."""

    success: bool
    text: str


class Refused(Exception):  # noqa: N818 - an answer, not an error
    """The rig does not take the command; the text says why."""


class Drive(Protocol):
    """A goal that the rig has accepted."""

    @property
    def elapsed(self) -> float:
        """Motion so far, s."""

    async def result(self) -> Outcome:
        """Its end."""

    async def cancel(self) -> bool:
        """Soft stop of this goal and of no other; False where the rig does not confirm it."""


class Pilot(Protocol):
    """The rig's node as the dashboard sees it."""

    def refusal(self) -> str | None:
        """Why nothing may be moved from here now."""

    async def call(self, name: str) -> Outcome:
        """One of the services; raises Refused where nobody serves it."""

    async def drive(self, goal: Sine | Move) -> Drive:
        """Send a goal; raises Refused."""


@dataclass
class Motion:
    """One command under way."""

    page: int
    text: str
    is_goal: bool
    drive: Drive | None = None
    abandoned: bool = False
    over: asyncio.Event = field(default_factory=asyncio.Event)

    @property
    def elapsed(self) -> float | None:
        """Motion so far, s; None before the rig has accepted, and of a service."""
        return None if self.drive is None else self.drive.elapsed


class Motions:
    """Passes commands on and remembers whose they are.

    Args:
        pilot: passes them to the rig.
        warn: takes a line for the log.
    """

    def __init__(self, pilot: Pilot, warn: Callable[[str], None]) -> None:
        self._pilot = pilot
        self._warn = warn
        self.under_way: list[Motion] = []
        self._tasks: set[asyncio.Task[None]] = set()

    async def perform(self, page: int, command: Command, tell: Tell) -> None:
        """Carry a command out to its end; what happens is told, nothing is raised.

        `stop` always goes to the rig. All else is for the rig to refuse, but for what `Pilot.refusal` says.
        """
        reason = "" if _is_stop(command) else self.refusal()
        if reason:
            tell("refused", reason)
            return
        motion = Motion(page, words(command), not isinstance(command, Call))
        if _moves(command):
            self.under_way.append(motion)
        try:
            outcome = await (self._call(command) if isinstance(command, Call) else self._drive(motion, command, tell))
        except Refused as refused:
            tell("refused", str(refused))
        else:
            tell("done" if outcome.success else "failed", outcome.text)
        finally:
            if motion in self.under_way:
                self.under_way.remove(motion)
            motion.over.set()

    async def _call(self, command: Call) -> Outcome:
        return await self._pilot.call(command.name)

    async def _drive(self, motion: Motion, goal: Sine | Move, tell: Tell) -> Outcome:
        motion.drive = await self._pilot.drive(goal)
        tell("accepted", motion.text)
        if motion.abandoned:  # the page went while the rig was judging
            await self._cancel(motion.drive)
        return await motion.drive.result()

    def refusal(self) -> str:
        """Why nothing but `stop` is taken just now; empty: it is for the rig to say."""
        return self._pilot.refusal() or ""

    def page_lost(self, page: int) -> None:
        """Stop what this page has set going, and nothing else."""
        for motion in self.under_way:
            if motion.page == page and not motion.abandoned:
                self._warn(f"the page that started '{motion.text}' is gone: stopping it")
                self._abandon(motion)

    async def end(self, patience: float) -> None:
        """The dashboard ends: stop what any page has set going, and wait for it, `patience` s at most."""
        for motion in self.under_way:
            if not motion.abandoned:
                self._abandon(motion)
        ends = [asyncio.ensure_future(motion.over.wait()) for motion in self.under_way]
        if ends:
            _, late = await asyncio.wait(ends, timeout=patience)
            for task in late:
                task.cancel()

    def _abandon(self, motion: Motion) -> None:
        motion.abandoned = True
        if motion.drive is not None:
            self._start(self._cancel(motion.drive))
        elif not motion.is_goal:  # a service cannot be cancelled; while it moves, the rig takes no other motion
            self._start(self._stop())

    def _start(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _cancel(self, drive: Drive) -> None:
        if not await drive.cancel():
            await self._stop()

    async def _stop(self) -> None:
        try:
            await self._pilot.call("stop")
        except Refused as refused:
            self._warn(f"could not stop: {refused}")


def _is_stop(command: Command) -> bool:
    return isinstance(command, Call) and command.name == "stop"


def _moves(command: Command) -> bool:
    return not isinstance(command, Call) or command.name in {"home", "park"}


def words(command: Command) -> str:
    """The command for people."""
    if isinstance(command, Call):
        return command.name
    if isinstance(command, Sine):
        return f"sinusoid {command.amplitude:g} m, {command.angular_frequency:g} rad/s, {command.cycles} cycles"
    shape = SHAPES[command.shape]
    if shape == "triangle":
        text = f"{command.amplitude:g} m, {command.angular_frequency:g} rad/s"
        return f"triangle {text} about {command.position:g} m for {command.duration:g} s"
    return f"{shape} to {command.position:g} m"
