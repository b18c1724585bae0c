"""A motion belongs to the page that started it, and ends with that page."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from gsense_rig.dashboard.motions import Motions, words
from gsense_rig.dashboard.protocol import Call, Move, Sine

from .dashboard_pilot import FakePilot

SINE = Sine(1, 0.15, 6.0, 20)


class Scene:
    def __init__(self) -> None:
        self.pilot = FakePilot()
        self.warnings: list[str] = []
        self.motions = Motions(self.pilot, self.warnings.append)
        self.told: dict[int, list[tuple[str, str]]] = {}
        self.tasks: list[asyncio.Task[None]] = []

    async def ask(self, page: int, command: Any) -> None:
        """Begin, and go on until nothing more happens by itself."""
        told = self.told.setdefault(page, [])
        work = self.motions.perform(page, command, lambda state, text: told.append((state, text)))
        self.tasks.append(asyncio.ensure_future(work))
        await settle()


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


def scene(play: Callable[[Scene], Coroutine[Any, Any, None]]) -> Callable[[], None]:
    async def whole() -> None:
        made = Scene()
        await play(made)
        await asyncio.wait_for(asyncio.gather(*made.tasks), 5.0)
        assert made.motions.under_way == []

    def test() -> None:
        asyncio.run(whole())

    test.__name__ = play.__name__
    return test


@scene
async def test_a_goal_is_accepted_and_ends(s):
    await s.ask(1, SINE)
    assert s.told[1] == [("accepted", "sinusoid 0.15 m, 6 rad/s, 20 cycles")]
    assert [(m.page, m.elapsed) for m in s.motions.under_way] == [(1, 1.5)]
    s.pilot.drives[0].finish(True, "0.02 mm")
    await settle()
    assert s.told[1][-1] == ("done", "0.02 mm")


@scene
async def test_a_rejection_gives_its_reason(s):
    s.pilot.rejects = "not homed: call rig/home first"
    await s.ask(1, SINE)
    assert s.told[1] == [("refused", "not homed: call rig/home first")]


@scene
async def test_during_a_campaign_only_stop_is_passed_on(s):
    s.pilot.refuses = "a campaign is using the rig"
    for command in (SINE, Move(2, 0, 0.0, 0.0, 0.0, 0.0), Call(3, "home"), Call(4, "reset"), Call(5, "stop")):
        await s.ask(1, command)
    assert s.pilot.goals == []
    assert s.pilot.calls == ["stop"]


@scene
async def test_a_lost_pages_motion_is_cancelled(s):
    await s.ask(1, SINE)
    s.motions.page_lost(1)
    s.motions.page_lost(1)
    await settle()
    assert s.pilot.drives[0].cancelled
    assert s.pilot.calls == []  # the goal alone, not whatever moves by then
    assert s.warnings == ["the page that started 'sinusoid 0.15 m, 6 rad/s, 20 cycles' is gone: stopping it"]


@scene
async def test_where_the_rig_does_not_confirm_it_is_stopped_altogether(s):
    s.pilot.confirms = False
    await s.ask(1, SINE)
    s.motions.page_lost(1)
    await settle()
    assert s.pilot.calls == ["stop"]


@scene
async def test_another_lost_page_changes_nothing(s):
    await s.ask(1, SINE)
    s.motions.page_lost(2)
    await settle()
    assert not s.pilot.drives[0].cancelled
    assert s.pilot.calls == []
    s.pilot.drives[0].finish(True, "")


@scene
async def test_a_page_that_goes_while_the_rig_is_judging(s):
    s.pilot.judging = asyncio.Event()
    await s.ask(1, SINE)
    s.motions.page_lost(1)
    s.pilot.judging.set()
    await settle()
    assert s.pilot.drives[0].cancelled


@scene
async def test_a_lost_pages_homing_is_stopped(s):
    s.pilot.homing = asyncio.Event()
    await s.ask(1, Call(1, "home"))
    assert s.pilot.calls == ["home"]
    s.motions.page_lost(1)
    await settle()
    assert s.pilot.calls == ["home", "stop"]


@scene
async def test_a_lost_page_after_the_end_changes_nothing(s):
    await s.ask(1, SINE)
    s.pilot.drives[0].finish(True, "")
    await settle()
    s.motions.page_lost(1)
    await settle()
    assert s.pilot.calls == []
    assert s.warnings == []


@scene
async def test_stop_reaches_the_rig_from_any_page(s):
    await s.ask(1, SINE)
    await s.ask(2, Call(9, "stop"))
    assert s.told[2] == [("done", "stop it is")]
    assert s.told[1][-1] == ("failed", "stopped")


@scene
async def test_the_dashboards_end_stops_everybodys_motion(s):
    await s.ask(1, SINE)
    s.pilot.homing = asyncio.Event()
    await s.ask(2, Call(1, "home"))
    await s.motions.end(2.0)
    assert s.pilot.drives[0].cancelled
    assert s.pilot.calls == ["home", "stop"]


def test_the_dashboards_end_does_not_wait_for_ever():
    async def whole() -> None:
        made = Scene()
        made.pilot.judging = asyncio.Event()
        await made.ask(1, SINE)
        await asyncio.wait_for(made.motions.end(0.05), 5.0)
        made.tasks[0].cancel()

    asyncio.run(whole())


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (Call(1, "home"), "home"),
        (Move(1, 0, 0.1, 0.0, 0.0, 0.0), "hold to 0.1 m"),
        (Move(1, 2, 0.0, 0.1, 4.0, 10.0), "triangle 0.1 m, 4 rad/s about 0 m for 10 s"),
    ],
)
def test_words(command, text):
    assert words(command) == text
