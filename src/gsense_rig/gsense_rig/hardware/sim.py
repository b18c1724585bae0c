"""The simulated rail behind the hardware interface; its clock is whatever `advance` is told."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.hardware.interface import MOTOR_OFF, HardwareError, HardwareReading, MotorOutput
from gsense_rig.hardware.sim_memory import RailMemory
from gsense_rig.plant.parameters import PlantParameters
from gsense_rig.plant.plant import Plant
from gsense_rig.plant.state import STATE_SIZE

if TYPE_CHECKING:
    from numpy.typing import NDArray

PWM_STEPS = 2083  # of the card's counter at 50 MHz / 24 kHz
_NOISE_BLOCK = 4096


@dataclass
class Injection:
    """Faults that a test puts into the simulated rail; change it at any time, it acts from then on."""

    encoder_frozen: bool = False
    encoder_jump: int = 0  # counts added to every reading
    encoder_reversed: bool = False  # counts the wrong way
    encoder_channel_dead: bool = False  # one channel off: the counter goes to and fro by one
    switches: dict[int, bool] = field(default_factory=dict)  # index -> level that it is stuck at
    current_offset: float = 0.0  # A added to the sensed current
    bridge_failed: bool = False  # bridge reports a fault and is open
    emergency_stop: bool = False  # supply cut, motor shorted by the resistor (`PlantParameters.emergency_resistor`)
    motor_reversed: bool = False  # the motor's cable is swapped
    direction_stuck: int = 0  # sign that the bridge drives whatever DIR says; 0: DIR works
    jammed: bool = False  # carriage held fast
    silent: bool = False  # the hardware does not answer


class SimRail:
    """Plant, encoder, current sensor and bridge inputs.

    Args:
        parameters: the physics.
        seed: draws the carriage's start position, the encoder's phase, the current sensor's noise and the switches.
        position: start position [m] instead of a random one.
        time: start time [s].
        memory: where physics and outputs are kept, overwritten; private where None.
    """

    def __init__(
        self,
        parameters: PlantParameters | None = None,
        seed: int = 0,
        position: float | None = None,
        time: float = 0.0,
        memory: RailMemory | None = None,
    ) -> None:
        self._rng = np.random.default_rng([seed, 0x7A11])
        drawn = float(self._rng.uniform(-0.2, 0.2))
        start = drawn if position is None else position
        self.parameters = _with_drawn_switches(parameters or PlantParameters(), seed)
        self.memory = memory or RailMemory()
        self.memory.output = MOTOR_OFF
        self.memory.zero = start - float(self._rng.uniform(0.0, 1.0)) / self.parameters.drive.counts_per_metre
        self.plant = Plant(self.parameters, start, time, _state_vector(self.memory))
        self.counts_per_metre = self.parameters.drive.counts_per_metre
        self.injection = Injection()
        self._onset: int | None = None  # true count when the encoder's fault began
        self._held = (False, False)
        self._noise: list[float] = []
        self.current_noise = 0.02  # A rms of the current sensor, chosen

    @classmethod
    def continued(cls, parameters: PlantParameters, seed: int, memory: RailMemory) -> SimRail:
        """Go on with a rail that another process has left in shared memory."""
        rail = cls(parameters, seed)
        rail.memory = memory
        rail.plant = Plant.continued(rail.parameters, _state_vector(memory))
        return rail

    @property
    def output(self) -> MotorOutput:
        """Outputs in force."""
        return self.memory.output

    def advance(self, until: float) -> NDArray[np.float64]:
        """Let the physics run to a time [s] under the outputs written last.

        Returns:
            Array with shape (n, 5), one row per whole millisecond: time [s], position, velocity, acceleration, motor
            current (SI).
        """
        fault = self.injection
        self._latch_onset()
        if (fault.jammed, fault.emergency_stop) != self._held:
            self._hold(fault)
        output = self.output
        duty = round(output.duty * PWM_STEPS) / PWM_STEPS
        if fault.direction_stuck:
            duty = math.copysign(duty, fault.direction_stuck)
        if fault.motor_reversed:
            duty = -duty
        if fault.emergency_stop:
            shorted = self.parameters.emergency_resistor is not None
            return self.plant.advance(until, 0.0, not shorted)
        return self.plant.advance(until, duty, output.disabled or fault.bridge_failed)

    def read(self) -> HardwareReading:
        """Read the sensors at the time reached.

        Raises:
            HardwareError: injected silence.
        """
        fault = self.injection
        if fault.silent:
            raise HardwareError("the simulated card does not answer")
        self._latch_onset()
        switches = self.plant.switches
        if fault.switches:
            levels = [fault.switches.get(k, level) for k, level in enumerate(switches)]
            switches = (levels[0], levels[1], levels[2], levels[3])
        return HardwareReading(
            self._counts() + fault.encoder_jump, switches, self._sensed_current(), not fault.bridge_failed,
            fault.emergency_stop,
        )  # fmt: skip

    def write(self, output: MotorOutput) -> None:
        """Set bridge and light; takes effect from the time reached."""
        self.memory.output = output

    def close(self) -> None:
        """Disable the motor."""
        self.memory.output = MOTOR_OFF

    def _true_counts(self) -> int:
        return self.memory.counts(self.counts_per_metre)

    def _latch_onset(self) -> None:
        fault = self.injection
        if not (fault.encoder_frozen or fault.encoder_reversed or fault.encoder_channel_dead):
            self._onset = None
        elif self._onset is None:
            self._onset = self._true_counts()

    def _counts(self) -> int:
        fault, counts = self.injection, self._true_counts()
        if self._onset is None:
            return counts
        if fault.encoder_frozen:
            return self._onset
        if fault.encoder_channel_dead:
            return self._onset + (counts & 1)
        return 2 * self._onset - counts

    def _sensed_current(self) -> float:
        """The sensor sits in the bridge: a swapped motor's current has the other sign, without supply there is none."""
        fault = self.injection
        if not self._noise:
            self._noise = self._rng.normal(0.0, self.current_noise, _NOISE_BLOCK).tolist()
        current = 0.0 if fault.emergency_stop else self.plant.current
        return (-current if fault.motor_reversed else current) + self._noise.pop() + fault.current_offset

    def _hold(self, fault: Injection) -> None:
        """Put a jam or the emergency stop's resistor into the physics, or take them out."""
        drive = self.parameters.drive
        if fault.jammed:
            drive = replace(drive, coulomb_friction=1000.0, static_friction=1000.0)
        if fault.emergency_stop and self.parameters.emergency_resistor is not None:
            drive = replace(drive, resistance=drive.resistance + self.parameters.emergency_resistor)
        self.plant.replace_parameters(replace(self.parameters, drive=drive))
        self._held = (fault.jammed, fault.emergency_stop)


def _state_vector(memory: RailMemory) -> NDArray[np.float64]:
    """The plant's part of the memory as an array with shape (STATE_SIZE,) over it."""
    return np.frombuffer(memory.values.cast("B"), dtype=np.float64, count=STATE_SIZE)


def _with_drawn_switches(parameters: PlantParameters, seed: int) -> PlantParameters:
    """Draw the inductive switches' sensing distance within its spread; alike, since 0 is midway between them."""
    switches = parameters.switches
    shift = float(np.random.default_rng([seed, 0x5E45]).uniform(-1.0, 1.0)) * switches.sensing_spread
    drawn = replace(switches, sensing_distance=switches.sensing_distance + shift)
    return replace(parameters, switches=drawn)
