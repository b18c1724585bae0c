"""What is fast in phase with the jerk: one finding with a mode of its own, not several that imitate its shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim
from tests.study.judge import analyse
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.effects.base import Drivers, Effect, Templates
from gsense_fusion.identification.effects.fast_mode import mode_fields
from gsense_fusion.identification.effects.g_cubed import GCubed
from gsense_fusion.identification.effects.g_squared import GSquared
from gsense_fusion.identification.effects.jerk_coupling import JerkCoupling
from gsense_fusion.identification.motion.harmonics import Kinematics

from .sessions import BASE, SETTINGS, analysed, changed, finding, made, names

TIME = np.arange(0.0, 20.0, 0.005)
MIDDLE = slice(1000, 3000)
HZ = 15.0
PLAIN = Templates()


def _drivers(templates: Templates = PLAIN, ringing_part: float = 0.0) -> Drivers:
    """A jerk at 15 Hz, a part of which is ringing."""
    w = 2 * np.pi * HZ
    a, j = np.sin(w * TIME), w * np.cos(w * TIME)
    kin = Kinematics(0 * TIME, 0 * TIME, (1 - ringing_part) * a, (1 - ringing_part) * j)
    ringing = ringing_part * np.stack([a, j]) if ringing_part else None
    return Drivers(kin, None, None, None, TIME, templates=templates, ringing=ringing)


@pytest.mark.parametrize("effect", [JerkCoupling(), GSquared(), GCubed()])
def test_what_answers_to_shaking_answers_to_the_ringing_too(effect: Effect) -> None:
    """What friction's kicks add at the reversals is multiplied by the square of the acceleration there."""
    whole = np.asarray(effect.design(_drivers()))
    apart = np.asarray(effect.design(_drivers(ringing_part=0.4)))
    assert apart == pytest.approx(whole, abs=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize(("f0", "damping"), [(35.0, 0.15), (110.0, 1.0)])
def test_the_mode_has_the_gain_and_phase_of_an_oscillator(f0: float, damping: float) -> None:
    hz, lag = mode_fields("jerk_coupling")
    drivers = _drivers(Templates().set(hz, f0).set(lag, damping / (np.pi * f0)))
    shaped = np.asarray(JerkCoupling().design(drivers))[MIDDLE, 0, 0]
    jerk = 2 * np.pi * HZ * np.exp(2j * np.pi * HZ * TIME[MIDDLE])
    expected = np.real(jerk / (1 - (HZ / f0) ** 2 + 2j * damping * HZ / f0))
    assert shaped == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())
    answer = JerkCoupling().vibration(np.array([HZ]), drivers)[0, 0, 0]
    assert np.abs(answer * np.exp(2j * np.pi * HZ * TIME[MIDDLE])) == pytest.approx(np.abs(expected).max(), rel=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["feedthrough", "belt_lever"])
def test_a_large_one_is_one_finding_with_its_rivals(kind: str) -> None:
    """Of exactly equal ones in one mounting the commoner is named; the other is listed."""
    base = replace(BASE, seed=5, chain=ChainParameters(rate_hz=100.0))
    result = analysed(Disturbance(kind, {"feedthrough": 0.05, "belt_lever": 0.004}[kind] * DEG), base=base)
    assert (result.verdict, names(result)) == ("effects_found", ["belt_tilt"]), result.unexplained
    assert "jerk_coupling" in finding(result, "belt_tilt").alternatives
    assert finding(result, "belt_tilt").separating_run == "board_turned_180"


@pytest.mark.slow
def test_soft_bearings_and_a_mount_are_rivals() -> None:
    """A carriage on bearings of 15 Hz and a board that rocks on its mount look alike in one mounting."""

    def soft(run: Run, role: str) -> tuple[Run, str]:
        imu = run.imu
        t = (imu.stamp_ns - imu.stamp_ns[0]) * 1e-9
        felt = imu.specific_force[:, 0] - imu.specific_force[0, 0]
        w, grid = 2 * np.pi * 15.0, np.arange(0.0, t[-1], 1e-3)
        _, rate, _ = lsim(([w * w, 0.0], [1.0, 0.3 * w, w * w]), np.interp(grid, t, felt), grid)
        turn = np.outer(np.interp(t, grid, rate), [2e-6, 8e-6, 4e-6])
        return replace(run, imu=replace(imu, angular_rate=imu.angular_rate + turn)), role

    base = replace(BASE, seed=5, chain=ChainParameters(rate_hz=100.0))
    result = analyse(changed(made(base=base), soft), SETTINGS)
    assert result.verdict == "effects_found", result.unexplained
    [found] = result.findings
    assert {found.effect, *found.alternatives} == {"belt_tilt", "jerk_coupling", "g_resonance"}
    assert found.separating_run == "board_turned_180"
