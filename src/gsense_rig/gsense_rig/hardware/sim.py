"""The simulated rail behind the hardware interface; its clock is whatever `advance` is told."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.hardware.interface import MOTOR_OFF, HardwareReading, MotorOutput
from gsense_rig.plant.parameters import PlantParameters
from gsense_rig.plant.plant import Plant

if TYPE_CHECKING:
    from numpy.typing import NDArray

PWM_STEPS = 2083  # of the card's counter at 50 MHz / 24 kHz
_NOISE_BLOCK = 4096


@dataclass
class Injection:
    """Faults that a test puts into the simulated rail; change it at any time."""

    encoder_frozen: bool = False
    encoder_jump: int = 0  # counts added to every reading
    encoder_reversed: bool = False
    switches: dict[int, bool] = field(default_factory=dict)  # index -> level that it is stuck at
    current_offset: float = 0.0  # A added to the sensed current
    bridge_failed: bool = False  # bridge reports a fault and is open
    emergency_stop: bool = False  # supply cut
    motor_reversed: bool = False  # DIR has the wrong sense (a swapped cable)
    jammed: bool = False  # carriage held fast


class SimRail:
    """Plant, encoder, current sensor and bridge inputs.

    Args:
        parameters: the physics.
        seed: draws the carriage's start position, the encoder's phase, the current sensor's noise and the switches.
        position: start position [m] instead of a random one.
        time: start time [s].
    """

    def __init__(
        self, parameters: PlantParameters | None = None, seed: int = 0, position: float | None = None, time: float = 0.0
    ) -> None:
        self._rng = np.random.default_rng([seed, 0x7A11])
        drawn = float(self._rng.uniform(-0.2, 0.2))
        start = drawn if position is None else position
        self.parameters = _with_drawn_switches(parameters or PlantParameters(), seed)
        self.plant = Plant(self.parameters, start, time)
        self.counts_per_metre = self.parameters.drive.counts_per_metre
        self.injection = Injection()
        self.output = MOTOR_OFF
        self._zero = start - float(self._rng.uniform(0.0, 1.0)) / self.counts_per_metre
        self._frozen_at: int | None = None
        self._jammed = False
        self._noise: list[float] = []
        self.current_noise = 0.02  # A rms of the current sensor, chosen

    def advance(self, until: float) -> NDArray[np.float64]:
        """Let the physics run to a time [s] under the outputs written last.

        Returns:
            Array with shape (n, 5), one row per whole millisecond: time [s], position, velocity, acceleration, motor
            current (SI).
        """
        fault = self.injection
        if fault.jammed != self._jammed:
            self._jam(fault.jammed)
        disabled = self.output.disabled or fault.bridge_failed or fault.emergency_stop
        duty = round(self.output.duty * PWM_STEPS) / PWM_STEPS
        return self.plant.advance(until, -duty if fault.motor_reversed else duty, disabled)

    def read(self) -> HardwareReading:
        """Read the sensors at the time reached."""
        fault = self.injection
        counts = math.floor((self.plant.encoder_position - self._zero) * self.counts_per_metre)
        if fault.encoder_frozen:
            self._frozen_at = counts if self._frozen_at is None else self._frozen_at
            counts = self._frozen_at
        if fault.encoder_reversed:
            counts = -counts
        switches = self.plant.switches
        if fault.switches:
            levels = [fault.switches.get(k, level) for k, level in enumerate(switches)]
            switches = (levels[0], levels[1], levels[2], levels[3])
        if not self._noise:
            self._noise = self._rng.normal(0.0, self.current_noise, _NOISE_BLOCK).tolist()
        current = self.plant.current + self._noise.pop() + fault.current_offset
        return HardwareReading(
            counts + fault.encoder_jump, switches, current, not fault.bridge_failed, fault.emergency_stop
        )

    def write(self, output: MotorOutput) -> None:
        """Set bridge and light; takes effect from the time reached."""
        self.output = output

    def close(self) -> None:
        """Disable the motor."""
        self.output = MOTOR_OFF

    def _jam(self, jammed: bool) -> None:
        drive = self.parameters.drive
        stuck = replace(drive, coulomb_friction=1000.0, static_friction=1000.0) if jammed else drive
        self.plant.replace_parameters(replace(self.parameters, drive=stuck))
        self._jammed = jammed


def _with_drawn_switches(parameters: PlantParameters, seed: int) -> PlantParameters:
    """Draw the inductive switches' sensing distance within its spread; alike, since 0 is midway between them."""
    switches = parameters.switches
    shift = float(np.random.default_rng([seed, 0x5E45]).uniform(-1.0, 1.0)) * switches.sensing_spread
    drawn = replace(switches, sensing_distance=switches.sensing_distance + shift)
    return replace(parameters, switches=drawn)
