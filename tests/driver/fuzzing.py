"""What must hold of the frame stream for any bytes; shared by the tests and the long fuzz."""

from functools import lru_cache

from tests.driver import wire

from gsense_driver.frames import Frame
from gsense_driver.stream import FrameStream, Reject


@lru_cache
def real_stream(seconds: float) -> bytes:
    return b"".join(wire.cobs(data) for _, data in wire.Board().frames(seconds))


def decode(packet: bytes) -> bytes | None:
    """COBS by its definition; None where it is not."""
    out, at = b"", 0
    while at < len(packet):
        code = packet[at]
        if code == 0 or at + code > len(packet):
            return None
        out += packet[at + 1 : at + code] + b"\0"
        at += code
    return out[:-1]


@lru_cache(maxsize=4096)
def valid(packet: bytes) -> bool:
    """Whether a packet (without its zero) is a frame of version 1, by an implementation of its own."""
    if len(packet) != 33:
        return False
    data = decode(packet)
    if data is None or len(data) != 32:
        return False
    return wire.crc16(data[:30]) == int.from_bytes(data[30:], "little") and data[0] >> 5 == 1


def encoded(frame: Frame) -> bytes:
    return wire.payload(frame.type, frame.sequence, frame.time_us, frame.body, frame.flags)


def check(data: bytes, size: int) -> int:
    """Feed `data` in chunks of `size`; returns the number of frames."""
    stream = FrameStream()
    items = [item for at in range(0, len(data), size) for item in stream.feed(data[at : at + size])]
    frames = [item for item in items if isinstance(item, Frame)]
    rejected = sum(item.size for item in items if isinstance(item, Reject))
    packets = data.split(b"\0")
    whole = sum(valid(packet) for packet in packets[:-1])
    assert len(frames) >= whole, "no packet with a right CRC is missed"
    if len(frames) > whole:  # the end of a piece without zeros that was given up as too long
        assert all(wire.cobs(encoded(frame)) in data for frame in frames), "no frame that is not in the data"
    zeros = sum(not packet for packet in packets[:-1])
    rest = stream.bytes_in - 34 * len(frames) - rejected - stream.skipped_bytes - zeros
    assert 0 <= rest <= 200, "every byte has one place; the rest is the unfinished packet"
    assert rejected == stream.rejected_bytes
    return len(frames)
