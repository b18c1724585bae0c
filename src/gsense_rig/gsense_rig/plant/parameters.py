"""Numbers of the rail's drive, track and switches.

The motor is a maxon RE 35 (30 V winding) on 24 V, behind a planetary gear and a toothed belt. What no source gives is
marked as chosen. The same drive numbers serve the plant (as truth) and the controller (as its model of the truth).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True)
class DriveParameters:
    """Motor, gear, belt and H-bridge. SI units; "at the belt" means reflected to the carriage's straight motion."""

    supply_voltage: float = 24.0  # V; with 12 V the drive saturates at 0.96 m/s
    resistance: float = 1.2  # ohm, maxon RE 35 sheet
    inductance: float = 0.34e-3  # H, maxon RE 35 sheet
    motor_constant: float = 0.0389  # N·m/A and V·s/rad, maxon RE 35 sheet
    rotor_inertia: float = 6.81e-6  # kg·m², maxon RE 35 sheet
    rotor_viscous: float = 6.33e-6  # N·m·s/rad
    rotor_coulomb: float = 2.0e-3  # N·m, chosen
    gear_ratio: float = 4.8  # motor turns per pulley turn
    gear_efficiency: float = 0.80  # of the transmitted torque, either way
    gear_inertia: float = 0.5e-6  # kg·m² at the motor
    pulley_radius: float = 20 * 5e-3 / (2 * 3.141592653589793)  # m: 20 teeth of 5 mm
    pulley_inertia: float = 1.0e-5  # kg·m²
    belt_stiffness: float = 150_000.0  # N/m, chosen: pulley and carriage ring against each other at 90 Hz
    belt_damping: float = 30.0  # N·s/m, chosen: 5 % of critical
    carriage_mass: float = 1.5  # kg with board; 1 to 2
    coulomb_friction: float = 3.0  # N at the belt, chosen
    static_friction: float = 3.5  # N at the belt, chosen (Stribeck's breakaway force)
    stribeck_speed: float = 5.0e-3  # m/s, chosen
    viscous_friction: float = 2.0  # N·s/m at the belt, chosen
    dead_zone: float = 0.015  # duty below which the bridge gives nothing (dead time, minimum on-time), 1 to 2 %
    current_limit: float = 8.0  # A: above it the bridge switches off until the current has fallen
    counts_per_metre: float = 20_000.0  # encoder at the gear's output: 500 lines x 4 on 100 mm of belt

    @property
    def transmission(self) -> float:
        """Motor radians per metre of belt."""
        return self.gear_ratio / self.pulley_radius

    @property
    def force_constant(self) -> float:
        """Force at the belt per ampere before gear loss [N/A], and back EMF per speed [V·s/m]; 11.73 by default."""
        return self.motor_constant * self.transmission

    @property
    def motor_mass(self) -> float:
        """Rotor and gear inertia as a mass at the belt [kg], ahead of the gear's loss."""
        return (self.rotor_inertia + self.gear_inertia) * self.transmission**2

    @property
    def pulley_mass(self) -> float:
        """The pulley's inertia as a mass at the belt [kg], behind the gear's loss."""
        return self.pulley_inertia / self.pulley_radius**2

    @property
    def load_mass(self) -> float:
        """Carriage and pulley as a mass at the belt [kg], behind the gear's loss: what a stiff belt makes of them."""
        return self.carriage_mass + self.pulley_mass

    @property
    def motor_coulomb(self) -> float:
        """Rotor's dry friction at the belt [N]."""
        return self.rotor_coulomb * self.transmission

    @property
    def motor_viscous(self) -> float:
        """Rotor's viscous friction at the belt [N·s/m]."""
        return self.rotor_viscous * self.transmission**2


@dataclass(frozen=True)
class SwitchParameters:
    """Three inductive switches (Omron TL-W5MC1) and the optical one; positions along the rail, 0 midway.

    A steel flag on the carriage passes the switches' faces at `gap`; a switch answers as soon as the flag's edge is
    within its sensing distance. The flag is so long that an end switch stays on up to the end stop.
    """

    limit_position: float = 0.24  # m: where the end switches answer at the nominal sensing distance
    sensing_distance: float = 5.0e-3  # m on steel; the sheet has 5 mm +-10 %, the thesis 4 to 6 mm
    sensing_spread: float = 0.5e-3  # m: SimRail draws its switches within this of the sensing distance
    hysteresis: float = 0.1  # of the sensing distance, the sheet's largest
    gap: float = 2.0e-3  # m between flag and face (thesis, section 6.2.1)
    centre_half_width: float = 9.0e-3  # m: half of the 18 mm flag of the centre switch
    inductive_delay: float = 1.5e-3  # s, 1 to 2 ms
    optical_position: float = 0.178  # m: sees the carriage within 0.122 m of the right end stop
    optical_hysteresis: float = 5.0e-3  # m
    optical_delay: float = 2.0e-3  # s

    def reach(self, distance: float) -> float:
        """How far ahead of a switch [m] the flag's edge is seen at a sensing distance [m]."""
        return math.sqrt(max(distance**2 - self.gap**2, 0.0))

    @property
    def _reaches(self) -> tuple[float, float]:
        return self.reach(self.sensing_distance), self.reach(self.sensing_distance * (1.0 + self.hysteresis))

    @property
    def limit_edges(self) -> tuple[float, float]:
        """Distances from the middle [m] beyond which an end switch goes on, within which it goes off."""
        face = self.limit_position + self.reach(SwitchParameters.sensing_distance)
        on, off = self._reaches
        return face - on, face - off

    @property
    def centre_edges(self) -> tuple[float, float]:
        """Distances from the middle [m] within which the centre switch goes on, beyond which it goes off."""
        on, off = self._reaches
        return self.centre_half_width + on, self.centre_half_width + off


@dataclass(frozen=True)
class TrackParameters:
    """End stops with buffers."""

    end_stop: float = 0.30  # m, either side
    buffer_length: float = 10.0e-3  # m, ahead of the stop
    buffer_stiffness: float = 32_000.0  # N/m: takes 1.2 m/s on its 10 mm
    buffer_damping: float = 200.0  # N·s/m, chosen


@dataclass(frozen=True)
class PlantParameters:
    """All of the simulated rail, and how finely it is computed."""

    drive: DriveParameters = field(default_factory=DriveParameters)
    switches: SwitchParameters = field(default_factory=SwitchParameters)
    track: TrackParameters = field(default_factory=TrackParameters)
    emergency_resistor: float | None = 1.8  # ohm across the motor when the emergency stop opens; None: left open
    step: float = 20.0e-6  # s, longest integration step; the electrical time constant is 0.28 ms
