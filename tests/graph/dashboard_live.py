"""A simulated rig with a dashboard in a namespace, and what a browser's page does over the websocket."""

from __future__ import annotations

import asyncio
import json
import select
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from gsense_msgs.msg import RigState
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from .compensations import compensation
from .ears import Ears
from .processes import Graph, parameters

NAMESPACE = ("-r", "__ns:=/lab")
STATE = "/lab/rig/state"


@dataclass
class Live:
    graph: Graph
    ears: Ears
    folder: Path
    address: str = ""

    @property
    def host(self) -> str:
        return urlsplit(self.address).netloc

    @property
    def token(self) -> str:
        return self.address.partition("#token=")[2]

    def mode(self) -> int:
        heard = self.ears.heard[STATE]
        return int(self.ears.messages(STATE, heard[-1:])[0].mode) if heard else -1

    def wait_mode(self, mode: int, timeout: float = 60.0) -> None:
        self.ears.wait(lambda: self.mode() == mode, timeout, f"mode {mode}")

    def start_dashboard(self) -> None:
        # pages that are held up by a loaded machine are no subject here: tests/rig/test_dashboard_server.py has silence
        given = parameters(port=0, folder=self.folder, page_timeout=60.0)
        process = self.graph.start("dashboard", "gsense_rig", "dashboard", *given, *NAMESPACE)
        ready, _, _ = select.select([process.stdout], [], [], 120.0)
        assert ready, self.graph.log("dashboard")
        assert process.stdout is not None
        self.address = process.stdout.readline().split()[1]


def start(graph: Graph, folder: Path) -> Live:
    bus, file = folder / "bus", folder / "compensation.yaml"
    file.write_text(compensation("mpu6050"))
    graph.start("rig", "gsense_rig", "rig", *parameters(seed=5, bus=bus), *NAMESPACE)
    port = graph.start_board("board", "--bus", str(bus), "--no-bench")
    graph.start("bridge", "gsense_driver", "bridge", *parameters(port=port, unit_id="unit-5"), *NAMESPACE)
    filtered = parameters(sensor="mpu6050", compensation_file=file)
    graph.start("fusion", "gsense_fusion", "fusion", *filtered, *NAMESPACE)
    made = Live(graph, Ears({STATE: RigState}), folder)
    made.start_dashboard()
    made.wait_mode(RigState.UNHOMED, 120.0)
    return made


class Page:
    """What a browser's page does: answers every state, keeps the last."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self.state: dict[str, Any] = {}
        self.positions: list[float] = []
        self.rates: list[list[float]] = []
        self.answers: dict[int, list[dict[str, Any]]] = {}

    async def __aenter__(self) -> Page:  # noqa: PYI034 - Self is not in Python 3.10
        request = HTTPRequest(f"ws://{self._live.host}/live", headers={"Origin": f"http://{self._live.host}"})
        self.socket = await websocket_connect(request)
        await self.say(type="hello", token=self._live.token)
        self._reader = asyncio.ensure_future(self._read())
        return self

    async def __aexit__(self, *_: object) -> None:
        self.socket.close()
        self._reader.cancel()
        with suppress(asyncio.CancelledError):
            await self._reader

    async def say(self, **message: Any) -> None:
        await self.socket.write_message(json.dumps(message))

    async def _read(self) -> None:
        while (text := await self.socket.read_message()) is not None:
            message = json.loads(text)
            if message["type"] == "answer":
                self.answers.setdefault(message["id"], []).append(message)
            if message["type"] == "state":
                self.state = message
                self.positions += [row[1] for row in message["carriage"]["rows"]]
                self.rates += [row[1:4] for row in (message["imu"] or {"rows": []})["rows"]]
                await self.say(type="alive", n=message["n"])

    async def until(self, condition: Callable[[], Any], what: str, timeout: float = 60.0) -> Any:
        end = time.monotonic() + timeout
        while not (value := condition()):
            assert time.monotonic() < end, f"no {what}; last state: {self.state}; answers: {self.answers}"
            self._live.graph.check()
            await asyncio.sleep(0.02)
        return value

    async def ask(self, number: int, kind: str, **fields: Any) -> dict[str, Any]:
        """The first answer to a command."""
        await self.say(type=kind, id=number, **fields)
        return dict((await self.until(lambda: self.answers.get(number), f"answer to {kind}"))[0])
