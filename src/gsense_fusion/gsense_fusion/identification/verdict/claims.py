"""From the best model to claims: vetoes, rivals, and what remains unexplained."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.errors.predict import Prediction, Predictor
from gsense_fusion.identification.likelihood.model import Fit, Likelihood, solve
from gsense_fusion.identification.likelihood.whitened import Gram
from gsense_fusion.identification.search.alternatives import p_beside
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK, Selection, template_sound
from gsense_fusion.identification.types import AXES, BoolArray, FloatArray, IntArray
from gsense_fusion.identification.verdict.homogeneity import homogeneity
from gsense_fusion.identification.verdict.refinement import of_its_own
from gsense_fusion.identification.verdict.residual import WindowResidual, residuals
from gsense_fusion.identification.verdict.sufficiency import (
    FAMILIES,
    FAMILY_ALPHA,
    Symptom,
    find_symptoms,
    order_energy,
)

SLOW_ALPHA = FAMILY_ALPHA / FAMILIES
"""Of what block means alone show: the chance that drift makes any of the slow alternatives gain as much."""
FELT_CLAIM_GAIN = 40.0
"""Least gain in twice the log-likelihood of what the accelerometer alone shows (a tilt with the speed, which hides in
G for the gyro)."""
REFINEMENT_PART = 0.01
"""An effect of the motion that removes less than this part of what the strongest one does refines a shape: no claim."""
FAMILY_PART = 0.1
"""The same beside one that looks alike to first order: what is left of it is more likely its own shape."""
IN_MOTION = frozenset({"orders", "kicks", "unequal", "lines", "band", "intensity"})
"""Kinds of symptoms that only motion shows."""
LOCKED_PART = 0.8
"""A claim stays only if it removes this part of the drive-locked structure, where some is left."""


@dataclass(frozen=True)
class Claims:
    """What is claimed, with the models that lead there."""

    full: Fit
    """The declared effects and all claims."""
    ladder: Mapping[str, Fit]
    """declared, then one model after each claim (named after it), and full."""
    names: tuple[str, ...]
    """Claimed effects, strongest first."""
    symptoms: tuple[Symptom, ...]
    nearest: tuple[str, ...]
    """Effects of the catalogue that come nearest to what is unexplained."""
    notes: tuple[str, ...]
    noise: Mapping[str, Explanation] = field(default_factory=dict)
    """Claimed effects that change the noise, by name."""


def judge(
    selection: Selection, best: Fit, statistical: Sequence[StatisticalEffect] = (), rounded: Rounding | None = None
) -> Claims:
    """Apply the vetoes to the best model and test what is left; `rounded`: what the step of the output does."""
    likelihood = selection.likelihood
    notes: list[str] = []
    terms = frozenset(n for n, e in selection.effects.items() if e.part_of is not None)
    found = sorted(best.names - selection.declared - terms, key=lambda n: -selection.gain(best, n)[0])
    names: list[str] = []
    refinements: list[str] = []
    for name in found:
        if (whose := _refines(selection, best, found, name)) is not None:
            notes.append(f"{name} improves the fit by under {whose}: a refinement of shape, not a claim")
            refinements.append(name)
        elif (reason := _refused(selection, best, name, rounded)) is not None:
            notes.append(f"{name} {reason}")
        else:
            names.append(name)
    tested = _fit(selection, names + refinements)
    left = residuals(likelihood, tested, likelihood.campaign.fit)
    symptoms, explained = explain_noise(likelihood, tested, left, statistical)
    unequal = _unequal(selection, tested, names)
    symptoms += [_unequal_symptom(selection, tested, n) for n in unequal]
    demoted = unequal + _companions(selection, names, refinements, unequal)
    names = [n for n in names if n not in demoted]
    if unequal or any(s.kind == "orders" for s in symptoms):
        rest = _fit(selection, names + refinements)
        demoted += [
            n for n in names if selection.effects[n].dynamic and _removed_part(selection, rest, n) < LOCKED_PART
        ]
        names = [n for n in names if n not in demoted]
    if any(s.kind in IN_MOTION for s in symptoms):
        doubtful = [n for n in names if not selection.effects[n].dynamic and _rests_on_motion(selection, names, n)]
        notes += [f"{n} rests on the means in motion, where something is unexplained: no claim" for n in doubtful]
        names = [n for n in names if n not in doubtful]
        explained, drifts = _without_drift(explained, likelihood, tested, left)
        symptoms += drifts
    full = _fit(selection, names)
    nearest = tuple(demoted) + tuple(n for n in _nearest(selection, full) if n not in demoted) if symptoms else ()
    return Claims(full, _ladder(selection, names), tuple(names), tuple(symptoms), nearest, tuple(notes), explained)


def _refines(selection: Selection, best: Fit, found: Sequence[str], name: str) -> str | None:
    """What an effect of the motion is small beside, so that it only refines its shape; None where it is not."""
    effects = selection.effects
    if not effects[name].dynamic:
        return None
    gain = {n: selection.gain(best, n)[0] for n in found if effects[n].dynamic}
    largest = max(gain, key=lambda n: gain[n])
    if gain[name] < REFINEMENT_PART * gain[largest] and not of_its_own(selection, best, name, largest):
        return f"{100 * REFINEMENT_PART:.0f} % of the strongest effect"
    family = effects[name].family
    alike = {n: g for n, g in gain.items() if family is not None and effects[n].family == family}
    strongest = max(alike, key=lambda n: alike[n], default=name)
    if gain[name] < FAMILY_PART * gain[strongest]:
        return f"{100 * FAMILY_PART:.0f} % of what {strongest} does, which looks like it"
    return None


def _refused(selection: Selection, best: Fit, name: str, rounded: Rounding | None) -> str | None:
    """Why an effect of the best model is no claim; None where it is one."""
    effect = selection.effects[name]
    if selection.gain(best, name)[0] < RIVAL_LOGLIK:
        return "hardly improves the fit: no claim"
    if not effect.dynamic and (p := _by_chance(selection, best, name)) > SLOW_ALPHA:
        return f"gains no more than drift alone may ({100 * p:.2g} % by chance): no claim"
    if _only_felt(selection, best, name):
        return "rests on the accelerometer alone and is not clear enough there: no claim"
    if not all(template_sound(selection.likelihood, best, t) for t in effect.templates if not t.optional):
        return "is only a local optimum: its parameter is not significant or at the end of its range"
    if rounded is not None and _is_rounding(selection, best, name, rounded):
        return "is as small as the gyro's rounding makes it: no claim"
    holds = not effect.dynamic or survives(selection, best, name)
    return None if holds else "does not hold on runs left out in turn: dropped"


def _rests_on_motion(selection: Selection, names: Sequence[str], name: str) -> bool:
    """Whether a slow effect is no more than chance where the means of the runs' motion are free."""
    rest = _fit(selection, [n for n in names if n != name and name not in selection.effects[n].needs])
    return p_beside(selection.likelihood, rest, name, 0.0, free_motion=True) > SLOW_ALPHA


