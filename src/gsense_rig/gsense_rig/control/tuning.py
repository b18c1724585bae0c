"""Identification of the drive by a short move: what the feed-forward and the observer need to know.

Two least-squares fits on the same move (the encoder smoothed without lag):

- electrical:  duty * supply = (1 - z) (R i + c v) + z supply sgn(duty)           -> R, c, dead zone z
- mechanical:  c i - rotor = (m_load a + F sgn v + b v) eta^-+1, on a grid of eta   -> eta, m_load, F, b

The rotor's inertia and friction are taken from the motor's sheet, as they cannot be told from the load's at one belt.
An error of the assumed supply or of the current sensor's scale goes into R and c; the voltages that the model asks for
stay right. Where no current is sensed, R and the viscous friction stay the nominal ones and the current is what R and c
make of the voltage; mass and Coulomb friction then take up what R is off.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import savgol_filter

from gsense_rig.control.references import Hold, MoveTo, Reference, Sine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gsense_rig.plant.parameters import DriveParameters

    Array = NDArray[np.float64]

IDENTIFIED = (
    "resistance", "motor_constant", "dead_zone", "gear_efficiency", "carriage_mass", "coulomb_friction",
    "viscous_friction",
)  # fmt: skip
_EFFICIENCIES = np.linspace(0.5, 1.0, 101)
_EMF_ROUNDS = 5
_SLOWEST = 0.03  # m/s: below it friction is not Coulomb's
_SMOOTHING = 0.04  # s of the smoothing window
_LARGEST_CHANGE = 3.0  # of R, c and mass against the nominal ones; beyond it something is wired wrongly
_RESIDUAL = 0.15  # of the force's rms that may stay unexplained


class TuneError(ValueError):
    """The move does not fit a drive; the message is one line."""


@dataclass(frozen=True)
class Tuning:
    """What a tune move found."""

    drive: DriveParameters
    force_residual: float  # rms of what the model leaves of the drive's force, relative to the force's rms

    def text(self, nominal: DriveParameters) -> str:
        """One line: every number and its change against the nominal one."""
        parts = []
        for name in IDENTIFIED:
            new, old = getattr(self.drive, name), getattr(nominal, name)
            parts.append(f"{name} {new:.4g} ({(new / old - 1.0) * 100.0:+.0f} %)")
        return ", ".join(parts) + f"; {self.force_residual * 100.0:.1f} % of the force unexplained"


def tune_segments(position: float, settle: float) -> list[Reference]:
    """The move: a slow sine for friction, a fast one for inertia; from a position [m] to the centre, some 10 s."""
    slow, fast = Sine(0.10, 3.0, 1, max_ramp=1.0), Sine(0.12, 7.0, 4)
    return [MoveTo(position, 0.0), Hold(0.0, settle), slow, fast, Hold(0.0, settle)]


def identify(record: Array, period: float, nominal: DriveParameters) -> Tuning:
    """Find the drive's numbers in a tune move.

    Args:
        record: array with shape (n, 3), a row per period: encoder position [m], duty (-1..1) since the row before,
            motor current [A], nan where none is sensed.
        period: of the loop [s].
        nominal: supplies what a move cannot tell (rotor, supply, inductance, pulley).

    Raises:
        TuneError: too short, no motion, or numbers that no such drive has.
    """
    window = 2 * round(0.5 * _SMOOTHING / period) + 1
    if record.ndim != 2 or record.shape[0] < 20 * window:
        raise TuneError(f"tune: {record.shape[0]} rows are too few; the move was cut short")
    position, duty, current = (np.ascontiguousarray(column) for column in record.T)
    sensed = not np.isnan(current).any()
    current = np.nan_to_num(current)
    velocity = savgol_filter(position, window, 3, deriv=1, delta=period)
    acceleration = savgol_filter(position, window, 3, deriv=2, delta=period)
    # A row's duty and current belong to the period before it: the mean with the next row's is centred on the row.
    duty, current = (savgol_filter(0.5 * (x + np.append(x[1:], x[-1])), window, 3) for x in (duty, current))
    used = np.abs(velocity) > _SLOWEST
    used[:window] = used[-window:] = False
    if np.count_nonzero(used) < 10 * window:
        raise TuneError("tune: the carriage hardly moved; check motor supply and encoder")
    v, a, i, d = velocity[used], acceleration[used], current[used], duty[used]
    tuning = _mechanical(_electrical(d, i, v, nominal), i, v, a) if sensed else _without_current(d, v, a, nominal)
    return _plausible(tuning, nominal)


def _without_current(duty: Array, velocity: Array, acceleration: Array, nominal: DriveParameters) -> Tuning:
    """The mechanical fit with the current that R and c make of the voltage, c such that viscous friction is nominal."""
    drive, voltage = nominal, _bridge_voltage(duty, nominal)
    for _ in range(_EMF_ROUNDS):
        c = drive.force_constant
        tuning = _mechanical(drive, (voltage - c * velocity) / drive.resistance, velocity, acceleration)
        excess = tuning.drive.viscous_friction - nominal.viscous_friction
        c += drive.resistance * excess / (tuning.drive.gear_efficiency * c)
        drive = replace(nominal, motor_constant=c / nominal.transmission)
    return tuning


def _bridge_voltage(duty: Array, drive: DriveParameters) -> Array:
    """Mean terminal voltage that a signed duty makes [V]."""
    size = (np.abs(duty) - drive.dead_zone).clip(0.0) / (1.0 - drive.dead_zone)
    return np.copysign(size, duty) * drive.supply_voltage


def _electrical(duty: Array, current: Array, velocity: Array, nominal: DriveParameters) -> DriveParameters:
    driven = np.abs(duty) > 2.0 * nominal.dead_zone
    columns = np.column_stack([current, velocity, np.sign(duty), np.ones_like(duty)])[driven]
    r, c, step, _ = np.linalg.lstsq(columns, duty[driven] * nominal.supply_voltage, rcond=None)[0]
    zone = min(max(float(step) / nominal.supply_voltage, 0.0), 0.1)
    return replace(
        nominal,
        resistance=float(r) / (1.0 - zone),
        motor_constant=float(c) / (1.0 - zone) / nominal.transmission,
        dead_zone=zone,
    )


def _mechanical(drive: DriveParameters, current: Array, velocity: Array, acceleration: Array) -> Tuning:
    sign = np.sign(velocity)
    rotor = drive.motor_mass * acceleration + drive.motor_coulomb * sign + drive.motor_viscous * velocity
    force = drive.force_constant * current - rotor
    columns = np.column_stack([acceleration, sign, velocity, np.ones_like(sign)])
    trials = [_mechanical_at(eta, columns, force, sign) for eta in _EFFICIENCIES]
    left, eta, (mass, coulomb, viscous, _) = min(trials, key=lambda trial: trial[0])
    found = replace(
        drive,
        gear_efficiency=eta,
        carriage_mass=float(mass) - drive.pulley_mass,
        coulomb_friction=float(coulomb),
        static_friction=drive.static_friction * float(coulomb) / drive.coulomb_friction,
        viscous_friction=float(viscous),
    )
    return Tuning(found, left / float(np.sqrt(np.mean(force**2))))


def _mechanical_at(eta: float, columns: Array, force: Array, sign: Array) -> tuple[float, float, Array]:
    """Rms of what a fit with a gear efficiency leaves [N], the efficiency, the fit's coefficients."""
    share = np.where(force * sign >= 0.0, eta, 1.0 / eta)
    solution = np.asarray(np.linalg.lstsq(columns / share[:, None], force, rcond=None)[0], dtype=np.float64)
    return float(np.sqrt(np.mean((force - columns @ solution / share) ** 2))), float(eta), solution


