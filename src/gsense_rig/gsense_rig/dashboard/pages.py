"""The open pages: what each may do, whether it still answers, what it has been sent. Pure."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from itertools import count

from gsense_rig.dashboard.snapshot import Viewing

MAX_PAGES = 16
MAX_AHEAD = 40  # state messages that may be on their way to a page: 2 s
LONGEST_TICK = 0.25  # s that a page is held to have been silent for one tick, however late we are ourselves

_numbers = count(1)


@dataclass
class Page:
    """One open page."""

    number: int = field(default_factory=lambda: next(_numbers))
    may_command: bool = False
    viewing: Viewing = field(default_factory=Viewing)
    sent: int = 0
    """Number of the last state message."""
    drawn: int = 0
    """Number of the last one that the page has drawn."""
    silence: float = 0.0
    """s since it last said so, of our own unhindered time."""

    def next_state(self) -> int | None:
        """Number of the state message to be sent now; None to a page that does not keep up."""
        if self.sent - self.drawn >= MAX_AHEAD:
            return None
        self.sent += 1
        return self.sent

    def has_drawn(self, number: int) -> None:
        """The page is alive; a number that was never sent counts for nothing."""
        if self.drawn < number <= self.sent:
            self.drawn = number
            self.silence = 0.0


class Pages:
    """All of them.

    Args:
        patience: s without a sign of life after which a page counts as lost.
    """

    def __init__(self, patience: float) -> None:
        self._patience = patience
        self.open: dict[int, Page] = {}
        self.malformed = 0
        self.complaints: deque[str] = deque(maxlen=5)

    def add(self) -> Page | None:
        """One more; None where there are too many."""
        if len(self.open) >= MAX_PAGES:
            return None
        page = Page()
        self.open[page.number] = page
        return page

    def remove(self, page: Page) -> None:
        """Closed, or its connection is lost."""
        self.open.pop(page.number, None)

    def note_malformed(self, complaint: str) -> None:
        """A message that could not be used."""
        self.malformed += 1
        self.complaints.append(complaint)

    def tick(self, elapsed: float) -> list[Page]:
        """Time goes by; gives the pages that have just become silent.

        Args:
            elapsed: s since the last call. Of a long one only a little counts: then it was us who were held up.
        """
        lost = []
        for page in self.open.values():
            before = page.silence
            page.silence += min(elapsed, LONGEST_TICK)
            if before <= self._patience < page.silence:
                lost.append(page)
        return lost
