"""`dashboard`: the live rig as a web page on this machine."""

from __future__ import annotations

import asyncio
import logging
import sys
import threading

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.signals import SignalHandlerOptions
from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets

from gsense_driver.user_input.arguments import without_ros
from gsense_driver.user_input.node_help import node_parser
from gsense_rig.dashboard.access import Access
from gsense_rig.dashboard.folder import Folder
from gsense_rig.dashboard.motions import Motions
from gsense_rig.dashboard.node import DashboardNode
from gsense_rig.dashboard.pages import Pages
from gsense_rig.dashboard.pilot import Pilot
from gsense_rig.dashboard.server import Desk
from gsense_rig.dashboard.settings import declare
from gsense_rig.ending import Ending
from gsense_rig.recording.spinning import Spinner

ABOUT = (
    "The live rig as a web page on this machine. Prints the address to open; who has it may move the rig. Ends "
    "on SIGINT or SIGTERM: motions that a page has started are stopped first. Exit 2 where it cannot be served on."
)
END_PATIENCE = 8.0  # s for motions to come to rest


def main() -> int:
    """Runs until a signal."""
    node_parser("dashboard", ABOUT, declare).parse_args(without_ros("dashboard", sys.argv))
    ended = threading.Event()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    ending = Ending(ended)
    logging.getLogger("tornado.access").setLevel(logging.ERROR)
    try:
        node = DashboardNode()
    except ParameterException as error:
        ending.over()
        print(f"dashboard: {error}", file=sys.stderr)  # noqa: T201
        rclpy.try_shutdown()
        return 2
    spinner = Spinner(node.context)
    try:
        return asyncio.run(_serve(node, spinner, ended))
    except OSError as error:
        print(f"dashboard: {node.settings.host}:{node.settings.port}: {error.strerror or error}", file=sys.stderr)  # noqa: T201
        return 2
    finally:
        ending.over()
        spinner.remove(node)
        spinner.close()
        node.destroy_node()
        rclpy.try_shutdown()


async def _serve(node: DashboardNode, spinner: Spinner, ended: threading.Event) -> int:
    settings, logger = node.settings, node.get_logger()
    sockets = bind_sockets(settings.port, settings.host)
    access = Access(settings.host, settings.names)
    motions = Motions(Pilot(node), logger.warning)
    desk = Desk(access, node.state, Pages(settings.page_timeout), motions, Folder(settings.folder), logger.info)
    server = HTTPServer(desk.application())
    server.add_sockets(sockets)
    spinner.add(node)
    reach = access.warning()
    if reach is not None:
        logger.warning(reach)
    print(f"dashboard: {access.address(sockets[0].getsockname()[1])}", flush=True)  # noqa: T201

    def before_tick() -> None:
        if not spinner.alive:
            raise RuntimeError("nothing comes from the graph any more")
        node.watched = desk.watched()
        node.drain()

    work = [asyncio.ensure_future(desk.serve_pages(before_tick)), asyncio.ensure_future(desk.watch_folder())]
    told = asyncio.ensure_future(_set(ended))
    await asyncio.wait([*work, told], return_when=asyncio.FIRST_COMPLETED)
    ended.set()
    server.stop()
    await motions.end(END_PATIENCE)
    for task in work:
        task.cancel()
    results = await asyncio.gather(*work, return_exceptions=True)
    for socket in list(desk.sockets.values()):
        socket.close(1001, "the dashboard ends")
    failures = [result for result in results if isinstance(result, Exception)]
    if failures:
        node.get_logger().error(f"the server failed: {failures[0]!r}")
    return 1 if failures else 0


async def _set(event: threading.Event) -> None:
    """Wait for an event of another thread."""
    await asyncio.get_running_loop().run_in_executor(None, event.wait)
