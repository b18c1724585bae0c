"""Noise in one run, at one place or with the acceleration: too little for a band of the session, and no mean."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.types import Role
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.uneven_noise import Blocks, one_place, where_accelerated, where_fast

from .sessions import BASE, SETTINGS, analyse, changed, made, names

QUIET = 0.005 * np.pi / 180
"""White noise of the simulated gyro, (rad/s)/sqrt(Hz)."""
PLAIN = replace(BASE, chain=replace(BASE.chain, rate_hz=200.0, filter_hz=80.0))


def _travel(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Position and acceleration at the gyro's samples."""
    assert run.pose is not None
    at = (run.imu.stamp_ns - run.pose.stamp_ns[0]) * 1e-9
    position = np.interp(at, (run.pose.stamp_ns - run.pose.stamp_ns[0]) * 1e-9, run.pose.position)
    step = float(np.median(np.diff(at)))
    smooth = sosfiltfilt(butter(4, 4.0, fs=1 / step, output="sos"), position)
    return position, np.gradient(np.gradient(smooth, step), step)


def _chatter(_run: Run, position: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(31)
    band = butter(3, (28.0, 33.0), "bandpass", fs=200.0, output="sos")
    noise = sosfilt(band, rng.standard_normal((len(position), 3)), axis=0) * QUIET * np.sqrt(100.0)
    return 1.2 * noise * float(np.abs(acceleration).max() > 8.0)


def _dent(run: Run, position: np.ndarray, _acceleration: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(int(run.imu.stamp_ns[0] % 1_000_003))
    near = np.exp(-(((position - 0.06) / 0.01) ** 2))
    return rng.standard_normal((len(position), 3)) * near[:, None] * QUIET * np.sqrt(100.0) * 1.5


def _rattle(run: Run, position: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(int(run.imu.stamp_ns[0] % 1_000_003))
    return rng.standard_normal((len(position), 3)) * np.abs(acceleration)[:, None] * QUIET * np.sqrt(100.0) * 0.1


def _sputter(run: Run, position: np.ndarray, _acceleration: np.ndarray) -> np.ndarray:
    """For a second in ten, wherever the carriage is then."""
    rng = np.random.default_rng(int(run.imu.stamp_ns[0] % 1_000_003))
    on = (np.arange(len(position)) + rng.integers(2000)) % 2000 < 200
    noise = rng.standard_normal((len(position), 3)) * QUIET * np.sqrt(100.0)
    return 1.2 * noise * (on & (np.ptp(position) > 0.01))[:, None]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "said"),
    [(_chatter, "one run alone"), (_dent, "one place"), (_rattle, "accelerated"), (_sputter, "bursts")],
)
def test_it_is_unexplained_and_nothing_is_named(
    noise: Callable[[Run, np.ndarray, np.ndarray], np.ndarray], said: str
) -> None:
    def noisy(run: Run, role: Role) -> tuple[Run, Role]:
        rate = run.imu.angular_rate + noise(run, *_travel(run))
        return replace(run, imu=replace(run.imu, angular_rate=rate)), role

    result = analyse(changed(made(base=PLAIN), noisy), SETTINGS)
    assert result.unexplained is not None
    assert said in result.unexplained.description
    assert names(result) == []


Course = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Power of the noise over its mean at speeds and positions from -1 to 1."""


def _growth(size: float) -> Course:
    return lambda velocity, _position: 1.0 + size * (velocity**2 - 0.5)


def _dented(place: float) -> Course:
    return lambda _velocity, position: 1.0 + 3.0 * (np.abs(position - place) < 0.15)


def _cycles(rng: np.random.Generator, courses: Sequence[Course]) -> tuple[Any, Any, list[WindowResidual]]:
    """Likelihood, fit and windows at 200 Hz of a sine, each with the course of its noise."""
    frequency = np.fft.rfftfreq(2000, 0.005)[1:]
    bins: Any = SimpleNamespace(frequency=frequency, weight=np.ones((len(frequency), 3)), keep=np.arange(1001) > 0)
    phase = np.arange(2000) * 0.03
    velocity, position = np.cos(phase), np.sin(phase)
    kin = SimpleNamespace(position=position, velocity=velocity, acceleration=-position)
    windows = []
    for course in courses:
        data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=200.0), motion=None)
        noise = rng.standard_normal((2000, 3)) * np.sqrt(course(velocity, position))[:, None]
        spectrum = np.fft.rfft(noise, axis=0)[1:] * np.sqrt(2.0 / 2000)
        both = np.stack([spectrum.real, spectrum.imag])
        windows.append(WindowResidual(data, Window(0, 2000, moving=True), bins, both))
    source = SimpleNamespace(of=lambda _data, _templates: SimpleNamespace(kinematics=kin))
    campaign = SimpleNamespace(rate_hz=200.0)
    return SimpleNamespace(source=source, effects=(), campaign=campaign), SimpleNamespace(names=frozenset()), windows


def test_noise_that_grows_within_each_run_is_seen_though_all_are_as_loud() -> None:
    (found,) = where_fast(*_cycles(np.random.default_rng(9), [_growth(0.35)] * 6))
    assert found.p_value < 1e-5
    assert "where the carriage is fast" in found.words


def test_steady_noise_is_fast_nowhere() -> None:
    rng = np.random.default_rng(10)
    assert sum(bool(where_fast(*_cycles(rng, [_growth(0.0)] * 6))) for _ in range(30)) <= 2


@pytest.mark.parametrize(
    "courses", [[_growth(0.0)] * 5 + [_growth(1.5)], [_growth(0.5)], [_dented(0.0)] * 6, [_dented(0.4)] * 6]
)
def test_what_one_run_or_one_place_shows_is_no_growth(courses: list[Course]) -> None:
    assert where_fast(*_cycles(np.random.default_rng(12), courses)) == []


def _window() -> WindowResidual:
    frequency = np.fft.rfftfreq(2000, 0.005)[1:]
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=200.0), motion=None)
    bins: Any = SimpleNamespace(frequency=frequency, weight=np.ones((len(frequency), 3)))
    return WindowResidual(data, Window(0, 2000, moving=True), bins, np.zeros((2, len(frequency), 3)))


def test_noise_that_grows_with_the_speed_alone_is_neither() -> None:
    rng = np.random.default_rng(8)
    rows = []
    for _ in range(12):
        phase = np.arange(1000) * 0.11
        position = 0.15 * np.sin(phase)
        power = (1.0 + np.cos(phase) ** 2)[:, None] * rng.gamma(2.0, 0.5, (1000, 3))
        fast, driven = np.cos(2 * phase) / 2, -np.cos(2 * phase) / 2
        rows.append(Blocks(position, -position, driven, fast, np.cbrt(power / power.mean(axis=0))))
    window = _window()
    place, accelerated = one_place(rows, window), where_accelerated(rows, window)
    assert place is not None
    assert place.p_value > 0.001
    assert accelerated is not None
    assert accelerated.p_value > 0.99
