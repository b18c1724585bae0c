"""A ripple of belt teeth that grows with the speed: most of it lies above the band of the other effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import Disturbance, PlannedRun
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.effects.belt_tooth import BeltTooth
from gsense_fusion.identification.effects.fine import fine_motion
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.motion.carriage import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.search.screening import PADDING, PEAK_BINS, POSITION_STEP, _peaks
from gsense_fusion.identification.types import Owner

from .sessions import BASE, SETTINGS, analysed, finding, made, names

PLAN = (
    PlannedRun(1.0, 20.0),
    PlannedRun(0.0, 45.0),
    PlannedRun(1.5, 18.0),
    PlannedRun(3.1, 16.0, role="held_out"),
    PlannedRun(8.0, 16.0),
    PlannedRun(2.2, 16.0),
    PlannedRun(4.0, 16.0),
    PlannedRun(1.25, 16.0, role="held_out"),
)
AT_200_HZ = replace(BASE, plan=PLAN, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0))
TEETH = Disturbance("teeth", 0.03 * DEG)
"""rad/s at 0.1 m/s."""


def test_the_filter_is_seen_in_the_noise() -> None:
    f = np.linspace(4.0, 100.0, 300)
    second_order = 1.0 / (1.0 + (f / 42.0) ** 4)
    response = Response.of({0: NoiseModel(1e-8, 1e-12, 1e-12, f, second_order)})
    assert response.at(np.array([10.0, 42.0, 80.0])) == pytest.approx([1.0, 0.71, 0.27], abs=0.02)
    assert response.at(np.array([200.0]))[0] == pytest.approx(0.27 * (80 / 200) ** 2, rel=0.1)
    flat = Response.of({0: NoiseModel(1e-8, 1e-12, 1e-12, f, np.ones_like(f))})
    assert flat.at(np.array([10.0, 300.0])) == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("damping", [0.5, np.sqrt(0.5), 1.0])
def test_the_filters_phase_follows_from_its_amplitude(damping: float) -> None:
    """Filters of second order at 42 Hz, sampled at 200 Hz, in noise that is known to 5 %; their delay is not theirs."""
    rng = np.random.default_rng(3)
    f = np.linspace(4.0, 99.0, 300)

    def transfer(at: np.ndarray) -> np.ndarray:
        x = 1j * at / 42.0
        return np.asarray(1 / (1 + 2 * damping * x + x**2))

    power = np.abs(transfer(f)) ** 2 + np.abs(transfer(200.0 - f)) ** 2
    uneven = np.repeat(rng.normal(1.0, 0.05, 30), 10)
    response = Response.of({0: NoiseModel(1e-8, 1e-14, 1e-14, f, power * uneven)}, 200.0)
    tried = np.array([15.0, 30.0, 42.0, 60.0, 80.0, 120.0, 200.0])
    exact = transfer(tried) * np.exp(2j * damping * tried / 42.0)
    assert np.abs(response.transfer(tried) - exact) == pytest.approx(0.0, abs=0.08)


def test_a_filter_of_another_order_has_its_own_shape() -> None:
    f = np.linspace(4.0, 99.0, 300)
    fourth = 1.0 / (1.0 + (f / 42.0) ** 8)
    response = Response.of({0: NoiseModel(1e-8, 1e-14, 1e-14, f, fourth)})
    assert response.at(np.array([15.0, 42.0, 60.0])) == pytest.approx([1.0, 0.71, 0.23], abs=0.03)


@pytest.mark.parametrize("passes", [True, False])
def test_a_pulse_is_sampled_as_the_filter_leaves_it(passes: bool) -> None:
    """A pulse shorter than a sample keeps its area, but for what the filter leaves at the sample rate."""
    f = np.linspace(4.0, 99.0, 300)
    response = Response.of({0: NoiseModel(1e-8, 0, 0, f, np.ones_like(f) if passes else 1 / (1 + (f / 42.0) ** 4))})
    time = np.arange(400) / 200.0
    drivers = Drivers(Kinematics.at_rest(0.0, 400), None, None, None, time, response=response)
    fine = fine_motion(drivers)
    for first in (400, 402, 405):
        pulse = np.zeros(len(fine.time))
        pulse[first : first + 3] = 1.0
        assert fine.sampled(pulse, response, means=True).sum() == pytest.approx(
            3 / fine.per_sample, rel=1e-3 if passes else 0.1
        )


@pytest.mark.parametrize(("reach_m", "as_line"), [(0.15, True), (0.006, False)])
def test_a_ripple_that_shows_near_the_ends_alone_is_a_hump(reach_m: float, as_line: bool) -> None:
    """A narrow filter leaves it where the carriage is slow: its line is as wide as that way is short."""
    at = np.arange(0.0, 1.0, POSITION_STEP)
    near = np.minimum(np.abs(at - 0.35), np.abs(at - 0.65)) < reach_m
    noise = np.random.default_rng(9).standard_normal(len(at))
    profile = near * np.sin(2 * np.pi * at / 5e-3) * (1.0 if as_line else 8.0) + noise
    power = np.abs(np.fft.rfft(profile, PADDING * len(at))) ** 2
    lines, humps = _peaks(power, PEAK_BINS), _peaks(power, len(power))
    assert any(abs(pitch - 5e-3) < 2e-5 for _, pitch in lines) == as_line
    assert [pitch for _, pitch in humps] == pytest.approx([5e-3], abs=2e-4)


@pytest.mark.slow
def test_a_ripple_that_grows_with_the_speed_is_found_with_its_pitch_and_size() -> None:
    result = analysed(TEETH, base=AT_200_HZ)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["belt_tooth"]
    found = finding(result, "belt_tooth")
    assert found.owner is Owner.RIG
    assert found.parameters["pitch"].value == pytest.approx(5.08e-3, abs=1e-5)
    angle = np.array([[found.parameters[f"angle_{f}_{x}"].value for x in "xyz"] for f in ("cos", "sin")])
    assert np.linalg.norm(angle) == pytest.approx(TEETH.size / 0.1, rel=0.12)
    assert any("above half" in n for n in result.notes), result.notes


@pytest.mark.slow
def test_half_of_the_runs_with_the_board_turned() -> None:
    """In the sensor's axes the ripples of the two halves cancel where they are laid over each other."""
    half = tuple(replace(run, turned=i % 2 == 0) for i, run in enumerate(PLAN))
    result = analysed(TEETH, base=replace(AT_200_HZ, plan=half))
    assert names(result) == ["belt_tooth"], result.unexplained
    assert finding(result, "belt_tooth").parameters["pitch"].value == pytest.approx(5.08e-3, abs=2e-5)


