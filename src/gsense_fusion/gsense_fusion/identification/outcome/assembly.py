"""The result of an analysis: parameters with their errors, findings, errors before and after, arrays for the plots."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from gsense_fusion.identification.analysis import UNDECIDED, Analysis
from gsense_fusion.identification.drivers import TEMPERATURE_REFERENCE
from gsense_fusion.identification.errors.metrics import (
    RATE_BAND_HZ,
    AttitudeTrace,
    Rms,
    attitude_rms,
    attitude_traces,
    band_rms,
    noise_floor,
    pose_floor,
    pose_rms,
)
from gsense_fusion.identification.felt.words import SPEED_TILT, felt_notes, hidden_tilt
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.likelihood.slow import Drift
from gsense_fusion.identification.motion.mounting import NOMINAL
from gsense_fusion.identification.outcome import plotdata
from gsense_fusion.identification.outcome.curves import fitted_curves
from gsense_fusion.identification.outcome.findings import TURNED, all_findings
from gsense_fusion.identification.outcome.hidden import OpenEffect, mounted_one_way, open_effects
from gsense_fusion.identification.outcome.parameters import declared_parameters, g_matrix, newest_bias, rail_direction
from gsense_fusion.identification.outcome.precision import covariances, encoder_delay, not_found, rest_noise
from gsense_fusion.identification.result import LoopResult, Plots, Ranked, RunSummary, Unexplained
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.types import AXES
from gsense_fusion.identification.verdict.sufficiency import Symptom

MAINS_HZ = (50.0, 60.0)
DRIFT_LIKE_HZ = 0.1
"""A tone that the sampling folds below this is no line."""


def assemble(a: Analysis, say: Callable[[str, float], None]) -> LoopResult:
    """Put the result together."""
    say("errors on held-out runs", 0.9)
    full = a.claims.full
    rest = a.likelihood.drift_at_rest(full)
    traces = attitude_traces(a.folds)
    units = sorted({c.unit_id for c in a.clean if c.unit_id})
    absent, spreads = not_found(a)
    left_open = open_effects(a, spreads)
    return LoopResult(
        sensor=a.clean[0].sensor,
        unit_id=units[0] if len(units) == 1 else None,
        declared=a.settings.declared,
        declared_parameters=declared_parameters(a),
        runs=_summaries(a),
        findings=all_findings(a),
        unexplained=_unexplained([*a.claims.symptoms, *_unnamed(a)], a.claims.nearest),
        rate_rms=_rate_rms(a, rest),
        pose_rms=_pose_rms(a, rest),
        attitude_gyro_only=attitude_rms(traces, "gyro_only"),
        attitude_madgwick=attitude_rms(traces, "madgwick"),
        bias=newest_bias(a, full),
        g_matrix=g_matrix(a),
        temperature_reference=TEMPERATURE_REFERENCE,
        undecided=_undecided(a, left_open),
        deciding_runs=_deciding_runs(a, left_open),
        notes=tuple(n for n in a.notes if UNDECIDED not in n)
        + a.claims.notes
        + tuple(felt_notes(a))
        + _several_units(units)
        + tuple(n for c in a.clean for n in c.notes),
        ranking=_ranking(a.selection, full),
        plots=_plots(a, traces, rest),
        supply_reference=a.likelihood.source.supply_reference,
        direction=rail_direction(a),
        covariances={**covariances(a), **spreads},
        not_found=absent,
        encoder_delay=encoder_delay(a),
        rest_noise=rest_noise(a),
    )


def _rate_rms(a: Analysis, rest: Mapping[int, Drift]) -> Rms:
    raw, declared, full = (band_rms(a.folds, m, RATE_BAND_HZ) for m in ("raw", "declared", "full"))
    return Rms(raw, declared, full, noise_floor(a.folds, a.noise, rest))


def _pose_rms(a: Analysis, rest: Mapping[int, Drift]) -> Rms | None:
    """None where there are too few still stretches."""
    raw, declared, full = (pose_rms(a.folds, m) for m in ("raw", "declared", "full"))
    if raw is None or declared is None or full is None:
        return None
    return Rms(raw, declared, full, pose_floor(a.folds, a.noise, rest))


def _summaries(a: Analysis) -> tuple[RunSummary, ...]:
    out = []
    for clean in a.clean:
        parts = [r for r in a.campaign.runs if r.run.path == clean.path]
        moving = next((r for r in parts if r.motion is not None and r.motion.angular_frequency is not None), None)
        delay = next((r.delay_s for r in parts if r.geometry.delay is not None), None)
        out.append(
            RunSummary(
                bag=clean.path,
                role=clean.role.value,
                samples=clean.received,
                lost=clean.lost,
                rate_hz=clean.rate_hz,
                session=clean.session,
                angular_frequency=None if moving is None or moving.motion is None else moving.motion.angular_frequency,
                amplitude=None if moving is None or moving.motion is None else moving.motion.amplitude,
                encoder_delay_s=delay,
            )
        )
    return tuple(out)


def _several_units(units: Sequence[str]) -> tuple[str, ...]:
    """What to do where the runs are of more than one sensor."""
    if len(units) < 2:
        return ()
    return (f"the bags are of units {', '.join(units)}, each with a G of its own: analyse every unit by itself",)


def _unexplained(symptoms: Sequence[Symptom], nearest: Sequence[str]) -> Unexplained | None:
    if not symptoms:
        return None
    axes = tuple(x for x in AXES if any(x in s.axes for s in symptoms))
    text = "; ".join(s.description for s in symptoms)
    if nearest:
        text += f"; partly like {nearest[0]}"
    frequencies = tuple(dict.fromkeys(f for s in symptoms for f in s.frequencies))
    rms = float(np.sqrt(np.sum([s.rate_rms**2 for s in symptoms])))
    return Unexplained(axes, rms, text, frequencies, tuple(nearest))


def _unnamed(a: Analysis) -> list[Symptom]:
    """What the recording shows and the catalogue has no name for."""
    return [Symptom("recording", x.axes, x.p_value, 0.0, (), x.symptom) for x in a.seen.unnamed]


def _undecided(a: Analysis, left_open: Sequence[OpenEffect]) -> tuple[str, ...]:
    out = [n for n in a.notes if UNDECIDED in n]
    out += [effect.line for effect in left_open]
    if mounted_one_way(a):
        out.append(
            "the board was mounted one way: only the column of G along the motion is identified, and a true tilt that "
            f"follows velocity {hidden_tilt(a)}; turn the board by 180 degrees"
        )
    if any(r.mounting is NOMINAL for r in a.campaign.runs):
        out.append(
            "no accelerometer: the rail is taken to lie along the sensor's x axis, z up and unturned, and how late the "
            "gyro is against the encoder is unknown; record an IMU of the same board beside it"
        )
    out += [_folded_mains(mains, a.campaign.rate_hz) for mains in MAINS_HZ if _near_zero(mains, a.campaign.rate_hz)]
    out.append("gyro scale, misalignment and lever arms cannot be seen while the true rate is zero")
    return tuple(out)


def _deciding_runs(a: Analysis, left_open: Sequence[OpenEffect]) -> dict[str, str]:
    """The run that would decide, of each effect that is left open; in one mounting a tilt with the speed is."""
    runs = {effect.name: effect.run for effect in left_open if effect.run is not None}
    hidden = mounted_one_way(a) and SPEED_TILT in a.selection.effects and SPEED_TILT not in a.claims.names
    return {**runs, SPEED_TILT: TURNED} if hidden else runs


def _near_zero(frequency_hz: float, rate_hz: float) -> bool:
    return abs((frequency_hz + rate_hz / 2) % rate_hz - rate_hz / 2) < DRIFT_LIKE_HZ


def _folded_mains(frequency_hz: float, rate_hz: float) -> str:
    return (
        f"line_tone at {frequency_hz:g} Hz {UNDECIDED}: at {rate_hz:.1f} samples a second the mains folds to nearly "
        "zero and looks like drift; record at another rate"
    )


def _ranking(selection: Selection, full: Fit) -> tuple[Ranked, ...]:
    tried = sorted(selection.tried(), key=lambda c: -c.score)
    best = tried[0].score
    return tuple(Ranked(tuple(sorted(c.fit.names)), best - c.score, full.loglik - c.fit.loglik) for c in tried[:12])


def _plots(a: Analysis, traces: Sequence[AttitudeTrace], rest: Mapping[int, Drift]) -> Plots:
    return Plots(
        per_run=plotdata.per_run(a, rest),
        orders=plotdata.orders(a),
        ellipse=plotdata.ellipse(a),
        position=plotdata.position_map(a),
        slow=plotdata.slow_trace(a),
        poses=plotdata.pose_scatter(a),
        attitude=plotdata.worst_attitude(traces),
        curves={
            **fitted_curves(a, plotdata.moving(a)),
            **{n: r.curve for n, r in a.seen.readings.items() if r.curve is not None},
        },
        **plotdata.spectra(a),
    )
