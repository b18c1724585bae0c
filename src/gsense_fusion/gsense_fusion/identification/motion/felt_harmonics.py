"""High orders of the carriage's acceleration from the accelerometer, where the encoder's counts do not show them.

Friction kicks the carriage at each reversal. The kick's high orders are microns for the encoder and a tenth of a m/s^2
for the accelerometer; a gyro of large g-sensitivity shows them, and without them in its driver they look like an
effect.
The low orders stay the encoder's: there gravity may turn. So does every order that the encoder knows better: its error
grows with the square of frequency. Accelerometer and gyro of one IMU have the same filter, so what the one feels is
what the other was shaken by. Above 20 Hz they are kept apart: what answers to shaking has them too (G f, squares and
cubes of the force, a coupling to the jerk, a mount, a carriage that its belt tilts), a curve of the rigid motion has
not. What lies above half the sample rate is in G f alone: of samples that fold no mode can be taken. Position and speed
stay the encoder's.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.harmonics import HIGHEST_HARMONIC_HZ, WORST_CONDITION, Harmonics
from gsense_fusion.identification.motion.phasors import Phasors
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray

FIRST_ORDER = 4
MAX_ORDERS = 160
"""To the end of the fitted band at 1 rad/s."""
CLEARLY = 5.0
"""Standard errors of an order's amplitude."""
HIGHEST_HZ = 80.0
"""A belt rings at 20 to 50 Hz; what lies above half the sample rate folds alike in gyro and accelerometer."""
APART = 2.0
"""Least distance of two orders, folded, in units of what the window resolves."""
MIN_SAMPLES = 200
SAMPLES_PER_ORDER = 5


def with_felt_orders(
    motion: CarriageMotion | None, run: CleanRun, slope: FloatArray | None, delay_s: float
) -> CarriageMotion | None:
    """The motion with the orders that the accelerometer feels clearly; the same where it says nothing.

    Args:
        motion: Of the carriage by the encoder.
        run: The sensor's samples.
        slope: d(specific force)/d(acceleration along the rail) in this run: direction and scale, shape (3,).
        delay_s: How much later than the encoder's the samples are.

    """
    if motion is None or motion.harmonics is None or motion.steady is None or slope is None:
        return motion
    time = run.time - delay_s
    inside = (time > motion.steady.start) & (time < motion.steady.stop) & run.valid
    acceleration = run.specific_force[inside] @ slope / float(slope @ slope)
    if inside.sum() < MIN_SAMPLES or not np.isfinite(acceleration).all():
        return motion
    found = _felt_orders(motion.harmonics, time[inside], acceleration, run.rate_hz)
    if found is None:
        return motion
    out = copy.copy(motion)
    frequency = found.orders * found.angular_frequency / (2 * np.pi)
    rigid, folded = frequency < HIGHEST_HARMONIC_HZ, frequency >= run.rate_hz / 2
    out.felt, out.ringing, out.folded = (_part(found, p) for p in (rigid, ~rigid & ~folded, ~rigid & folded))
    return out


def _part(harmonics: Harmonics, keep: BoolArray) -> Harmonics:
    return replace(harmonics, orders=harmonics.orders[keep], cosine=harmonics.cosine[keep], sine=harmonics.sine[keep])


def _felt_orders(encoder: Harmonics, time: FloatArray, acceleration: FloatArray, rate_hz: float) -> Harmonics | None:
    """What is to be added to the encoder's harmonics; None where it is nothing."""
    w = encoder.angular_frequency
    most = min(MAX_ORDERS, len(time) // SAMPLES_PER_ORDER, int(HIGHEST_HZ * 2 * np.pi / w))
    orders = told_apart(np.arange(1.0, most + 1), w, float(np.ptp(time)), rate_hz)
    if not len(orders):
        return None
    beyond = acceleration - encoder.acceleration_at(time)
    found = amplitudes(time - encoder.origin, w, orders.astype(np.int64), beyond)
    if found is None:
        return None
    cosine, sine, sigma = found
    known = np.isin(orders, encoder.orders)
    counts = encoder.stderr * (w * orders) ** 2
    # an order that the encoder has as well is replaced where it is known better, a new one has to be clear
    used = (orders >= FIRST_ORDER) & np.where(known, sigma < counts, np.hypot(cosine, sine) > CLEARLY * sigma)
    if not used.any():
        return None
    scale = -1.0 / (w * orders[used]) ** 2
    return replace(encoder, offset=0.0, orders=orders[used], cosine=cosine[used] * scale, sine=sine[used] * scale)


def told_apart(order: FloatArray, w: float, duration_s: float, rate_hz: float) -> FloatArray:
    """Those of some orders of the drive whose samples differ, the first first, shape (k,)."""
    folded = np.abs((order * w / (2 * np.pi) + rate_hz / 2) % rate_hz - rate_hz / 2)
    taken = np.concatenate([[0.0, rate_hz / 2], np.zeros(len(order))])
    used: list[int] = []
    for i, frequency in enumerate(folded):
        known = 2 + len(used)
        if np.abs(taken[:known] - frequency).min() * duration_s > APART:
            taken[known] = frequency
            used.append(i)
    return np.asarray(order[used])


def amplitudes(
    t: FloatArray, w: float, orders: IntArray, series: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Cosine and sine amplitudes (k,) of a series (n,) at orders of the angular frequency, and their standard errors.

    A constant, a slope and a curvature are fitted beside them. None where the samples do not tell the orders apart.
    """
    k = len(orders)
    slow = (t - t.mean()) / np.ptp(t)
    rest = np.stack([slow, slow**2])
    phasors = Phasors.of(w * t)
    *slow_sums, found = phasors.sums(np.stack([*rest, series]), orders)
    with_slow = np.array(slow_sums).T
    cross = np.concatenate([rest.sum(axis=1)[None], with_slow.real, with_slow.imag])
    matrix = np.block([[phasors.normal_matrix(orders), cross], [cross.T, rest @ rest.T]])
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return None
    if np.linalg.norm(matrix, 1) * np.linalg.norm(inverse, 1) > WORST_CONDITION:
        return None
    beta = inverse @ np.concatenate([[series.sum()], found.real, found.imag, rest @ series])
    size = beta[1 : 1 + k] - 1j * beta[1 + k : 1 + 2 * k]
    left = series - beta[0] - phasors.oscillation(size[None], orders)[0] - beta[1 + 2 * k :] @ rest
    spread_of = np.abs(np.diag(inverse)) * np.sum(left**2) / (len(t) - len(beta))
    sigma = np.sqrt((spread_of[1 : 1 + k] + spread_of[1 + k : 1 + 2 * k]) / 2)
    return beta[1 : 1 + k], beta[1 + k : 1 + 2 * k], sigma
