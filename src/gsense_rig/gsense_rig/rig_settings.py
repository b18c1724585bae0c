"""Parameters of the rig node, and what is started from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType

from gsense_rig import drive_file
from gsense_rig.control.controllers import CONTROLLERS
from gsense_rig.control.tuning import TuneError
from gsense_rig.hardware.interface import HardwareError
from gsense_rig.hardware.mf624.card import CardPlace, require_card
from gsense_rig.hardware.mf624.rail import CardRailSpec
from gsense_rig.hardware.mf624.wiring import Wiring, load_wiring
from gsense_rig.live_board import SimulatedBoard
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.spec import ProcessSpec
from gsense_rig.safety.modes import Mode
from gsense_rig.safety.monitor import SafetyLimits

if TYPE_CHECKING:
    from rclpy.node import Node

HARDWARE = ("sim", "mf624")
MOUNTINGS = ("0", "90", "180", "tilt_x", "tilt_y")  # of sensors.mounting, whose imports are heavy
POSE_RATE = 200.0  # Hz, of the contract
CARD_TIMEOUT = 0.015  # s
SIMULATED_TIMEOUT = 0.5  # s; nobody is hurt, and a busy machine may hold up the node


@dataclass(frozen=True)
class RigSettings:
    """The node's parameters."""

    hardware: str
    controller: str
    autohome: bool
    seed: int
    unit_seed: int
    mounting: str
    effects: tuple[str, ...]
    bus: Path | None
    memory: Path | None
    wiring: Path | None
    command_timeout: float
    drive_file: Path | None

    def process_spec(self) -> ProcessSpec:
        """What the loop process runs.

        Raises:
            HardwareError: this hardware cannot be used; the message says why.
        """
        if self.hardware not in HARDWARE:
            raise HardwareError(f"hardware '{self.hardware}' is unknown; choose one of {', '.join(HARDWARE)}")
        if self.controller not in CONTROLLERS:
            raise HardwareError(f"controller '{self.controller}' is unknown; choose one of {', '.join(CONTROLLERS)}")
        parameters = self._with_drive(
            replace(
                LoopParameters(controller=self.controller), safety=SafetyLimits(command_timeout=self._command_timeout())
            )
        )
        if self.hardware == "mf624":
            return self._card_spec(parameters)
        board = SimulatedBoard(self.unit_seed, self.seed, self.effects, self.mounting, self.bus)
        return ProcessSpec(
            parameters=parameters,
            seed=self.seed,
            telemetry_every=round(parameters.rate / POSE_RATE),
            feed_factory=board,
            memory=self.memory,
        )

    def _card_spec(self, parameters: LoopParameters) -> ProcessSpec:
        wiring = Wiring() if self.wiring is None else load_wiring(self.wiring)
        place = CardPlace()
        require_card(place.uio_class)
        card = CardRailSpec(place, wiring)
        return ProcessSpec(parameters, telemetry_every=round(parameters.rate / POSE_RATE), card=card)

    def _command_timeout(self) -> float:
        if self.command_timeout > 0.0:
            return self.command_timeout
        return CARD_TIMEOUT if self.hardware == "mf624" else SIMULATED_TIMEOUT

    def _with_drive(self, parameters: LoopParameters) -> LoopParameters:
        """The identified drive where there is a file of one; the simulation is what the nominal numbers say."""
        if self.drive_file is not None and self.drive_file.exists():
            try:
                return replace(parameters, model=drive_file.read(self.drive_file, parameters.model), tuned=True)
            except TuneError as error:
                raise HardwareError(str(error)) from error
        return replace(parameters, tuned=self.hardware == "sim")


def _describe(text: str, constraints: str = "", **more: Any) -> Any:
    return ParameterDescriptor(description=text, additional_constraints=constraints, read_only=True, **more)


def declare(node: Node) -> RigSettings:
    """Declare the node's parameters and read them."""

    def declared(name: str, default: Any, descriptor: Any) -> Any:
        return node.declare_parameter(name, default, descriptor).value

    seed = declared(
        "seed",
        1,
        _describe("draws start position and sensor noise", integer_range=[IntegerRange(from_value=0, to_value=2**31)]),
    )
    unit_seed = declared("unit_seed", -1, _describe("draws the simulated board's own errors; -1: as seed"))
    memory = declared("memory", "", _describe("file for the simulated rail's memory, to be looked at from outside"))
    wiring = declared("wiring", "", _describe("YAML file with the card's terminals; empty: the defaults"))
    identified = declared("drive_file", "", _describe("YAML that rig/tune writes and the start reads; empty: none"))
    bus = declared("bus", "", _describe("file of the sensor bus; empty: the board's default"))
    return RigSettings(
        hardware=declared("hardware", "sim", _describe("the rail behind the loop", " or ".join(HARDWARE))),
        controller=declared("controller", CONTROLLERS[0], _describe("position controller", " or ".join(CONTROLLERS))),
        autohome=declared("autohome", False, _describe("home at the start")),
        seed=seed,
        unit_seed=seed if unit_seed < 0 else unit_seed,
        mounting=declared("mounting", "0", _mounting_descriptor()),
        effects=_effects(node),
        bus=Path(bus) if bus else None,
        memory=Path(memory) if memory else None,
        wiring=Path(wiring) if wiring else None,
        drive_file=Path(identified) if identified else None,
        command_timeout=declared(
            "command_timeout",
            0.0,
            _describe(
                "seconds without a sign of life of this node after which the loop stops the motor; "
                f"0: {CARD_TIMEOUT:g} for a card, {SIMULATED_TIMEOUT:g} for the simulation",
                floating_point_range=[FloatingPointRange(from_value=0.0, to_value=10.0)],
            ),
        ),
    )


def _mounting_descriptor() -> Any:
    text = "how the simulated board is mounted; setting it turns the board, at rest only"
    descriptor = _describe(text, ", ".join(MOUNTINGS))
    descriptor.read_only = False
    return descriptor


def refuse_mounting(hardware: str, mode: Mode, name: str) -> str:
    """Why the board cannot be turned now; empty where it can."""
    if hardware != "sim":
        return "turn the board by hand: only a simulated one is turned by this parameter"
    if name not in MOUNTINGS:
        return f"mounting '{name}' is unknown; use one of {', '.join(MOUNTINGS)}"
    if mode not in (Mode.UNHOMED, Mode.IDLE, Mode.FAULT):
        return f"the rig is {mode.name.lower()}: turn the board at rest"
    return ""


def _effects(node: Node) -> tuple[str, ...]:
    descriptor = _describe("effects of the simulated board, NAME=VALUE each", type=ParameterType.PARAMETER_STRING_ARRAY)
    values = node.declare_parameter("effects", [""], descriptor).value
    return tuple(effect for effect in values if effect)
