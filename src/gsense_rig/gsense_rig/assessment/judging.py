"""All sines on one plant, before and after tuning, and what they amount to over the plants."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gsense_rig.assessment import estimation
from gsense_rig.assessment.sine_run import Tracking, drive, tracking
from gsense_rig.control.tuning import identify
from gsense_rig.loop.messages import Home, Tune, UseModel
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop

if TYPE_CHECKING:
    from gsense_rig.assessment.estimation import Estimate
    from gsense_rig.assessment.sine_run import SineRun
    from gsense_rig.control.tuning import Tuning
    from gsense_rig.plant.parameters import PlantParameters

FREQUENCIES = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)  # rad/s
AMPLITUDE = 0.15  # m
RMS_TARGET, PHASE_TARGET = 0.5e-3, 0.2  # m, deg


@dataclass(frozen=True)
class Peaks:
    """What the fastest sine asks of the drive."""

    current: float  # A
    current_rms: float  # A
    voltage: float  # V, mean of each period


@dataclass(frozen=True)
class Judged:
    """One plant: figures by angular frequency."""

    plant: str
    untuned: dict[float, Tracking]
    tuned: dict[float, Tracking]
    observer: dict[float, Estimate]  # tuned
    thesis: dict[float, Estimate]  # of the same runs
    change: str  # what tuning found
    peaks: Peaks  # of the fastest tuned sine


def judge_plant(
    name: str, plant: PlantParameters, seed: int = 1, frequencies: tuple[float, ...] = FREQUENCIES
) -> Judged:
    """Home, drive all sines, tune, drive them again, with the better controller.

    Raises:
        RuntimeError: a command failed; the message names the plant.
    """
    parameters = LoopParameters(plant=plant)
    clock = _homed(parameters, seed)
    try:
        untuned = {w: tracking(_sine(clock, w)) for w in frequencies}
        found = tune(clock)
        runs = {w: _sine(clock, w) for w in frequencies}
    except (RuntimeError, ValueError) as error:
        raise RuntimeError(f"{name}: {error}") from error
    return Judged(
        name,
        untuned,
        {w: tracking(run) for w, run in runs.items()},
        {w: estimation.observer(run) for w, run in runs.items()},
        {w: estimation.thesis(run, parameters.period) for w, run in runs.items()},
        found.text(plant.drive),
        _peaks(runs[max(frequencies)], plant),
    )


def judge_pi(seed: int = 1, frequencies: tuple[float, ...] = FREQUENCIES) -> dict[float, Tracking]:
    """The thesis's PI on the plant as believed."""
    clock = _homed(LoopParameters(controller="pi"), seed)
    return {w: tracking(_sine(clock, w)) for w in frequencies}


def tune(clock: VirtualClock) -> Tuning:
    """Make the tune move, identify the drive, have the loop use it.

    Raises:
        RuntimeError: the move failed.
        TuneError: the move does not fit a drive.
    """
    parameters = clock.loop.parameters
    moved = clock.run_command(Tune(1))
    if moved.record is None:
        raise RuntimeError(moved.message)
    found = identify(moved.record, parameters.period, parameters.model)
    clock.run_command(UseModel(1, found.drive))
    return found


def worst(judged: list[dict[float, Tracking]]) -> dict[float, Tracking]:
    """The largest of each figure over the plants, by angular frequency."""
    return {
        w: Tracking(
            max(j[w].rms for j in judged),
            max((j[w].phase for j in judged), key=abs),
            max(j[w].shake for j in judged),
        )
        for w in judged[0]
    }


def within_targets(figures: dict[float, Tracking]) -> bool:
    """Whether tracking and phase are within the targets at every angular frequency."""
    return all(f.rms < RMS_TARGET and abs(f.phase) < PHASE_TARGET for f in figures.values())


def _homed(parameters: LoopParameters, seed: int) -> VirtualClock:
    loop, hardware = make_simulated_loop(parameters, seed)
    clock = VirtualClock(loop, hardware)
    result = clock.run_command(Home(1))
    if not result.success:
        raise RuntimeError(result.message)
    return clock


def _sine(clock: VirtualClock, w: float) -> SineRun:
    return drive(clock, 1, AMPLITUDE, w, 1 if w < 2.0 else 2 if w < 4.0 else 4)


def _peaks(run: SineRun, plant: PlantParameters) -> Peaks:
    current, duty = run.truth[:, 2], run.loop[:, 5]
    drive_, size = plant.drive, abs(duty)
    voltage = (size - drive_.dead_zone).clip(0.0) / (1.0 - drive_.dead_zone) * drive_.supply_voltage
    return Peaks(float(abs(current).max()), math.sqrt(float((current**2).mean())), float(voltage.max()))