def _plausible(tuning: Tuning, nominal: DriveParameters) -> Tuning:
    for name in ("resistance", "motor_constant", "carriage_mass"):
        new, old = getattr(tuning.drive, name), getattr(nominal, name)
        if not old / _LARGEST_CHANGE < new < old * _LARGEST_CHANGE:
            raise TuneError(
                f"tune: {name} {new:.3g} against {old:.3g} in the sheet; check motor, current and encoder wiring"
            )
    if tuning.drive.coulomb_friction <= 0.0:
        raise TuneError(f"tune: friction of {tuning.drive.coulomb_friction:.2g} N; check the current sensor's sign")
    if tuning.force_residual > _RESIDUAL:
        raise TuneError(f"tune: {tuning.force_residual:.0%} of the force unexplained; does the carriage rub or slip?")
    return tuning


def drive_from_mapping(values: object, nominal: DriveParameters) -> DriveParameters:
    """Drive numbers of a drive file's `drive:` mapping over the nominal ones.

    Raises:
        TuneError: not a mapping of known names to numbers.
    """
    known = {field.name for field in fields(nominal)}
    if not isinstance(values, dict) or not values:
        raise TuneError("`drive:` is not a mapping of names to numbers")
    for name, value in values.items():
        if name not in known:
            raise TuneError(f"`{name}` is no number of the drive")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise TuneError(f"`{name}` is not a number")
    return replace(nominal, **{name: float(value) for name, value in values.items()})