def _without_drift(
    explained: dict[str, Explanation], likelihood: Likelihood, fit: Fit, left: Sequence[WindowResidual]
) -> tuple[dict[str, Explanation], list[Symptom]]:
    """Explanations but for a drift in motion, which becomes a symptom: what else moves the means looks like it."""
    kept = {n: found for n, found in explained.items() if found.settles != "drift"}
    if len(kept) == len(explained):
        return explained, []
    return kept, [s for s in find_symptoms(likelihood, fit, left) if s.kind == "drift"]


def _by_chance(selection: Selection, best: Fit, name: str) -> float:
    """Chance that drift alone makes some slow effect gain as much as this one does beside the others."""
    rest = selection.candidate(best.names - selection.with_dependants(best.names, name)).fit
    return p_beside(selection.likelihood, rest, name, selection.gain(best, name)[0])


def explain_noise(
    likelihood: Likelihood, fit: Fit, windows: Sequence[WindowResidual], statistical: Sequence[StatisticalEffect]
) -> tuple[list[Symptom], dict[str, Explanation]]:
    """What is left when the effects that change the noise are taken into account, each where its symptom vanishes."""
    symptoms = find_symptoms(likelihood, fit, windows)
    found: dict[str, Explanation] = {}
    level = 1.0
    settled: set[str] = set()
    for effect in statistical:
        if not any(s.kind == effect.symptom for s in symptoms):
            continue
        explanation = effect.explain(Seen(likelihood, fit, tuple(windows)))
        if explanation is None:
            continue
        level *= explanation.level
        settled.add(explanation.settles)
        rest = [s for s in find_symptoms(likelihood, fit, explanation.windows, level) if s.kind not in settled]
        if not any(s.kind == effect.symptom for s in rest):
            symptoms, windows = rest, explanation.windows
            found[effect.name] = explanation
    return symptoms, found


