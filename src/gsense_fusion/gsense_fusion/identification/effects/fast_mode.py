"""What is fast in phase with the jerk has a limit: the first mode behind it, or a filter before it.

The jerk is the first order of any fast linear response. A large one shows its second: the elastic bearings that a belt
tilts the carriage on ring at 30 to 50 Hz, a coupling through a capacitance has a corner. Both are a lag and a
frequency: 1 / (1 + i w lag - (f / f0)^2), whose two parts the data tells nearly independently.
"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, TemplateSpec
from gsense_fusion.identification.effects.g_resonance import resonant, transfer
from gsense_fusion.identification.types import ComplexArray, FloatArray


def mode_fields(name: str) -> tuple[str, str]:
    """Fields of the searched frequency in Hz and lag in s behind an effect."""
    return f"{name}_mode_hz", f"{name}_lag_s"


def mode_templates(name: str) -> tuple[TemplateSpec, ...]:
    """The searched parameters: the mode may be as slow as a mount's (a rival then); none above 200 Hz shows."""
    hz, lag = mode_fields(name)
    return (
        TemplateSpec("mode", "Hz", hz, (16.0, 28.0, 35.0, 50.0, 150.0), 10.0, 200.0, 15.0),
        TemplateSpec("lag", "s", lag, (5e-4, 1.5e-3, 3e-3, 6e-3), 2e-4, 0.015, 1e-3),
    )


def fast_jerk(name: str, drivers: Drivers) -> FloatArray:
    """The jerk, through the mode where the model has one, m/s^3, shape (n,)."""
    mode = _mode(name, drivers)
    return drivers.jerk if mode is None else resonant(drivers.time, drivers.jerk, *mode)


def fast_response(name: str, drivers: Drivers, frequency_hz: FloatArray) -> ComplexArray:
    """What it makes of an acceleration of unit amplitude, by frequency, shape (m,)."""
    mode = _mode(name, drivers)
    jerk = 2j * np.pi * frequency_hz
    return np.asarray(jerk if mode is None else jerk * transfer(frequency_hz, *mode))


def _mode(name: str, drivers: Drivers) -> tuple[float, float] | None:
    """Frequency in Hz and damping; None where the model has no mode."""
    f0, lag = (drivers.templates.get(field) for field in mode_fields(name))
    return (f0, np.pi * f0 * lag) if f0 and lag else None
