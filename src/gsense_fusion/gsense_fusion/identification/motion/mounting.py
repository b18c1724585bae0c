"""How the board sits on the carriage in a run and how late its samples are: from gravity and the accelerometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.harmonics import Harmonics, Kinematics, least_squares
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import GRAVITY, FloatArray

ROUGH_HEADING_RAD = 0.1
LEAST_SAMPLES = 100
FELT = 0.5
"""Of the carriage's acceleration, in the accelerometer's reading: less is a sensor that does not ride on it."""
DELAY_ITERATIONS = 4
PROBE_S = 2e-3
CLEAR_ENOUGH = 0.1
"""Part of a jerk that must be the motion's."""
OWN_DELAY_STDERR_S = 3e-4
"""Runs whose delay is known better than this say how much the runs scatter."""
STEADY_ENOUGH = 0.5  # of the error that steady sines leave: what other runs must better
WANDERING_DELAY_S = 2e-3
"""A delay that differs by more from run to run is no chain's: encoder and IMU have clocks that drift apart."""


@dataclass(frozen=True)
class Delay:
    """How much later than the encoder's the IMU's samples are, s."""

    value: float
    stderr: float


@dataclass(frozen=True)
class Mounting:
    """One way the board was mounted; unit vectors in the sensor's axes, shape (3,)."""

    up: FloatArray
    along: FloatArray | None
    """Direction of the rail (positive position); None where no run of this mounting moved."""
    gravity: float = GRAVITY
    """Mean norm of the specific force at rest, m/s^2."""

    @cached_property
    def sensor_from_rail(self) -> FloatArray | None:
        """Rotation from rail axes (x along the rail, z up) to the sensor's axes, shape (3, 3)."""
        if self.along is None:
            return None
        x = self.along / np.linalg.norm(self.along)
        z = self.up - x * float(x @ self.up)
        z /= np.linalg.norm(z)
        return np.column_stack([x, np.cross(z, x), z])


