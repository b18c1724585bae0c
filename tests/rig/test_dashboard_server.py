"""The server on a loopback port, with a rig that is played: what it serves, and to whom."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.websocket import websocket_connect

from gsense_rig.dashboard.access import Access
from gsense_rig.dashboard.folder import Folder
from gsense_rig.dashboard.motions import Motions
from gsense_rig.dashboard.pages import MAX_PAGES, Pages
from gsense_rig.dashboard.server import STATIC, Desk
from gsense_rig.dashboard.state import GraphState, RigSeen

from .dashboard_pilot import FakePilot

SINE = {"type": "sinusoid", "id": 4, "amplitude": 0.1, "angular_frequency": 5.0, "cycles": 3}


class Site:
    def __init__(self, folder: Path) -> None:
        self.pilot = FakePilot()
        self.log: list[str] = []
        self.desk = Desk(
            Access("127.0.0.1"),
            GraphState(),
            Pages(1.0),
            Motions(self.pilot, self.log.append),
            Folder(folder),
            self.log.append,
        )
        self.desk.state.take_rig(RigSeen(2, (False,) * 4, 1, 0.0, 0.0, 0.0, 0, ""), 0.0)
        (socket,) = bind_sockets(0, "127.0.0.1")
        self.host = f"127.0.0.1:{socket.getsockname()[1]}"
        self.server = HTTPServer(self.desk.application())
        self.server.add_sockets([socket])
        self.sockets: list[Any] = []
        self.tasks = [
            asyncio.ensure_future(self.desk.serve_pages(lambda: None)),
            asyncio.ensure_future(self.desk.watch_folder()),
        ]

    async def get(self, path: str, **headers: str) -> Any:
        return await AsyncHTTPClient().fetch(HTTPRequest(f"http://{self.host}/{path}", headers=headers))

    async def status(self, path: str, **headers: str) -> int:
        try:
            return (await self.get(path, **headers)).code
        except HTTPClientError as error:
            return error.code

    async def page(self, token: str | None = None, **headers: str) -> Any:
        """A websocket; its own origin unless told otherwise."""
        request = HTTPRequest(f"ws://{self.host}/live", headers={"Origin": f"http://{self.host}", **headers})
        socket = await websocket_connect(request)
        self.sockets.append(socket)
        await say(socket, type="hello", token=self.desk.access.token if token is None else token)
        return socket

    async def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        results = await asyncio.gather(*self.tasks, return_exceptions=True)
        for socket in self.sockets:
            socket.close()
        self.server.stop()
        failures = [result for result in results if not isinstance(result, asyncio.CancelledError)]
        assert not failures, failures


async def say(socket: Any, **message: Any) -> None:
    await socket.write_message(json.dumps(message))


async def hear(socket: Any, kind: str, **fields: Any) -> dict[str, Any]:
    """The next message of that type with these fields; answers each state, as a page does."""
    while True:
        text = await asyncio.wait_for(socket.read_message(), 20.0)
        assert text is not None, "closed"
        message = json.loads(text)
        if message["type"] == "state":
            await say(socket, type="alive", n=message["n"])
        if message["type"] == kind and all(message.get(name) == value for name, value in fields.items()):
            return dict(message)


async def until(condition: Callable[[], Any]) -> None:
    for _ in range(400):
        if condition():
            return
        await asyncio.sleep(0.05)
    raise AssertionError("never happened")


Play = Callable[[Site], Coroutine[Any, Any, None]]


@pytest.fixture
def run(tmp_path: Path) -> Callable[[Play], None]:
    async def whole(play: Play) -> None:
        site = Site(tmp_path)
        try:
            await asyncio.wait_for(play(site), 60.0)
        finally:
            await site.close()

    return lambda play: asyncio.run(whole(play))


def test_every_file_that_the_page_names_is_served(run):
    async def play(site: Site) -> None:
        answer = await site.get("")
        assert answer.headers["Content-Type"].startswith("text/html")
        policy = answer.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "frame-ancestors 'none'" in policy
        assert site.desk.access.token not in answer.body.decode()
        named = set(re.findall(r'(?:src|href)="(static/[^"]+)"', answer.body.decode()))
        for module in STATIC.glob("*.js"):
            named |= {f"static/{name}" for name in re.findall(r'from "\./([^"]+)"', module.read_text())}
        assert len(named) > 8
        for name in named:
            assert await site.status(name) == 200, name

    run(play)


def test_pages_name_no_other_site():
    own = [file for file in STATIC.iterdir() if not file.name.startswith("uPlot")]
    for file in own:
        text = file.read_text().replace("http://www.w3.org/2000/svg", "")
        assert not re.search(r"https?://|//[a-z]+\.[a-z]", text), file.name


def test_vendored_library_has_its_licence_and_version():
    assert "MIT License" in (STATIC / "uPlot.LICENSE.txt").read_text()
    assert "(v1.6.32)" in (STATIC / "uPlot.iife.min.js").read_text()[:200]


def test_nothing_else_is_served(run):
    async def play(site: Site) -> None:
        (site.desk.folder.root / "secret.html").write_text("no report")
        for path in ("static/../server.py", "static/..%2fserver.py", "server.py", "reports/secret.html",
                     "reports/../../etc/passwd", "reports/%2e%2e/secret.html", "static/"):  # fmt: skip
            assert await site.status(path) in {403, 404}, path

    run(play)


def test_a_foreign_name_is_refused(run):
    async def play(site: Site) -> None:
        for path in ("", "static/app.js", "live", "reports/x"):
            assert await site.status(path, Host="evil.example:8077") == 403

    run(play)


def test_a_foreign_page_gets_no_websocket(run):
    async def play(site: Site) -> None:
        for origin in ("http://evil.example", "http://127.0.0.1:1", "null"):
            with pytest.raises(HTTPClientError) as caught:
                await site.page(Origin=origin)
            assert caught.value.code == 403

    run(play)


def test_without_the_token_a_page_looks_on_and_stops(run):
    async def play(site: Site) -> None:
        page = await site.page(token="guessed")
        state = await hear(page, "state")
        assert state["rig"]["mode"] == "IDLE"
        assert not state["may_command"]
        for command in (SINE, {"type": "home", "id": 4}, {"type": "reset", "id": 4}):
            await say(page, **command)
            answer = await hear(page, "answer", id=4)
            assert answer["state"] == "refused"
            assert "may only look on" in answer["text"]
        await say(page, type="stop", id=5)
        assert (await hear(page, "answer", id=5))["state"] == "done"
        assert site.pilot.calls == ["stop"]
        assert site.pilot.goals == []

    run(play)


def test_a_goal_from_its_start_to_its_end(run):
    async def play(site: Site) -> None:
        page, other = await site.page(), await site.page()
        await say(page, **SINE)
        assert (await hear(page, "answer", id=4))["state"] == "accepted"
        for one, mine in ((page, True), (other, False)):
            while not (motions := (await hear(one, "state"))["motions"]):
                pass
            assert [motion["mine"] for motion in motions] == [mine]
        site.pilot.drives[0].finish(True, "tracked")
        assert (await hear(page, "answer", id=4))["text"] == "tracked"

    run(play)


def test_a_rejection_is_told(run):
    async def play(site: Site) -> None:
        site.pilot.rejects = "amplitude 1 m leaves the soft limits"
        page = await site.page()
        await say(page, **SINE)
        assert (await hear(page, "answer", id=4))["text"] == site.pilot.rejects

    run(play)


def test_a_closed_page_stops_its_motion(run):
    async def play(site: Site) -> None:
        page = await site.page()
        await say(page, **SINE)
        await hear(page, "answer", id=4)
        page.close()
        await until(lambda: site.pilot.drives[0].cancelled)
        await until(lambda: not site.desk.pages.open)

    run(play)


def test_a_page_that_falls_silent_stops_its_motion(run):
    async def play(site: Site) -> None:
        page = await site.page()
        await say(page, **SINE)
        await hear(page, "answer", id=4)
        await until(lambda: site.pilot.drives[0].cancelled)  # nothing is read or answered from here on
        assert site.desk.pages.open

    run(play)


def test_nonsense_is_answered_counted_and_does_no_harm(run):
    async def play(site: Site) -> None:
        page = await site.page()
        for text in ("nonsense", "[]", '{"type": "sinusoid", "id": 8}', '{"type": "fly", "id": 8}', "{}" * 50):
            await page.write_message(text)
            answer = await hear(page, "answer")
            assert answer["state"] == "refused"
            assert answer["text"].startswith("message not understood: ")
        await page.write_message(b"\x00\x01", binary=True)
        assert (await hear(page, "state", malformed=6))["malformed"] == 6
        assert site.pilot.goals == []

    run(play)


def test_a_message_that_is_too_long_ends_that_page_alone(run):
    async def play(site: Site) -> None:
        page, other = await site.page(), await site.page()
        await page.write_message("x" * 100_000)
        while await asyncio.wait_for(page.read_message(), 20.0) is not None:
            pass
        assert (await hear(other, "state", pages=1))["pages"] == 1

    run(play)


def test_too_many_pages(run):
    async def play(site: Site) -> None:
        for _ in range(MAX_PAGES):
            await site.page()
        one_more = await site.page()
        assert await asyncio.wait_for(one_more.read_message(), 20.0) is None
        assert one_more.close_code == 1013

    run(play)


def test_reports_are_listed_and_served_where_their_scripts_reach_nothing(run):
    async def play(site: Site) -> None:
        page = await site.page()
        folder = site.desk.folder.root / "my report"
        folder.mkdir()
        (folder / "report.json").write_text('{"schema": "gsense-close-loop/1", "verdict": "nothing_missing"}')
        (folder / "report.html").write_text("<p>found</p>")
        while not (message := await hear(page, "folder"))["reports"]:
            pass
        assert message["reports"][0]["path"] == "my report/report.html"
        answer = await site.get("reports/my%20report/report.html")
        assert answer.body == b"<p>found</p>"
        assert "sandbox allow-scripts" in answer.headers["Content-Security-Policy"]
        assert "allow-same-origin" not in answer.headers["Content-Security-Policy"]
        (folder / "report.html").unlink()
        assert await site.status("reports/my%20report/report.html") == 404

    run(play)