@pytest.mark.slow
def test_without_teeth_in_the_catalogue_it_is_unexplained() -> None:
    toothless = tuple(e for e in CATALOGUE if "belt_tooth" not in (e.name, e.part_of))
    strong = made(Disturbance("teeth", 0.1 * DEG), base=AT_200_HZ)
    result = analyse(strong, Settings("mpu6050", catalogue=toothless))
    assert result.verdict == "unexplained", (result.verdict, names(result))


@pytest.mark.slow
def test_no_ripple_at_200_hz() -> None:
    result = analyse(made(base=AT_200_HZ), SETTINGS)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)


def test_nothing_ripples_while_the_carriage_stands() -> None:
    """A rest before the motion, in which the encoder's spline still moves by some micrometres."""
    time = np.arange(0.0, 12.0, 0.005)
    w, begin = 4.0, 4.0
    driven = np.maximum(time - begin, 0.0)
    uneasy = 1e-6 * np.sin(30.0 * time)
    position = 0.075 * (1.0 - np.cos(w * driven)) + uneasy
    velocity, acceleration, jerk = (np.gradient(position, 0.005), *(np.zeros(len(time)) for _ in range(2)))
    level = Mounting(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    drivers = Drivers(Kinematics(position, velocity, acceleration, jerk), level, None, None, time)
    columns = np.abs(np.asarray(BeltTooth().design(drivers))).max(axis=(1, 2))
    assert columns[time < begin - 0.1].max() == 0.0
    assert columns[time > begin + 0.1].max() > 0.9
