"""One fault in one run, measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gsense_rig.fault_trials.world import World
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from gsense_rig.fault_trials.cases import Case

INSTANTS = (0.02, 0.27, 0.52, 0.77)  # of the time to the loop's next tick or the guard's next look
PHASES = tuple(0.28 + k * math.pi / 4.0 for k in range(8))  # rad of the cycle; a carriage coasts farthest from 0.28
_MOVING_DUTY = 0.06  # 1.1 V; breaking loose takes 0.6 V
_LONGEST = 2.0  # s until everything must be at rest


@dataclass(frozen=True)
class Outcome:
    """What became of one run."""

    found: float  # s from the onset until the output was safe
    fault: Fault
    distance: float  # m from the onset to rest
    farthest: float  # m from the middle, after the onset
    current: float  # A, largest from the safe output on
    hit_speed: float  # m/s at a buffer; 0: none was met
    stopped: bool


@dataclass(frozen=True)
class Row:
    """One fault's line in the table."""

    case: Case
    centre: Outcome  # the worst of some instants at the centre, full speed
    anywhere: Outcome | None  # the worst of the cycle


def run_trial(case: Case, phase: float = 0.0, instant: float = INSTANTS[0], seed: int = 1) -> Outcome:
    """Drive 0.15 m at 8 rad/s, inject at a phase of it [rad] and an instant of the loop's period, see what happens."""
    world = World(seed, position=0.16)
    if case.at_start:
        world.home()
        case.inject(world)
        world.start_sine()
        while abs(world.rail.output.duty) < _MOVING_DUTY:
            world.step()
    else:
        world.drive(phase)
        world.advance(world.now + instant * (world.next_event - world.now))
    onset, start = world.now, world.rail.plant.position
    world.farthest = world.current = 0.0
    if not case.at_start:
        case.inject(world)
    while not world.safe and world.now - onset < _LONGEST:
        world.step()
        if case.at_start and not world.safe and abs(world.rail.output.duty) < _MOVING_DUTY:
            onset = world.now  # the controller still waits: no duty that should move the carriage
    found, world.current = world.now - onset, 0.0
    while world.now - onset < _LONGEST and not (world.stopped and world.now - onset > found + 0.4):
        world.step()
    distance = abs(world.rail.plant.position - start)
    fault = world.loop.machine.fault
    return Outcome(found, fault, distance, world.farthest, world.current, world.hit_speed, world.stopped)


def worst(outcomes: list[Outcome]) -> Outcome:
    """The largest of each figure."""
    last = max(outcomes, key=lambda o: o.found)
    return Outcome(
        last.found, last.fault, max(o.distance for o in outcomes), max(o.farthest for o in outcomes),
        max(o.current for o in outcomes), max(o.hit_speed for o in outcomes), all(o.stopped for o in outcomes),
    )  # fmt: skip


def try_case(case: Case, anywhere: bool = True, seed: int = 1) -> Row:
    """Inject at the case's phase at several instants, and (where the case allows) in every part of the cycle."""
    centre = worst([run_trial(case, case.phase, instant, seed) for instant in INSTANTS])
    if not (anywhere and case.anywhere):
        return Row(case, centre, None)
    return Row(case, centre, worst([run_trial(case, phase, INSTANTS[0], seed) for phase in PHASES]))
