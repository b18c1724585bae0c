"""The causal application: signs, delays, lags, gaps; the compiled kernel against the plain oracle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.compensation import (
    AccelerometerCorrection,
    CompensationFile,
    Compensator,
    FrictionPickup,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    JerkCoupling,
    MagnetometerCorrection,
    ScaleMisalignment,
    SpeedPickup,
    SupplyVoltage,
    TemperatureBias,
    compensate,
    corrected_field,
    corrected_force,
)
from gsense_fusion.identification.drivers import lagged_temperature
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import Role

from .oracle import Oracle

G = ((1e-3, 2e-5, -3e-4), (4e-4, -5e-4, 6e-4), (7e-4, 8e-4, 9e-4))
D = (0.36, 0.48, 0.8)
C = (1e-3, -2e-3, 3e-3)


def test_signs_of_equation_7_4() -> None:
    """omega_x -= k a_y, omega_y -= k a_z, omega_z -= k a_x."""
    file = CompensationFile("s", terms=(GSensitivity(k=0.1),))
    rate = Compensator(file).update(0, np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 30.0]))
    np.testing.assert_allclose(rate, [1.0 - 2.0, 2.0 - 3.0, 3.0 - 1.0])


def _session(n: int = 450) -> tuple[Any, Any, Any, Any]:
    rng = np.random.default_rng(2)
    stamp = np.cumsum(rng.integers(4_000_000, 6_500_000, n)) + 1_760_000_000_000_000_000
    stamp[300:] += 400_000_000  # a gap
    temperature = (stamp[20::25] + 1_000_000, 25 + np.cumsum(rng.normal(size=len(stamp[20::25]))))
    return stamp, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)) * 5 + [0, 0, 9.8], temperature


ALL_TERMS = (
    GSensitivity(matrix=G),
    GSquared(c=C, direction=D),
    GSquared(matrix=G),
    GSquared(c=C, direction=D, higher=(1e-6, -2e-6, 5e-7)),
    GCubed(c=C, direction=D),
    GCubed(c=C, direction=D, higher=(-1e-8, 0.0, 3e-8)),
    GCubed(matrix=G),
    JerkCoupling(c=C, direction=D),
    JerkCoupling(matrix=G),
    JerkCoupling(c=C, direction=D, lag_s=0.007),
    GResonance(C, D, 9.0, 0.07),
    GResonance(C, D, 6.0, 0.2, rate=(2e-5, 1e-5, -3e-5)),
    TemperatureBias(C, 25.0, 3.0),
    TemperatureBias(C, 20.0),
    SupplyVoltage(C, 3.7),
    FrictionPickup(C),
    FrictionPickup(C, 0.5),
    SpeedPickup(C),
    ScaleMisalignment(((0.01, 0.002, 0.0), (0.0, -0.02, 0.003), (0.001, 0.0, 0.015))),
)


def _fed(
    file: CompensationFile, series: list[tuple[Any, Any]], stamp: Any, rate: Any, force: Any, cut: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Compensator and oracle sample by sample; at `cut` the state moves to another compensator."""
    live, oracle, fed = Compensator(file), Oracle(file), [0, 0, 0]
    out, want = [], []
    for i in range(len(stamp)):
        for k, (stamps, values) in enumerate(series):
            while fed[k] < len(stamps) and stamps[fed[k]] <= stamp[i]:
                (live.set_temperature, live.set_supply, live.set_carriage_velocity)[k](values[fed[k]])
                setattr(oracle, ("reading", "volts", "velocity")[k], values[fed[k]])
                fed[k] += 1
        if i == cut:
            live = Compensator(file, live.state.copy())
        out.append(live.update(int(stamp[i]), rate[i], force[i]))
        want.append(oracle.update(int(stamp[i]), rate[i], force[i]))
    return np.array(out), np.array(want)


@pytest.mark.parametrize("delay", [0.0, 0.0123, -0.01])
@pytest.mark.parametrize("term", [*ALL_TERMS, None], ids=lambda t: "all" if t is None else t.effect)
def test_batch_equals_sample_by_sample_and_the_oracle(term: Any, delay: float) -> None:
    stamp, rate, force, temperature = _session()
    force[400:405] = np.nan
    supply = (stamp[30::200], np.linspace(4.9, 2.6, len(stamp[30::200])))
    carriage = (stamp[10::3] - 1_000_000, np.sin(np.arange(len(stamp[10::3])) * 0.1))
    file = CompensationFile("s", terms=ALL_TERMS if term is None else (term,), gyro_delay_s=delay)
    live, want = _fed(file, [temperature, supply, carriage], stamp, rate, force, cut=250)
    batch = compensate(file, stamp, rate, force, temperature, supply, carriage)
    np.testing.assert_array_equal(batch, live)
    np.testing.assert_allclose(batch, want, atol=1e-9, rtol=1e-9)
    assert np.abs(batch - rate).max() > 1e-3


