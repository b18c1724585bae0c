"""Homing: fast to the right switch, retract, slowly back to its edge; across to the left one; the zero is midway.

It begins on the right, where the optical switch announces the end: a right switch that does not answer is found out
before the carriage reaches the buffer, and the left one is met slowly where the right one says that it must be. So no
single broken switch lets the carriage run into an end.

The sequence knows positions on the encoder's arbitrary zero. It is told position and switches once a period and says
what to do: follow a reference, or brake. An edge is always met slowly and from the same side of its switch, so that
hysteresis and delay cancel in the middle of the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

from gsense_rig.control.references import Creep, MoveTo
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from collections.abc import Callable

    from gsense_rig.control.references import Reference

Switches = tuple[bool, bool, bool, bool]  # left, centre, right, optical


@dataclass(frozen=True)
class HomingParameters:
    """Speeds and distances of homing."""

    fast: float = 0.25  # m/s towards the right switch
    retract: float = 0.06  # m/s off the switch
    slow: float = 0.02  # m/s over the edge; the switch's delay of 1.5 ms is then 30 um
    traverse: float = 0.5  # m/s between the switches
    span: float = 0.48  # m between the two edges
    span_tolerance: float = 0.01  # m
    clearance: float = 0.008  # m beyond the release, before the slow approach
    margin: float = 0.012  # m ahead of the left edge where the slow approach begins
    longest_search: float = 0.62  # m: more than the rail is long
    longest_optical: float = 0.082  # m from the optical switch's edge, in which the right one must answer; 62 mm lie
    # between them
    longest_clear: float = 0.16  # m: the optical switch is off after 0.13 m at most
    longest_press: float = 0.075  # m: a switch that is still on after this is stuck
    longest_slow: float = 0.035  # m
    settle: float = 0.06  # s of braking between two moves


class Phase(Enum):
    """What homing is doing."""

    CLEAR = auto()
    SEARCH = auto()
    RETRACT = auto()
    RIGHT_EDGE = auto()
    TRAVERSE = auto()
    LEFT_EDGE = auto()
    RETURN = auto()
    DONE = auto()
    FAILED = auto()


@dataclass(frozen=True)
class HomingFailure:
    """Why homing ended."""

    fault: Fault
    text: str


class Homing:
    """One homing run.

    Attributes:
        reference: motion to follow (positions on the encoder's arbitrary zero), None: brake.
        started: time at which the reference began [s].
        zero: position of the middle on the encoder's arbitrary zero [m]; valid from RETURN on.
        failure: set in FAILED.
    """

    def __init__(self, parameters: HomingParameters) -> None:
        self.parameters = parameters
        self.phase = Phase.CLEAR
        self.reference: Reference | None = None
        self.started = 0.0
        self.zero = 0.0
        self.failure: HomingFailure | None = None
        self._next: Phase | None = None
        self._settled_at = 0.0
        self._origin = 0.0
        self._right = 0.0
        self._mark: float | None = None
        self._steps: dict[Phase, Callable[[float, float, Switches], None]] = {
            Phase.CLEAR: self._clear,
            Phase.SEARCH: self._search,
            Phase.RETRACT: self._retract,
            Phase.RIGHT_EDGE: self._right_edge,
            Phase.TRAVERSE: self._traverse,
            Phase.LEFT_EDGE: self._left_edge,
            Phase.RETURN: self._return,
        }

    def begin(self, now: float, position: float, switches: Switches) -> None:
        """Start from wherever the carriage is."""
        _, _, right, optical = switches
        self._enter(Phase.CLEAR if right or optical else Phase.SEARCH, now, position)

    def update(self, now: float, position: float, switches: Switches) -> None:
        """Take one period's position [m] and switches."""
        if switches[0] and switches[2]:
            self._fail("both end switches are pressed", Fault.SWITCH_STUCK)
            return
        if self._next is not None:
            if now >= self._settled_at:
                self._enter(self._next, now, position)
            return
        step = self._steps.get(self.phase)
        if step is not None:
            step(now, position, switches)

    def _clear(self, now: float, position: float, switches: Switches) -> None:
        """Leave the right end, so that both switches there are seen to answer."""
        left, _, right, optical = switches
        travelled = self._travelled(position)
        if left:
            self._fail("the left switch answered while the right end was to be left: a switch on the right is stuck")
        elif right and travelled > self.parameters.longest_press:
            self._stuck("right", position)
        elif optical and travelled > self.parameters.longest_clear:
            self._stuck("optical", position)
        elif right or optical:
            self._mark = None
        elif self._mark is None:
            self._mark = position
        elif self._mark - position >= self.parameters.clearance:
            self._brake_then(Phase.SEARCH, now)

    def _search(self, now: float, position: float, switches: Switches) -> None:
        p = self.parameters
        left, _, right, optical = switches
        if optical and self._mark is None:
            self._mark = position
        if right:
            self._brake_then(Phase.RETRACT, now)
        elif left and self._travelled(position) > p.longest_press:
            self._stuck("left", position)
        elif self._mark is not None and position - self._mark > p.longest_optical:
            self._fail(f"no right switch within {p.longest_optical * 1e3:.0f} mm of the optical one")
        elif self._travelled(position) > p.longest_search:
            self._fail(f"no right switch within {p.longest_search:g} m")

    def _retract(self, now: float, position: float, switches: Switches) -> None:
        left, _, right, _ = switches
        if left:
            self._fail("the left switch answered while the right one was to be left: check motor and switch wiring")
        elif right:
            self._mark = None
            if self._travelled(position) > self.parameters.longest_press:
                self._stuck("right", position)
        elif self._mark is None:
            self._mark = position
        elif self._mark - position >= self.parameters.clearance:
            self._brake_then(Phase.RIGHT_EDGE, now)

    def _right_edge(self, now: float, position: float, switches: Switches) -> None:
        if switches[2]:
            self._right = position
            self._brake_then(Phase.TRAVERSE, now)
        elif self._travelled(position) > self.parameters.longest_slow:
            self._fail("the right switch did not answer again on the slow approach")

    def _traverse(self, now: float, position: float, switches: Switches) -> None:
        left, _, right, _ = switches
        if left:
            self._fail(f"left switch {self._right - position:.3f} m from the right one, not {self.parameters.span:g} m")
        elif right and self._travelled(position) > self.parameters.longest_press:
            self._stuck("right", position)
        elif now - self.started >= self._duration():
            self._brake_then(Phase.LEFT_EDGE, now)

    def _left_edge(self, now: float, position: float, switches: Switches) -> None:
        span = self._right - position
        if not switches[0]:
            if self._travelled(position) > self.parameters.longest_slow:
                self._fail(f"no left switch within {span:.3f} m of the right one")
            return
        if abs(span - self.parameters.span) > self.parameters.span_tolerance:
            self._fail(f"the switches are {span:.4f} m apart, not {self.parameters.span:g} m")
            return
        self.zero = 0.5 * (self._right + position)
        self._brake_then(Phase.RETURN, now)

    def _return(self, now: float, _position: float, _switches: Switches) -> None:
        if now - self.started >= self._duration() + self.parameters.settle:
            self.phase, self.reference = Phase.DONE, None

    def _enter(self, phase: Phase, now: float, position: float) -> None:
        p = self.parameters
        self.phase, self._next = phase, None
        self.started, self._origin, self._mark = now, position, None
        references: dict[Phase, Reference] = {
            Phase.CLEAR: Creep(position, -p.fast),
            Phase.SEARCH: Creep(position, p.fast),
            Phase.RETRACT: Creep(position, -p.retract),
            Phase.RIGHT_EDGE: Creep(position, p.slow),
            Phase.TRAVERSE: MoveTo(position, self._right - p.span + p.margin, p.traverse),
            Phase.LEFT_EDGE: Creep(position, -p.slow),
            Phase.RETURN: MoveTo(position, self.zero, p.traverse),
        }
        self.reference = references[phase]

    def _duration(self) -> float:
        return self.reference.duration if self.reference is not None else 0.0

    def _travelled(self, position: float) -> float:
        return abs(position - self._origin)

    def _brake_then(self, phase: Phase, now: float) -> None:
        self.reference = None
        self._next, self._settled_at = phase, now + self.parameters.settle

    def _fail(self, text: str, fault: Fault = Fault.HOMING_FAILED) -> None:
        self.phase, self.reference = Phase.FAILED, None
        self.failure = HomingFailure(fault, f"homing: {text}")

    def _stuck(self, side: str, position: float) -> None:
        text = f"the {side} switch stays pressed after {self._travelled(position) * 1e3:.0f} mm"
        self._fail(text, Fault.SWITCH_STUCK)
