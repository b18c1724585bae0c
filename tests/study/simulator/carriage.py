"""The carriage: motor side and carriage side of a belt, friction, and a position control that follows the reference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .parameters import PlannedRun

Array = NDArray[np.float64]
STEP_S = 5e-4
OUTPUT_EVERY = 2
RATE_HZ = 1.0 / (STEP_S * OUTPUT_EVERY)
REST_S = 2.0
RAMP_S = 1.4


@dataclass(frozen=True)
class Travel:
    """Motion at 1 kHz from the run's start, each shape (n,)."""

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    force: Array
    """Of the motor, N."""


@njit(cache=True)
def _integrate(reference: Array, v_ref: Array, a_ref: Array, coulomb: float, stiction: float) -> Array:
    motor, carriage, belt, damping, viscous = 0.8, 1.2, 1.7e4, 6.0, 1.5
    kp, kd, ki = 2850.0, 120.0, 4000.0
    h = STEP_S
    xm = reference[0]
    xc = reference[0]
    vm = 0.0
    vc = 0.0
    total = 0.0
    out = np.zeros((len(reference) // OUTPUT_EVERY, 2))
    for i in range(len(reference)):
        error = reference[i] - xm
        total += ki * error * h
        u = (motor + carriage) * a_ref[i] + kp * error + kd * (v_ref[i] - vm) + total
        u = min(max(u, -60.0), 60.0)
        pull = belt * (xm - xc) + damping * (vm - vc)
        friction = (coulomb + (stiction - coulomb) * np.exp(-((vc / 0.02) ** 2))) * np.tanh(vc / 0.002) + viscous * vc
        ac = (pull - friction) / carriage
        vm += h * (u - pull) / motor
        vc += h * ac
        xm += h * vm
        xc += h * vc
        if i % OUTPUT_EVERY == 0 and i // OUTPUT_EVERY < len(out):
            out[i // OUTPUT_EVERY, 0] = xc
            out[i // OUTPUT_EVERY, 1] = u
    return out


def _envelope(t: Array, duration: float) -> Array:
    """0 at rest, 1 in full motion, smooth (quintic) ramps."""

    def smooth(x: Array) -> Array:
        y = np.clip(x, 0.0, 1.0)
        return y**3 * (10 - 15 * y + 6 * y**2)

    return smooth((t - REST_S) / RAMP_S) * smooth((duration - REST_S - t) / RAMP_S)


@lru_cache(maxsize=256)
def drive(run: PlannedRun, friction: float) -> Travel:
    """Solve the motion of a run; `friction` is the Coulomb force in N."""
    n = round(run.duration_s / STEP_S)
    t = np.arange(n) * STEP_S
    reference = run.position + run.amplitude * np.sin(run.angular_frequency * (t - REST_S)) * _envelope(
        t, run.duration_s
    )
    if run.angular_frequency == 0:
        zero = np.zeros(n // OUTPUT_EVERY)
        return Travel(t[::OUTPUT_EVERY][: len(zero)], zero + run.position, zero, zero, zero)
    v_ref = np.gradient(reference, STEP_S)
    out = _integrate(reference, v_ref, np.gradient(v_ref, STEP_S), friction, 1.4 * friction)
    # derivatives of the integrated positions themselves: the integrator's own velocity stands half a step beside them
    velocity = np.gradient(out[:, 0], 1 / RATE_HZ)
    acceleration = np.gradient(velocity, 1 / RATE_HZ)
    return Travel(t[::OUTPUT_EVERY][: len(out)], out[:, 0], velocity, acceleration, out[:, 1])
