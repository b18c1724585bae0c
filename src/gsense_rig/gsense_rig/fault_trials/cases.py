"""The faults that are put into a run, and how soon the output must be safe."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gsense_rig.control.references import Creep
from gsense_rig.loop.motion import Motion
from gsense_rig.safety.modes import Fault

if TYPE_CHECKING:
    from collections.abc import Callable

    from gsense_rig.control.controllers import Measured
    from gsense_rig.control.references import Setpoint
    from gsense_rig.fault_trials.world import World


@dataclass(frozen=True)
class Case:
    """One fault."""

    name: str
    inject: Callable[[World], None]
    faults: tuple[Fault, ...]  # what it may be called; empty: the loop cannot say, the guard acts
    bound: float | None  # s from the onset until the output is safe; None: none is demanded
    coasts: bool = False  # no bridge left to brake with
    anywhere: bool = True  # whether it is also tried in every part of the cycle
    at_start: bool = False  # injected before the motion; the onset is then the first duty that should move the carriage
    phase: float = 0.0  # rad of the cycle; 0: the centre, at full speed


class Runaway:
    """A controller gone wrong: pushes in the sense of the motion with all that the supply or a current limit gives.

    Args:
        current: limit [A]; None: the supply alone.
        resistance: of the winding [ohm].
        constant: back EMF per speed [V·s/m].
    """

    def __init__(self, current: float | None, resistance: float, constant: float) -> None:
        self._room = None if current is None else resistance * current
        self._constant = constant

    def reset(self) -> None:
        """Nothing to forget."""

    def voltage(self, setpoint: Setpoint, measured: Measured, period: float) -> float:  # noqa: ARG002 - the protocol's
        """As much as there is."""
        size = _SUPPLY if self._room is None else min(_SUPPLY, self._constant * abs(measured.velocity) + self._room)
        return size if measured.velocity >= 0.0 else -size


def set_fault(**fields: Any) -> Callable[[World], None]:
    """Injection that sets fields of the rail's faults."""

    def inject(world: World) -> None:
        for name, value in fields.items():
            setattr(world.rail.injection, name, value)

    return inject


def _stick_switch(world: World) -> None:
    world.rail.injection.switches[2] = True


def _pass_switch(world: World) -> None:
    """Move the right switch's edge to where the carriage is; the switch's own delay counts."""
    parameters = world.rail.parameters
    switches = parameters.switches
    shift = abs(world.rail.plant.position) - switches.limit_edges[0] - 1e-6
    moved = replace(switches, limit_position=switches.limit_position + shift)
    world.rail.plant.replace_parameters(replace(parameters, switches=moved))


def _double_supply(world: World) -> None:
    parameters = world.rail.parameters
    drive = replace(parameters.drive, supply_voltage=2.0 * parameters.drive.supply_voltage)
    world.rail.plant.replace_parameters(replace(parameters, drive=drive))


def _drag(world: World) -> None:
    parameters = world.rail.parameters
    drive = replace(parameters.drive, coulomb_friction=80.0, static_friction=80.0)
    world.rail.plant.replace_parameters(replace(parameters, drive=drive))


def _open_emergency_stop(world: World) -> None:
    world.rail.parameters = replace(world.rail.parameters, emergency_resistor=None)
    world.rail.injection.emergency_stop = True


def _kill(name: str) -> Callable[[World], None]:
    return lambda world: setattr(world, f"{name}_alive", False)


def _hold_loop(world: World) -> None:
    world.loop_held_until = world.now + 0.1


def _run_away(current: float | None) -> Callable[[World], None]:
    def inject(world: World) -> None:
        model = world.parameters.model
        controller = Runaway(current, model.resistance, model.force_constant)
        world.loop._drive._controller = controller  # noqa: SLF001 - a trial breaks what nobody else may touch

    return inject


def _leave_limits(world: World) -> None:
    position, velocity = world.telemetry.position, world.telemetry.velocity
    motion = Motion(2, [Creep(position, velocity, max_acceleration=1e4)], world.now)
    world.loop._work.motion = motion  # noqa: SLF001 - as if admission had let it through


_SUPPLY = 23.0  # V
FAST, LOST, RUNAWAY, STALL = 5e-3, 20e-3, 30e-3, 100e-3

CASES = (
    Case("end switch, driven over", _pass_switch, (Fault.END_SWITCH,), FAST, anywhere=False),
    Case("end switch, stuck on", _stick_switch, (Fault.END_SWITCH,), FAST),
    Case("current sensor 12 A high", set_fault(current_offset=12.0), (Fault.OVERCURRENT,), FAST),
    Case("supply of twice the voltage", _double_supply, (Fault.OVERCURRENT,), FAST),
    Case("emergency stop", set_fault(emergency_stop=True), (Fault.EMERGENCY_STOP,), FAST),
    Case("encoder stuck", set_fault(encoder_frozen=True), (Fault.ENCODER,), FAST),
    Case("encoder jumps by 10 mm", set_fault(encoder_jump=200), (Fault.ENCODER,), FAST),
    Case("encoder counts backwards", set_fault(encoder_reversed=True), (Fault.ENCODER,), FAST),
    Case("encoder cable off (one channel)", set_fault(encoder_channel_dead=True), (Fault.ENCODER,), FAST),
    Case("card silent", set_fault(silent=True), (Fault.HARDWARE,), FAST),
    Case("command source silent", _kill("source"), (Fault.COMMAND_LOST,), LOST),
    Case("loop held up for 100 ms", _hold_loop, (), LOST),
    Case("loop process killed", _kill("loop"), (), LOST),
    Case("guard process killed", _kill("guard"), (Fault.GUARD,), LOST),
    Case("runaway, 5 A", _run_away(5.0), (Fault.RUNAWAY,), RUNAWAY),
    Case("runaway, 23 V", _run_away(None), (Fault.RUNAWAY, Fault.OVERCURRENT), RUNAWAY),
    Case("carriage jams at speed", set_fault(jammed=True), (Fault.STALL, Fault.OVERCURRENT), STALL),
    Case(
        "carriage jams where it turns",
        set_fault(jammed=True),
        (Fault.STALL, Fault.OVERCURRENT),
        STALL,
        phase=0.5 * math.pi,
    ),
    Case("carriage dragged to a halt (80 N)", _drag, (Fault.STALL, Fault.OVERCURRENT), STALL, anywhere=False),
    Case(
        "carriage blocked from the start",
        set_fault(jammed=True),
        (Fault.STALL,),
        STALL,
        anywhere=False,
        at_start=True,
    ),
    Case("reference leaves the soft limits", _leave_limits, (Fault.SOFT_LIMIT,), None, anywhere=False),
    Case("DIR line stuck", set_fault(direction_stuck=1), (Fault.ENCODER, Fault.RUNAWAY), None),
    Case("bridge fault", set_fault(bridge_failed=True), (Fault.BRIDGE,), FAST, coasts=True),
    Case("emergency stop, no brake resistor", _open_emergency_stop, (Fault.EMERGENCY_STOP,), FAST, coasts=True),
)