def test_delay_uses_the_specific_force_of_then() -> None:
    stamp = np.arange(100) * 5_000_000
    force = np.zeros((100, 3))
    force[:, 0] = np.arange(100.0)
    file = CompensationFile("s", terms=(GSensitivity(matrix=((1, 0, 0), (0, 0, 0), (0, 0, 0))),), gyro_delay_s=0.02)
    taken = -compensate(file, stamp, np.zeros((100, 3)), force)[:, 0]
    np.testing.assert_allclose(taken[10:], np.arange(6.0, 96.0), atol=1e-9)


@pytest.mark.parametrize("frequency", [2.0, 8.0])
def test_the_current_of_inertia_follows_the_carriage(frequency: float) -> None:
    inertia, amplitude = 2.0, 0.15
    t = np.arange(0.0, 10.0, 0.005)
    stamp = (t * 1e9).astype(np.int64)
    acceleration = -amplitude * frequency**2 * np.sin(frequency * t)
    velocity = amplitude * frequency * np.cos(frequency * t)
    noise = np.random.default_rng(5).normal(scale=1e-3, size=len(t))
    current = np.sign(velocity) + inertia * acceleration
    file = CompensationFile("s", terms=(FrictionPickup((1.0, 0.0, 0.0), inertia),))
    picked_up, still = np.outer(current, [1.0, 0.0, 0.0]), np.zeros((len(t), 3))
    left = compensate(file, stamp, picked_up, still, carriage=(stamp - 1_000_000, velocity + noise))[:, 0]
    settled = (t > 0.2) & (np.abs(velocity) > 5e-3)
    assert left[settled].std() < 0.05 * (inertia * acceleration).std() + 0.2  # speeds are 1 mm/s off


