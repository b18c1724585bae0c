"""A headless Chromium that is asked over its own debugging protocol: what stands in the page, what it fetched."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any

from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.websocket import websocket_connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def chromium() -> str | None:
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One page. `requests` are the addresses of all that it asked for, `errors` what its console complains about."""

    def __init__(self, executable: str, folder: Path, width: int = 1280, height: int = 800) -> None:
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._answers: dict[int, asyncio.Future[Any]] = {}
        self._ids = count(1)
        options = [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--no-default-browser-check", "--hide-scrollbars", "--remote-debugging-port=0",
            f"--user-data-dir={folder}", f"--window-size={width},{height}",
        ]  # fmt: skip
        self._port_file = folder / "DevToolsActivePort"
        self._process = subprocess.Popen(
            [executable, *options, "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    async def connect(self, timeout: float = 90.0) -> None:
        end = time.monotonic() + timeout
        pages: list[Any] = []
        while not pages:
            assert time.monotonic() < end, "Chromium does not answer"
            await asyncio.sleep(0.1)
            with suppress(OSError, ValueError, IndexError):
                port = int(self._port_file.read_text().split()[0])
                answer = await AsyncHTTPClient().fetch(HTTPRequest(f"http://127.0.0.1:{port}/json/list"))
                pages = [page for page in json.loads(answer.body) if page["type"] == "page"]
        self._socket = await websocket_connect(pages[0]["webSocketDebuggerUrl"], max_message_size=1 << 28)
        self._reader = asyncio.ensure_future(self._read())
        for domain in ("Page", "Network", "Runtime", "Log"):
            await self.send(f"{domain}.enable")

    async def _read(self) -> None:
        while (text := await self._socket.read_message()) is not None:
            message = json.loads(text)
            if "id" in message:
                self._answers.pop(message["id"]).set_result(message)
                continue
            method, about = message["method"], message["params"]
            if method == "Network.requestWillBeSent":
                self.requests.append(about["request"]["url"])
            elif method == "Network.webSocketCreated":
                self.requests.append(about["url"])
            elif method == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(about["exceptionDetails"]))
            elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
                self.errors.append(about["entry"]["text"])

    async def send(self, method: str, **parameters: Any) -> Any:
        number = next(self._ids)
        self._answers[number] = answered = asyncio.get_running_loop().create_future()
        await self._socket.write_message(json.dumps({"id": number, "method": method, "params": parameters}))
        answer = await asyncio.wait_for(answered, 60.0)
        assert "error" not in answer, answer
        return answer["result"]

    async def evaluate(self, expression: str) -> Any:
        answer = await self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    async def wait(self, expression: str, timeout: float = 60.0) -> Any:
        """The expression's value as soon as it is true."""
        end = time.monotonic() + timeout
        while True:
            value = await self.evaluate(expression)
            if value:
                return value
            assert time.monotonic() < end, f"never true: {expression}; the page shows: {await self.text()}"
            await asyncio.sleep(0.1)

    async def text(self) -> str:
        return str(await self.evaluate("document.body.innerText"))

    async def open(self, address: str) -> None:
        await self.send("Page.navigate", url=address)
        await self.wait("location.href !== 'about:blank' && document.readyState === 'complete'")

    async def resize(self, width: int, height: int, mobile: bool = False) -> None:
        await self.send(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2 if mobile else 1, mobile=mobile,
        )  # fmt: skip

    async def screenshot(self) -> bytes:
        """PNG."""
        answer = await self.send("Page.captureScreenshot", format="png")
        return base64.b64decode(answer["data"])

    def close(self) -> None:
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
