"""A magnetometer's field that changes because the carriage turns in it: no steel and no motor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.magnetic import MICRO, MOTOR, POSITION
from gsense_fusion.identification.effects.recorded import Reading, Seen
from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.types import Owner

EARTH_FIELD = 65e-6
"""T: the strongest at the earth's surface (World Magnetic Model 2020: 22 to 67 microtesla)."""
SURE = 3.0
"""Standard errors by which a field's change must exceed what the turn may make of it."""


def beyond_turns(seen: Seen, folds: Sequence[Held]) -> Seen:
    """Without the magnetic findings that the rig's own rotation, as it was claimed, may make of the earth's field."""
    turn = _largest_turn(folds)
    made = {n: r for n, r in seen.readings.items() if n in (POSITION, MOTOR) and _change(r) < EARTH_FIELD * turn}
    if not made:
        return seen
    most = f"the carriage's turn by {np.degrees(turn):.2g} deg may make of the earth's field"
    notes = tuple(f"{r.symptom.partition(',')[0]}, but by no more than {most}" for r in made.values())
    return replace(
        seen, readings={n: r for n, r in seen.readings.items() if n not in made}, notes=(*seen.notes, *notes)
    )


def _largest_turn(folds: Sequence[Held]) -> float:
    """Range of the rig's true rotation within a moving window, rad."""
    largest = 0.0
    for fold in folds[:1]:
        for data in fold.everything:
            rate = fold.predictor.rate(data, fold.models["full"], frozenset({Owner.RIG}))
            for window in (w for w in data.windows if w.moving):
                turn = np.cumsum(rate[window.start : window.stop], axis=0) / data.run.rate_hz
                largest = max(largest, float(np.linalg.norm(np.ptp(turn, axis=0))))
    return largest


def _change(reading: Reading) -> float:
    """Range of the fitted field less its error, T; infinite where it is not known."""
    known = [p for p in reading.parameters.values() if p.unit.startswith("T")]
    if reading.curve is None or not known:
        return float("inf")
    size, error = (float(np.linalg.norm([getattr(p, part) for p in known])) for part in ("value", "stderr"))
    span = float(np.linalg.norm(np.ptp(reading.curve.fitted, axis=0))) / MICRO
    return span * max(0.0, 1.0 - SURE * error / size) if size else 0.0
