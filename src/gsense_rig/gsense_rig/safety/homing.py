"""Homing: fast to the left switch, retract, slowly back to its edge; across to the right one; the zero is midway.

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
    from gsense_rig.control.references import Reference


@dataclass(frozen=True)
class HomingParameters:
    """Speeds and distances of homing."""

    fast: float = 0.25  # m/s towards the left switch
    retract: float = 0.06  # m/s off the switch
    slow: float = 0.02  # m/s over the edge; the switch's delay of 1.5 ms is then 30 um
    traverse: float = 0.5  # m/s between the switches
    span: float = 0.48  # m between the two edges
    span_tolerance: float = 0.01  # m
    clearance: float = 0.008  # m beyond the release, before the slow approach
    margin: float = 0.012  # m ahead of the right edge where the slow approach begins
    longest_search: float = 0.62  # m: more than the rail is long
    longest_press: float = 0.075  # m: a switch that is still on after this is stuck
    longest_slow: float = 0.035  # m
    settle: float = 0.06  # s of braking between two moves


class Phase(Enum):
    """What homing is doing."""

    SEARCH = auto()
    RETRACT = auto()
    LEFT_EDGE = auto()
    TRAVERSE = auto()
    RIGHT_EDGE = auto()
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
        self.phase = Phase.SEARCH
        self.reference: Reference | None = None
        self.started = 0.0
        self.zero = 0.0
        self.failure: HomingFailure | None = None
        self._next: Phase | None = None
        self._settled_at = 0.0
        self._origin = 0.0
        self._left = 0.0
        self._released: float | None = None
        self._ignore_right = False

    def begin(self, now: float, position: float, left: bool, right: bool) -> None:
        """Start from wherever the carriage is."""
        self._ignore_right = right
        self._enter(Phase.RETRACT if left else Phase.SEARCH, now, position)

    def update(self, now: float, position: float, left: bool, right: bool) -> None:
        """Take one period's position [m] and switches."""
        if self._next is not None:
            if now >= self._settled_at:
                self._enter(self._next, now, position)
            return
        self._ignore_right = self._ignore_right and right
        if self.phase is Phase.SEARCH:
            self._search(now, position, left, right)
        elif self.phase is Phase.RETRACT:
            self._retract(now, position, left)
        elif self.phase is Phase.LEFT_EDGE:
            self._left_edge(now, position, left)
        elif self.phase is Phase.TRAVERSE:
            self._traverse(now, position, left, right)
        elif self.phase is Phase.RIGHT_EDGE:
            self._right_edge(now, position, right)
        elif self.phase is Phase.RETURN and now - self.started >= self._duration() + self.parameters.settle:
            self.phase, self.reference = Phase.DONE, None

    def _search(self, now: float, position: float, left: bool, right: bool) -> None:
        if left:
            self._brake_then(Phase.RETRACT, now)
        elif right and not self._ignore_right:
            self._fail("the right switch answered while the carriage went left: check motor and switch wiring")
        elif self._travelled(position) > self.parameters.longest_search:
            self._fail(f"no left switch within {self.parameters.longest_search:g} m")
        elif self._ignore_right and self._travelled(position) > self.parameters.longest_press:
            self._stuck("right", position)

    def _retract(self, now: float, position: float, left: bool) -> None:
        if left:
            self._released = None
            if self._travelled(position) > self.parameters.longest_press:
                self._stuck("left", position)
        elif self._released is None:
            self._released = position
        elif position - self._released >= self.parameters.clearance:
            self._brake_then(Phase.LEFT_EDGE, now)

    def _left_edge(self, now: float, position: float, left: bool) -> None:
        if left:
            self._left = position
            self._brake_then(Phase.TRAVERSE, now)
        elif self._travelled(position) > self.parameters.longest_slow:
            self._fail("the left switch did not answer again on the slow approach")

    def _traverse(self, now: float, position: float, left: bool, right: bool) -> None:
        if right:
            self._fail(f"right switch {position - self._left:.3f} m from the left one, not {self.parameters.span:g} m")
        elif left and self._travelled(position) > self.parameters.longest_press:
            self._stuck("left", position)
        elif now - self.started >= self._duration():
            self._brake_then(Phase.RIGHT_EDGE, now)

    def _right_edge(self, now: float, position: float, right: bool) -> None:
        span = position - self._left
        if not right:
            if self._travelled(position) > self.parameters.longest_slow:
                self._fail(f"no right switch within {span:.3f} m of the left one")
            return
        if abs(span - self.parameters.span) > self.parameters.span_tolerance:
            self._fail(f"the switches are {span:.4f} m apart, not {self.parameters.span:g} m")
            return
        self.zero = 0.5 * (self._left + position)
        self._brake_then(Phase.RETURN, now)

    def _enter(self, phase: Phase, now: float, position: float) -> None:
        p = self.parameters
        self.phase, self._next = phase, None
        self.started, self._origin, self._released = now, position, None
        references: dict[Phase, Reference] = {
            Phase.SEARCH: Creep(position, -p.fast),
            Phase.RETRACT: Creep(position, p.retract),
            Phase.LEFT_EDGE: Creep(position, -p.slow),
            Phase.TRAVERSE: MoveTo(position, self._left + p.span - p.margin, p.traverse),
            Phase.RIGHT_EDGE: Creep(position, p.slow),
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

    def _fail(self, text: str) -> None:
        self.phase, self.reference = Phase.FAILED, None
        self.failure = HomingFailure(Fault.HOMING_FAILED, f"homing: {text}")

    def _stuck(self, side: str, position: float) -> None:
        self.phase, self.reference = Phase.FAILED, None
        text = f"homing: the {side} switch stays pressed after {self._travelled(position) * 1e3:.0f} mm"
        self.failure = HomingFailure(Fault.SWITCH_STUCK, text)