def _unequal(selection: Selection, fit: Fit, names: Sequence[str]) -> list[str]:
    """Dynamic claims that are of another size in every run."""
    dynamic = [n for n in names if selection.effects[n].dynamic]
    return [n for n in dynamic if not homogeneity(selection.likelihood, fit, selection.effects[n]).holds]


def _companions(
    selection: Selection, names: Sequence[str], refinements: Sequence[str], demoted: Sequence[str]
) -> list[str]:
    """Claims that are of one size only beside a demoted one: together they imitated what is in neither."""
    out: list[str] = []
    new = list(demoted)
    while new:
        left = [n for n in names if n not in demoted and n not in out]
        new = _unequal(selection, _fit(selection, [*left, *refinements]), left)
        out += new
    return out


def _unequal_symptom(selection: Selection, fit: Fit, name: str) -> Symptom:
    """What is left where a demoted claim was: something like it, of another size in every run."""
    likelihood = selection.likelihood
    rms = _size_in_motion(selection, fit, name)
    fastest = max(
        (r.motion.angular_frequency or 0.0 for r in likelihood.campaign.fit if r.motion is not None), default=0.0
    )
    text = f"locked to the drive and like {name}, but of another size in every run"
    p = homogeneity(likelihood, fit, selection.effects[name]).p_value
    return Symptom("unequal", _axes_of(rms), p, float(np.linalg.norm(rms)), (fastest,), text)


def _is_rounding(selection: Selection, fit: Fit, name: str, rounded: Rounding) -> bool:
    """Whether an effect is a curve of the signal that rounding to the gyro's step can make by itself."""
    if not selection.effects[name].memoryless:
        return False
    rms = _size_in_motion(selection, fit, name)
    return rounded.makes(_axes_of(rms), float(np.linalg.norm(rms)))


def _axes_of(rms: FloatArray) -> tuple[str, ...]:
    return tuple(AXES[i] for i in range(3) if rms[i] > 0.3 * rms.max())


def _size_in_motion(selection: Selection, fit: Fit, name: str) -> FloatArray:
    """Root mean square of an effect over the windows in motion, rad/s, shape (3,)."""
    likelihood = selection.likelihood
    predictor = Predictor(likelihood.effects, likelihood.source)
    with_it = Prediction.of("with", fit)
    without = replace(
        with_it, beta=np.where(np.isin(np.arange(len(fit.beta)), _columns_of(selection, name)), 0.0, fit.beta)
    )
    square, count = np.zeros(3), 0
    for data in likelihood.campaign.fit:
        for window in data.windows:
            if window.moving:
                cut = slice(window.start, window.stop)
                part = predictor.rate(data, with_it)[cut] - predictor.rate(data, without)[cut]
                square += np.sum(part**2, axis=0)
                count += len(window)
    return np.asarray(np.sqrt(square / max(count, 1)))


def _columns_of(selection: Selection, name: str) -> IntArray:
    return selection.likelihood.columns.index(selection.with_parts({name}))


def _fit(selection: Selection, names: Sequence[str]) -> Fit:
    return selection.candidate(selection.with_parts(selection.declared | frozenset(names))).fit


def _ladder(selection: Selection, names: Sequence[str]) -> dict[str, Fit]:
    steps = {"declared": _fit(selection, ())}
    for i in range(len(names)):
        allowed = frozenset(names[: i + 1]) | selection.declared
        # an effect that needs a later one (time_offset needs G) comes into the model with it
        needs = frozenset(need for n in allowed for need in selection.effects[n].needs)
        steps[names[i]] = selection.candidate(selection.with_parts(allowed | needs)).fit
    steps["full"] = _fit(selection, names)
    return steps