NOMINAL = Mounting(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""How the rig's board lies: assumed where no accelerometer tells."""


@dataclass(frozen=True)
class Heading:
    """What a motion that is no steady sine tells: the rail's direction in the sensor's axes, roughly, and the delay."""

    along: FloatArray
    """Unit vector, shape (3,)."""
    stderr: float
    """Of its angle, rad."""
    delay: Delay | None
    """None where the encoder's noise hides it."""


@dataclass(frozen=True)
class RunGeometry:
    """Accelerometer against encoder in one run."""

    mean_force: FloatArray
    """Specific force without the drive, m/s^2, shape (3,)."""
    along: FloatArray | None
    """d(specific force)/d(acceleration along the rail), shape (3,); its norm is the accelerometer's scale."""
    delay: Delay | None
    heading: Heading | None = None
    """Where the rail's direction is known from a motion that is no steady sine."""
    along_stderr: float = float("inf")
    """Of the angle of `along`, rad."""

    @property
    def own_delay(self) -> Delay | None:
        """Of the steady sine, else of the motion as it is."""
        return self.delay or (self.heading.delay if self.heading else None)


def run_geometry(run: CleanRun, motion: CarriageMotion | None) -> RunGeometry:
    """Rest direction, rail direction and delay of one run, by regression of the specific force on [1, a, j]."""
    if motion is None or not np.isfinite(run.specific_force).all():
        return RunGeometry(np.asarray(np.mean(run.specific_force, axis=0)), None, None)
    return force_geometry(run.time[run.valid], run.specific_force[run.valid], motion)


def force_geometry(time: FloatArray, force: FloatArray, motion: CarriageMotion) -> RunGeometry:
    """The same from valid samples: times in s (n,), specific force in m/s^2 (n, 3)."""
    if not np.isfinite(force).all():
        return RunGeometry(np.full(3, np.nan), None, None)
    if motion.steady is None or motion.harmonics is None:
        heading = _heading(time, force, motion) or _heading(time, force, motion.slowly())
        return RunGeometry(np.asarray(np.mean(force, axis=0)), None, None, heading)
    inside = (time >= motion.steady.start + 0.1) & (time <= motion.steady.stop - 0.1)
    # friction kicks at the reversals have harmonics that the encoder cannot show: the lowest orders alone are sure
    steady = motion.harmonics.lowest(3)
    felt = _felt(time[inside], force[inside], steady)
    if felt is None:
        return RunGeometry(np.asarray(np.mean(force[inside], axis=0)), None, None)
    return RunGeometry(felt.mean, felt.slope, felt.delay, along_stderr=felt.angle_stderr)


@dataclass(frozen=True, eq=False)
class _Felt:
    """Specific force against a motion: f = mean + slope a(t - delay)."""

    mean: FloatArray
    slope: FloatArray
    delay: Delay
    kinematics: Kinematics
    noise: float
    """Standard deviation of what is left, m/s^2."""

    @property
    def angle_stderr(self) -> float:
        """Of the slope's direction, rad."""
        size = float(np.linalg.norm(self.slope)) * float(np.sqrt(np.sum(self.kinematics.acceleration**2)))
        return self.noise / max(size, 1e-12)


def _felt(
    time: FloatArray, force: FloatArray, motion: CarriageMotion | Harmonics, clarity: float = 1.0
) -> _Felt | None:
    """The motion is moved until nothing of the force is left on its jerk; None for what is not on this carriage.

    Args:
        time: Of the samples, s, shape (n,).
        force: Specific force, m/s^2, shape (n, 3).
        motion: Of the carriage.
        clarity: Part of the motion's jerk that is no noise of the encoder.

    """
    delay = 0.0
    for _ in range(DELAY_ITERATIONS):
        kin = motion.at(time - delay)
        X = np.column_stack([np.ones(len(time)), kin.acceleration, kin.jerk])
        beta = least_squares(X, force)
        size = float(beta[1] @ beta[1])
        if size < FELT**2:
            return None
        # f(t - d) = f(t) - d f'(t): the coefficient on the jerk along the rail is -d
        delay -= float(beta[2] @ beta[1]) / size / clarity
    noise = float(np.sqrt(np.mean(np.var(force - X @ beta, axis=0))))
    stderr = noise / np.sqrt(size * float(np.sum(kin.jerk**2))) / clarity
    return _Felt(beta[0], beta[1], Delay(delay, stderr), kin, noise)


def _clarity(time: FloatArray, force: FloatArray, motion: CarriageMotion) -> float:
    """Part of the motion's jerk that is no noise of the encoder: how far a known shift shows in the regression."""
    late = []
    for shift in (-PROBE_S, PROBE_S):
        kin = motion.at(time - shift)
        beta = least_squares(np.column_stack([np.ones(len(time)), kin.acceleration, kin.jerk]), force)
        late.append(-float(beta[2] @ beta[1]) / max(float(beta[1] @ beta[1]), 1e-12))
    return (late[0] - late[1]) / (2 * PROBE_S)


def _heading(time: FloatArray, force: FloatArray, motion: CarriageMotion) -> Heading | None:
    """From the band-limited acceleration of any motion; None where it does not tell the direction.

    What is left of the encoder's noise in the acceleration makes the slope smaller and turns it nowhere; in the jerk it
    makes the steps towards the delay shorter.
    """
    if motion.moving is None:
        return None
    inside = (time >= motion.moving.start) & (time <= motion.moving.stop)
    if inside.sum() < LEAST_SAMPLES:
        return None
    clarity = _clarity(time[inside], force[inside], motion)
    felt = _felt(time[inside], force[inside], motion, max(clarity, CLEAR_ENOUGH))
    if felt is None:
        return None
    delay, stderr = felt.delay if clarity > CLEAR_ENOUGH else None, felt.angle_stderr
    return Heading(felt.slope / np.linalg.norm(felt.slope), stderr, delay) if stderr < ROUGH_HEADING_RAD else None


def common_delay(geometry: Sequence[RunGeometry]) -> Delay:
    """Weighted mean of the runs' delays; zero with infinite uncertainty where no run moves.

    The steady sines tell it, unless all of them are slow: then what moves faster (a drive that jitters) does.
    """
    steady = _mean([g.delay for g in geometry if g.delay is not None])
    every = _mean([d for g in geometry if (d := g.own_delay) is not None])
    return every if every.stderr < STEADY_ENOUGH * steady.stderr else steady


def _mean(known: Sequence[Delay]) -> Delay:
    if not known:
        return Delay(0.0, float("inf"))
    weight = np.array([1.0 / d.stderr**2 for d in known])
    return Delay(float(np.average([d.value for d in known], weights=weight)), float(1.0 / np.sqrt(weight.sum())))


def run_delays(geometry: Sequence[RunGeometry], common: Delay) -> list[float]:
    """Delay of each run: its own as far as it is known better than the runs scatter, else the common one, s.

    A driver's clock model has an error of its own in every run; at 8 rad/s a tenth of a millisecond is already seen.
    """
    own = [g.own_delay for g in geometry]
    excess = [(d.value - common.value) ** 2 - d.stderr**2 for d in own if d and d.stderr < OWN_DELAY_STDERR_S]
    spread = float(np.sqrt(max(float(np.mean(excess)), 0.0))) if excess else 0.0
    out = []
    for late in own:
        weight = 0.0 if late is None or spread == 0.0 else spread**2 / (spread**2 + late.stderr**2)
        out.append(common.value if late is None else common.value + weight * (late.value - common.value))
    return out


def wandering_delay(geometry: Sequence[RunGeometry]) -> str | None:
    """A line for the report where encoder and IMU were stamped by clocks that drift apart; else None."""
    known = [g.delay.value for g in geometry if g.delay is not None and g.delay.stderr < OWN_DELAY_STDERR_S]
    if len(known) < 2 or max(known) - min(known) < WANDERING_DELAY_S:
        return None
    between = f"between {1e3 * min(known):.1f} and {1e3 * max(known):.1f} ms"
    return f"the encoder's delay lies {between}, run by run: two clocks drift apart; synchronise them"
