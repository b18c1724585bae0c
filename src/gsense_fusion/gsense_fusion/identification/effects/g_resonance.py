"""The board sways on its mount: g-sensitivity through a resonance."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from gsense_fusion.identification.effects.base import (
    Drivers,
    Effect,
    TemplateSpec,
    along_sign,
    lacks_motion,
    per_axis,
    spec,
)
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import FloatArray, Owner


class GResonance(Effect):
    """c times the acceleration through a second-order resonance (f0, damping); its static part is in G."""

    name = "g_resonance"
    owner = Owner.MOUNT
    equation = "c h(f0, damping) * a"
    source = "mass on an elastic mount; hot glue: 3 to 30 Hz"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^2)", 3e-4)
    templates = (
        TemplateSpec(
            "f0", "Hz", "resonance_hz", (2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0), 1.5, 45.0, 5.0, default=10.0
        ),
        TemplateSpec("damping", "1", "resonance_damping", (0.03, 0.1, 0.3), 0.005, 0.9, 0.05, default=0.1),
    )
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Filtered acceleration on each axis, shape (n, 3, 3)."""
        f0 = drivers.templates.get("resonance_hz", 10.0)
        damping = drivers.templates.get("resonance_damping", 0.1)
        return per_axis(along_sign(drivers) * resonant(drivers.time, drivers.kinematics.acceleration, f0, damping))


class RockingMount(Effect):
    """The board truly turns on its mount: the rate of the same mode's sway, a quarter of a period ahead of it."""

    name = "g_resonance_rate"
    owner = Owner.MOUNT
    equation = "c' d/dt (h(f0, damping) * a)"
    source = GResonance.source
    parameters = spec("rate_x rate_y rate_z", "(rad/s)/(m/s^3)", 1e-5)
    needs = ("g_resonance",)
    part_of = "g_resonance"
    fields = ("resonance_hz", "resonance_damping")

    def missing(self, drivers: Drivers) -> str | None:
        """What the resonance needs."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Filtered jerk on each axis, shape (n, 3, 3)."""
        f0 = drivers.templates.get("resonance_hz", 10.0)
        damping = drivers.templates.get("resonance_damping", 0.1)
        return per_axis(along_sign(drivers) * resonant(drivers.time, drivers.kinematics.jerk, f0, damping))


def resonant(time: FloatArray, series: FloatArray, f0: float, damping: float) -> FloatArray:
    """A series (n,) that begins and ends at rest through f0^2 / (f0^2 - f^2 + 2 i damping f0 f), shape (n,)."""
    n = next_fast_len(len(series) + int(4.0 / (damping * f0) / max(float(np.median(np.diff(time))), 1e-4)), real=True)
    f = np.fft.rfftfreq(n, float(np.median(np.diff(time))))
    response = f0**2 / (f0**2 - f**2 + 2j * damping * f0 * f)
    return np.asarray(irfft(rfft(series, n) * response, n)[: len(series)])
