"""The board sways on its mount: g-sensitivity through a resonance."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from gsense_fusion.identification.effects.base import (
    Drivers,
    Effect,
    TemplateSpec,
    along_sign,
    lacks_motion,
    per_axis,
    spec,
    step_of,
)
from gsense_fusion.identification.effects.design import Design, Mixed
from gsense_fusion.identification.types import ComplexArray, FloatArray, Owner

MOST_DAMPED = 0.5
"""A mode that is damped more hardly rings; what follows late and does not ring is a delay."""


def _frequency(name: str, field: str, grid: tuple[float, ...], default: float) -> TemplateSpec:
    """A mode's own: what responds alike whatever its frequency is a derivative or a delay."""
    return TemplateSpec(name, "Hz", field, grid, 1.5, 45.0, 5.0, default=default, known_to=0.5)


def _damping(name: str, field: str, grid: tuple[float, ...]) -> TemplateSpec:
    """A mode's damping as a part of the critical one."""
    return TemplateSpec(name, "1", field, grid, 0.005, MOST_DAMPED, 0.05, default=0.1, below_upper=True)


class GResonance(Effect):
    """c times the acceleration through a second-order resonance (f0, damping); its static part is in G."""

    name = "g_resonance"
    owner = Owner.MOUNT
    equation = "c h(f0, damping) * a"
    source = "mass on an elastic mount; hot glue: 3 to 30 Hz"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s^2)", 3e-4)
    templates = (
        _frequency("f0", "resonance_hz", (2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0, 30.0), 10.0),
        _damping("damping", "resonance_damping", (0.03, 0.1, 0.3)),
    )
    separating_run = "board_turned_180"
    family = "fast"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Filtered acceleration on each axis, shape (n, 3, 3)."""
        f0 = drivers.templates.get("resonance_hz", 10.0)
        damping = drivers.templates.get("resonance_damping", 0.1)
        return per_axis(along_sign(drivers) * resonant(drivers.time, drivers.acceleration, f0, damping))

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray:
        """What the mode makes of a vibration along the rail."""
        f0 = drivers.templates.get("resonance_hz", 10.0)
        damping = drivers.templates.get("resonance_damping", 0.1)
        return np.asarray(along_sign(drivers) * transfer(frequency_hz, f0, damping)[:, None, None] * np.eye(3))


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
        return per_axis(along_sign(drivers) * resonant(drivers.time, drivers.jerk, f0, damping))

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray:
        """What the mode makes of a vibration along the rail."""
        f0 = drivers.templates.get("resonance_hz", 10.0)
        damping = drivers.templates.get("resonance_damping", 0.1)
        turn = 2j * np.pi * frequency_hz * transfer(frequency_hz, f0, damping)
        return np.asarray(along_sign(drivers) * turn[:, None, None] * np.eye(3))


class SecondMode(Effect):
    """A board sways in more than one mode: the same two columns through another resonance."""

    name = "g_resonance_second"
    owner = Owner.MOUNT
    equation = "c2 h(f2, damping2) * a + c2' d/dt (h(f2, damping2) * a)"
    source = GResonance.source
    parameters = (
        *spec("c2_x c2_y c2_z", "(rad/s)/(m/s^2)", 3e-4),
        *spec("rate2_x rate2_y rate2_z", "(rad/s)/(m/s^3)", 1e-5),
    )
    templates = (
        _frequency("f2", "resonance2_hz", (3.5, 6.0, 10.0, 15.0, 24.0), 20.0),
        _damping("damping2", "resonance2_damping", (0.05, 0.2)),
    )
    needs = ("g_resonance",)
    part_of = "g_resonance"
    bought = True

    def missing(self, drivers: Drivers) -> str | None:
        """What the resonance needs."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Mixed:
        """Filtered acceleration and jerk on each axis, shape (n, 3, 6)."""
        f0, damping = self._mode(drivers)
        sign = along_sign(drivers)
        swayed = (sign * resonant(drivers.time, x, f0, damping) for x in (drivers.acceleration, drivers.jerk))
        return Mixed.beside([per_axis(x) for x in swayed])

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray:
        """What the mode makes of a vibration along the rail."""
        sway = along_sign(drivers) * transfer(frequency_hz, *self._mode(drivers))
        both = np.stack([sway, 2j * np.pi * frequency_hz * sway], axis=1)
        return np.asarray((both[:, None, :, None] * np.eye(3)[None, :, None, :]).reshape(-1, 3, 6))

    @staticmethod
    def _mode(drivers: Drivers) -> tuple[float, float]:
        return drivers.templates.get("resonance2_hz", 20.0), drivers.templates.get("resonance2_damping", 0.1)


def transfer(frequency_hz: FloatArray, f0: float, damping: float) -> ComplexArray:
    """f0^2 / (f0^2 - f^2 + 2 i damping f0 f), shape of the frequencies."""
    return np.asarray(f0**2 / (f0**2 - frequency_hz**2 + 2j * damping * f0 * frequency_hz))


def resonant(time: FloatArray, series: FloatArray, f0: float, damping: float) -> FloatArray:
    """A series (n,) that begins and ends at rest through f0^2 / (f0^2 - f^2 + 2 i damping f0 f), shape (n,)."""
    if not series.any():
        return np.zeros(len(series))
    step = step_of(time)
    n = next_fast_len(len(series) + int(4.0 / (damping * f0) / max(step, 1e-4)), real=True)
    response = transfer(rfftfreq(n, step), f0, damping)
    return np.asarray(irfft(rfft(series, n) * response, n)[: len(series)])
