"""From serial bytes and their arrival times to stamped readings: stream, link, clock and samples wired together.

Pure: the same bytes with the same arrival times give the same readings. Until the clock has a fix (a third of a
second), frames are held and then released with right stamps, in order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from gsense_driver.clock import BoardClock, ClockSettings
from gsense_driver.frames import TYPE_STATUS, Frame
from gsense_driver.link import LinkTracker, Verdict
from gsense_driver.mounting import Mounting
from gsense_driver.samples import Reading, Sampler
from gsense_driver.scaling import ScaleSettings
from gsense_driver.stream import FrameStream, Reject
from gsense_driver.text import DEFAULT_COLUMNS, Row, TextSampler, TextStream
from gsense_driver.transport import delays_by_type

_HELD_LIMIT = 4096
# The period of a text line is known to some percent only.
_TEXT_CLOCK = ClockSettings(skew_sigma=0.05, noise_s=1e-3, late_step_s=0.5)


@dataclass(frozen=True)
class PipelineSettings:
    """What the pipeline needs of the node's parameters."""

    protocol: str = "binary"  # or "text"
    transport_delay: float = 0.0  # s, of an MPU frame
    scales: ScaleSettings = field(default_factory=ScaleSettings)
    mountings: Mapping[str, Mounting] = field(default_factory=dict)
    text_columns: tuple[str, ...] = DEFAULT_COLUMNS
    text_period: float = 0.04  # s
    text_counter_bits: int = 16


class _Source(Protocol):
    """One protocol: how bytes become frames, and frames readings."""

    @property
    def stream(self) -> FrameStream | TextStream: ...

    def feed(self, data: bytes) -> Sequence[Frame | tuple[Frame, Row] | Reject]: ...

    def readings(self, frame: Frame, row: Row | None, stamp_ns: int) -> list[Reading]: ...


class _Binary:
    def __init__(self, sampler: Sampler) -> None:
        self.stream = FrameStream()
        self._sampler = sampler

    def feed(self, data: bytes) -> list[Frame | Reject]:
        return self.stream.feed(data)

    def readings(self, frame: Frame, row: Row | None, stamp_ns: int) -> list[Reading]:  # noqa: ARG002
        return self._sampler.readings(frame, stamp_ns)


class _Text:
    def __init__(self, sampler: Sampler, settings: PipelineSettings) -> None:
        self.stream = TextStream(settings.text_columns, settings.text_counter_bits)
        self._sampler = TextSampler(sampler, settings.text_columns, settings.text_period, settings.text_counter_bits)

    def feed(self, data: bytes) -> list[tuple[Frame, Row] | Reject]:
        items = self.stream.feed(data)
        return [item if isinstance(item, Reject) else (self._sampler.frame_of(item), item) for item in items]

    def readings(self, frame: Frame, row: Row | None, stamp_ns: int) -> list[Reading]:  # noqa: ARG002
        return [] if row is None else self._sampler.readings(row, stamp_ns)


class Pipeline:
    """Feed bytes, get readings. Stamps are wall-clock ns: the steady clock of the arrivals plus `wall_offset_ns`."""

    def __init__(self, settings: PipelineSettings, wall_offset_ns: int = 0) -> None:
        text = settings.protocol == "text"
        self.link = LinkTracker()
        self.clock = BoardClock(_TEXT_CLOCK if text else None)
        self.sampler = Sampler(settings.scales, settings.mountings)
        self.wall_offset_ns = wall_offset_ns
        self.held = 0  # frames that waited for a fix of the clock
        self.rejects: dict[str, int] = {}
        self.last_frame_ns: int | None = None  # arrival of the last valid frame
        self._source: _Source = _Text(self.sampler, settings) if text else _Binary(self.sampler)
        self._waiting: list[tuple[Frame, Row | None, int]] = []
        self._newest_us = 0
        self._status_us = 0
        self.configure(settings)

    def configure(self, settings: PipelineSettings) -> None:
        """Take what may change while running: delay, scales, mountings."""
        self._delay_ns = {kind: round(s * 1e9) for kind, s in delays_by_type(settings.transport_delay).items()}
        self._default_delay_ns = round(settings.transport_delay * 1e9)
        self.sampler.configure(settings.scales, settings.mountings)

    @property
    def stream(self) -> FrameStream | TextStream:
        """The splitter in use, for its counts."""
        return self._source.stream

    def reopened(self) -> None:
        """The port was opened anew: what was left of a packet is void."""
        self._source.stream.reset()

    def feed(self, data: bytes, arrival_ns: int) -> list[Reading]:
        """Take bytes that had arrived at `arrival_ns` (steady clock); returns the readings that can be stamped now."""
        out: list[Reading] = []
        for item in self._source.feed(data):
            if isinstance(item, Frame):
                self._take(item, None, arrival_ns, out)
            elif isinstance(item, Reject):
                self.link.rejected(item.size)
                self.rejects[item.reason] = self.rejects.get(item.reason, 0) + 1
            else:
                self._take(item[0], item[1], arrival_ns, out)
        return out

    def host_offset_s(self) -> float:
        """Wall clock minus board time now, in seconds; NaN before the first fix."""
        if not self.clock.fixed:
            return float("nan")
        return (self.clock.host_ns(self._newest_us) + self.wall_offset_ns - self._newest_us * 1000) * 1e-9

    def uptime_s(self) -> float:
        """The board's own uptime: the last STATUS and the board time since, or the board time alone before it."""
        status = self.sampler.board.status
        if status is None:
            return self._newest_us * 1e-6
        return status.uptime_s + max(0, self._newest_us - self._status_us) * 1e-6

    def _take(self, frame: Frame, row: Row | None, arrival_ns: int, out: list[Reading]) -> None:
        self.last_frame_ns = arrival_ns
        verdict = self.link.update(frame, arrival_ns * 1e-9)
        if verdict is Verdict.DUPLICATE:
            return
        clock = self.clock
        if verdict is Verdict.RESTART:
            self._restarted()
            clock.restart()
        arrival_ns -= self._delay_ns.get(frame.type, self._default_delay_ns)
        board_us = clock.unwrap(frame.time_us, arrival_ns)
        # A STATUS frame reads no sensor, so its way is of another length: it gets a time, but gives none.
        if frame.type != TYPE_STATUS and clock.observe(board_us, arrival_ns):
            self.link.restarted()
            self._restarted()
            board_us = clock.unwrap(frame.time_us, arrival_ns)
        self._newest_us = board_us
        if frame.type == TYPE_STATUS:
            self.sampler.take_status(frame)
            self._status_us = board_us
        if not clock.fixed:
            self._hold(frame, row, board_us)
            return
        offset = self.wall_offset_ns
        if self._waiting:
            for old, old_row, old_us in self._waiting:
                out += self._source.readings(old, old_row, clock.host_ns(old_us) + offset)
            self._waiting.clear()
        out += self._source.readings(frame, row, clock.host_ns(board_us) + offset)

    def _restarted(self) -> None:
        self._waiting.clear()  # of a board that ran too short for a fix: nothing is known of their time
        self.sampler.restart()
        self._status_us = 0

    def _hold(self, frame: Frame, row: Row | None, board_us: int) -> None:
        self.held += 1
        if len(self._waiting) < _HELD_LIMIT:
            self._waiting.append((frame, row, board_us))
