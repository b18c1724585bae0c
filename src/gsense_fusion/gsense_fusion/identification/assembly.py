"""The result of an analysis: parameters with their errors, findings, errors before and after, arrays for the plots."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification import plotdata
from gsense_fusion.identification.analysis import UNDECIDED, Analysis
from gsense_fusion.identification.campaign import TEMPERATURE_REFERENCE
from gsense_fusion.identification.claims import survives
from gsense_fusion.identification.curves import fitted_curves
from gsense_fusion.identification.effects.base import Effect, parts_of
from gsense_fusion.identification.felt_words import felt_notes, hidden_tilt
from gsense_fusion.identification.interval import searched
from gsense_fusion.identification.likelihood import Fit, Likelihood
from gsense_fusion.identification.metrics import (
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
from gsense_fusion.identification.mounting import NOMINAL
from gsense_fusion.identification.precision import (
    covariances,
    encoder_delay,
    not_found,
    rest_noise,
    rounding_variance,
)
from gsense_fusion.identification.predict import Prediction, Predictor, session_biases
from gsense_fusion.identification.result import Finding, LoopResult, Plots, Ranked, RunSummary, Unexplained
from gsense_fusion.identification.selection import Selection
from gsense_fusion.identification.sufficiency import Symptom
from gsense_fusion.identification.types import AXES, FloatArray, Parameter

MAINS_HZ = (50.0, 60.0)
DRIFT_LIKE_HZ = 0.1
"""A tone that the sampling folds below this is no line."""
AXIS_SIGMA = 2.576
SLOW_BAND_HZ = 0.1
TURNED = "board_turned_180"
OPPOSITE = -0.9
"""Cosine between the rail's directions in the sensor's axes from which a board counts as turned."""
BAND_ORDERS = 3.0
"""A dynamic effect's own band reaches to the third order of the fastest drive."""


def assemble(a: Analysis, say: Callable[[str, float], None]) -> LoopResult:
    """Put the result together."""
    say("errors on held-out runs", 0.9)
    full = a.claims.full
    folds = a.folds
    before, declared, after = (band_rms(folds, m, RATE_BAND_HZ) for m in ("raw", "declared", "full"))
    rest = a.likelihood.drift_at_rest(full)
    rate = Rms(before, declared, after, noise_floor(folds, a.noise, rest))
    poses = [pose_rms(folds, m) for m in ("raw", "declared", "full")]
    pose = None
    if poses[0] is not None and poses[1] is not None and poses[2] is not None:
        pose = Rms(poses[0], poses[1], poses[2], pose_floor(folds, a.noise, rest))
    traces = attitude_traces(folds)
    units = [c.unit_id for c in a.clean if c.unit_id]
    absent, spreads = not_found(a)
    return LoopResult(
        sensor=a.clean[0].sensor,
        unit_id=units[0] if units else None,
        declared=a.settings.declared,
        declared_parameters=_declared_parameters(a),
        runs=_summaries(a),
        findings=_findings(a),
        unexplained=_unexplained([*a.claims.symptoms, *_unnamed(a)], a.claims.nearest),
        rate_rms=rate,
        pose_rms=pose,
        attitude_gyro_only=attitude_rms(traces, "gyro_only"),
        attitude_madgwick=attitude_rms(traces, "madgwick"),
        bias=_bias(a, full),
        g_matrix=_g_matrix(a),
        temperature_reference=TEMPERATURE_REFERENCE,
        undecided=_undecided(a),
        notes=tuple(n for n in a.notes if UNDECIDED not in n)
        + a.claims.notes
        + tuple(felt_notes(a))
        + tuple(n for c in a.clean for n in c.notes),
        ranking=_ranking(a.selection, full),
        plots=_plots(a, traces),
        supply_reference=a.likelihood.source.supply_reference,
        direction=_direction(a),
        covariances={**covariances(a), **spreads},
        not_found=absent,
        encoder_delay=encoder_delay(a),
        rest_noise=rest_noise(a),
    )


