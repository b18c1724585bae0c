"""One sine on a simulated rail: what the loop knew, what was true, and figures of both over whole periods."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import butter, sosfilt

from gsense_rig.loop.messages import DriveSine

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gsense_rig.loop.messages import Telemetry
    from gsense_rig.loop.simulated import VirtualClock

    Array = NDArray[np.float64]

MPU_ACCEL_BANDWIDTH = 44.0  # Hz, DLPF_CFG 3


@dataclass(frozen=True)
class SineRun:
    """A sine at full amplitude, whole periods.

    Attributes:
        angular_frequency: rad/s.
        loop: shape (n, 7), a row per tick: time [s], encoder position, reference, observer's velocity and acceleration,
            duty of the tick, current as read.
        truth: shape (n, 3), at the same instants: the carriage's velocity, acceleration, motor current.
        history: shape (m, 5), 1 kHz: time, the carriage's position, velocity, acceleration, motor current.
    """

    angular_frequency: float
    loop: Array
    truth: Array
    history: Array


@dataclass(frozen=True)
class Tracking:
    """How well a sine was followed."""

    rms: float  # m, at the encoder
    phase: float  # deg of the encoder behind (-) the reference
    shake: float  # m/s^2 rms of the carriage beside the sine, as the MPU-6050's 44 Hz filter passes it


def drive(clock: VirtualClock, command: int, amplitude: float, w: float, cycles: int) -> SineRun:
    """Drive a sine on a homed rail.

    Raises:
        RuntimeError: refused or ended by a fault; the message says which.
    """
    rows: list[tuple[float, ...]] = []
    truth: list[tuple[float, float, float]] = []
    histories: list[Array] = []

    def note(t: Telemetry, history: Array) -> None:
        plant = clock.hardware.plant
        rows.append((t.time, t.position, t.reference, t.velocity, t.acceleration, t.duty, t.current))
        truth.append((plant.velocity, plant.acceleration, plant.current))
        histories.append(history)

    clock.on_tick = note
    try:
        result = clock.run_command(DriveSine(command, amplitude, w, cycles))
    finally:
        clock.on_tick = None
    if not result.success:
        raise RuntimeError(f"{w:g} rad/s: {result.message}")
    return _steady(w, cycles, clock.loop.parameters.settle, np.array(rows), np.array(truth), np.concatenate(histories))


def _steady(w: float, cycles: int, settle: float, loop: Array, truth: Array, history: Array) -> SineRun:
    period = 2.0 * math.pi / w
    end = loop[-1, 0] - settle - min(period, 2.0)
    inside, true_inside = ((t > end - cycles * period) & (t <= end) for t in (loop[:, 0], history[:, 0]))
    # The filter needs to have swung in: the history keeps what came before.
    filtered = history.copy()
    filtered[:, 3] = sosfilt(butter(2, MPU_ACCEL_BANDWIDTH, fs=1000.0, output="sos"), history[:, 3])
    return SineRun(w, loop[inside], truth[inside], filtered[true_inside])


def phasor(w: float, time: Array, values: Array) -> complex:
    """Amplitude and phase of a tone over whole periods."""
    return complex(2.0 * np.mean(values * np.exp(-1j * w * time)))


def tracking(run: SineRun) -> Tracking:
    """The figures of a run."""
    time, position, reference = run.loop[:, 0], run.loop[:, 1], run.loop[:, 2]
    w = run.angular_frequency
    turn = phasor(w, time, position) / phasor(w, time, reference)
    t, a = run.history[:, 0], run.history[:, 3]
    sine = np.column_stack([np.sin(w * t), np.cos(w * t), np.ones_like(t)])
    beside = a - sine @ np.linalg.lstsq(sine, a, rcond=None)[0]
    return Tracking(
        rms=float(np.sqrt(np.mean((position - reference) ** 2))),
        phase=math.degrees(math.atan2(turn.imag, turn.real)),
        shake=float(np.std(beside)),
    )
