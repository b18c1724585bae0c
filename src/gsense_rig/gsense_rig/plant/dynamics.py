"""The rail's equations of motion, compiled; one call advances the plant to a time.

Two masses on a belt, all as straight motion at the belt (p: pulley with rotor and encoder, no index: carriage):

Winding:   L di/dt = u - R i - c v_p
Gear:      the transmitted force c i - f_motor - m_motor a_p loses 1 - eta in the direction in which power flows
Pulley:    m_pulley a_p = transmitted - belt,   belt = k (x_p - x) + d (v_p - v)
Carriage:  m a = belt - friction(v) - buffers(x, v),   friction: Coulomb, Stribeck and viscous

The bridge is averaged over its 24 kHz period: PWM high drives the DIR diagonal, low short-circuits the motor (slow
decay), DIS opens all four switches, so that the current returns to the supply through the diodes and then stays zero.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from gsense_rig.plant.state import (
    ACCELERATION,
    CURRENT,
    POSITION,
    PULLEY,
    PULLEY_SPEED,
    SAMPLED_POSITION,
    SAMPLED_SPEED,
    SPEED,
    SWITCH,
    TIME,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gsense_rig.plant.parameters import PlantParameters

# parameter vector
(
    P_SUPPLY, P_R, P_L, P_C, P_ETA, P_MOTOR_MASS, P_PULLEY_MASS, P_MASS, P_MOTOR_COULOMB, P_MOTOR_VISCOUS, P_BELT,
    P_BELT_DAMPING, P_COULOMB, P_STATIC, P_STRIBECK, P_VISCOUS, P_DEAD_ZONE, P_CURRENT_LIMIT, P_STOP, P_BUFFER,
    P_STIFFNESS, P_DAMPING, P_STEP, P_LIMIT_ON, P_LIMIT_OFF, P_CENTRE_ON, P_CENTRE_OFF, P_DELAY, P_OPTICAL,
    P_OPTICAL_HYSTERESIS, P_OPTICAL_DELAY,
) = range(31)  # fmt: skip

HISTORY_COLUMNS = 5
SAMPLE = 1e-3  # s, of the history
STEPS_PER_SWITCH = 5  # the switches are looked at every 0.1 ms; they take 1 to 2 ms themselves
SLOW = 6.0  # times the Stribeck speed, beyond which its share of friction is below 1e-15
DIODE_DROP = 0.7  # V, of each of the two conducting body diodes


def parameter_vector(parameters: PlantParameters) -> NDArray[np.float64]:
    """Flatten the parameters in the order of the P_ constants; array with shape (31,)."""
    d, s, t = parameters.drive, parameters.switches, parameters.track
    return np.array(
        [
            d.supply_voltage, d.resistance, d.inductance, d.force_constant, d.gear_efficiency, d.motor_mass,
            d.pulley_mass, d.carriage_mass, d.motor_coulomb, d.motor_viscous, d.belt_stiffness, d.belt_damping,
            d.coulomb_friction, d.static_friction, d.stribeck_speed, d.viscous_friction, d.dead_zone, d.current_limit,
            t.end_stop, t.buffer_length, t.buffer_stiffness, t.buffer_damping, parameters.step, *s.limit_edges,
            *s.centre_edges, s.inductive_delay, s.optical_position, s.optical_hysteresis, s.optical_delay,
        ]
    )  # fmt: skip


@njit(cache=True)
def _open_bridge_voltage(i: float, emf: float, p: NDArray[np.float64]) -> tuple[float, bool]:
    """All switches open: only the diodes conduct."""
    rail = p[P_SUPPLY] + 2.0 * DIODE_DROP
    if i != 0.0:
        return -math.copysign(rail, i), True
    if abs(emf) > rail:  # the motor as a generator, rectified into the supply
        return math.copysign(rail, emf), True
    return 0.0, False


@njit(cache=True)
def _bridge_voltage(duty: float, disabled: bool, i: float, emf: float, p: NDArray[np.float64]) -> tuple[float, bool]:
    """Return the motor's terminal voltage, and whether a current can flow at all."""
    if disabled:
        return _open_bridge_voltage(i, emf, p)
    size = abs(duty)
    if size <= p[P_DEAD_ZONE]:
        return 0.0, True
    u = math.copysign((min(size, 1.0) - p[P_DEAD_ZONE]) / (1.0 - p[P_DEAD_ZONE]) * p[P_SUPPLY], duty)
    if abs(i) > p[P_CURRENT_LIMIT] and u * i > 0.0:  # the bridge chops
        return 0.0, True
    return u, True


