"""The simulated rail against figures that were calculated for this drive by other means (1.5 kg carriage)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from gsense_rig.plant.parameters import DriveParameters, PlantParameters, TrackParameters
from gsense_rig.plant.plant import Plant

if TYPE_CHECKING:
    from gsense_rig.assessment.judging import Peaks

SPEED = 1.2  # m/s, the fastest of 0.15 m at 8 rad/s
_LONG = TrackParameters(end_stop=50.0)


@dataclass(frozen=True)
class Check:
    """One figure and the range that was calculated."""

    name: str
    value: float
    unit: str
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Whether the figure lies in the range."""
        return self.low <= self.value <= self.high


def stopping_distance(drive: DriveParameters, disabled: bool) -> float:
    """Distance [m] from SPEED to rest with the motor shorted (PWM 0), or with the bridge open (DIS)."""
    plant = Plant(PlantParameters(drive=drive, track=_LONG))
    plant.set_motion(0.0, SPEED)
    plant.advance(3.0, 0.0, disabled)
    return plant.position


def checks(peaks: Peaks) -> list[Check]:
    """Brake, coasting and what the fastest sine takes.

    The calculated 0.31 to 0.38 m of coasting (1.5 to 2 kg) leave out the rotor's viscous friction and the gear's loss;
    without them the plant coasts as far. The brake's were rounded to whole millimetres.
    """
    drive = DriveParameters()
    bare = replace(drive, rotor_viscous=0.0, gear_efficiency=1.0, static_friction=drive.coulomb_friction)
    braked = replace(drive, carriage_mass=2.0, coulomb_friction=5.0, static_friction=5.5)
    heavy = replace(bare, carriage_mass=2.0)
    return [
        Check("short-circuit brake from 1.2 m/s, 1.5 kg", stopping_distance(drive, False) * 1e3, "mm", 17.5, 22.5),
        Check("the same, 2 kg and 5 N of friction", stopping_distance(braked, False) * 1e3, "mm", 17.5, 22.5),
        Check("coasting without rotor drag and gear loss, 1.5 kg", stopping_distance(bare, True), "m", 0.305, 0.315),
        Check("the same, 2 kg", stopping_distance(heavy, True), "m", 0.375, 0.385),
        Check("coasting with them (closed form 0.278 m)", stopping_distance(drive, True), "m", 0.270, 0.280),
        Check("peak current at 8 rad/s", peaks.current, "A", 2.3, 2.9),
        Check("rms current at 8 rad/s", peaks.current_rms, "A", 1.45, 1.6),
        Check("peak voltage at 8 rad/s", peaks.voltage, "V", 14.8, 15.6),
    ]
