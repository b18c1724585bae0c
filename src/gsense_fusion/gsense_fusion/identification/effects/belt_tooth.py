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
from gsense_fusion.identification.types import FloatArray, Owner, Parameter


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
        phase, passed = _phase_and_gain(drivers)
        return Mixed.beside([about_rail_axes(drivers, f(phase) * passed) for f in (np.cos, np.sin)])

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
        phase, passed = _phase_and_gain(drivers)
        speed = drivers.kinematics.velocity * passed
        return Mixed.beside([about_rail_axes(drivers, f(phase) * speed) for f in (np.cos, np.sin)])


def _phase_and_gain(drivers: Drivers) -> tuple[FloatArray, FloatArray]:
    """Phase of the ripple, and what the gyro's filter leaves of it at the moment's frequency v / pitch; zero at rest.

    Without the filter, fast runs would have a ripple beyond the sample rate folded into the band of the fit.
    """
    kin = drivers.kinematics
    pitch = drivers.templates.get("tooth_pitch_m", 5e-3)
    speed = np.abs(kin.velocity)
    passed = (speed > 0).astype(float) if drivers.response is None else drivers.response.at(speed / pitch) * (speed > 0)
    return 2 * np.pi * kin.position / pitch, np.asarray(passed)


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
