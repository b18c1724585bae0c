"""What turns the carriage's motion into the sensors' signals: the coefficients that unit and effects together set."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gsense_rig.sensors.drivers import Chip, FieldDriver, GyroDriver, TiltDriver
from gsense_rig.sensors.parameters import UnitParameters

Array = npt.NDArray[np.float64]
FORCE = slice(GyroDriver.FORCE_X, GyroDriver.FORCE_Z + 1)


@dataclass
class SignalModel:
    """Mutable: an effect's `apply` changes it before the simulation starts."""

    gyro_terms: Array
    """(3 chips, 3 axes, drivers): see `drivers.GyroDriver`; rad/s per unit of the driver."""
    tilt: Array
    """(3 axes, drivers): see `drivers.TiltDriver`; rad per unit of the driver, rail axes."""
    random_walk: Array
    """(3 chips,), (rad/s)/sqrt(s)."""
    field: Array = field(default_factory=lambda: np.zeros((3, len(FieldDriver))))
    """(3 axes, drivers): see `drivers.FieldDriver`; tesla per unit of the driver, rail axes."""
    gyro_delay: float = 0.0
    """s: the gyros' whole path is this much later than the accelerometers'."""
    tone_frequency: float = 50.0
    """Hz, of `GyroDriver.TONE`."""
    tone_phase: float = 0.0
    """rad."""
    jump_time: float = 60.0
    """s from the start of the session, of `GyroDriver.JUMP`."""
    temperature_lag: float = 0.0
    """s: of `GyroDriver.WARMTH` behind the die temperature."""
    sway_frequency: float = 9.0
    """Hz, of the mount's resonance, `GyroDriver.SWAY`."""
    sway_damping: float = 0.08
    tooth_pitch: float = 5e-3
    """m, of `TiltDriver.TOOTH`."""
    tooth_phase: float = 0.7
    """rad."""
    play: float = 1e-4
    """m: the carriage leans from one side of its bearings' play to the other, `TiltDriver.PLAY`, within twice this."""
    rattle_bandwidth: float = 60.0
    """Hz, of the vibration in `GyroDriver.RATTLE_X`."""
    gyro_limit: float = math.inf
    """rad/s: gyros stand there."""
    accel_limit: float = math.inf
    """m/s^2: accelerometers stand there."""
    gyro_step: float = 0.0
    """rad/s: the gyros' registers change by no less."""
    clock_error: float = 0.0
    """Relative: the stamps of the board run faster than the rig's."""
    lost: float = 0.0
    """Part of the board's frames that never arrives."""
    encoder_scale: float = 0.0
    """What the encoder reads too much of every metre, 1."""

    @classmethod
    def of_unit(cls, unit: UnitParameters) -> SignalModel:
        """The declared model alone: bias and g-sensitivity."""
        terms = np.zeros((len(Chip), 3, len(GyroDriver)))
        for chip, gyro in zip(Chip, unit.gyros, strict=True):
            terms[chip, :, GyroDriver.ONE] = gyro.bias
            terms[chip, :, FORCE] = gyro.g_sensitivity
        return cls(
            gyro_terms=terms,
            tilt=np.zeros((3, len(TiltDriver))),
            random_walk=np.array([gyro.random_walk for gyro in unit.gyros]),
            temperature_lag=unit.thermal.gyro_lag,
        )
