"""A recording in blocks against the live estimator fed sample by sample: the same numbers, whatever happens."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.attitude.fusion import Fusion
from gsense_fusion.attitude.offline import Recording, run_offline
from gsense_fusion.attitude.registry import channels
from gsense_fusion.compensation import CompensationFile, GSensitivity, SpeedPickup, TemperatureBias

STEP = 5_000_000
START = 1_760_000_000_000_000_000
NAMES = ("complementary", "kalman", "madgwick", "mahony", "vqf", "bounded", "rig_aided", "gyro_only", "own")
FILE = CompensationFile(
    "s", terms=(GSensitivity(k=2e-4), TemperatureBias((1e-3, 0.0, -1e-3), 25.0, 3.0), SpeedPickup((1e-3, 0.0, 0.0)))
)


def recording(case: str, n: int = 2400) -> Recording:
    """Rest for 3 s, then the carriage moves at 4 rad/s; temperature, field, encoder beside it."""
    rng = np.random.default_rng(7)
    stamps = START + np.arange(n) * STEP
    t = np.arange(n) * STEP * 1e-9
    go = np.clip(t - 3.0, 0, 1)
    smooth = 0.15 * (go**3 * (10 - 15 * go + 6 * go**2)) * np.sin(4 * np.clip(t - 3, 0, None))
    acceleration = np.gradient(np.gradient(smooth, t), t)
    rate = rng.normal(size=(n, 3)) * 1e-3 + np.radians([0.4, -0.3, 2.0])
    force = rng.normal(size=(n, 3)) * 0.03 + [0, 0, 9.8] + acceleration[:, None] * [1.0, 0.05, 0.0]
    if case == "starts in motion":
        force[:500, 1] += 5 * np.sin(np.arange(500) * 0.3)
    if case == "no accelerometer":
        force[:] = np.nan
    if case == "gaps and disorder":
        keep = rng.random(n) > 0.02
        keep[700:760] = False
        rate[100] = np.nan
        order = np.flatnonzero(keep)
        order[900], order[901] = order[901], order[900]
        order = np.insert(order, 1200, order[1199])
        stamps, rate, force = stamps[order], rate[order], force[order]
    if case == "readings come with dropped samples":
        rate[np.arange(n) % 10 != 3] = np.nan
        rate[1480:1500] = np.nan
        stamps[1500:] -= 6_000_000_000
    if case == "clock set back":
        stamps[1500:] -= 6_000_000_000
    places = START - 1_000_000 + np.arange(n) * STEP
    position = np.round(smooth / 5e-5) * 5e-5
    slow = START + 700_000_000 + np.arange(100) * 100_000_000
    has_field = case in ("field", "late field", "readings come with dropped samples")
    fields = slow + (3_000_000_000 if case == "late field" else 0)
    return Recording(
        stamps,
        rate,
        force,
        field=(fields, np.tile([0.0, 2e-5, -4e-5], (100, 1)) + rng.normal(size=(100, 3)) * 1e-7) if has_field else None,
        temperature=(slow, 25.0 + np.arange(100) * 0.05),
        carriage=(places, position),
        carriage_velocity=np.gradient(position, STEP * 1e-9),
        own=(slow - 40_000_000, _own()) if case != "no accelerometer" else None,
    )


def _own() -> Any:
    """What a chip might say: a slow turn, with readings missing."""
    angle = np.arange(100) * 0.01
    own = np.stack([np.cos(angle), np.sin(angle) * 0.6, 0 * angle, np.sin(angle) * 0.8], axis=1)
    own[30:40] = np.nan
    return own


def live(r: Recording, fusion: Fusion) -> dict[str, list[Any]]:
    """As the node is fed: what has an older or the same stamp came before."""
    found: dict[str, list[Any]] = {}
    field = temperature = place = own = 0
    for i in range(len(r.stamp_ns)):
        newest = r.stamp_ns[: i + 1].max()
        while r.field is not None and field < len(r.field[0]) and r.field[0][field] <= newest:
            fusion.add_field(r.field[1][field])
            field += 1
        while r.own is not None and own < len(r.own[0]) and r.own[0][own] <= newest:
            fusion.add_own(r.own[1][own])
            own += 1
        while (
            r.temperature is not None
            and temperature < len(r.temperature[0])
            and r.temperature[0][temperature] <= newest
        ):
            fusion.add_temperature(r.temperature[1][temperature])
            temperature += 1
        while r.carriage is not None and place < len(r.carriage[0]) and r.carriage[0][place] <= newest:
            assert r.carriage_velocity is not None
            fusion.add_carriage(int(r.carriage[0][place]), r.carriage[1][place], r.carriage_velocity[place])
            place += 1
        for e in fusion.add_sample(int(r.stamp_ns[i]), r.angular_rate[i], r.specific_force[i], i):
            found.setdefault(e.channel, []).append((e.source, *e.quaternion, *e.angular_rate))
    return found


@pytest.mark.parametrize(
    "case",
    [
        "plain",
        "field",
        "late field",
        "starts in motion",
        "no accelerometer",
        "gaps and disorder",
        "clock set back",
        "readings come with dropped samples",
    ],
)
def test_blocks_give_the_live_numbers(case: str) -> None:
    r = recording(case)
    one, two = (Fusion(channels(NAMES, with_compensation=True), FILE) for _ in range(2))
    expected = live(r, one)
    found = run_offline(two, r)
    assert two.status.counts == one.status.counts
    assert (two.status.start, two.status.uses_field) == (one.status.start, one.status.uses_field)
    assert set(found.quaternion) == set(expected)
    if r.stamp_ns[-1] < r.stamp_ns.max():  # of a bag, all series are sorted by stamp: the encoder's cannot go back too
        expected = {name: rows for name, rows in expected.items() if not name.startswith("rig_aided")}
    for name, rows in expected.items():
        table = np.array(rows)
        np.testing.assert_array_equal(found.rows, table[:, 0])
        np.testing.assert_allclose(found.quaternion[name], table[:, 1:5], rtol=0, atol=1e-9, err_msg=name)
        np.testing.assert_allclose(found.angular_rate[name], table[:, 5:], rtol=0, atol=1e-12, err_msg=name)
    counts = one.status.counts
    if case == "gaps and disorder":
        assert (counts.out_of_order, counts.repeated) == (1, 1)
        assert counts.missing > 60
    if case == "clock set back":
        assert counts.resets == 1


def test_too_short_for_a_start_gives_nothing() -> None:
    r = recording("plain", 150)
    found = run_offline(Fusion(channels(["madgwick"], with_compensation=False)), r)
    assert not len(found.rows)
    assert not found.quaternion


def test_rig_aided_does_not_see_the_carriage_and_madgwick_does() -> None:
    r = recording("plain", 6000)
    found = run_offline(Fusion(channels(["rig_aided", "madgwick"], with_compensation=False)), r)
    tilt = {name: np.degrees(2 * np.hypot(q[:, 1], q[:, 2])) for name, q in found.quaternion.items()}
    moving = slice(800, None)
    still = {name: np.median(values[:500]) for name, values in tilt.items()}
    assert np.abs(tilt["rig_aided"] - still["rig_aided"])[moving].max() < 0.15
    assert np.abs(tilt["madgwick"] - still["madgwick"])[moving].max() > 0.3


@pytest.mark.parametrize("wrong", [1e12, 1e200, 1e308])
def test_a_position_of_no_rail_is_passed_over(wrong: float) -> None:
    r = recording("plain", 3000)
    assert r.carriage is not None
    places, position = r.carriage
    position = position.copy()
    position[[900, 1500]] = wrong, -wrong
    found = run_offline(
        Fusion(channels(["rig_aided"], with_compensation=False)), replace(r, carriage=(places, position))
    )
    (q,) = found.quaternion.values()
    tilt = np.degrees(2 * np.hypot(q[:, 1], q[:, 2]))
    assert np.abs(tilt - np.median(tilt[:500]))[800:].max() < 0.15
