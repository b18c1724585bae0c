"""Bookkeeping of the radio link: sequence unwrapping and the counts of LinkStatus.

Every frame that the board sent ends in exactly one of three counts: `received` (distinct frames), `corrupt` (bytes
came, but no valid frame) or `lost` (nothing came). To keep that so, a gap in the sequence is charged first to the
rejected bytes seen inside it, the rest is lost. Duplicates and late-comers are recognised in a short window of recent
frames.

A restart of the board is recognised by any of: the started flag with a young board time where it does not continue; a
sequence number seen before with another board time; a board time that fell back, or advanced by more than both the
host's elapsed time and the sequence allow (a fall back by over half the 71.6 min range looks like an advance).
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from enum import Enum

from gsense_driver.frames import FLAG_STARTED, Frame
from gsense_driver.stream import WIRE_SIZE

WINDOW = 64  # recent frames in which duplicates and late-comers are recognised
_SEQUENCE_RANGE = 1 << 16
_TIME_RANGE = 1 << 32
_YOUNG_US = 1_500_000
_REORDER_US = 2_000_000
_SLACK_S = 2.0
_PLAIN_US = 1_000_000  # less than any advance that could mean a restart ...
_PLAIN_FRAMES = 30_000  # ... or a whole turn of the sequence
_CROSSING_US = 100_000  # reads that began earlier may be sent later: so far back a board time may go in order


class Verdict(Enum):
    """What a frame is to the link."""

    NEW = "new"
    REORDERED = "reordered"  # new, but older than the newest
    DUPLICATE = "duplicate"
    RESTART = "restart"  # new, and the first after a restart of the board


@dataclass
class LinkCounts:
    """Counts since the node started."""

    received: int = 0
    lost: int = 0
    corrupt: int = 0
    duplicate: int = 0
    reordered: int = 0
    restarts: int = 0


class LinkTracker:
    """Unwraps sequence numbers and keeps `LinkCounts`."""

    def __init__(self) -> None:
        self._done = LinkCounts()
        self._recent: OrderedDict[int, int] = OrderedDict()  # u16 sequence -> u32 board time
        self._newest: Frame | None = None
        self._newest_arrival_s = 0.0
        self._run_bytes = 0  # rejected since the last valid frame
        self._frames_total = 0  # sequence numbers passed since start or restart
        self._time_total_us = 0

    @property
    def counts(self) -> LinkCounts:
        """A copy of the counts, the rejected bytes of an unfinished run included."""
        done = self._done
        return LinkCounts(
            done.received,
            done.lost,
            done.corrupt + self._run_frames(),
            done.duplicate,
            done.reordered,
            done.restarts,
        )

    def rejected(self, size: int) -> None:
        """`size` bytes arrived that are no frame. Pieces of one broken packet count as one frame."""
        self._run_bytes += size

    def restarted(self) -> None:
        """A restart that only the clock could see (the board time fits, but stays late)."""
        self._done.restarts += 1

    def update(self, frame: Frame, arrival_s: float) -> Verdict:
        """Book one valid frame; `arrival_s` is host time in seconds from any origin."""
        newest = self._newest
        if newest is not None and not self._run_bytes and self._is_next(newest, frame):
            self._frames_total += 1
            self._time_total_us += frame.time_us - newest.time_us
            self._accept(frame, arrival_s)
            return Verdict.NEW
        return self._update(newest, frame, arrival_s)

    def _is_next(self, old: Frame, new: Frame) -> bool:
        """Whether a frame is plainly the next one. Only saves time: the long way comes to the same for it."""
        advance_us = new.time_us - old.time_us
        return (
            0 <= advance_us < _PLAIN_US
            and new.sequence == old.sequence + 1
            and new.sequence not in self._recent
            and advance_us * self._frames_total < _PLAIN_FRAMES * self._time_total_us
        )

    def _update(self, newest: Frame | None, frame: Frame, arrival_s: float) -> Verdict:
        corrupt = self._run_frames()
        self._done.corrupt += corrupt
        self._run_bytes = 0
        if newest is None:
            self._accept(frame, arrival_s)
            return Verdict.NEW
        seen = self._recent.get(frame.sequence)
        if seen == frame.time_us:
            self._done.duplicate += 1
            return Verdict.DUPLICATE
        back = (newest.sequence - frame.sequence) % _SEQUENCE_RANGE
        if seen is None and back <= WINDOW and (newest.time_us - frame.time_us) % _TIME_RANGE < _REORDER_US:
            return self._late_comer(frame)
        if seen is not None or back <= WINDOW or self._restart_between(newest, frame, arrival_s):
            self._recent.clear()
            self._frames_total = self._time_total_us = 0
            self._done.restarts += 1
            self._accept(frame, arrival_s)
            return Verdict.RESTART
        advance_us = _advance(newest, frame)
        steps = self._unwrapped_steps((frame.sequence - newest.sequence) % _SEQUENCE_RANGE, advance_us)
        self._done.lost += max(0, steps - 1 - corrupt)
        self._frames_total += steps
        self._time_total_us += advance_us
        self._accept(frame, arrival_s)
        return Verdict.NEW

    def _run_frames(self) -> int:
        return max(1, round(self._run_bytes / WIRE_SIZE)) if self._run_bytes else 0

    def _accept(self, frame: Frame, arrival_s: float) -> None:
        self._done.received += 1
        self._newest = frame
        self._newest_arrival_s = arrival_s
        self._recent[frame.sequence] = frame.time_us
        if len(self._recent) > WINDOW:
            self._recent.popitem(last=False)

    def _late_comer(self, frame: Frame) -> Verdict:
        self._done.received += 1
        self._done.reordered += 1
        self._done.lost = max(0, self._done.lost - 1)  # it was booked as lost when its successor came
        self._recent[frame.sequence] = frame.time_us
        if len(self._recent) > WINDOW:
            self._recent.popitem(last=False)
        return Verdict.REORDERED

    def _frames_in(self, time_us: int) -> float | None:
        """Frames that the board sends in `time_us`, from its history; None while unknown."""
        if self._frames_total < 20 or self._time_total_us <= 0:
            return None
        return time_us * self._frames_total / self._time_total_us

    def _restart_between(self, old: Frame, new: Frame, arrival_s: float) -> bool:
        advance_us = _advance(old, new)
        elapsed_s = arrival_s - self._newest_arrival_s
        if new.flags & FLAG_STARTED and new.time_us < _YOUNG_US and advance_us > _YOUNG_US:
            return True
        if advance_us * 1e-6 <= elapsed_s + _SLACK_S:
            return False
        # The board time ran ahead of the host: data was held up and then caught up (the sequence agrees), or a restart.
        frames = self._frames_in(advance_us)
        steps = (new.sequence - old.sequence) % _SEQUENCE_RANGE
        if frames is None or frames > 0.8 * _SEQUENCE_RANGE:
            return True
        return not 0.5 * frames - 16 <= steps <= 1.5 * frames + 16

    def _unwrapped_steps(self, steps: int, advance_us: int) -> int:
        """Add the whole turns of the 16-bit counter that a long silence hid."""
        frames = self._frames_in(advance_us)
        if frames is None:
            return steps
        return steps + max(0, round((frames - steps) / _SEQUENCE_RANGE)) * _SEQUENCE_RANGE


def _advance(old: Frame, new: Frame) -> int:
    """Board time from frame to frame in us: 0 to the wrap, or slightly negative where two sensors' reads crossed."""
    advance_us = (new.time_us - old.time_us) % _TIME_RANGE
    steps = (new.sequence - old.sequence) % _SEQUENCE_RANGE
    crossed = advance_us > _TIME_RANGE - _CROSSING_US and steps <= WINDOW
    return advance_us - _TIME_RANGE if crossed else advance_us
