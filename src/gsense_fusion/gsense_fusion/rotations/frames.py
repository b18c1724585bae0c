"""Earth-fixed and local frames: ECI, ECEF, NED, ENU. Thesis, chapter 2, equations 2.1 to 2.6.

Every matrix C takes a vector of the first frame to the second: `v_second = C v_first` (equation 2.4).
"""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EARTH_RATE = (1 + 365.25) / (365.25 * 24) * 2 * pi / 3600
"""rad/s, equation 2.1: one turn a day and one a year."""


def earth_rate() -> FloatArray:
    """Rate of ECEF against ECI in ECEF's axes, equation 2.2, rad/s, shape (3,)."""
    return np.array([0.0, 0.0, EARTH_RATE])


def eci_to_ecef(seconds: float) -> FloatArray:
    """C of ECI -> ECEF, `seconds` after both axes x coincided, shape (3, 3)."""
    c, s = cos(EARTH_RATE * seconds), sin(EARTH_RATE * seconds)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def ecef_to_ned(latitude: float, longitude: float) -> FloatArray:
    """C of ECEF -> north-east-down at a place (geodetic, rad), shape (3, 3)."""
    sp, cp, sl, cl = sin(latitude), cos(latitude), sin(longitude), cos(longitude)
    return np.array([[-sp * cl, -sp * sl, cp], [-sl, cl, 0.0], [-cp * cl, -cp * sl, -sp]])


def ecef_to_enu(latitude: float, longitude: float) -> FloatArray:
    """C of ECEF -> east-north-up at a place (geodetic, rad), shape (3, 3)."""
    return enu_to_ned().T @ ecef_to_ned(latitude, longitude)


def enu_to_ned() -> FloatArray:
    """C of ENU -> NED (and back): x and y change places and z changes its sign, shape (3, 3)."""
    return np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