@njit(cache=True)
def _turning(sign: float, v: float, i: float, belt: float, p: NDArray[np.float64]) -> float:
    """Acceleration of the pulley [m/s²] that turns, or is about to turn, towards `sign`."""
    motor = p[P_C] * i - p[P_MOTOR_COULOMB] * sign - p[P_MOTOR_VISCOUS] * v
    eta = p[P_ETA]
    a = (eta * motor - belt) / (p[P_PULLEY_MASS] + eta * p[P_MOTOR_MASS])
    if (motor - p[P_MOTOR_MASS] * a) * sign < 0.0:  # the load drives the motor: the loss changes sides
        a = (motor / eta - belt) / (p[P_PULLEY_MASS] + p[P_MOTOR_MASS] / eta)
    return a


@njit(cache=True)
def _pulley_acceleration(v: float, i: float, belt: float, p: NDArray[np.float64]) -> float:
    """Acceleration of the pulley [m/s²]; zero where the rotor's dry friction and the gear's loss hold it."""
    if v != 0.0:
        return _turning(math.copysign(1.0, v), v, i, belt, p)
    return max(_turning(1.0, 0.0, i, belt, p), 0.0) + min(_turning(-1.0, 0.0, i, belt, p), 0.0)


@njit(cache=True)
def _buffer_force(x: float, v: float, p: NDArray[np.float64]) -> float:
    start = p[P_STOP] - p[P_BUFFER]
    if x > start:
        return min(0.0, -p[P_STIFFNESS] * (x - start) - p[P_DAMPING] * v)
    if x < -start:
        return max(0.0, -p[P_STIFFNESS] * (x + start) - p[P_DAMPING] * v)
    return 0.0


@njit(cache=True)
def _carriage_acceleration(x: float, v: float, belt: float, p: NDArray[np.float64]) -> float:
    """Acceleration of the carriage [m/s²]; zero where dry friction holds it."""
    push = belt + _buffer_force(x, v, p)
    if v == 0.0:
        held = abs(push) <= p[P_STATIC]
        return 0.0 if held else (push - math.copysign(p[P_STATIC], push)) / p[P_MASS]
    dry = p[P_COULOMB]
    if abs(v) < SLOW * p[P_STRIBECK]:
        dry += (p[P_STATIC] - p[P_COULOMB]) * math.exp(-((v / p[P_STRIBECK]) ** 2))
    return (push - math.copysign(dry, v) - p[P_VISCOUS] * v) / p[P_MASS]


@njit(cache=True)
def _raw_switch(index: int, was: bool, x: float, p: NDArray[np.float64]) -> bool:
    """Level of a switch ahead of its delay, with hysteresis."""
    if index == 0:
        return x <= -(p[P_LIMIT_OFF] if was else p[P_LIMIT_ON])
    if index == 1:
        return abs(x) <= (p[P_CENTRE_OFF] if was else p[P_CENTRE_ON])
    if index == 2:
        return x >= (p[P_LIMIT_OFF] if was else p[P_LIMIT_ON])
    return x >= p[P_OPTICAL] - (p[P_OPTICAL_HYSTERESIS] if was else 0.0)


@njit(cache=True)
def _update_switches(state: NDArray[np.float64], p: NDArray[np.float64]) -> None:
    for k in range(4):
        raw = _raw_switch(k, state[SWITCH + 4 + k] > 0.5, state[POSITION], p)
        if raw != (state[SWITCH + 4 + k] > 0.5):
            state[SWITCH + 4 + k] = 1.0 if raw else 0.0
            state[SWITCH + 8 + k] = state[TIME]
        delay = p[P_OPTICAL_DELAY] if k == 3 else p[P_DELAY]
        if state[SWITCH + k] != state[SWITCH + 4 + k] and state[TIME] - state[SWITCH + 8 + k] >= delay:
            state[SWITCH + k] = state[SWITCH + 4 + k]


