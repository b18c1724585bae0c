"""Whether a motion is within the rail's and the drive's reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gsense_rig.control.references import Sine
from gsense_rig.control.triangle import CORNER_ACCELERATION, Triangle, triangle_is_possible

if TYPE_CHECKING:
    from gsense_rig.control.controllers import ControlLimits
    from gsense_rig.control.model import DriveModel
    from gsense_rig.control.references import Reference


@dataclass(frozen=True)
class MotionLimits:
    """Limits of motions that are accepted."""

    soft_limit: float = 0.22  # m either side of the centre; switches at 0.24, end stops at 0.30
    velocity: float = 1.35  # m/s; the thesis's fastest run has 1.2
    acceleration: float = 12.0  # m/s²; the thesis's fastest run has 9.6
    step_velocity: float = 1.0  # m/s of a step, the shortest way from rest to rest
    step_acceleration: float = 8.0  # m/s²
    hold: float = 86_400.0  # s
    park: float = -0.20  # m, where the board is turned
    cycles: int = 100_000
    samples: int = 400  # instants of ramp and period at which a motion is checked


def refuse_sine(
    amplitude: float, angular_frequency: float, cycles: int, limits: MotionLimits, model: DriveModel,
    drive: ControlLimits,
) -> str | None:  # fmt: skip
    """Return why a sine cannot be driven, or None where it can."""
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        return f"amplitude {amplitude} m is not a positive number"
    if not (math.isfinite(angular_frequency) and angular_frequency > 0.0):
        return f"angular frequency {angular_frequency} rad/s is not a positive number"
    if not 1 <= cycles <= limits.cycles:
        return f"cycles {cycles} is not within 1 to {limits.cycles}"
    if amplitude > limits.soft_limit:
        return f"amplitude {amplitude:g} m leaves the soft limits of +-{limits.soft_limit:g} m"
    sine = Sine(amplitude, angular_frequency, 1)
    return refuse_reference(sine, sine.ramp + sine.steady, limits, model, drive)


def refuse_hold(position: float, duration: float, limits: MotionLimits) -> str | None:
    """Return why a position cannot be gone to and held, or None where it can."""
    if not (math.isfinite(position) and abs(position) <= limits.soft_limit):
        return f"position {position:g} m is outside the soft limits of +-{limits.soft_limit:g} m"
    if not (math.isfinite(duration) and 0.0 <= duration <= limits.hold):
        return f"duration {duration:g} s is not within 0 to {limits.hold:g} s"
    return None


def refuse_triangle(
    position: float, amplitude: float, angular_frequency: float, duration: float, limits: MotionLimits,
    model: DriveModel, drive: ControlLimits,
) -> str | None:  # fmt: skip
    """Return why a triangle cannot be driven, or None where it can."""
    reason = refuse_hold(position, duration, limits)
    if reason is not None:
        return reason
    if not (math.isfinite(amplitude) and amplitude > 0.0):
        return f"amplitude {amplitude} m is not a positive number"
    if not (math.isfinite(angular_frequency) and angular_frequency > 0.0):
        return f"angular frequency {angular_frequency} rad/s is not a positive number"
    if abs(position) + amplitude > limits.soft_limit:
        return f"{position:g} +- {amplitude:g} m leaves the soft limits of +-{limits.soft_limit:g} m"
    if not triangle_is_possible(amplitude, angular_frequency):
        return (
            f"a triangle of {amplitude:g} m cannot turn round at {angular_frequency:g} rad/s with "
            f"{CORNER_ACCELERATION:g} m/s^2"
        )
    triangle = Triangle(amplitude, angular_frequency, 1, position)
    return refuse_reference(triangle, triangle.duration, limits, model, drive)


def refuse_reference(
    reference: Reference, span: float, limits: MotionLimits, model: DriveModel, drive: ControlLimits
) -> str | None:
    """Return what a reference asks too much of in its first `span` seconds, or None."""
    step = span / limits.samples
    points = [reference.at(k * step) for k in range(limits.samples + 1)]
    velocity = max(abs(p.velocity) for p in points)
    acceleration = max(abs(p.acceleration) for p in points)
    if velocity > limits.velocity:
        return f"peak velocity {velocity:.2f} m/s is above the limit of {limits.velocity:g} m/s"
    if acceleration > limits.acceleration:
        return f"peak acceleration {acceleration:.1f} m/s^2 is above the limit of {limits.acceleration:g} m/s^2"
    needs = [model.need(p.velocity, p.acceleration) for p in points]
    voltage, current = max(abs(n.voltage) for n in needs), max(abs(n.current) for n in needs)
    if voltage > drive.voltage:
        return f"needs {voltage:.1f} V, the drive gives {drive.voltage:g} V"
    if current > drive.current:
        return f"needs {current:.1f} A, the drive gives {drive.current:g} A"
    return None
