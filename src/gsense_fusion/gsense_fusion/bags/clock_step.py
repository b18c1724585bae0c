"""A recording in whose midst the host's clock was set: which part of it is used.

A recorder's times of reception jump with the clock at once, the stamps of driver and rig follow within a second. What
was recorded on one side of the step shares a time axis; the two sides do not, so the longest part stands for the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

_Stamps = NDArray[np.int64]
_Rows = NDArray[np.intp]

_BACK_NS = 200_000_000
"""Recorders write out of order, by less than this."""
_FORWARD_NS = 500_000_000
_SAME_NS = 50_000_000
"""Two clocks that follow the same step jump alike within this."""
_FOLLOWED_NS = 1_500_000_000
"""After so long all stamps have followed."""
_SESSION_NS = 60 * 10**9
_MOST = 3
"""Steps of a run; more are a file in disorder."""


@dataclass(frozen=True)
class Part:
    """The part that is used, told by the topic that was looked at."""

    back: int
    """How often that topic's times of reception run backwards, and ..."""
    number: int
    """... after how many of those the part lies."""
    window_ns: tuple[int, int]
    """Times of reception from the first to the last message of the part."""
    note: str

    def rows(self, received_ns: _Stamps) -> _Rows:
        """Rows of another topic that belong to the part; times of reception in order of the file."""
        low, high = self.window_ns
        inside = (received_ns >= low) & (received_ns <= high)
        edges = _back(received_ns)
        if len(edges) == self.back:  # else too slow a topic to tell: the window must do
            inside &= np.searchsorted(edges, np.arange(len(received_ns)), side="right") == self.number
        return np.flatnonzero(inside)


def longest_part(stamp_ns: _Stamps, received_ns: _Stamps) -> Part | None:
    """The longest stretch without a step of the clock; None where there is no step.

    Args:
        stamp_ns: header stamps of a steady topic in order of the file, zero where there is none, shape (n,).
        received_ns: times of reception, shape (n,).
    """
    if len(received_ns) < 2:
        return None
    stamp = np.where(stamp_ns == 0, received_ns, stamp_ns)
    back = _back(received_ns)
    found = [back, _forward(stamp, received_ns), _endless(stamp), _endless(received_ns)]
    edges = _apart(np.unique(np.concatenate(found)), received_ns)
    if not 0 < len(edges) <= _MOST:
        return None
    bounds = [0, *edges.tolist(), len(stamp)]
    best = int(np.argmax(np.diff(bounds)))
    start, end = bounds[best], bounds[best + 1]
    high = int(received_ns[end - 1]) if end < len(stamp) else np.iinfo(np.int64).max
    low = int(received_ns[start]) + _FOLLOWED_NS if start else np.iinfo(np.int64).min
    steps = ", ".join(f"{_step(stamp, received_ns, edge):+.1f}" for edge in edges.tolist())
    lasted = [(received_ns[b - 1] - received_ns[a]) * 1e-9 for a, b in pairwise(bounds)]
    note = (
        f"the host's clock was set by {steps} s in the midst of the run; used is its longest part, "
        f"{lasted[best]:.1f} of {sum(lasted):.1f} s"
    )
    return Part(len(back), int(np.searchsorted(back, start, side="right")), (low, high), note)


def _back(received_ns: _Stamps) -> _Rows:
    """First rows after the clock was set back; none where the pieces, put in order, are one recording."""
    edges = np.flatnonzero(np.diff(received_ns) < -_BACK_NS) + 1
    if not 0 < len(edges) <= _MOST:
        return edges[:0]
    pieces = sorted((int(piece.min()), int(piece.max())) for piece in np.split(received_ns, edges))
    gaps = np.array([after[0] - before[1] for before, after in pairwise(pieces)])
    in_disorder = bool(np.all((gaps > -_BACK_NS) & (gaps < _FORWARD_NS)))
    return edges[:0] if in_disorder else edges


def _forward(stamp_ns: _Stamps, received_ns: _Stamps) -> _Rows:
    """First rows after a jump of reception that the stamps follow later: in a silence both jump at the same row."""
    waited, passed = np.diff(received_ns), np.diff(stamp_ns)
    edges = []
    for late in np.flatnonzero((passed > _FORWARD_NS) & (waited < passed // 2)).tolist():
        near = np.flatnonzero(np.abs(waited[:late] - passed[late]) < _SAME_NS)
        edges += [i + 1 for i in near.tolist() if received_ns[late] - received_ns[i + 1] < _FOLLOWED_NS]
    return np.array(edges, dtype=np.intp)


def _endless(stamp_ns: _Stamps) -> _Rows:
    """First row after a gap that is longer than all that was recorded: no silence of one run."""
    gaps = np.diff(stamp_ns)
    widest = int(np.argmax(gaps))
    others = int(np.clip(np.delete(gaps, widest), 0, None).sum())
    return np.array([widest + 1] if gaps[widest] > max(_SESSION_NS, others) else [], dtype=np.intp)


def _apart(edges: _Rows, received_ns: _Stamps) -> _Rows:
    """Without those that are the stamps following the one before."""
    follows = [0 <= received_ns[b] - received_ns[a] < _FOLLOWED_NS for a, b in pairwise(edges)]
    return edges[~np.array([False, *follows][: len(edges)], dtype=bool)]


def _step(stamp_ns: _Stamps, received_ns: _Stamps, edge: int) -> float:
    by = received_ns[edge] - received_ns[edge - 1]
    return float(by if abs(by) > _BACK_NS else stamp_ns[edge] - stamp_ns[edge - 1]) * 1e-9
