"""Attitude at rest, rest itself, and time steps."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gsense_fusion.attitude import attitude_at_rest
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error
from gsense_fusion.attitude.initial import levelled
from gsense_fusion.attitude.rest import is_rest
from gsense_fusion.attitude.timing import StepKind, StepTimer

TURNS = Rotation.random(40, random_state=11)
FIELD = np.array([0.0, 2.0e-5, -4.5e-5])


@pytest.mark.parametrize("turn", list(TURNS))
def test_recovers_the_attitude(turn: Rotation) -> None:
    truth = turn.as_quat()[[3, 0, 1, 2]][None]
    force = turn.inv().apply([0, 0, 9.81])
    assert total_error(attitude_at_rest(force, turn.inv().apply(FIELD))[None], truth)[0] < 1e-9
    no_heading = attitude_at_rest(force)
    assert inclination_error(no_heading[None], truth)[0] < 1e-9
    other = Rotation.random(random_state=2)
    level = levelled(other.as_quat()[[3, 0, 1, 2]], force)
    assert inclination_error(level[None], truth)[0] < 1e-9
    again = levelled(level, force)
    assert total_error(again[None], level[None])[0] < 1e-7


def test_conventions() -> None:
    np.testing.assert_allclose(attitude_at_rest(np.array([0, 0, 9.81])), [1, 0, 0, 0], atol=1e-12)
    # x points to magnetic north, z up: a quarter turn to the left from east
    q = attitude_at_rest(np.array([0, 0, 9.81]), np.array([2e-5, 0, -4e-5]))
    np.testing.assert_allclose(q, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=1e-12)
    assert heading_error(q[None], np.array([[1.0, 0, 0, 0]]))[0] == pytest.approx(np.pi / 2)
    upright = attitude_at_rest(np.array([9.81, 0, 0]))  # the x axis up: its y axis points east
    np.testing.assert_allclose(Rotation.from_quat(upright[[1, 2, 3, 0]]).apply([0, 1, 0]), [1, 0, 0], atol=1e-12)
    upside = levelled(np.array([0.0, 1.0, 0.0, 0.0]), np.array([0, 0, 9.81]))
    np.testing.assert_allclose(Rotation.from_quat(upside[[1, 2, 3, 0]]).apply([0, 0, 1]), [0, 0, 1], atol=1e-9)


@pytest.mark.parametrize("force", [[0, 0, 0], [np.nan, 0, 9.8]])
def test_no_direction_is_refused(force: list[float]) -> None:
    with pytest.raises(ValueError, match="no direction in the mean specific force"):
        attitude_at_rest(np.array(force))


def test_rest_and_what_is_none() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(200) / 200
    rate = rng.normal(size=(200, 3)) * np.radians(0.05) + np.radians([18.0, -5.0, 2.0])  # an MPU-6050 with a large bias
    force = rng.normal(size=(200, 3)) * 0.04 + [0.3, 9.7, 0.5]
    assert is_rest(rate, force)
    assert is_rest(rate, np.full((200, 3), np.nan))
    assert not is_rest(rate[:5], force[:5])
    drive = np.outer(9.6 * np.sin(8 * t), [1, 0, 0])
    assert not is_rest(rate, force + drive)
    slow = np.outer(0.15 * np.sin(1.0 * t), [1, 0, 0])
    assert not is_rest(rate, force + slow)
    assert not is_rest(rate + np.outer(np.radians(2) * t, [0, 0, 1]), force)
    assert not is_rest(rate, force * 0.5)


def test_steps_and_counts() -> None:
    timer = StepTimer(longest_s=0.1)
    ms = 1_000_000
    assert timer.step(0) == (StepKind.FIRST, 0.0)
    for i in range(1, 50):
        assert timer.step(5 * ms * i) == (StepKind.NEXT, pytest.approx(0.005))
    assert timer.step(5 * ms * 53) == (StepKind.NEXT, pytest.approx(0.02))  # three samples lost
    assert (timer.counts.gaps, timer.counts.missing) == (1, 3)
    assert timer.step(5 * ms * 51)[0] is StepKind.DROP
    assert timer.step(5 * ms * 53)[0] is StepKind.DROP
    assert (timer.counts.out_of_order, timer.counts.repeated) == (1, 1)
    assert timer.step(5 * ms * 1053) == (StepKind.NEXT, 0.1)  # five seconds are not extrapolated
    assert timer.counts.missing == 3 + 999
    assert timer.step(0) == (StepKind.RESET, 0.0)
    assert timer.step(5 * ms) == (StepKind.NEXT, pytest.approx(0.005))
    assert (timer.counts.resets, timer.counts.samples) == (1, 54)


def test_a_pair_of_close_stamps_is_no_new_rhythm_and_a_new_rhythm_is_learnt() -> None:
    timer, now = StepTimer(), 0
    intervals_ms = [1] + [10] * 50 + [1, 9] + [10] * 50 + [20] * 50  # it begins with the pair, too
    timer.step(now)
    for interval in intervals_ms:
        now += interval * 1_000_000
        timer.step(now)
    assert timer.usual_s == pytest.approx(0.02)
    assert (
        timer.counts.missing == 2 * 9 + 2
    )  # two intervals until the rhythm after the first pair and the last is known
