"""The web server: the page's own files, the reports that were found, and one websocket a page."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tornado.web
import tornado.websocket

from gsense_rig.dashboard.access import Access
from gsense_rig.dashboard.folder import Folder, FolderSeen
from gsense_rig.dashboard.motions import Motions, words
from gsense_rig.dashboard.pages import Page, Pages
from gsense_rig.dashboard.protocol import (
    MAX_LENGTH,
    Alive,
    Call,
    Command,
    Hello,
    ProtocolError,
    View,
    id_of,
    parse,
)
from gsense_rig.dashboard.snapshot import graph_message
from gsense_rig.dashboard.state import GraphState

STATIC = Path(__file__).parent / "static"
TICK = 0.05  # s
FOLDER_PERIOD = 2.0  # s
LOOK_ON = "this page may only look on and stop: open the address that the dashboard printed"
PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
REPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; font-src data:; "
    "base-uri 'none'; form-action 'none'; sandbox allow-scripts allow-downloads"
)
"""A report's scripts run in an origin of their own: no websocket of this server is open to them."""


@dataclass
class Desk:
    """What all requests share."""

    access: Access
    state: GraphState
    pages: Pages
    motions: Motions
    folder: Folder
    log: Callable[[str], None]
    seen: FolderSeen = field(default_factory=FolderSeen)
    sockets: dict[int, LiveSocket] = field(default_factory=dict)

    def watched(self) -> frozenset[tuple[str, str]]:
        """Sensor and filter that each page shows."""
        return frozenset((socket.shown[0], socket.shown[1]) for socket in self.sockets.values())

    async def serve_pages(self, before_tick: Callable[[], None]) -> None:
        """For ever: send the state, look for pages that are lost. `before_tick` brings the state up to date."""
        last = time.monotonic()
        while True:
            await asyncio.sleep(TICK)
            before_tick()
            now = time.monotonic()
            for page in self.pages.tick(now - last):
                self.motions.page_lost(page.number)
            last = now
            for socket in list(self.sockets.values()):
                socket.send_state(now)

    async def watch_folder(self) -> None:
        """For ever: look into the folder, tell the pages what is new."""
        loop = asyncio.get_running_loop()
        while True:
            seen = await loop.run_in_executor(None, self.folder.look)
            if seen != self.seen:
                self.seen = seen
                for socket in list(self.sockets.values()):
                    socket.send(type="folder", **seen.to_dict())
            await asyncio.sleep(FOLDER_PERIOD)

    def application(self) -> tornado.web.Application:
        """Its addresses."""
        shared = {"desk": self}
        return tornado.web.Application(
            [
                (r"/live", LiveSocket, shared),
                (r"/reports/(.+)", Report, shared),
                (r"/()", Asset, {**shared, "path": str(STATIC), "default_filename": "index.html"}),
                (r"/static/([A-Za-z]+\.[A-Za-z.]+)", Asset, {**shared, "path": str(STATIC)}),
            ],
            websocket_max_message_size=MAX_LENGTH,
            websocket_ping_interval=5,
            log_function=lambda _handler: None,
        )


class Guarded:
    """Refuses requests under a name that is not this server's, before anything else."""

    desk: Desk
    request: Any

    def host_is_foreign(self) -> bool:
        """Whether this request came under somebody else's name."""
        return not self.desk.access.host_allowed(self.request.host)


