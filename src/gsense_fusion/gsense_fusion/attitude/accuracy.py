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

from .errors import heading_error, inclination_error, total_error
from .interface import FloatArray, IntArray
from .rest import is_rest

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
    for k in range(len(edges) - 4):
        part = slice(edges[k], edges[k + 4])
        if is_rest(rate[part], force[part]):
            still[part] = True
    return still


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


def aligned(estimate: FloatArray, reference: Reference, *, has_heading: bool) -> FloatArray:
    """The estimate in the reference's frames, (w, x, y, z), shape (n, 4)."""
    found, true = _rotation(estimate), _rotation(np.nan_to_num(reference.orientation, nan=0.5))
    rest = reference.rest
    heading = heading_error(estimate[rest], reference.orientation[rest])
    turn = float(np.angle(np.mean(np.exp(1j * heading))))
    if has_heading and abs(turn) > HEADING_LIMIT:
        turn = 0.0
    earth = Rotation.from_rotvec([0.0, 0.0, -turn])
    body = ((earth * found[rest]).inv() * true[rest]).mean()
    return np.asarray((earth * found * body).as_quat()[:, [3, 0, 1, 2]], dtype=np.float64)


def score(estimate: FloatArray, reference: Reference, *, has_heading: bool) -> Accuracy:
    """Accuracy of one filter's attitudes, (w, x, y, z), shape (n, 4)."""
    rows = reference.scored
    ours, true = aligned(estimate, reference, has_heading=has_heading)[rows], reference.orientation[rows]
    return Accuracy(
        _rms(inclination_error(ours, true)),
        _rms(heading_error(ours, true)),
        _rms(total_error(ours, true)),
        int(rows.sum()),
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
