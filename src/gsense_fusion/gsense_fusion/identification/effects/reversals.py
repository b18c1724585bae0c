"""What happens at the ends of a stroke, from positions and velocities on the sensor's grid."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gsense_fusion.identification.effects.base import step_of
from gsense_fusion.identification.types import FloatArray, Int8Array

SLOWEST = 2e-3
"""Velocity in m/s under which the carriage counts as standing."""
TURNED_M = 2e-4
"""Travel between two reversals under which neither is one: a carriage that sticks stands for a while, and the
encoder's harmonics, which end at 20 Hz, ripple about its place (4 counts)."""
FARTHEST = 40.0
"""Widths behind a reversal at which nothing is left to go where the contacts give way no later than an exponential."""


def zero_crossings(velocity: FloatArray) -> FloatArray:
    """Fractional sample numbers at which the carriage reverses, shape (r,)."""
    sign = np.sign(np.where(np.abs(velocity) < 1e-9, 1e-9, velocity))
    at = np.flatnonzero(sign[1:] != sign[:-1])
    v0, v1 = velocity[at], velocity[at + 1]
    return np.asarray(at + np.clip(v0 / (v0 - v1), 0.0, 1.0))


def mean_direction(time: FloatArray, velocity: FloatArray) -> FloatArray:
    """Sign of the velocity averaged over each sample's interval, zero at rest, shape (n,)."""
    n = len(time)
    step = np.where(velocity > 0, 1.0, -1.0)
    for x in zero_crossings(velocity):
        k = int(np.floor(x + 0.5))  # the sample in whose interval (k - 1/2, k + 1/2) the carriage reverses
        if 0 < k < n - 1:
            after = 1.0 if velocity[k + 1] > 0 else -1.0
            step[k] = after * (1.0 - 2.0 * (x - (k - 0.5)))
    return np.asarray(step * under_way(time, velocity))


@dataclass(frozen=True, eq=False)
class Travel:
    """What the carriage has travelled since it last reversed, at the edges of the samples' intervals."""

    way: FloatArray
    """m, shape (n + 1,)."""
    direction: Int8Array
    """Of the travel; zero everywhere without a reversal, shape (n + 1,)."""
    moving: Int8Array
    """One while the carriage is under way, else zero, shape (n,)."""
    step_s: float

    @staticmethod
    def of(time: FloatArray, position: FloatArray, velocity: FloatArray) -> Travel:
        """From the motion at the samples, each (n,)."""
        n = len(time)
        step = step_of(time)
        moving = under_way(time, velocity).astype(np.int8)
        edges = np.arange(n + 1) - 0.5
        bulge = np.concatenate([[0.0], (velocity[:-1] - velocity[1:]) * step / 8, [0.0]])
        at = np.interp(edges, np.arange(n), position) + bulge
        cross, where = reversals(position, velocity, step)
        if not len(cross):
            return Travel(np.zeros(n + 1), np.zeros(n + 1, dtype=np.int8), moving, step)
        ahead = np.where(np.diff(where, append=position[-1]) > 0, 1, -1).astype(np.int8)
        last = np.searchsorted(cross, edges, side="right") - 1
        known = last >= 0
        way = np.where(known, np.abs(at - where[np.maximum(last, 0)]), 1e3)
        return Travel(way, np.where(known, ahead[np.maximum(last, 0)], -ahead[0]), moving, step)

    def angle(self, width: float, ductility: float = 1.0, slack: float = 0.0) -> FloatArray:
        """A turn from -1 to 1 that follows each reversal over the travel `width` beyond a `slack`, shape (n + 1,)."""
        turned = np.ones(len(self.way))
        near = np.flatnonzero(self.way < (FARTHEST * width if ductility <= 1.0 else np.inf))
        travel = self.way[near] / width
        if slack:
            travel = np.maximum(travel - slack, 0.0) / (1.0 - slack)
        turned[near] -= to_go(travel, ductility)
        return np.asarray(self.direction * turned)

    def rate(self, width: float, ductility: float = 1.0, slack: float = 0.0) -> FloatArray:
        """Its rate, 1/s, shape (n,).

        Each sample has the mean rate over its interval: a turn shorter than a sample stays a pulse of the right area.
        """
        return np.asarray(np.diff(self.angle(width, ductility, slack)) / self.step_s * self.moving)


def to_go(travel: FloatArray, ductility: float) -> FloatArray:
    """How far the turn is from its other end after a travel in widths, from 2 to 0: Dahl's u' = -u^ductility.

    Zero: slack that is taken up evenly and then is gone; one: contacts that give way ever less (an exponential).
    """
    if abs(ductility - 1.0) < 1e-6:
        return np.asarray(2.0 * np.exp(-travel))
    power = 1.0 - ductility
    return np.asarray(np.maximum(2.0**power - power * travel, 0.0) ** (1.0 / power))


def reversals(position: FloatArray, velocity: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Sample numbers (r,) and positions (r,) of the reversals between which the carriage really travels.

    Of several zeros of the velocity about one place the one furthest out is left: the smallest way between two
    neighbours is taken out, with both of its ends, until all are long enough.
    """
    cross = zero_crossings(velocity)
    if not len(cross):
        return cross, cross
    at, where = cross.tolist(), _reversal_position(cross, position, velocity, step_s).tolist()
    way = [abs(b - a) for a, b in pairwise(where)]
    while way and min(way) < TURNED_M:
        i = way.index(min(way))
        del at[i : i + 2], where[i : i + 2]
        way[max(0, i - 1) : i + 2] = [abs(where[i] - where[i - 1])] if 0 < i < len(where) else []
    return np.array(at), np.array(where)


def _reversal_position(cross: FloatArray, position: FloatArray, velocity: FloatArray, step: float) -> FloatArray:
    """Position at fractional sample numbers between which the velocity changes sign: a parabola, not a chord."""
    k = np.floor(cross).astype(int)
    part = (cross - k) * step
    return np.asarray(position[k] + velocity[k] * part / 2)


def under_way(time: FloatArray, velocity: FloatArray) -> FloatArray:
    """One while the carriage is under way (a reversal included), else zero, shape (n,)."""
    rate = 1.0 / step_of(time)
    fast = np.flatnonzero(np.abs(velocity) > SLOWEST)
    out = np.zeros(len(velocity))
    if len(fast):
        pieces = np.split(fast, np.flatnonzero(np.diff(fast) > 0.5 * rate) + 1)
        for piece in pieces:
            out[piece[0] : piece[-1] + 1] = 1.0
    return out