def survives(selection: Selection, best: Fit, name: str) -> bool:
    """Whether, on every run left out in turn, the effect fitted on the others gains likelihood in sum."""
    likelihood = selection.likelihood
    dropped = selection.with_dependants(best.names, name)
    without = selection.candidate(best.names - dropped).fit
    if not any(w.moving for r in likelihood.campaign.fit for w in r.windows):  # still poses only
        return _left_out_poses(likelihood, best) < _left_out_poses(likelihood, without)
    return _left_out(likelihood, best) > _left_out(likelihood, without)


def _left_out_poses(likelihood: Likelihood, fit: Fit) -> float:
    """Squared error of each pose's blocks predicted by least squares on the others."""
    X = likelihood.block_columns(fit.templates)
    index = likelihood.columns.index(fit.names)
    total = 0.0
    poses = np.unique(likelihood.blocks.run)
    for pose in poses:
        out = likelihood.blocks.run == pose
        beta, bias = _solve_without(likelihood, X, index, ~out)
        error = likelihood.blocks.rate[out] - X[out][:, :, index] @ beta - bias
        total += float(np.sum(error**2))
    return total


def _solve_without(
    likelihood: Likelihood, X: FloatArray, index: IntArray, keep: BoolArray
) -> tuple[FloatArray, FloatArray]:
    k = int(keep.sum())
    columns = np.concatenate([X[keep][:, :, index], np.repeat(np.eye(3)[None], k, axis=0)], axis=2)
    weight = np.sqrt(likelihood.blocks.duration[keep])
    A = (columns * weight[:, None, None]).reshape(3 * k, -1)
    y = (likelihood.blocks.rate[keep] * weight[:, None]).reshape(-1)
    beta, *_ = np.linalg.lstsq(A, y, rcond=1e-9)
    return beta[: len(index)], beta[len(index) :]


def _only_felt(selection: Selection, best: Fit, name: str) -> bool:
    """Whether the gyro would not miss an effect, and the accelerometer does not miss it clearly either."""
    felt = selection.felt_gain(best, name)
    seen = selection.gain(best, name)[0] - felt
    return selection.effects[name].dynamic and seen < RIVAL_LOGLIK and felt < FELT_CLAIM_GAIN


def _left_out(likelihood: Likelihood, fit: Fit) -> float:
    """Log-likelihood of every run's motion under coefficients from the other runs."""
    grams = likelihood.fast.grams(fit.templates, fit.names)
    slow = likelihood.slow_gram(fit.templates, fit.drift, fit.names)
    total = sum(likelihood.felt.grams(fit.names, fit.templates).values(), slow)
    moving = sum(gram.rows > 0 for gram in grams)
    for gram in grams:
        total = total + gram
    index = likelihood.columns.index(fit.names)
    value = 0.0
    for gram in grams:
        if gram.rows == 0:
            continue
        rest = Gram(total.xx - gram.xx, total.xy - gram.xy, total.yy - gram.yy, total.rows - gram.rows)
        part, _, _ = solve(rest, index, likelihood.columns.plausible)
        xx = gram.xx[np.ix_(index, index)]
        value -= 0.5 * (gram.yy - 2 * float(part @ gram.xy[index]) + float(part @ xx @ part))
        beta = np.zeros(len(fit.beta))
        beta[index] = part
        value += likelihood.felt.loglik(fit, beta) / moving
    return value


def _removed_part(selection: Selection, full: Fit, name: str) -> float:
    """Part of the drive-locked energy that the effect removes from the model without it."""
    likelihood = selection.likelihood
    dropped = selection.with_dependants(full.names, name)
    without = selection.candidate(full.names - dropped).fit
    runs = likelihood.campaign.fit
    before = order_energy([w for w in residuals(likelihood, without, runs) if w.window.moving]).locked()
    after = order_energy([w for w in residuals(likelihood, full, runs) if w.window.moving]).locked()
    return 1.0 - after / before if before > 0 else 1.0


def _nearest(selection: Selection, full: Fit) -> list[str]:
    """Effects that would explain some of the rest, best first."""
    gains = []
    for name in selection.claimable():
        names = full.names | {name}
        if name in full.names or not selection.allowed(names):
            continue
        gain = 2 * (selection.rough(names).fit.loglik - full.loglik)
        if gain > RIVAL_LOGLIK:
            gains.append((gain, name))
    return [name for _, name in sorted(gains, reverse=True)]