@njit(cache=True)
def _step(state: NDArray[np.float64], p: NDArray[np.float64], duty: float, disabled: bool, h: float) -> None:
    """One semi-implicit step of h seconds."""
    x, v, i = state[POSITION], state[SPEED], state[CURRENT]
    pulley, pulley_v = state[PULLEY], state[PULLEY_SPEED]
    emf = p[P_C] * pulley_v
    u, conducts = _bridge_voltage(duty, disabled, i, emf, p)
    i_new = 0.0
    if conducts:
        i_new = (i + h / p[P_L] * (u - emf)) / (1.0 + h * p[P_R] / p[P_L])
        if disabled and i_new * i < 0.0:
            i_new = 0.0  # the diodes block
    belt = p[P_BELT] * (pulley - x) + p[P_BELT_DAMPING] * (pulley_v - v)
    pulley_new = _braked(pulley_v, pulley_v + h * _pulley_acceleration(pulley_v, i_new, belt, p))
    v_new = _braked(v, v + h * _carriage_acceleration(x, v, belt, p))
    x_new = x + h * v_new
    if abs(x_new) > p[P_STOP]:
        x_new = math.copysign(p[P_STOP], x_new)
        v_new = 0.0
    state[TIME] += h
    state[POSITION], state[SPEED], state[CURRENT] = x_new, v_new, i_new
    state[ACCELERATION] = (v_new - v) / h
    state[PULLEY], state[PULLEY_SPEED] = pulley + h * pulley_new, pulley_new


@njit(cache=True)
def _braked(v: float, v_new: float) -> float:
    """The new velocity; zero where it changed its sign, so that dry friction acts anew from rest."""
    return 0.0 if v * v_new < 0.0 else v_new


@njit(cache=True)
def settle_switches(state: NDArray[np.float64], p: NDArray[np.float64]) -> None:
    """Set the switches to what the position demands, without delay (power-on)."""
    for k in range(4):
        level = 1.0 if _raw_switch(k, False, state[POSITION], p) else 0.0
        state[SWITCH + k] = level
        state[SWITCH + 4 + k] = level
        state[SWITCH + 8 + k] = state[TIME]


@njit(cache=True)
def mark_sample(state: NDArray[np.float64]) -> None:
    """The next row of the history is the mean from here on."""
    state[SAMPLED_POSITION], state[SAMPLED_SPEED] = state[POSITION], state[SPEED]


@njit(cache=True)
def advance(
    state: NDArray[np.float64], p: NDArray[np.float64], duty: float, disabled: bool, until: float
) -> NDArray[np.float64]:
    """Advance the plant in place to the time `until` [s] under constant bridge inputs.

    Args:
        state: array with shape (STATE_SIZE,), changed in place.
        p: array with shape (31,), see `parameter_vector`.
        duty: signed duty, -1 to 1 (sign: DIR, size: PWM).
        disabled: level of DIS.
        until: time to reach [s], same zero as the state's time.

    Returns:
        Array with shape (n, 5), one row per whole millisecond passed: time [s], the carriage's position [m], its mean
        velocity [m/s] and acceleration [m/s²] over the millisecond, as a sensor averages, motor current [A].
    """
    first = math.floor(state[TIME] * 1000.0 + 1e-6) + 1
    last = math.floor(until * 1000.0 + 1e-6)
    rows = np.empty((max(last - first + 1, 0), HISTORY_COLUMNS))
    for k in range(first, last + 2):
        target = k * SAMPLE if k <= last else until
        remaining = target - state[TIME]
        if remaining > 0.0:
            count = math.ceil(remaining / p[P_STEP] - 1e-9)
            h = remaining / max(count, 1)
            for n in range(1, count + 1):
                _step(state, p, duty, disabled, h)
                if n % STEPS_PER_SWITCH == 0 or n == count:
                    _update_switches(state, p)
            state[TIME] = target
        if k <= last:
            row = rows[k - first]
            row[0], row[1], row[4] = target, state[POSITION], state[CURRENT]
            row[2] = (state[POSITION] - state[SAMPLED_POSITION]) / SAMPLE
            row[3] = (state[SPEED] - state[SAMPLED_SPEED]) / SAMPLE
            mark_sample(state)
    return rows
