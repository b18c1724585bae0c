"""A narrow filter of the IMU, from what it leaves of the low orders of the carriage's acceleration.

Accelerometer and gyro of one IMU have the same filter. At 5 Hz it takes a seventh off the third order of a drive of
8 rad/s, and delays it by more than the first: without it in the driver of G f the rest looks like a resonance. The
low orders stay the encoder's, as gravity may turn there; they pass through the one filter that all runs agree on.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.felt_harmonics import MIN_SAMPLES, amplitudes
from gsense_fusion.identification.motion.harmonics import Harmonics
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import ComplexArray, FloatArray

HIGHEST_ORDER = 3
CORNERS_HZ = (2.0, 25.0)
"""A wider one does nothing to these orders."""
START_HZ = 8.0
LEAST_GAIN = 30.0
"""In twice the log-likelihood over a delay alone."""
OWN_LATE_S = 3e-4
"""By how much a run's delay may differ from the others': clocks wander."""
PART = 1e-3
"""Of an amplitude, beside its noise."""
GRAVITY_TURNS = 0.1
"""1/s^2: what gravity along a bowed rail (0.6 deg/m) adds to the acceleration, over the square of frequency."""


@dataclass(frozen=True)
class NarrowFilter:
    """A low-pass of second order."""

    corner: float
    """rad/s."""
    damping: float

    def transfer(self, angular_frequency: FloatArray) -> ComplexArray:
        """Amplitude and phase at rad/s, the delay at low frequencies excepted."""
        x = angular_frequency / self.corner
        return np.asarray(np.exp(2j * self.damping * x) / (1.0 - x**2 + 2j * self.damping * x))


@dataclass(frozen=True, eq=False)
class _Orders:
    """One run's low orders: what was felt over what the encoder says."""

    w: FloatArray
    """rad/s, shape (k,)."""
    ratio: ComplexArray
    error: FloatArray
    delay_s: float
    """That was taken out already."""


@dataclass(frozen=True)
class RunFelt:
    """What one run brings: the encoder's motion, the sensor's samples, direction and delay."""

    motion: CarriageMotion | None
    run: CleanRun
    slope: FloatArray | None
    """d(specific force)/d(acceleration along the rail), shape (3,)."""
    delay_s: float


def through_narrow_filter(runs: Sequence[RunFelt]) -> list[CarriageMotion | None]:
    """The runs' motions, their acceleration and jerk as a narrow filter leaves them; the same where there is none."""
    seen = [_orders(r) for r in runs]
    known = [o for o in seen if o is not None]
    found = _fitted(known) if known else None
    if found is None:
        return [r.motion for r in runs]
    narrow, lates = found
    late = iter(lates)
    return [r.motion if o is None else _filtered(r.motion, narrow, next(late)) for r, o in zip(runs, seen, strict=True)]


def _orders(felt: RunFelt) -> _Orders | None:
    motion, run, slope = felt.motion, felt.run, felt.slope
    if motion is None or motion.harmonics is None or motion.steady is None or slope is None:
        return None
    encoder = motion.harmonics.lowest(HIGHEST_ORDER)
    time = run.time - felt.delay_s
    inside = (time > motion.steady.start) & (time < motion.steady.stop) & run.valid
    acceleration = run.specific_force[inside] @ slope / float(slope @ slope)
    if inside.sum() < MIN_SAMPLES or not np.isfinite(acceleration).all():
        return None
    t = time[inside] - encoder.origin
    found = amplitudes(t, encoder.angular_frequency, encoder.orders.astype(np.int64), acceleration)
    if found is None:
        return None
    cosine, sine, sigma = found
    w = encoder.orders * encoder.angular_frequency
    own = -(w**2) * (encoder.cosine - 1j * encoder.sine)
    error = np.hypot(sigma, encoder.stderr * w**2) / np.abs(own)
    return _Orders(
        w, (cosine - 1j * sine) / own, np.sqrt(error**2 + PART**2 + (GRAVITY_TURNS / w**2) ** 2), felt.delay_s
    )


def _fitted(runs: Sequence[_Orders]) -> tuple[NarrowFilter, FloatArray] | None:
    """The filter and what to add to each run's delay beside it, s; None where a delay alone does as well."""
    taken = np.array([o.delay_s for o in runs])

    def lates(x: FloatArray) -> FloatArray:
        return np.asarray(x[1] + x[2 : 2 + len(runs)] - taken)

    def missed(x: FloatArray, narrow: NarrowFilter | None) -> FloatArray:
        out = [x[2 : 2 + len(runs)] / OWN_LATE_S]
        for o, late in zip(runs, lates(x), strict=True):
            through = np.exp(x[0] - 1j * o.w * late) * (1.0 if narrow is None else narrow.transfer(o.w))
            out.append(((o.ratio - through) / o.error).view(float))
        return np.concatenate(out)

    def filtered(x: FloatArray) -> FloatArray:
        return missed(x[:-2], NarrowFilter(*np.exp(x[-2:])))

    start = np.concatenate([[0.0, np.median(taken)], np.zeros(len(runs))])
    plain = least_squares(missed, start, x_scale="jac", args=(None,))
    logs = np.log([2 * np.pi * START_HZ, np.sqrt(0.5)])
    found = least_squares(filtered, np.concatenate([start, logs]), x_scale="jac")
    narrow = NarrowFilter(*(float(v) for v in np.exp(found.x[-2:])))
    inside = CORNERS_HZ[0] < narrow.corner / (2 * np.pi) < CORNERS_HZ[1]
    if not inside or 2 * (plain.cost - found.cost) < LEAST_GAIN:
        return None
    return narrow, lates(found.x)


def _filtered(motion: CarriageMotion | None, narrow: NarrowFilter, late_s: float) -> CarriageMotion | None:
    """What is felt of the encoder's orders; those that the accelerometer told have passed the filter already."""
    if motion is None or motion.harmonics is None:
        return motion
    encoder, felt = motion.harmonics, motion.felt
    told = np.zeros(0) if felt is None else felt.orders
    keep = ~np.isin(encoder.orders, told)
    w = encoder.orders[keep] * encoder.angular_frequency
    size = encoder.cosine[keep] - 1j * encoder.sine[keep]
    change = size * (narrow.transfer(w) * np.exp(-1j * w * late_s) - 1.0)
    out = copy.copy(motion)
    out.felt = _joined(encoder, encoder.orders[keep], change, felt)
    return out


def _joined(encoder: Harmonics, orders: FloatArray, size: ComplexArray, felt: Harmonics | None) -> Harmonics:
    if felt is not None:
        orders = np.concatenate([orders, felt.orders])
        size = np.concatenate([size, felt.cosine - 1j * felt.sine])
    return replace(encoder, offset=0.0, orders=orders, cosine=size.real, sine=-size.imag)