def effect_parameters(
    likelihood: Likelihood, fit: Fit, effect: Effect, rounded: FloatArray | None = None
) -> dict[str, Parameter]:
    """Linear parameters with their errors (those of the effect's further terms too), then the searched ones.

    `rounded`: what a coarse step adds to the variance of each column's coefficient, shape (P,).
    """
    out = {}
    parts = parts_of(likelihood.effects, effect.name, fit.names)
    errors, added = searched(likelihood, fit, effect)
    variance = np.maximum(np.diag(fit.covariance), 0.0) + np.diag(added) + (0.0 if rounded is None else rounded)
    for part in parts:
        first = likelihood.columns.start[part.name]
        for i, parameter in enumerate(part.parameters):
            stderr = float(np.sqrt(variance[first + i]))
            out[parameter.name] = Parameter(float(fit.beta[first + i]), stderr, parameter.unit)
    for template, stderr in zip((t for e in parts for t in e.templates), errors, strict=True):
        value = fit.templates.get(template.field, template.default)
        out[template.name] = Parameter(value, float(stderr), template.unit)
    return effect.report(out)


def _direction(a: Analysis) -> tuple[float, float, float] | None:
    """The axis of the sensor that the rail is nearest to: what the effects of odd powers take for their sign."""
    known = [r.mounting.along for r in a.campaign.runs if r.mounting is not None and r.mounting.along is not None]
    if not known:
        return None
    along = known[0] * np.sign(known[0][int(np.argmax(np.abs(known[0])))])
    x, y, z = (float(v) for v in along / np.linalg.norm(along))
    return x, y, z


def _declared_parameters(a: Analysis) -> dict[str, dict[str, Parameter]]:
    full = a.claims.full
    out: dict[str, dict[str, Parameter]] = {}
    for name in a.settings.declared:
        if name == "bias":
            values, errors = _bias(a, full), _bias_stderr(a, full)
            out[name] = {f"b_{x}": Parameter(values[i], errors[i], "rad/s") for i, x in enumerate(AXES)}
        elif name in a.selection.effects:
            parameters = effect_parameters(a.likelihood, full, a.selection.effects[name], rounding_variance(a))
            doubt = not significant(a, name)
            out[name] = {n: replace(p, in_doubt=doubt) for n, p in parameters.items()}
    return out


def _bias(a: Analysis, fit: Fit) -> tuple[float, float, float]:
    """Of the newest session that was fitted."""
    predictor = Predictor(a.likelihood.effects, a.likelihood.source)
    model = Prediction.of("full", fit)
    biases = session_biases(a.campaign.runs, {r: predictor.without(r, model) for r in a.campaign.runs})
    newest = max(r.run.session for r in a.campaign.fit)
    x, y, z = (float(v) for v in biases[newest])
    return x, y, z


def _bias_stderr(a: Analysis, fit: Fit) -> tuple[float, float, float]:
    out = [0.0, 0.0, 0.0]
    for axis, slow in a.likelihood.slow.items():
        ones = np.ones((len(a.likelihood.blocks), 1))
        K = slow.covariance(fit.drift[axis])
        out[axis] = float(1.0 / np.sqrt((ones.T @ np.linalg.solve(K, ones))[0, 0]))
    return out[0], out[1], out[2]


def _g_matrix(a: Analysis) -> tuple[tuple[float, float, float], ...] | None:
    """G where it is significant; one that is not compensates nothing."""
    if not significant(a, "g_sensitivity"):
        return None
    first = a.likelihood.columns.start["g_sensitivity"]
    g = a.claims.full.beta[first : first + 9].reshape(3, 3)
    return tuple((float(r[0]), float(r[1]), float(r[2])) for r in g)


def significant(a: Analysis, name: str) -> bool:
    """Whether an effect of the full model would be a finding if it were not declared.

    A declared one needs no second run in motion that confirms it: where there is none, the criterion decides alone.
    """
    full = a.claims.full
    moving = sum(any(w.moving for w in r.windows) for r in a.campaign.fit)
    confirmed = moving == 1 or (name in full.names and survives(a.selection, full, name))
    return name in full.names and a.selection.supported(full, name) and confirmed


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


def _findings(a: Analysis) -> tuple[Finding, ...]:
    out = []
    full = a.claims.full
    steps = ["declared", *a.claims.names]
    for before, name in itertools.pairwise(steps):
        effect = a.selection.effects[name]
        band = _own_band(a, effect)
        parameters = effect_parameters(a.likelihood, full, effect)
        alternatives = a.selection.alternatives(full, name)
        out.append(
            Finding(
                effect=name,
                owner=effect.owner,
                axes=_axes(a, effect, parameters),
                parameters=parameters,
                p_value=a.selection.p_value(full, name),
                rate_rms_before=band_rms(a.folds, before, band),
                rate_rms_after=band_rms(a.folds, name, band),
                alternatives=tuple(alternatives),
                separating_run=_separating_run(a, name, alternatives),
                equation=effect.equation,
                source=effect.source,
            )
        )
    return (*out, *_noise_findings(a, steps[-1]), *_recorded_findings(a, steps[-1]))


