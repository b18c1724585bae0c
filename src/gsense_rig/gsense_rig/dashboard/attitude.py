"""An orientation in degrees, for people to read."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Quaternion:
    """Orientation of a sensor in a frame with z up, (w, x, y, z), of unit length."""

    w: float
    x: float
    y: float
    z: float

    @classmethod
    def of(cls, w: float, x: float, y: float, z: float) -> Quaternion | None:
        """Made to unit length; None where it is no rotation (zero, or not finite)."""
        length = math.sqrt(w * w + x * x + y * y + z * z)
        if not (math.isfinite(length) and length > 1e-9):
            return None
        return cls(w / length, x / length, y / length, z / length)

    def roll_pitch_heading(self) -> tuple[float, float, float]:
        """Degrees: about x, about y (up to 90 either way), about z (REP-103)."""
        w, x, y, z = self.w, self.x, self.y, self.z
        roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
        pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
        heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return math.degrees(roll), math.degrees(pitch), math.degrees(heading)

    def inclination(self) -> float:
        """Degrees between the sensor's z axis and the vertical."""
        return 2.0 * math.degrees(math.atan2(math.hypot(self.x, self.y), math.hypot(self.w, self.z)))

    def angle_to(self, other: Quaternion) -> float:
        """Degrees of the rotation between the two."""
        a, b = self, other
        w = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z
        x = a.w * b.x - a.x * b.w - a.y * b.z + a.z * b.y
        y = a.w * b.y + a.x * b.z - a.y * b.w - a.z * b.x
        z = a.w * b.z - a.x * b.y + a.y * b.x - a.z * b.w
        return 2.0 * math.degrees(math.atan2(math.sqrt(x * x + y * y + z * z), abs(w)))
