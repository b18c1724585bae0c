"""From serial bytes to frames: a COBS packet splitter.

Each 32-byte payload travels as 33 COBS bytes closed by a 0x00, so any 0x00 re-synchronises. The splitter holds at
most one unfinished packet of bounded length, never raises on data, and reports what it rejects in its place in the
stream. The first piece after an opening may be the tail of a packet that began before: it is skipped, not counted as
corrupt.
"""

from __future__ import annotations

from typing import NamedTuple

from cobs import cobs

from gsense_driver.frames import PAYLOAD_SIZE, Frame, parse_payload

PACKET_SIZE = PAYLOAD_SIZE + 1  # COBS adds one byte to any payload shorter than 254
WIRE_SIZE = PACKET_SIZE + 1  # with the closing 0x00
_MAX_PENDING = 4 * PACKET_SIZE


class Reject(NamedTuple):
    """A piece of the stream that is no frame."""

    reason: str  # "length", "cobs", "crc" or "version"
    size: int  # bytes on the wire, closing zero included


class Splitter:
    """Cuts a byte stream at an ending byte; counts what it saw, what it rejected and what it skipped."""

    def __init__(self, end: bytes) -> None:
        self.bytes_in = 0
        self.rejected_bytes = 0
        self.skipped_bytes = 0
        self._end = end
        self._pending = b""
        self._synchronised = False

    def reset(self) -> None:
        """Forget the unfinished piece (the port was opened anew); the counts stay."""
        self.skipped_bytes += len(self._pending)
        self._pending = b""
        self._synchronised = False

    def _pieces(self, data: bytes) -> list[bytes]:
        self.bytes_in += len(data)
        pieces = (self._pending + data).split(self._end)
        self._pending = pieces.pop()
        return pieces

    def _reject(self, reason: str, size: int) -> Reject:
        self.rejected_bytes += size
        return Reject(reason, size)


class FrameStream(Splitter):
    """Splits a byte stream into frames and rejects, in order of their arrival."""

    def __init__(self) -> None:
        super().__init__(b"\0")

    def feed(self, data: bytes) -> list[Frame | Reject]:
        """Take bytes as they arrived; returns every frame and reject that they complete."""
        items: list[Frame | Reject] = []
        for packet in self._pieces(data):
            if len(packet) == PACKET_SIZE:
                try:
                    item = parse_payload(cobs.decode(packet))
                except cobs.DecodeError:
                    item = "cobs"
                items.append(self._reject(item, WIRE_SIZE) if isinstance(item, str) else item)
            elif packet:
                if self._synchronised or len(packet) > PACKET_SIZE:
                    items.append(self._reject("length", len(packet) + 1))
                else:
                    self.skipped_bytes += len(packet) + 1
            self._synchronised = True
        if len(self._pending) > _MAX_PENDING:
            items.append(self._reject("length", len(self._pending)))
            self._pending = b""
            self._synchronised = True
        return items
