"""What a recording says of itself: lost and repeated samples, clocks that drift apart, a coarse step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from tests.study.judge import analyse
from tests.study.simulator import Session
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.bags.run import ImuSeries, LinkCounts, PoseSeries, Run
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.quantization import noise_before_rounding
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.recording.clock import Skew, on_one_clock
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.recording.lattice import lattice_step
from gsense_fusion.identification.recording.stamps import grid_index, look_at_stamps
from gsense_fusion.identification.types import Owner, Role
from gsense_fusion.report.figures import figures

from .sessions import BASE, BOW, SETTINGS, G, analysed, changed, finding, made, names

Change = Callable[[Run, str], tuple[Run, str]]


def _clock_of(ppm: float, anew: bool, first_ns: int, run: Run, role: str) -> tuple[Run, str]:
    """Stamps by a clock that is faster; `anew`: set right in the middle of every run."""
    stamps = run.imu.stamp_ns
    origin = int(stamps[len(stamps) // 2]) if anew else first_ns
    faster = origin + np.round((stamps - origin) * (1 + ppm * 1e-6)).astype(np.int64)
    return replace(run, imu=replace(run.imu, stamp_ns=faster)), role


def skewed(session: Session, ppm: float, anew: bool = False) -> Session:
    return changed(session, partial(_clock_of, ppm, anew, int(session.runs[0][0].imu.stamp_ns[0])))


def _without(run: Run, keep: np.ndarray) -> Run:
    imu = run.imu
    kept = replace(
        imu,
        stamp_ns=imu.stamp_ns[keep],
        received_ns=imu.received_ns[keep],
        angular_rate=imu.angular_rate[keep],
        specific_force=imu.specific_force[keep],
    )
    return replace(run, imu=kept)


def lossy(part: float, link: bool = True) -> Change:
    """Single samples lost by chance; `link`: the frame counter knows of them."""

    def change(run: Run, role: str) -> tuple[Run, str]:
        keep = np.random.default_rng(len(run.imu) + int(run.name[-2:])).random(len(run.imu)) >= part
        keep[[0, -1]] = True
        counts = LinkCounts(int(keep.sum()), int((~keep).sum()) if link else 0, 0, 0, 0, 0)
        return replace(_without(run, keep), link=counts), role

    return change


def stale(part: float) -> Change:
    """Samples replaced by their predecessors: a sensor that is read too fast."""

    def change(run: Run, role: str) -> tuple[Run, str]:
        fresh = np.random.default_rng(len(run.imu)).random(len(run.imu)) >= part
        at = np.maximum.accumulate(np.where(fresh, np.arange(len(fresh)), 0))
        imu = replace(run.imu, angular_rate=run.imu.angular_rate[at], specific_force=run.imu.specific_force[at])
        return replace(run, imu=imu), role

    return change


def gap(start: float, stop: float) -> Change:
    def change(run: Run, role: str) -> tuple[Run, str]:
        t = run.imu.seconds
        return (_without(run, ~((t > start) & (t < stop))), role) if role == "fit" else (run, role)

    return change


def coarse(step_deg_s: float) -> Change:
    """A coarser converter.

    What the finer one's rounding took is put back by chance first: rounding twice, 1.965 of the finer steps to a
    coarser one, is a curve of its own (block means up to 38 standard errors off, however much noise there is).
    """

    def change(run: Run, role: str) -> tuple[Run, str]:
        step, rate = step_deg_s * DEG, run.imu.angular_rate
        fine = np.array([lattice_step(rate[:, i]) for i in range(3)])
        analogue = rate + fine * np.random.default_rng(len(rate)).uniform(-0.5, 0.5, rate.shape)
        return replace(run, imu=replace(run.imu, angular_rate=np.round(analogue / step) * step)), role

    return change


def test_clocks_of_one_speed_are_no_finding_and_their_skew_is_within_its_error() -> None:
    _, skew = on_one_clock(clean_runs([(run, Role(role)) for run, role in made().runs]))
    assert skew is not None
    assert abs(skew.value) < 3 * skew.stderr < 6e-5


@pytest.mark.parametrize(("ppm", "anew"), [(200.0, False), (-300.0, True), (2000.0, False), (5000.0, False)])
def test_a_skew_is_found_and_taken_out(ppm: float, anew: bool) -> None:
    campaign, skew = on_one_clock(clean_runs([(run, Role(role)) for run, role in skewed(made(), ppm, anew).runs]))
    assert isinstance(skew, Skew)
    assert skew.free is not anew
    assert skew.value == pytest.approx(ppm * 1e-6, abs=3 * skew.stderr)
    true, _ = on_one_clock(clean_runs([(run, Role(role)) for run, role in made().runs]))
    assert campaign.delay.value == pytest.approx(true.delay.value, abs=1e-4)


def test_the_error_of_a_short_motions_skew_is_that_of_noise_behind_a_filter() -> None:
    """Nothing is left between the orders of five periods, and the level up to half the sample rate is too low."""
    t = np.arange(0.0, 14.0, 0.005)
    u = np.clip(np.minimum(t - 3.0, 12.0 - t) / 1.2, 0.0, 1.0)
    x = 0.15 * u**3 * (10 - 15 * u + 6 * u**2) * np.sin(5.0 * t)
    felt = np.column_stack([np.gradient(np.gradient(x, t), t), 0.0 * t, np.full(len(t), 9.81)])
    run = made().runs[0][0]
    stamps = run.imu.stamp_ns[0] + np.arange(len(t)) * 5_000_000
    pose = PoseSeries(stamps, np.round(x / 5e-5) * 5e-5)
    found = []
    for seed in range(12):
        noise = np.random.default_rng(seed).standard_normal((2, len(t), 3))
        force = felt + 0.06 * sosfilt(butter(2, 10.0, fs=200.0, output="sos"), noise[0], axis=0)
        imu = ImuSeries(stamps, stamps, 1e-3 * noise[1], force, (True, True, True))
        _, skew = on_one_clock(clean_runs([(replace(run, imu=imu, joint=None, pose=pose), Role.FIT)]))
        assert skew is not None
        found.append(skew.value / skew.stderr)
    assert 0.5 < np.std(found) < 1.7


@pytest.mark.slow
def test_a_skew_leaves_the_other_findings_alone() -> None:
    result = analyse(skewed(made(BOW), 300.0), SETTINGS)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["clock_skew", "rail_curvature"]
    found = finding(result, "clock_skew")
    assert found.owner is Owner.CHAIN
    assert found.parameters["skew"].value == pytest.approx(3e-4, abs=1e-5)
    assert "clock_skew" in {f.key for f in figures(result)}


@pytest.mark.slow
@pytest.mark.parametrize("ppm", [5000.0, -20000.0])
def test_nothing_remains_of_a_large_skew_that_is_taken_out(ppm: float) -> None:
    """A sensor's own oscillator: 1 % of tolerance is usual. At the session's end the clocks are seconds apart."""
    result, without = analyse(skewed(made(), ppm), SETTINGS), analysed()
    assert (result.verdict, names(result)) == ("effects_found", ["clock_skew"]), result.unexplained
    assert finding(result, "clock_skew").parameters["skew"].value == pytest.approx(ppm * 1e-6, abs=1e-5)
    assert result.rate_rms.full == pytest.approx(without.rate_rms.full, rel=0.01)


@pytest.mark.slow
def test_what_sound_crystals_differ_by_is_a_note() -> None:
    result = analyse(skewed(made(), 25.0), SETTINGS)
    assert names(result) == []
    assert any("+25 ppm" in n for n in result.notes), result.notes


@pytest.mark.parametrize("part", [0.06, pytest.param(0.02, marks=pytest.mark.slow)])
def test_many_lost_samples_are_a_finding(part: float) -> None:
    many = analyse(changed(made(BOW), lossy(part)), SETTINGS)
    assert names(many) == ["rail_curvature", "sample_loss"], many.unexplained
    found = finding(many, "sample_loss")
    assert found.owner is Owner.CHAIN
    assert found.parameters["part"].value == pytest.approx(part, abs=3 * found.parameters["part"].stderr)
    assert "radio" in found.advice


@pytest.mark.slow
def test_few_lost_samples_are_a_note() -> None:
    few = analyse(changed(made(), lossy(0.005)), SETTINGS)
    assert few.verdict == "nothing_missing"
    assert any("missing" in n for n in few.notes)


@pytest.mark.slow
def test_where_the_samples_were_lost_is_said() -> None:
    result = analyse(changed(made(), lossy(0.06, link=False)), SETTINGS)
    assert "host" in finding(result, "sample_loss").advice


@pytest.mark.slow
def test_repeated_samples_are_lost_ones() -> None:
    found = finding(analyse(changed(made(), stale(0.08)), SETTINGS), "sample_loss")
    assert found.parameters["missing"].value == 0
    assert found.parameters["part"].value == pytest.approx(0.08, abs=0.015)
    assert "no faster" in found.advice


def test_a_gap_in_a_run_is_neither_an_effect_nor_unexplained() -> None:
    result = analyse(changed(made(), gap(7.0, 8.5)), SETTINGS)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
    assert any("gap" in n for n in result.notes)


@pytest.mark.slow
def test_a_coarse_step_is_named_and_explains_what_it_makes() -> None:
    result = analyse(changed(made(BOW), coarse(0.1)), SETTINGS)
    assert names(result) == ["quantization", "rail_curvature"], result.unexplained
    found = finding(result, "quantization")
    assert found.owner is Owner.SENSOR
    assert found.parameters["step"].value == pytest.approx(0.1 * DEG)
    alone = analyse(changed(made(), coarse(0.25)), SETTINGS)
    assert names(alone) == ["quantization"], alone.unexplained


@pytest.mark.slow
def test_an_axis_that_rests_on_one_value_shows_no_noise() -> None:
    result = analyse(changed(made(), coarse(2.0)), SETTINGS)
    assert len(result.rest_noise) < 3
    assert all(p.value > 0 for p in result.rest_noise.values())


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.35, 0.5])
def test_what_a_step_of_many_times_the_noise_makes_of_g_is_no_curve_of_the_sensor(step: float) -> None:
    result, truth = analyse(changed(made(), coarse(step)), SETTINGS), np.array(G)
    assert names(result) == ["quantization"], result.unexplained
    fine = analysed().declared_parameters["g_sensitivity"]
    for name, p in result.declared_parameters["g_sensitivity"].items():
        true = truth["xyz".index(name[2]), "xyz".index(name[3])]
        if fine[name].stderr < 3e-5 and p.stderr > 0:
            assert abs(p.value - true) < 4 * p.stderr, (name, p, true)
            assert p.stderr > 3 * fine[name].stderr


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.025, 0.03, 0.035])
def test_a_step_as_fine_as_the_noise_is_nothing(step: float) -> None:
    result = analyse(changed(made(), coarse(step)), SETTINGS)
    assert names(result) == []
    assert result.verdict == "nothing_missing", result.unexplained


@pytest.mark.slow
def test_without_its_name_it_is_unexplained() -> None:
    nameless = Settings("mpu6050", catalogue=tuple(e for e in CATALOGUE if e.name != "sample_loss"))
    result = analyse(changed(made(), lossy(0.06)), nameless)
    assert result.verdict == "unexplained"
    assert result.unexplained is not None
    assert "missing" in result.unexplained.description


@pytest.mark.parametrize("sigma", [0.15, 0.25, 0.5, 1.0])
def test_noise_before_rounding_of_any_mean(sigma: float) -> None:
    rng = np.random.default_rng(4)
    pieces = [np.round(rng.uniform(-0.5, 0.5) + sigma * rng.standard_normal(400)) for _ in range(12)]
    assert noise_before_rounding(pieces) == pytest.approx(sigma, rel=0.25)


def test_the_lattice_of_scaled_integers_and_none_of_real_numbers() -> None:
    rng = np.random.default_rng(5)
    counts = np.round(30 * rng.standard_normal(3000))
    assert lattice_step(counts * 0.01 + 3.21) == pytest.approx(0.01)
    assert lattice_step(rng.standard_normal(3000)) == 0.0


def test_a_late_sample_is_no_lost_one_and_a_gap_is_counted() -> None:
    rng = np.random.default_rng(6)
    at = np.delete(np.arange(4000), [700, 701, 702, 2500])
    late = rng.random(len(at)) < 0.02
    stamps = np.round((at + 0.7 * late + 0.05 * rng.standard_normal(len(at))) * 5e6).astype(np.int64)
    index, period = grid_index(np.sort(stamps))
    assert index[-1] == 3999
    assert period == pytest.approx(5e-3, rel=1e-4)
    seen = look_at_stamps(index, period, rng.standard_normal((len(at), 6)))
    assert (seen.missing, seen.repeated) == (4, 0)
    assert seen.longest_s == pytest.approx(0.015, abs=0.006)


def test_no_accelerometer_leaves_the_clocks_undecided() -> None:
    def deaf(run: Run, role: str) -> tuple[Run, str]:
        return replace(run, imu=replace(run.imu, specific_force=np.full_like(run.imu.specific_force, np.nan))), role

    base = replace(BASE, chain=ChainParameters(rate_hz=25.0, filter_hz=9.0), temperature_topic=False)
    result = analyse(changed(made(base=base), deaf), SETTINGS)
    assert any(u.startswith("clock_skew could not be decided") for u in result.undecided), result.undecided


def test_at_25_hz_the_mains_could_not_be_decided_and_the_supply_says_which_run_would() -> None:
    base = replace(BASE, chain=ChainParameters(rate_hz=25.0, filter_hz=9.0, clock_ppm=0.0), temperature_topic=False)
    result = analyse(made(base=base), SETTINGS)
    assert any(u.startswith("line_tone at 50 Hz could not be decided") for u in result.undecided), result.undecided
    assert any(u.startswith("temperature_bias") for u in result.undecided)
    assert any("supply_toggled" in u for u in result.undecided if u.startswith("supply_voltage"))
