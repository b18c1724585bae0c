"""How the board is turned is read from any motion, not from steady sines alone."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.grouping import find_mountings
from gsense_fusion.identification.motion.mounting import (
    RunGeometry,
    common_delay,
    force_geometry,
    run_delays,
)

GRAVITY = 9.81
COUNT_M = 5e-5


def geometry(
    turned: bool,
    waves: tuple[tuple[float, float], ...],
    seed: int,
    moved: bool = True,
    late_s: float = 0.0,
    tilt: float = 0.0,
) -> RunGeometry:
    """A run of 25 s: rest, a motion of some waves (m, rad/s), rest; the board at an odd angle about the vertical.

    The carriage is tilted (rad) across the rail: the turned board feels that the other way round.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 25.0, 0.005)
    fade = np.clip(np.minimum(time - 2.0, 23.0 - time), 0.0, 2.0) / 2.0
    fade = fade**3 * (10.0 - 15.0 * fade + 6.0 * fade**2) * moved
    position = fade * sum(size * np.sin(w * time + i) for i, (size, w) in enumerate(waves))
    acceleration = np.gradient(np.gradient(position, 0.005), 0.005)
    angle = 0.3 + np.pi * turned
    along = np.array([np.cos(angle), -np.sin(angle), 0.0])
    up = np.array([-along[1] * tilt, along[0] * tilt, 1.0])
    force = GRAVITY * up + np.outer(acceleration, along) + rng.normal(0.0, 0.04, (len(time), 3))
    return force_geometry(time + late_s, force, CarriageMotion(time, COUNT_M * np.round(position / COUNT_M)))


ODD = ((0.08, 1.1), (0.05, 1.7), (0.02, 4.3))
SINE = ((0.15, 5.0),)


def test_runs_that_are_no_sines_belong_to_the_mounting_that_they_feel() -> None:
    runs = [geometry(True, ODD, 1), geometry(False, SINE, 2), geometry(True, SINE, 3), geometry(False, ODD, 4)]
    assert [r.along is None for r in runs] == [True, False, False, True]
    mountings, member = find_mountings(runs)
    assert len(mountings) == 2
    assert member[0] == member[2] != member[1] == member[3]


def test_a_session_without_any_sine_has_a_direction() -> None:
    [mounting], member = find_mountings([geometry(False, ODD, seed) for seed in (5, 6)])
    assert member == [0, 0]
    assert mounting.along == pytest.approx([np.cos(0.3), -np.sin(0.3), 0.0], abs=0.01)


def test_a_rest_has_no_heading() -> None:
    assert geometry(False, ODD, 7, moved=False).heading is None


@pytest.mark.parametrize("tilt", [0.0, 0.02])
def test_a_rest_of_the_turned_board_is_of_its_mounting(tilt: float) -> None:
    """The last run only rests: a board that is not quite level feels how it is turned, else the run before it tells."""
    turned = (False, False, True, True, False, True)
    moved = (False, True, True, True, True, False)
    order = (0, 1, 4, 2, 3, 5)
    runs = [geometry(turned[i], SINE, 20 + i, moved[i], tilt=tilt) for i in order]
    _, member = find_mountings(runs)
    assert [k == member[0] for k in member] == [not turned[i] for i in order]


def test_gravity_tells_the_mounting_of_a_rest_between_runs_of_another() -> None:
    runs = [geometry(i > 1, SINE, 30 + i, i != 3, tilt=0.02) for i in range(4)]
    _, member = find_mountings([runs[3], *runs[:3]])
    assert member[0] == member[3] != member[1] == member[2]


def test_motions_that_are_no_sines_tell_the_delay() -> None:
    late = common_delay([geometry(False, ODD, seed, late_s=0.006) for seed in (8, 9)])
    assert late.value == pytest.approx(0.006, abs=4 * late.stderr)
    assert late.stderr < 1e-3


def test_steady_sines_tell_the_delay_better() -> None:
    sine = geometry(False, SINE, 10, late_s=0.006)
    assert common_delay([sine, geometry(False, ODD, 11, late_s=0.004)]) == common_delay([sine])


def test_a_drive_that_jitters_where_it_is_fast_tells_the_delay_there() -> None:
    """A narrow filter is later the faster the drive: what slow sines hardly see is wrong where it counts."""
    slow = geometry(False, ((0.15, 1.0),), 12, late_s=0.004)
    fast = geometry(False, ((0.14, 8.0), (0.02, 7.1)), 13, late_s=0.006)
    assert slow.delay is not None
    assert fast.delay is None
    delay = common_delay([slow, fast])
    assert delay.value == pytest.approx(0.006, abs=2e-4)
    assert run_delays([slow, fast], delay)[1] == pytest.approx(0.006, abs=2e-4)


def test_a_drive_that_jitters_where_it_is_fast_tells_the_direction_of_the_rail_there() -> None:
    """One slow steady sine is felt so little that noise turns its direction by a degree."""
    slow = geometry(False, ((0.15, 1.0),), 12)
    fast = geometry(False, ((0.14, 8.0), (0.02, 7.1)), 13)
    assert slow.along is not None
    assert fast.along is None
    [mounting], _ = find_mountings([slow, fast])
    assert mounting.along == pytest.approx([np.cos(0.3), -np.sin(0.3), 0.0], abs=1e-3)


def test_steady_sines_tell_the_direction_better() -> None:
    sine, odd = geometry(False, SINE, 10), geometry(False, ODD, 11)
    [both], _ = find_mountings([sine, odd])
    [alone], _ = find_mountings([sine])
    assert both.along == pytest.approx(alone.along)
