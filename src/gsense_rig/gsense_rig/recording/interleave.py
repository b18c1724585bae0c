"""Streams of equally long messages put into one sequence by their times, as blocks of an MCAP file."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.recording.mcap_file import CHUNK, MESSAGE, Block, Times

_HEAD = np.dtype({"names": ["op", "length", "channel", "sequence", "log", "publish"],
                  "formats": ["u1", "<u8", "<u2", "<u4", "<u8", "<u8"], "offsets": [0, 1, 9, 11, 15, 23],
                  "itemsize": MESSAGE.size})  # fmt: skip
_OPCODE = 0x05
_BEFORE_LENGTH = 9
"""Bytes of a record that its length does not count."""


@dataclass(frozen=True)
class Stream:
    """The messages of one connection."""

    channel: int
    log_ns: Times
    """(n,), they do not fall."""
    rows: npt.NDArray[np.uint8]
    """(n, size) serialised messages."""

    @property
    def record_size(self) -> int:
        """Bytes of one message's record."""
        return MESSAGE.size + int(self.rows.shape[1])

    def records(self, first: int, last: int) -> npt.NDArray[np.uint8]:
        """Records of messages first to last, shape (last - first, record_size)."""
        count = last - first
        head = np.zeros(count, dtype=_HEAD)
        head["op"], head["channel"] = _OPCODE, self.channel
        head["length"] = self.record_size - _BEFORE_LENGTH
        head["log"] = head["publish"] = self.log_ns[first:last]
        return np.concatenate([head.view(np.uint8).reshape(count, MESSAGE.size), self.rows[first:last]], axis=1)


def interleave(streams: Sequence[Stream], limit: int = CHUNK) -> Iterator[Block]:
    """All messages in order of their times (equal ones in order of the streams), in blocks of about `limit` bytes."""
    times = np.concatenate([stream.log_ns for stream in streams])
    owner = np.repeat(np.arange(len(streams)), [stream.log_ns.shape[0] for stream in streams])
    order = np.argsort(times, kind="stable")
    times, owner = times[order], owner[order]
    ends = np.cumsum(np.array([stream.record_size for stream in streams])[owner])
    taken = [0] * len(streams)
    first = 0
    while first < times.shape[0]:
        base = int(ends[first - 1]) if first else 0
        last = max(first + 1, int(np.searchsorted(ends, base + limit, side="right")))
        offsets = np.concatenate([[0], ends[first : last - 1] - base])
        buffer = np.empty(int(ends[last - 1]) - base, dtype=np.uint8)
        for number, stream in enumerate(streams):
            mine = offsets[owner[first:last] == number]
            following = taken[number] + mine.shape[0]
            place = mine[:, None] + np.arange(stream.record_size)
            buffer[place] = stream.records(taken[number], following)
            taken[number] = following
        channels = np.array([stream.channel for stream in streams])[owner[first:last]]
        yield Block(buffer.tobytes(), channels, times[first:last], offsets)
        first = last
