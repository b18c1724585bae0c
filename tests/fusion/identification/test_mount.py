"""A board that sways on its mount, in one mode or in two."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.study.cases import Case, with_disturbances
from tests.study.judge import analyse
from tests.study.simulator import Disturbance, simulate
from tests.study.simulator.parameters import ChainParameters

from gsense_fusion.compensation import GResonance as Term
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.base import Drivers, Templates
from gsense_fusion.identification.effects.g_resonance import GResonance, RockingMount, SecondMode, resonant
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.search import soundness
from gsense_fusion.report.outputs import compensation

from .sessions import BASE, LATE, SETTINGS, analysed, finding, made, names


@pytest.mark.slow
def test_two_modes_are_one_finding_and_nothing_is_left() -> None:
    base = replace(BASE, seed=3, chain=ChainParameters(rate_hz=100.0))
    result = analysed(Disturbance("mount_resonance", 3e-5), base=base)
    assert (result.verdict, names(result)) == ("effects_found", ["g_resonance"]), result.unexplained
    p = finding(result, "g_resonance").parameters
    modes = sorted([p["f0"].value, p["f2"].value])
    assert modes == pytest.approx([3.1, 11.0], rel=0.05)
    assert len([t for t in compensation(result).terms if isinstance(t, Term)]) == 2
    assert result.rate_rms.full < 1.06 * result.rate_rms.noise_floor


@pytest.mark.slow
def test_a_delay_is_no_mount_that_sways() -> None:
    """One that is damped so much that it does not ring would pass for it, were there no `time_offset`."""
    without = replace(SETTINGS, catalogue=tuple(e for e in CATALOGUE if e.name != "time_offset"))
    result = analyse(made(LATE), without)
    assert (result.verdict, names(result)) == ("unexplained", [])


@pytest.mark.slow
def test_a_delay_is_no_mount_that_sways_in_two_modes() -> None:
    """Two modes follow a delay within the noise, but their frequencies may be anything."""
    case = Case("single", ("time_offset",), 4000.0, 1_022_400)
    without = replace(SETTINGS, catalogue=tuple(e for e in CATALOGUE if e.name != "time_offset"))
    result = analyse(simulate(with_disturbances(case)), without)
    assert (result.verdict, names(result)) == ("unexplained", [])


@pytest.mark.parametrize(
    ("values", "errors", "holds"),
    [
        ((8.0, 0.2, 20.0, 0.1), (0.5, 0.04, 1.0, 0.03), True),
        ((8.0, 0.49, 20.0, 0.1), (0.5, 0.04, 1.0, 0.03), True),  # one that rings is enough
        ((8.0, 0.4, 20.0, 0.1), (0.5, 0.06, 6.0, 0.03), False),  # the first may not ring, the second be anywhere
    ],
)
def test_a_mode_rings_at_a_frequency_that_is_known(
    monkeypatch: pytest.MonkeyPatch, values: tuple[float, ...], errors: tuple[float, ...], holds: bool
) -> None:
    effects = {e.name: e for e in (GResonance(), RockingMount(), SecondMode())}
    fields = ("resonance_hz", "resonance_damping", "resonance2_hz", "resonance2_damping")
    fit = SimpleNamespace(names=frozenset(effects), templates=Templates(tuple(zip(fields, values, strict=True))))
    likelihood = SimpleNamespace(effects=tuple(effects.values()))
    monkeypatch.setattr(soundness, "searched", lambda *_: (np.array(errors), None))
    made_up: Any = SimpleNamespace(likelihood=likelihood, effects=effects)
    known: Any = fit
    assert soundness.sound(made_up, known, "g_resonance") is holds


def test_a_vibration_is_answered_as_the_motion_is() -> None:
    """At one frequency the columns are the acceleration times what `vibration` says."""
    time = np.arange(0.0, 20.0, 0.005)
    f = 4.0
    acceleration = np.sin(2 * np.pi * f * time)
    jerk = 2 * np.pi * f * np.cos(2 * np.pi * f * time)
    kin = Kinematics(0 * time, 0 * time, acceleration, jerk)
    templates = Templates(
        (("resonance2_damping", 0.2), ("resonance2_hz", 6.0), ("resonance_damping", 0.3), ("resonance_hz", 5.0))
    )
    drivers = Drivers(kin, None, None, None, time, templates=templates)
    middle = slice(1000, 3000)
    carrier = np.exp(2j * np.pi * f * time[middle])
    for effect in (GResonance(), RockingMount(), SecondMode()):
        columns = np.asarray(effect.design(drivers))[middle]
        answer = effect.vibration(np.array([f]), drivers)[0]
        expected = np.imag(carrier[:, None, None] * answer)
        assert columns == pytest.approx(expected, abs=1e-2 * np.abs(expected).max())


def test_a_mode_far_above_the_drive_is_the_drive() -> None:
    time = np.arange(0.0, 10.0, 0.005)
    slow = np.sin(2 * np.pi * 0.5 * time)
    assert resonant(time, slow, 40.0, 0.3) == pytest.approx(slow, abs=0.02)
