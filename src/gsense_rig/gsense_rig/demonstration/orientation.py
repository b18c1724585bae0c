"""The published orientation's error while the carriage only translates: true rate zero, true vertical constant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import yaml

Array = npt.NDArray[np.float64]
CUTOFF = 5.0
"""Hz."""


@dataclass(frozen=True)
class Track:
    """What one orientation topic said."""

    time: Array
    """s, shape (n,)."""
    rate: Array
    """rad/s, shape (n, 3)."""
    quaternion: Array
    """Body to world, (w, x, y, z), shape (n, 4)."""


@dataclass(frozen=True)
class OrientationError:
    """Root mean squares."""

    rate: float
    """rad/s, three axes, below 5 Hz, about the mean."""
    tilt: float
    """rad, against the vertical at rest before the motion."""


@dataclass(frozen=True)
class LiveErrors:
    """Of the live node's two outputs over one motion."""

    before: OrientationError
    after: OrientationError
    less_reference: float | None
    """Rate error (rad/s) of the compensated output less the rig's true turning; None where none was found."""


@dataclass(frozen=True)
class Reference:
    """The rig's true rotation by position about the rail's axes, a polynomial; the board lies along them."""

    powers: Mapping[int, Array]
    """Coefficients by power of the position, rad/m^power, each shape (3,)."""

    def rate(self, time: Array, position: Array, velocity: Array, wanted: Array) -> Array:
        """Angular rate at the times `wanted`, shape (n, 3), from the carriage's motion at `time`."""
        if time.size < 2:
            raise ValueError("too few samples of the carriage's motion arrived")
        s, v = np.interp(wanted, time, position)[:, None], np.interp(wanted, time, velocity)[:, None]
        slopes = (power * s ** (power - 1) * coefficient for power, coefficient in self.powers.items())
        turning: Array = v * sum(slopes, np.zeros(3))
        return turning


def read_reference(path: Path) -> Reference | None:
    """The rail's turning by a compensation file; None where it has none."""
    terms = (yaml.safe_load(path.read_text(encoding="utf-8")) or {}).get("reference") or []
    for term in terms:
        if term.get("effect") == "rail_curvature":
            keys = {{"t": "1", "u": "2"}.get(key, key[1:]): key for key in term if key != "effect"}
            return Reference({int(n): np.array(term[key], dtype=float) for n, key in keys.items()})
    return None


def orientation_error(track: Track, start: float, stop: float) -> OrientationError:
    """The error from `start` to `stop` (s, of `track.time`); what is before `start` was at rest.

    Raises:
        ValueError: there are not enough samples.
    """
    moving = (track.time >= start) & (track.time <= stop)
    rest = track.time < start
    if moving.sum() < 100 or rest.sum() < 20:
        raise ValueError("too few samples of the orientation arrived")
    period = float(np.median(np.diff(track.time)))
    rate = low_passed(track.rate[moving] - track.rate[moving].mean(axis=0), 1.0 / period)
    up = vertical(track.quaternion)
    upright = up[rest].mean(axis=0)
    upright /= np.linalg.norm(upright)
    sine = np.linalg.norm(np.cross(up[moving], upright), axis=1)
    tilt = np.arctan2(sine, up[moving] @ upright)
    return OrientationError(float(np.sqrt(np.mean(rate**2))), float(np.sqrt(np.mean(tilt**2))))


def low_passed(signal: Array, rate_hz: float) -> Array:
    """Zero-phase brick-wall low-pass of columns, shape (n, m)."""
    spectrum = np.fft.rfft(signal, axis=0)
    spectrum[np.fft.rfftfreq(signal.shape[0], 1.0 / rate_hz) > CUTOFF] = 0.0
    return np.fft.irfft(spectrum, signal.shape[0], axis=0)


def vertical(quaternion: Array) -> Array:
    """The world's z axis in body axes, shape (n, 3): last row of the rotation matrices."""
    w, x, y, z = quaternion.T
    return np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
