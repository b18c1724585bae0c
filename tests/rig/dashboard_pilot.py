"""A rig that does what the test says, behind the dashboard's commands."""

from __future__ import annotations

import asyncio

from gsense_rig.dashboard.motions import Outcome, Refused


class FakeDrive:
    def __init__(self, pilot: FakePilot, confirms: bool) -> None:
        self.elapsed = 1.5
        self.cancelled = False
        self._pilot = pilot
        self._confirms = confirms
        self.end = asyncio.get_running_loop().create_future()

    async def result(self) -> Outcome:
        return await self.end

    async def cancel(self) -> bool:
        self.cancelled = True
        if self._confirms:
            self.finish(False, "stopped")
        return self._confirms

    def finish(self, success: bool, text: str) -> None:
        if not self.end.done():
            self.end.set_result(Outcome(success, text))


class FakePilot:
    """`calls` and `drives`: what came, in order."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.goals: list[object] = []
        self.drives: list[FakeDrive] = []
        self.refuses: str | None = None
        self.rejects: str | None = None
        self.confirms = True
        self.judging: asyncio.Event | None = None
        self.homing: asyncio.Event | None = None

    def refusal(self) -> str | None:
        return self.refuses

    async def call(self, name: str) -> Outcome:
        self.calls.append(name)
        if name == "home" and self.homing is not None:
            await self.homing.wait()
        if name == "stop":
            for drive in self.drives:
                drive.finish(False, "stopped")
            if self.homing is not None:
                self.homing.set()
        return Outcome(True, f"{name} it is")

    async def drive(self, goal: object) -> FakeDrive:
        self.goals.append(goal)
        if self.judging is not None:
            await self.judging.wait()
        if self.rejects is not None:
            raise Refused(self.rejects)
        drive = FakeDrive(self, self.confirms)
        self.drives.append(drive)
        return drive