def _recorded_findings(a: Analysis, last: str) -> list[Finding]:
    """What the recording itself shows: nothing can be subtracted, something has to be set or mended."""
    known = {e.name: e for e in a.settings.catalogue}
    rms = band_rms(a.folds, last, 0.4 * a.campaign.rate_hz) if a.seen.readings else 0.0
    return [
        Finding(
            effect=name,
            owner=known[name].owner,
            axes=found.axes,
            parameters=found.parameters,
            p_value=found.p_value,
            rate_rms_before=rms,
            rate_rms_after=rms,
            alternatives=found.alternatives,
            separating_run=found.separating_run,
            equation=known[name].equation,
            source=known[name].source,
            advice=found.advice,
        )
        for name, found in a.seen.readings.items()
    ]


def _noise_findings(a: Analysis, last: str) -> list[Finding]:
    """Effects that change the noise: nothing to subtract but, from each run with its own phase, a tone."""
    out = []
    known = {e.name: e for e in a.settings.catalogue}
    before = band_rms(a.folds, last, 0.4 * a.campaign.rate_hz)
    for name, found in a.claims.noise.items():
        after = float(np.sqrt(max(before**2 - found.removable**2 / len(a.campaign.axes), 0.0)))
        e = known[name]
        out.append(
            Finding(
                effect=name,
                owner=e.owner,
                axes=found.axes,
                parameters=found.parameters,
                p_value=found.p_value,
                rate_rms_before=before,
                rate_rms_after=after,
                alternatives=(),
                separating_run=None,
                equation=e.equation,
                source=e.source,
            )
        )
        before = after
    return out


def _separating_run(a: Analysis, name: str, alternatives: Sequence[str]) -> str | None:
    """The run that tells an effect from its rivals, as the pair, it or one of them knows it; none that is there."""
    done = {TURNED} if _turned(a) else set()
    for one, other in [(name, n) for n in alternatives] + [(n, name) for n in alternatives]:
        run = a.selection.effects[one].separates.get(other)
        if run is not None and run not in done:
            return run
    known = (a.selection.effects[n].separating_run for n in (name, *alternatives))
    return next((run for run in known if run is not None and run not in done), None) if alternatives else None


def _turned(a: Analysis) -> bool:
    """Whether two of the runs have the board turned by about 180 degrees against one another."""
    known = [r.mounting.along for r in a.campaign.fit if r.mounting is not None and r.mounting.along is not None]
    return any(float(one @ other) < OPPOSITE for one, other in itertools.combinations(known, 2))


def _own_band(a: Analysis, effect: Effect) -> float:
    """Up to where an effect acts, Hz, at most 0.4 of the sample rate."""
    fastest = max((r.motion.angular_frequency or 0.0 for r in a.campaign.runs if r.motion is not None), default=0.0)
    band = BAND_ORDERS * fastest / (2 * np.pi) if effect.dynamic and fastest else SLOW_BAND_HZ
    return float(min(max(band, SLOW_BAND_HZ), 0.4 * a.campaign.rate_hz))


def _axes(a: Analysis, effect: Effect, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Axes with a significant parameter: the first letter after the underscore names the axis (c_x, t_y, g_xz)."""
    hit = {n.split("_")[1][0] for n, p in parameters.items() if "_" in n and abs(p.value) > AXIS_SIGMA * p.stderr > 0}
    axes = tuple(x for x in AXES if x in hit)
    if axes:
        return axes
    if effect.needs:  # it acts on the axes of the effect that it modifies
        other = a.selection.effects[effect.needs[0]]
        return _axes(a, other, effect_parameters(a.likelihood, a.claims.full, other))
    return tuple(AXES[i] for i in a.campaign.axes)


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


def _undecided(a: Analysis) -> tuple[str, ...]:
    out = [n for n in a.notes if UNDECIDED in n]
    mounts = {r.mounting_number for r in a.campaign.runs if r.motion is not None and r.mounting_number is not None}
    if len(mounts) == 1:
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


def _plots(a: Analysis, traces: Sequence[AttitudeTrace]) -> Plots:
    return Plots(
        per_run=plotdata.per_run(a),
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