@pytest.mark.parametrize("set_by_s", [3600, -3600, -2])
def test_a_clock_that_is_set_leaves_the_temperature_as_it_was(set_by_s: int) -> None:
    file = CompensationFile("s", terms=(TemperatureBias((1.0, 0.0, 0.0), 25.0, 3.0),))
    plain, stepped = Compensator(file), Compensator(file)
    zero, up = np.zeros(3), np.array([0.0, 0.0, 9.81])
    differences = []
    for i in range(6000):
        stamp = 1_760_000_000_000_000_000 + 10_000_000 * i
        for compensator in (plain, stepped):
            compensator.set_temperature(25.0 + (0.005 * (i // 100) if i < 3000 else 0.15))
        expected = plain.update(stamp, zero, up)
        found = stepped.update(stamp + (set_by_s * 10**9 if i >= 4000 else 0), zero, up)
        differences.append(abs(found[0] - expected[0]))
    assert max(differences) < (0.05 if set_by_s < 0 else 1.0)  # K; ahead, an hour may have passed
    assert max(differences[5500:]) < 0.02


def test_temperature_lag_settles_with_its_time_constant() -> None:
    """After a minute at rest the die jumps by 1 K within a second: the lagged one follows with its 5 s."""
    file = CompensationFile("s", terms=(TemperatureBias((1.0, 0.0, 0.0), 20.0, 5.0),))
    stamp = np.arange(0, 140_000_000_000, 20_000_000)
    assert Compensator(file).update(0, np.zeros(3), np.array([0, 0, 9.8]))[0] == 0.0  # no reading: nothing is taken off
    readings = (stamp[::5], 20.0 + np.clip(stamp[::5] * 1e-9 - 60.0, 0.0, 1.0))
    taken = -compensate(file, stamp, np.zeros((len(stamp), 3)), np.full((len(stamp), 3), 9.8), readings)[:, 0]
    t = stamp * 1e-9
    assert np.abs(taken[t < 60]).max() < 1e-9
    assert np.interp(65.5, t, taken) == pytest.approx(1 - np.exp(-1), abs=0.06)
    assert taken[-1] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_lag_on_a_warming_board_agrees_with_the_analysis(seed: int) -> None:
    """A board that warms when the node starts: live and analysis agree, settled-at-the-first-reading does not."""
    rng = np.random.default_rng(seed)
    lag, slope = 10.0, 0.04
    stamp = np.arange(0, 120_000_000_000, 10_000_000)
    t = stamp * 1e-9
    true = 25.0 + slope * 140.0 * (1 - np.exp(-t / 140.0))
    readings = (stamp[::10], true[::10] + 0.06 * rng.normal(size=len(t[::10])))
    file = CompensationFile("s", terms=(TemperatureBias((1.0, 0.0, 0.0), 25.0, lag),))
    live = -compensate(file, stamp, np.zeros((len(stamp), 3)), np.full((len(stamp), 3), 9.8), readings)[:, 0]
    run = _warming_run(t, np.polynomial.Polynomial.fit(t[::10], readings[1], 3)(t))
    analysis = lagged_temperature(run, lag)
    assert analysis is not None
    naive = np.empty(len(t))
    naive[0] = 0.0
    for i in range(1, len(t)):
        naive[i] = naive[i - 1] + (1 - np.exp(-0.01 / lag)) * (true[i] - 25.0 - naive[i - 1])
    # what a bias taken in the first seconds would be off by ever after: the change of the error since then
    late, start = t > 60.0, (t > 5.0) & (t < 8.0)
    off = {
        name: abs(np.mean((x - analysis)[start]) - np.mean((x - analysis)[late]))
        for name, x in (("live", live), ("naive", naive))
    }
    assert off["naive"] > 0.15
    assert off["live"] < 0.4 * off["naive"]
    assert np.abs(live - analysis)[late].max() < 0.1


def _warming_run(t: Any, temperature: Any) -> CleanRun:
    n = len(t)
    zeros = np.zeros((n, 3))
    return CleanRun(
        "run",
        "run",
        "s",
        Role.FIT,
        0,
        t,
        100.0,
        zeros,
        zeros,
        np.ones(n, bool),
        (0, 1, 2),
        0,
        n,
        None,
        None,
        temperature,
    )


@pytest.mark.parametrize("lag", [0.0, 0.012])
def test_jerk_of_a_sweep_is_taken_off(lag: float) -> None:
    """At 8 rad/s, 200 Hz, with the accelerometer's noise: more than nine tenths of the coupling go, late as it is."""
    rng = np.random.default_rng(0)
    t = np.arange(0, 20, 0.005)
    force = np.zeros((len(t), 3))
    force[:, 0] = 9.6 * np.sin(8 * t)
    jerk = 9.6 * 8 * np.cos(8 * t)
    noisy = force + 0.04 * rng.normal(size=force.shape)
    rate = np.outer(np.interp(t - lag, t, jerk), C)
    file = CompensationFile("s", terms=(JerkCoupling(c=C, direction=(1.0, 0.0, 0.0), lag_s=lag),))
    left = compensate(file, np.rint(t * 1e9).astype(np.int64), rate, noisy)[20:]
    assert np.sqrt(np.mean(left**2)) < 0.08 * np.sqrt(np.mean(rate**2))


def test_groves_model_is_inverted() -> None:
    """Measured (I + M) w + G f gives w back."""
    rng = np.random.default_rng(1)
    M, w, f = rng.normal(size=(3, 3)) * 0.02, rng.normal(size=3), rng.normal(size=3) * 10
    matrix = tuple(tuple(float(x) for x in row) for row in M)
    file = CompensationFile("s", terms=(GSensitivity(matrix=G), ScaleMisalignment(matrix)))  # type: ignore[arg-type]
    measured = (np.eye(3) + M) @ w + np.array(G) @ f
    np.testing.assert_allclose(Compensator(file).update(0, measured, f), w, atol=1e-12)


def test_corrections_of_accelerometer_and_magnetometer() -> None:
    matrix = ((1.1, 0.0, 0.0), (0.02, 0.9, 0.0), (0.0, 0.0, 1.0))
    file = CompensationFile(
        "s",
        accelerometer=AccelerometerCorrection(matrix, (0.1, 0.2, -0.3)),
        magnetometer=MagnetometerCorrection((1e-5, 0.0, -2e-5), matrix),
    )
    f = np.array([[1.0, 2.0, 9.0], [0.1, 0.2, -0.3]])
    np.testing.assert_allclose(corrected_force(file, f), [np.array(matrix) @ (f[0] - [0.1, 0.2, -0.3]), np.zeros(3)])
    np.testing.assert_allclose(corrected_field(file, f[0]), np.array(matrix) @ (f[0] - [1e-5, 0.0, -2e-5]))
    plain = replace(file, accelerometer=None, magnetometer=None)
    assert corrected_force(plain, f) is f
    assert corrected_field(plain, f) is f


def test_without_specific_force_the_g_term_is_left_out() -> None:
    file = CompensationFile("s", bias=(9, 9, 9), terms=(GSensitivity(k=0.1),))
    rate = Compensator(file).update(0, np.ones(3), np.full(3, np.nan))
    np.testing.assert_array_equal(rate, np.ones(3))
    np.testing.assert_array_equal(
        compensate(file, np.array([0]), np.ones((1, 3)), np.full((1, 3), np.nan)), [[1, 1, 1]]
    )
