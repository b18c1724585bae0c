"""The dashboard on a live simulated rig, in a namespace: over its websocket as a page, and in headless Chromium."""

from __future__ import annotations

import asyncio
import signal
import time
from collections.abc import Callable, Coroutine, Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from tests.domains import own_domain

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")

from gsense_msgs.msg import RigState  # noqa: E402

from .browser import Browser, chromium  # noqa: E402
from .dashboard_live import NAMESPACE, Live, Page, start  # noqa: E402
from .processes import Graph, parameters  # noqa: E402

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]

LONG = {"amplitude": 0.15, "angular_frequency": 6.0, "cycles": 1000}


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    folder = tmp_path_factory.mktemp("dashboard")
    with own_domain():
        graph = Graph(folder)
        ears = None
        try:
            made = start(graph, folder)
            ears = made.ears
            yield made
        finally:
            graph.close()
            if ears is not None:
                ears.close()


def played(live: Live, play: Callable[[Page], Coroutine[Any, Any, None]]) -> None:
    async def whole() -> None:
        async with Page(live) as page:
            await page.until(lambda: page.state.get("may_command"), "permission")
            await play(page)

    asyncio.run(whole())


def test_before_homing_the_page_lives_and_a_goal_is_refused_with_the_rigs_reason(live):
    async def play(page: Page) -> None:
        await page.until(lambda: page.state.get("rig") and page.state["rig"]["mode"] == "UNHOMED", "mode")
        await page.until(lambda: len(page.rates) > 10, "rates")
        await page.until(lambda: (page.state["link"] or {}).get("unit_id") == "unit-5", "link")
        await page.until(lambda: page.state["battery"], "battery")
        both = lambda: page.state["attitude"]["raw"] and page.state["attitude"]["gcomp"]  # noqa: E731
        await page.until(both, "orientation with and without compensation")
        assert page.state["filter"] == "madgwick"
        every = {"mpu6050", "bno055", "lisy300"}
        await page.until(lambda: set(page.state["sensors"]) == every, "raw topics of all sensors")
        answer = await page.ask(1, "sinusoid", **LONG)
        assert (answer["state"], answer["text"]) == ("refused", "not homed: call rig/home first")
        await page.until(lambda: any(n["name"] == "rig" for n in page.state["notes"]), "diagnostics")

    played(live, play)


def test_home_start_stop(live):
    async def play(page: Page) -> None:
        homed = await page.ask(1, "home")
        assert homed["state"] == "done", homed
        too_far = await page.ask(2, "sinusoid", **{**LONG, "amplitude": 0.5})
        assert too_far["state"] == "refused"
        assert "soft limits" in too_far["text"]
        page.positions.clear()
        assert (await page.ask(3, "sinusoid", **LONG))["state"] == "accepted"
        await page.until(lambda: page.positions and max(page.positions) > 0.13, "motion to the right")
        await page.until(lambda: min(page.positions) < -0.13, "motion to the left")
        assert page.state["rig"]["light"] == "AMBER"
        assert page.state["motions"][0]["mine"]
        busy = await page.ask(4, "move", shape="hold", position=0.0)
        assert (busy["state"], busy["text"]) == ("refused", "busy: running")
        assert (await page.ask(5, "stop"))["state"] == "done"
        await page.until(lambda: len(page.answers[3]) == 2, "end of the sinusoid")
        assert page.answers[3][1]["state"] == "failed"
        await page.until(lambda: page.state["rig"]["mode"] == "IDLE", "rest")
        assert not page.state["motions"]

    played(live, play)


def test_a_lost_pages_run_is_stopped_and_no_other(live):
    async def play(page: Page) -> None:
        async with Page(live) as other:
            assert (await other.ask(1, "sinusoid", **LONG))["state"] == "accepted"
            await page.until(lambda: page.state["rig"]["mode"] == "RUNNING", "motion")
            async with Page(live):
                pass  # one that has started nothing
            await asyncio.sleep(1.0)
            assert page.state["rig"]["mode"] == "RUNNING"
        await page.until(lambda: page.state["rig"]["mode"] == "IDLE", "rest after the page was closed", 20.0)

    played(live, play)
    assert "the page that started 'sinusoid 0.15 m, 6 rad/s, 1000 cycles' is gone" in live.graph.log("dashboard")


def test_a_campaign_has_the_rig_for_itself(live):
    async def play(page: Page) -> None:
        campaign = rclpy.create_node("campaign", namespace="/lab", context=live.ears.context)
        try:
            number, end = 1, time.monotonic() + 60.0
            while not (answer := await page.ask(number, "reset"))["text"].startswith("a campaign is using the rig"):
                assert time.monotonic() < end
                number += 1
                await asyncio.sleep(0.1)
            assert answer["state"] == "refused"
            assert (await page.ask(number + 1, "stop"))["state"] == "done"
        finally:
            campaign.destroy_node()

    played(live, play)


def test_in_chromium(live, tmp_path):
    executable = chromium()
    if executable is None:
        pytest.skip("no Chromium on this machine (apt install chromium)")

    async def whole() -> None:
        browser = Browser(executable, tmp_path)
        try:
            await browser.connect()
            await _look(browser, live)
        finally:
            browser.close()

    asyncio.run(whole())


MODE = "document.getElementById('mode').textContent"


async def _look(browser: Browser, live: Live) -> None:
    await browser.open(live.address)
    await browser.wait(f"{MODE} === 'idle'")
    assert "token" not in await browser.evaluate("location.href")
    shown = await browser.text()
    for words in ("unit-5", "position", "Angular rate", "without compensation", "with g-compensation", "4.0"):
        assert words in shown, words
    await browser.wait("document.querySelectorAll('canvas').length >= 6")
    await browser.wait("!document.querySelector('#sinusoid button').disabled")
    await browser.evaluate("document.querySelector('#sinusoid button').click()")
    await browser.wait(f"{MODE} === 'running'")
    figure = "document.querySelector('#carriage dd').textContent"
    before = await browser.evaluate(figure)
    await browser.wait(f"{figure} !== {before!r}")
    await browser.wait("parseFloat(document.querySelector('#rail .cart').getAttribute('transform').slice(10)) > 100")
    await browser.evaluate("document.getElementById('stop').click()")
    await browser.wait(f"{MODE} === 'idle'")
    await browser.wait("document.getElementById('answers').innerText.includes('stop done: stopped')")
    assert browser.errors == []
    assert len(browser.requests) > 8
    assert {urlsplit(address).hostname for address in browser.requests} == {"127.0.0.1"}


def test_the_dashboards_end_stops_what_it_started(live):
    async def play(page: Page) -> None:
        assert (await page.ask(1, "sinusoid", **LONG))["state"] == "accepted"
        await page.until(lambda: page.state["rig"]["mode"] == "RUNNING", "motion")
        live.graph.processes["dashboard"].send_signal(signal.SIGINT)
        end = time.monotonic() + 60.0
        while live.graph.processes["dashboard"].poll() is None:
            assert time.monotonic() < end
            await asyncio.sleep(0.05)

    played(live, play)
    assert live.graph.end("dashboard") == 0
    live.wait_mode(RigState.IDLE, 20.0)


def test_an_address_that_is_taken(live):
    live.start_dashboard()
    taken = parameters(port=urlsplit(live.address).port)
    second = live.graph.start("second", "gsense_rig", "dashboard", *taken, *NAMESPACE)
    second.wait(60.0)
    assert live.graph.end("second") == 2
    last = live.graph.log("second").strip().splitlines()[-1]
    assert last.startswith("dashboard: 127.0.0.1:")
    assert "in use" in last