class Asset(Guarded, tornado.web.StaticFileHandler):
    """A file of the package."""

    def initialize(self, desk: Desk, path: str, default_filename: str | None = None) -> None:  # type: ignore[override]
        """Tornado's constructor."""
        self.desk = desk
        super().initialize(path, default_filename)

    def prepare(self) -> None:
        """Guard."""
        if self.host_is_foreign():
            raise tornado.web.HTTPError(403, reason="Unknown host name")

    def set_extra_headers(self, path: str) -> None:  # noqa: ARG002
        """Nothing from elsewhere, no frames."""
        self.set_header("Content-Security-Policy", PAGE_POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-cache")


class Report(Guarded, tornado.web.RequestHandler):
    """A report that was found in the folder; no other file of it."""

    def initialize(self, desk: Desk) -> None:
        """Tornado's constructor."""
        self.desk = desk

    async def get(self, path: str) -> None:
        """Send it."""
        if self.host_is_foreign():
            raise tornado.web.HTTPError(403, reason="Unknown host name")
        if path not in {report.path for report in self.desk.seen.reports}:
            raise tornado.web.HTTPError(404, reason="No such report")
        try:
            content = await asyncio.get_running_loop().run_in_executor(None, (self.desk.folder.root / path).read_bytes)
        except OSError:
            raise tornado.web.HTTPError(404, reason="The report is gone") from None
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.set_header("Content-Security-Policy", REPORT_POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cache-Control", "no-cache")
        self.finish(content)


class LiveSocket(Guarded, tornado.websocket.WebSocketHandler):
    """One page."""

    page: Page | None = None
    shown: tuple[str, str] = ("", "")
    """Sensor and filter of the last state message."""

    def initialize(self, desk: Desk) -> None:
        """Tornado's constructor."""
        self.desk = desk
        self._work: set[asyncio.Task[None]] = set()

    def check_origin(self, origin: str) -> bool:
        """No foreign page."""
        return self.desk.access.origin_allowed(origin, self.request.host)

    def prepare(self) -> None:
        """Guard."""
        if self.host_is_foreign():
            raise tornado.web.HTTPError(403, reason="Unknown host name")

    def open(self, *_arguments: str, **_named: str) -> None:
        """A page has come."""
        self.page = self.desk.pages.add()
        if self.page is None:
            self.close(1013, "too many pages")
            return
        self.set_nodelay(True)
        self.desk.sockets[self.page.number] = self
        self.send(type="folder", **self.desk.seen.to_dict())

    def on_close(self) -> None:
        """It is gone; what it has set going is stopped."""
        if self.page is not None:
            self.desk.pages.remove(self.page)
            self.desk.sockets.pop(self.page.number, None)
            self.desk.motions.page_lost(self.page.number)

    def on_message(self, text: str | bytes) -> None:
        """One message; none of them raises."""
        page = self.page
        if page is None:
            return
        try:
            message = parse(text)
        except ProtocolError as error:
            self.desk.pages.note_malformed(str(error))
            self.send(type="answer", id=id_of(text), state="refused", text=f"message not understood: {error}")
            return
        if isinstance(message, Hello):
            page.may_command = self.desk.access.may_command(message.token)
        elif isinstance(message, Alive):
            page.has_drawn(message.n)
        elif isinstance(message, View):
            page.viewing.choose(message.sensor, message.filter)
        else:
            self._command(page, message)

    def _command(self, page: Page, command: Command) -> None:
        def tell(state: str, text: str) -> None:
            self.send(type="answer", id=command.id, state=state, text=text)

        if not (page.may_command or (isinstance(command, Call) and command.name == "stop")):
            tell("refused", LOOK_ON)
            return
        self.desk.log(f"page {page.number}: {words(command)}")
        task = asyncio.ensure_future(self.desk.motions.perform(page.number, command, tell))
        self._work.add(task)
        task.add_done_callback(self._work.discard)

    def send_state(self, now: float) -> None:
        """The graph as it stands, unless the page does not keep up."""
        page = self.page
        number = page.next_state() if page is not None else None
        if page is None or number is None:
            return
        graph = graph_message(self.desk.state, page.viewing, now)
        self.shown = graph["sensor"], graph["filter"]
        motions = [
            {"text": motion.text, "elapsed": motion.elapsed, "mine": motion.page == page.number}
            for motion in self.desk.motions.under_way
        ]
        self.send(
            type="state", n=number, may_command=page.may_command, pages=len(self.desk.pages.open),
            malformed=self.desk.pages.malformed, refusal=self.desk.motions.refusal(), motions=motions, **graph,
        )  # fmt: skip

    def send(self, **message: Any) -> None:
        """JSON; a page that has just gone hears it no more."""
        with contextlib.suppress(tornado.websocket.WebSocketClosedError):
            self.write_message(json.dumps(message, allow_nan=False, separators=(",", ":")))
