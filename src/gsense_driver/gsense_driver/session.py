"""One configured stretch of work, live or from a raw log: pipeline, messages and reports, in one order of events.

Live, the node calls the methods and a raw log keeps the calls; a replay makes the same calls from the log. All that
the messages depend on goes through here, so both publish the same. No ROS and no clock here: `Outlet` has the messages.
"""

from __future__ import annotations

import json
import threading
from typing import Protocol

from gsense_driver.diagnostics import Figures, Health
from gsense_driver.link import LinkCounts
from gsense_driver.pipeline import Pipeline
from gsense_driver.raw_log import WALL_PAYLOAD, Kind, RawLogHeader, encode_report
from gsense_driver.report import Reporter
from gsense_driver.samples import Reading
from gsense_driver.scaling import Scales
from gsense_driver.settings import Settings


class Outlet(Protocol):
    """Where readings go (`messages.Messages`)."""

    def configure(self, settings: Settings, scales: Scales) -> None:
        """Take frame ids and covariances."""

    def publish(self, reading: Reading) -> None:
        """Publish one reading."""

    def publish_link(self, now_ns: int, counts: LinkCounts, figures: dict[str, float], unit_id: str) -> None:
        """Publish `link`; `figures` by the message's field names."""

    def publish_health(self, now_ns: int, prefix: str, hardware_id: str, entries: list[Health]) -> None:
        """Publish `/diagnostics`."""


class Log(Protocol):
    """What keeps the events (`raw_log_writer.RawLogWriter`)."""

    def put(self, kind: Kind, time_ns: int, payload: bytes = b"") -> None:
        """Keep one event."""


def header_of(settings: Settings, wall_offset_ns: int) -> RawLogHeader:
    """Header of a raw log of a session."""
    return RawLogHeader(
        port=settings.port,
        baud=settings.baud,
        protocol=settings.pipeline.protocol,
        unit_id=settings.unit_id,
        wall_offset_ns=wall_offset_ns,
        parameters=dict(settings.values),
    )


class Session:
    """Takes events, publishes. `feed`, `opened` and `configure` are the reading thread's, `report` any thread's."""

    def __init__(
        self, settings: Settings, wall_offset_ns: int, outlet: Outlet, prefix: str, log: Log | None = None
    ) -> None:
        """`prefix`: of the names in `/diagnostics`, node and namespace."""
        self.settings = settings
        self.pipeline = Pipeline(settings.pipeline, wall_offset_ns)
        self._reporter = Reporter(self.pipeline)
        self._outlet = outlet
        self._prefix = prefix
        self._log = log
        self._lock = threading.Lock()  # events have one order, which is the log's
        self._void = False  # nothing came since the port was lost or opened
        self._scales = self.pipeline.sampler.scales
        outlet.configure(settings, self._scales)

    def feed(self, data: bytes, arrival_ns: int) -> None:
        """Bytes that arrived at a time of the steady clock."""
        with self._lock:
            if self._log is not None:
                self._log.put(Kind.DATA, arrival_ns, data)
            self._void = False
            readings = self.pipeline.feed(data, arrival_ns)
        for reading in readings:
            self._outlet.publish(reading)
        if self.pipeline.sampler.scales is not self._scales:
            self._take_scales()

    def opened(self, now_ns: int) -> None:
        """The port was lost or opened anew."""
        if self._void:
            return
        with self._lock:
            if self._log is not None:
                self._log.put(Kind.OPENED, now_ns)
            self._void = True
            self.pipeline.reopened()

    def configure(self, settings: Settings, now_ns: int) -> None:
        """Parameters changed."""
        with self._lock:
            if self._log is not None:
                self._log.put(Kind.SETTINGS, now_ns, json.dumps(dict(settings.values), sort_keys=True).encode())
            self.settings = settings
            self.pipeline.configure(settings.pipeline)
        self._take_scales()

    def set_wall_offset(self, offset_ns: int, now_ns: int) -> None:
        """The wall clock was set: stamps follow it."""
        with self._lock:
            if self._log is not None:
                self._log.put(Kind.WALL, now_ns, WALL_PAYLOAD.pack(offset_ns))
            self.pipeline.wall_offset_ns = offset_ns

    def report(self, now_ns: int, wall_ns: int, problem: str | None, more: tuple[Health, ...] = ()) -> Figures:
        """Publish `link` and `/diagnostics`; `problem`: what is wrong with the port, `more`: entries of the caller."""
        with self._lock:
            if self._log is not None:
                self._log.put(Kind.REPORT, now_ns, encode_report(wall_ns, problem))
            figures = self._reporter.figures(self.settings, now_ns, problem)
            health = [*self._reporter.health(figures), *more]
            unit_id = self.settings.unit_id
        self._outlet.publish_link(wall_ns, figures.counts, self._reporter.link_fields(figures), unit_id)
        self._outlet.publish_health(wall_ns, self._prefix, unit_id or "none", health)
        return figures

    def _take_scales(self) -> None:
        self._scales = self.pipeline.sampler.scales
        self._outlet.configure(self.settings, self._scales)
