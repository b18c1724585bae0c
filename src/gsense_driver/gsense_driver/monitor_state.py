"""What the monitor knows: rates and last values by topic, link, battery and the diagnostics' words. Pure."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

_WINDOW_S = 2.0  # over which a rate is taken
_STALE_S = 3.0  # without a report the driver counts as gone


class Rate:
    """Messages per second over the last two seconds."""

    def __init__(self) -> None:
        self._times: deque[float] = deque()

    def count(self, now_s: float) -> None:
        """Note one message."""
        self._times.append(now_s)
        self._forget(now_s)

    def value(self, now_s: float) -> float:
        """Rate in Hz."""
        self._forget(now_s)
        if len(self._times) < 2:
            return 0.0
        return (len(self._times) - 1) / max(1e-9, self._times[-1] - self._times[0])

    def _forget(self, now_s: float) -> None:
        while self._times and self._times[0] < now_s - _WINDOW_S:
            self._times.popleft()


@dataclass
class Topic:
    """One topic of a sensor: its rate and last value in words."""

    rate: Rate = field(default_factory=Rate)
    value: str = ""


@dataclass(frozen=True)
class Link:
    """The last LinkStatus; `lost_since`, `corrupt_since`: against the one before."""

    unit_id: str
    received: int
    lost: int
    corrupt: int
    duplicate: int
    reordered: int
    restarts: int
    rate_hz: float
    clock_offset_s: float
    clock_skew_ppm: float
    uptime_s: float
    lost_since: int = 0
    corrupt_since: int = 0

    @property
    def loss(self) -> float:
        """Share of the board's frames that did not arrive, 0 to 1."""
        total = self.received + self.lost + self.corrupt
        return (self.lost + self.corrupt) / total if total else 0.0


@dataclass(frozen=True)
class Verdict:
    """One entry of `/diagnostics`; level OK 0, WARN 1, ERROR 2, STALE 3."""

    level: int
    reason: str


class MonitorState:
    """Takes messages' contents, gives what is shown. Times are of any steady clock, s."""

    def __init__(self, topics: tuple[str, ...]) -> None:
        self.topics: Mapping[str, Topic] = {name: Topic() for name in topics}
        self.temperatures: dict[str, float] = {}
        self.battery_v: float | None = None
        self.link: Link | None = None
        self.link_time_s = 0.0
        self.verdicts: dict[str, Verdict] = {}

    def take_sample(self, topic: str, value: str, now_s: float) -> None:
        """A message of a sensor."""
        entry = self.topics[topic]
        entry.rate.count(now_s)
        entry.value = value

    def take_link(self, link: Link, now_s: float) -> None:
        """A LinkStatus."""
        self.link = link
        self.link_time_s = now_s

    def silent(self, now_s: float) -> bool:
        """Whether no driver reports."""
        return self.link is None or now_s - self.link_time_s > _STALE_S

    def worst(self) -> Verdict:
        """The first of the worst entries."""
        return max(self.verdicts.values(), key=lambda verdict: verdict.level, default=Verdict(3, "no diagnostics yet"))


def since(new: Mapping[str, int], old: Link | None) -> tuple[int, int]:
    """Frames lost and corrupt since the report before; a driver that started anew counts from zero."""
    if old is None or new["received"] < old.received:
        return 0, 0
    return max(0, new["lost"] - old.lost), max(0, new["corrupt"] - old.corrupt)


def own_task(status_name: str, namespace: str, tasks: frozenset[str]) -> str | None:
    """Task of a diagnostics entry ("rig1/bridge: link") where it is a driver's in `namespace` ("/rig1"), else None."""
    node, _, task = status_name.rpartition(": ")
    parent = "/" + node.strip("/").rpartition("/")[0]
    return task if task in tasks and parent == "/" + namespace.strip("/") else None
