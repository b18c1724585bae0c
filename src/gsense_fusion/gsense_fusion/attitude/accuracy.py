"""How far attitudes are from a reference: root mean squares of inclination, heading and total error.

Reference and sensor may be mounted apart, and a filter without magnetometer knows no north: a constant rotation between
them is found over the first 5 s at rest and taken out; what remains from the first motion on is scored. At rest a turn
about the vertical can be the sensor's (mounting) or the earth frame's (heading). Without a field it is taken for the
heading's, with one too while it is below `HEADING_LIMIT`, as errors of magnetometers are; else it is the mounting's.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .errors import heading_error, squared_errors
from .interface import FloatArray, IntArray
from .rest import RestLimits, is_rest

ALIGNMENT_S = 5.0
HEADING_LIMIT = radians(15.0)
_LONGEST_GAP_NS = 50_000_000
_MOVED = 0.001
BoolArray = NDArray[np.bool_]


class AccuracyError(ValueError):
    """Nothing can be scored; one line that says why."""


@dataclass(frozen=True)
class Accuracy:
    """Root mean squares, rad."""

    inclination: float
    heading: float
    total: float
    samples: int


@dataclass(frozen=True)
class Reference:
    """True attitude at the samples of a recording."""

    orientation: FloatArray
    """Body -> earth, (w, x, y, z), shape (n, 4); NaN where there is none."""
    rest: BoolArray
    """Samples of the first 5 s at rest that have a reference, shape (n,)."""
    scored: BoolArray
    """Samples from the first motion on that have one."""


def at_samples(stamp_ns: IntArray, reference_ns: IntArray, orientation: FloatArray) -> FloatArray:
    """Reference attitudes at the samples, between neighbours of at most 50 ms; NaN elsewhere, shape (n, 4)."""
    after = np.searchsorted(reference_ns, stamp_ns)
    exact = (after < len(reference_ns)) & (reference_ns[np.minimum(after, len(reference_ns) - 1)] == stamp_ns)
    lo, hi = np.clip(after - 1, 0, None), np.clip(after, None, len(reference_ns) - 1)
    lo = np.where(exact, hi, lo)
    gap = (reference_ns[hi] - reference_ns[lo]).astype(np.float64)
    inside = exact | ((reference_ns[lo] <= stamp_ns) & (reference_ns[hi] >= stamp_ns) & (gap <= _LONGEST_GAP_NS))
    share = np.divide(stamp_ns - reference_ns[lo], gap, out=np.zeros(len(gap)), where=gap > 0)[:, None]
    a, b = orientation[lo], orientation[hi]
    b = np.where(np.sum(a * b, axis=1, keepdims=True) < 0, -b, b)
    mixed = (1 - share) * a + share * b
    mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.where(inside[:, None], mixed, np.nan)


def resting(stamp_ns: IntArray, rate: FloatArray, force: FloatArray) -> BoolArray:
    """Samples in quarter seconds that no second in motion touches, shape (n,)."""
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    edges = np.searchsorted(t, np.arange(0.0, t[-1] + 0.25, 0.25))
    still = np.zeros(len(t), dtype=bool)
    for k in np.flatnonzero(_quiet(np.concatenate([rate, force], axis=1), edges)):
        part = slice(edges[k], edges[k + 4])
        if is_rest(rate[part], force[part]):
            still[part] = True
    return still


def _quiet(values: FloatArray, edges: NDArray[np.intp]) -> BoolArray:
    """Seconds (four intervals of `edges` each) whose deviations may be those of rest: a rough sieve, quick.

    Sums of squares about the values' own means lose digits, far fewer than the slack of 10 % makes up for. Whether a
    second that lacks some of its specific forces rests is not for the sieve to say: by `is_rest` it does not.
    """
    limits = RestLimits()
    most = 1.1 * np.repeat([limits.rate_deviation, limits.force_deviation], 3)
    filled = np.nan_to_num(values)
    centred = filled - filled.mean(axis=0)
    sums = [np.concatenate([np.zeros((1, 6)), np.cumsum(part, axis=0)])[edges] for part in (centred, centred**2)]
    count = (edges[4:] - edges[:-4])[:, None]
    mean, square = ((part[4:] - part[:-4]) / np.maximum(count, 1) for part in sums)
    loud = square - mean**2 > most**2
    return ~np.any(loud, axis=1)


def moving_carriage(stamp_ns: IntArray, carriage_ns: IntArray, position: FloatArray) -> BoolArray:
    """Samples at which the carriage has left the place of its start by a millimetre, or has done so before."""
    left = np.abs(position - position[0]) > _MOVED
    if not left.any():
        return np.zeros(len(stamp_ns), dtype=bool)
    first = int(np.argmax(left))
    # back to where it still stood: the encoder's last step before
    while first > 0 and position[first - 1] != position[0]:
        first -= 1
    return np.asarray(stamp_ns >= carriage_ns[max(first - 1, 0)])


def reference_of(stamp_ns: IntArray, orientation: FloatArray, moving: BoolArray) -> Reference:
    """Rest and scored samples of a reference.

    Args:
        stamp_ns: of the samples, shape (n,).
        orientation: true attitude, NaN where there is none, shape (n, 4).
        moving: samples in motion, shape (n,).

    Raises:
        AccuracyError: no rest with a reference, or no motion with one.
    """
    known = np.isfinite(orientation).all(axis=1)
    if not known.any():
        raise AccuracyError("the reference and the samples share no time")
    still = np.flatnonzero(known & ~moving)
    if not len(still):
        raise AccuracyError("no rest with a reference, by which its frame could be found")
    rest = np.zeros(len(stamp_ns), dtype=bool)
    rest[still[stamp_ns[still] - stamp_ns[still[0]] <= ALIGNMENT_S * 1e9]] = True
    first = int(np.argmax(moving)) if moving.any() else len(moving)
    scored = known & (np.arange(len(moving)) >= first)
    if not scored.any():
        raise AccuracyError("no motion with a reference")
    return Reference(orientation, rest, scored)


def _rotation(quaternion: FloatArray) -> Rotation:
    return Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])


def _alignment(estimate: FloatArray, reference: Reference, *, has_heading: bool) -> tuple[Rotation, Rotation]:
    """Constant turns (earth, body) after which earth * estimate * body is in the reference's frames."""
    rest = reference.rest
    found, true = estimate[rest], reference.orientation[rest]
    turn = float(np.angle(np.mean(np.exp(1j * heading_error(found, true)))))
    if has_heading and abs(turn) > HEADING_LIMIT:
        turn = 0.0
    earth = Rotation.from_rotvec([0.0, 0.0, -turn])
    return earth, ((earth * _rotation(found)).inv() * _rotation(true)).mean()


def aligned(estimate: FloatArray, reference: Reference, *, has_heading: bool) -> FloatArray:
    """The estimate in the reference's frames, (w, x, y, z), shape (n, 4)."""
    earth, body = _alignment(estimate, reference, has_heading=has_heading)
    return np.asarray((earth * _rotation(estimate) * body).as_quat()[:, [3, 0, 1, 2]], dtype=np.float64)


def score(estimate: FloatArray, reference: Reference, *, has_heading: bool) -> Accuracy:
    """Accuracy of one filter's attitudes, unit (w, x, y, z), shape (n, 4)."""
    earth, body = (_wxyz(turn) for turn in _alignment(estimate, reference, has_heading=has_heading))
    squares = squared_errors(
        np.ascontiguousarray(estimate),
        np.ascontiguousarray(reference.orientation),
        np.ascontiguousarray(reference.scored),
        earth,
        body,
    )
    count = int(reference.scored.sum())
    inclination, heading, total = np.sqrt(np.array(squares) / count).tolist()
    return Accuracy(inclination, heading, total, count)


def _wxyz(turn: Rotation) -> tuple[float, ...]:
    x, y, z, w = turn.as_quat().tolist()
    return (w, x, y, z)
