"""What the carriage's true rotation makes of the earth's field is no steel and no motor."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.effects.recorded import Reading, Seen
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.types import Parameter
from gsense_fusion.identification.verdict.turned_field import beyond_turns

RATE_HZ, DRIVE = 100.0, 5.0
WINDOW = Window(0, 1000, moving=True)


def _fold(turn: float) -> Any:
    """A rig that turns by so many rad to and fro."""
    t = np.arange(1000) / RATE_HZ
    rate = turn / 2 * DRIVE * np.cos(DRIVE * t)[:, None] * np.array([1.0, 0.0, 0.0])
    data = SimpleNamespace(windows=(WINDOW,), run=SimpleNamespace(rate_hz=RATE_HZ))
    predictor = SimpleNamespace(rate=lambda *_: rate)
    return SimpleNamespace(everything=(data,), predictor=predictor, models={"full": None})


def _seen(change: float, stderr: float) -> Seen:
    """A field that changes by so many tesla over the position, on y."""
    x = np.linspace(-0.15, 0.15, 25)
    fitted = np.outer(x / 0.3 * change * 1e6, [0.0, 1.0, 0.0])
    parameters = {f"d_{a}": Parameter(change * (a == "y"), stderr, "T") for a in "xyz"}
    reading = Reading(
        {**parameters, "lag_s": Parameter(0.0, 0.003, "s")},
        ("y",),
        1e-12,
        "the magnetometer's field changes with the carriage's position",
        "",
        curve=Curve(x, fitted, fitted, ("x", "y", "z"), "", "", ""),
    )
    return Seen({"mag_position": reading})


@pytest.mark.parametrize(
    ("change", "stderr", "turn", "stays"),
    [
        (5e-8, 5e-9, 1e-3, False),  # 65 microtesla turned by 1 mrad are 6.5e-8 T
        (9e-8, 1e-8, 1e-3, False),  # within its error of that
        (9e-8, 2e-9, 1e-3, True),
        (5e-8, 5e-9, 0.0, True),
        (5e-8, 5e-9, 1e-5, True),
    ],
)
def test_a_change_must_exceed_what_the_turn_makes(change: float, stderr: float, turn: float, stays: bool) -> None:
    left = beyond_turns(_seen(change, stderr), [_fold(turn)])
    assert ("mag_position" in left.readings) == stays
    assert any("turn by" in note for note in left.notes) == (not stays)
