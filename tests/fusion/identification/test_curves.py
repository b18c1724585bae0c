"""Each finding's fitted curve lies on its data."""

from __future__ import annotations

import numpy as np
import pytest
from tests.fusion.identification.sessions import BOW, LATE, TEMPERATURE, analysed
from tests.study.simulator import Disturbance

from gsense_fusion.report.figures import figures


@pytest.mark.parametrize(
    ("disturbance", "effect", "label"),
    [
        (BOW, "rail_curvature", "phase of the drive"),
        (LATE, "time_offset", "phase of the drive"),
        (TEMPERATURE, "temperature_bias", "time in the session"),
    ],
)
def test_a_finding_has_its_curve_over_its_data(disturbance: Disturbance, effect: str, label: str) -> None:
    result = analysed(disturbance)
    assert set(result.plots.curves) == {f.effect for f in result.findings} == {effect}
    curve = result.plots.curves[effect]
    assert curve.x_label.startswith(label)
    assert np.all(np.diff(curve.x) > 0)
    assert curve.measured.shape == curve.fitted.shape == (len(curve.x), 3)
    axis = int(np.argmax(np.ptp(curve.fitted, axis=0)))
    assert np.corrcoef(curve.measured[:, axis], curve.fitted[:, axis])[0, 1] > (
        0.6 if effect == "time_offset" else 0.85
    )
    (drawn,) = (f for f in figures(result) if f.key == effect)
    assert drawn.title == f"{effect}: data and fitted curve"
    assert "the finding" in drawn.svg


def test_a_bent_rail_follows_the_velocity() -> None:
    """Largest where the carriage passes the centre: at phases 0 and 180 degrees."""
    curve = analysed(BOW).plots.curves["rail_curvature"]
    axis = int(np.argmax(np.ptp(curve.fitted, axis=0)))
    velocity = np.cos(np.radians(curve.x))
    assert abs(np.corrcoef(curve.fitted[:, axis], velocity)[0, 1]) > 0.8
