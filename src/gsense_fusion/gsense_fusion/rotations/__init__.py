"""Attitude representations and frames of the thesis's chapters 2 and 4."""

from .frames import EARTH_RATE, earth_rate, ecef_to_enu, ecef_to_ned, eci_to_ecef, enu_to_ned
from .kinematics import (
    GimbalLockError,
    dcm_from_euler,
    dcm_rate,
    euler_from_dcm,
    euler_from_quaternion,
    euler_rates,
    quaternion_from_axis,
    quaternion_from_euler,
    quaternion_product,
    quaternion_rate,
    rate_from_euler_rates,
    skew,
    transform_from_vectors,
)

__all__ = [
    "EARTH_RATE",
    "GimbalLockError",
    "dcm_from_euler",
    "dcm_rate",
    "earth_rate",
    "ecef_to_enu",
    "ecef_to_ned",
    "eci_to_ecef",
    "enu_to_ned",
    "euler_from_dcm",
    "euler_from_quaternion",
    "euler_rates",
    "quaternion_from_axis",
    "quaternion_from_euler",
    "quaternion_product",
    "quaternion_rate",
    "rate_from_euler_rates",
    "skew",
    "transform_from_vectors",
]
