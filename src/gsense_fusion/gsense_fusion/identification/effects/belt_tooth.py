"""Belt teeth and pulley: a ripple that is periodic in position."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import (
    Drivers,
    Effect,
    TemplateSpec,
    about_rail_axes,
    lacks_direction,
    spec,
)
from gsense_fusion.identification.effects.design import Design, Mixed
from gsense_fusion.identification.effects.fine import fine_motion
from gsense_fusion.identification.effects.reversals import under_way
from gsense_fusion.identification.types import Owner, Parameter

LEAST_FINE_HZ = 400.0
POINTS_A_WAVE = 3.0
"""Of the finer grid, at the highest frequency v / pitch."""


class BeltTooth(Effect):
    """a cos(2 pi s / pitch + phase) about the rail's axes: a frequency of v / pitch."""

    name = "belt_tooth"
    owner = Owner.RIG
    equation = "R a cos(2 pi s / pitch + phase)"
    source = "meshing of a toothed belt; pitches of 2 to 10 mm, pulleys up to 60 mm a turn"
    parameters = spec("cos_x cos_y cos_z sin_x sin_y sin_z", "rad/s", 3e-3)
    templates = (TemplateSpec("pitch", "m", "tooth_pitch_m", (), 5e-4, 0.08, 1e-5, default=5e-3),)
    separating_run = "small_stroke"
    wide_band = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Cosine and sine over position while the carriage moves, shape (n, 3, 6)."""
        return _ripple(drivers, harmonic=1, as_angle=False)

    def report(self, parameters: dict[str, Parameter]) -> dict[str, Parameter]:
        """Signed amplitude of each axis with the phase that they have in common."""
        return amplitude_and_phase(parameters)


class BeltToothAngle(Effect):
    """The part of the ripple that is constant as an angle: its rate grows with the speed."""

    name = "belt_tooth_angle"
    owner = Owner.RIG
    equation = "R v a' cos(2 pi s / pitch + phase')"
    source = BeltTooth.source
    parameters = spec("angle_cos_x angle_cos_y angle_cos_z angle_sin_x angle_sin_y angle_sin_z", "rad/m", 3e-2)
    needs = ("belt_tooth",)
    part_of = "belt_tooth"
    wide_band = True
    fields = ("tooth_pitch_m",)

    def missing(self, drivers: Drivers) -> str | None:
        """What the ripple needs."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Velocity times cosine and sine over position, shape (n, 3, 6)."""
        return _ripple(drivers, harmonic=1, as_angle=True)


class BeltToothDouble(Effect):
    """The second harmonic of the ripple: teeth are no cosines. The search buys it where it shows."""

    name = "belt_tooth_double"
    owner = Owner.RIG
    equation = "R a2 cos(4 pi s / pitch + phase2)"
    source = BeltTooth.source
    parameters = spec("double_cos_x double_cos_y double_cos_z double_sin_x double_sin_y double_sin_z", "rad/s", 1e-3)
    needs = ("belt_tooth",)
    part_of = "belt_tooth"
    bought = True
    wide_band = True
    fields = ("tooth_pitch_m",)

    def missing(self, drivers: Drivers) -> str | None:
        """What the ripple needs."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Cosine and sine over half the pitch, shape (n, 3, 6)."""
        return _ripple(drivers, harmonic=2, as_angle=False)


class BeltToothDoubleAngle(BeltToothDouble):
    """The second harmonic of the part that is constant as an angle."""

    name = "belt_tooth_double_angle"
    equation = "R v a2' cos(4 pi s / pitch + phase2')"
    parameters = spec(
        "double_angle_cos_x double_angle_cos_y double_angle_cos_z "
        "double_angle_sin_x double_angle_sin_y double_angle_sin_z",
        "rad/m",
        1e-2,
    )

    def design(self, drivers: Drivers) -> Design:
        """Velocity times cosine and sine over half the pitch, shape (n, 3, 6)."""
        return _ripple(drivers, harmonic=2, as_angle=True)


def _ripple(drivers: Drivers, harmonic: int, *, as_angle: bool) -> Mixed:
    """Cosine and sine over position, or these times the velocity, as the gyro's filter leaves them; zero at rest.

    A fast run's ripple lies beyond the sample rate: the filter takes most of it before the rest is folded down.
    """
    pitch = drivers.templates.get("tooth_pitch_m", 5e-3) / harmonic
    highest = float(np.max(np.abs(drivers.kinematics.velocity), initial=0.0)) / pitch
    fine = fine_motion(drivers, max(LEAST_FINE_HZ, POINTS_A_WAVE * highest))
    phase = 2 * np.pi * fine.position / pitch
    # what the encoder leaves of a speed at rest is no motion
    size = fine.velocity if as_angle else under_way(fine.time, fine.velocity)
    return Mixed.beside(
        [about_rail_axes(drivers, fine.sampled(f(phase) * size, drivers.response)) for f in (np.cos, np.sin)]
    )


def amplitude_and_phase(parameters: dict[str, Parameter]) -> dict[str, Parameter]:
    """cos_x, sin_x, ... as a_x, ... and one phase (of the largest), with first-order errors."""
    p = {x: complex(parameters[f"cos_{x}"].value, -parameters[f"sin_{x}"].value) for x in "xyz"}
    error = {x: float(np.hypot(parameters[f"cos_{x}"].stderr, parameters[f"sin_{x}"].stderr)) for x in "xyz"}
    # the phase that all axes share up to their signs: half the angle of the sum of squares
    phase = float(np.angle(sum(v**2 for v in p.values()))) / 2
    unit = parameters["cos_x"].unit
    largest = max(p, key=lambda x: abs(p[x]))
    if (p[largest] * np.exp(-1j * phase)).real < 0:
        phase += np.pi
    out = {f"a_{x}": Parameter(float((p[x] * np.exp(-1j * phase)).real), error[x] / np.sqrt(2), unit) for x in "xyz"}
    size = float(np.sqrt(sum(abs(v) ** 2 for v in p.values())))
    rest = {n: v for n, v in parameters.items() if not n.startswith(("cos_", "sin_"))}
    spread = error[largest] / np.sqrt(2) / size if size > 0 else float("inf")
    return {**out, **rest, "phase": Parameter(float(np.angle(np.exp(1j * phase))), spread, "rad")}
