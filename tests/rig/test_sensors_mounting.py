"""How the board lies: gravity, acceleration and the Earth's rate in its axes."""

from __future__ import annotations

import numpy as np
import pytest
from tests.rig.sensor_unit import DEGREE, G, force, ideal, rest

from gsense_rig.sensors.mounting import MOUNTINGS, Site


@pytest.mark.parametrize(
    ("mounting", "up", "forward"),
    [
        ("0", [0, 0, 1], [1, 0, 0]),
        ("180", [0, 0, 1], [-1, 0, 0]),
        ("90", [0, 0, 1], [0, -1, 0]),
        ("tilt_x", [0, 1, 0], [1, 0, 0]),
        ("tilt_y", [-1, 0, 0], [0, 0, 1]),
    ],
)
def test_mountings_turn_gravity_and_acceleration(mounting: str, up: list[float], forward: list[float]) -> None:
    assert force(ideal(mounting=mounting), rest(0.2))[-1] == pytest.approx(G * np.array(up), abs=1e-3)
    steady = rest(0.2)
    steady[:, 3] = 2.0
    expected = G * np.array(up) + 2.0 * np.array(forward)
    assert force(ideal(mounting=mounting), steady)[-1] == pytest.approx(expected, abs=1e-3)


def test_every_mounting_name_is_tested_above() -> None:
    assert set(MOUNTINGS) == {"0", "180", "90", "tilt_x", "tilt_y"}


def test_earth_rate_turns_with_the_board() -> None:
    site = Site(latitude=50 * DEGREE, azimuth=0.0)
    north, up = 7.292115e-5 * np.cos(50 * DEGREE), 7.292115e-5 * np.sin(50 * DEGREE)
    assert site.rotation_rate() == pytest.approx([north, 0, up])
