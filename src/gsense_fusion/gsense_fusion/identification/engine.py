"""Closing the loop, step by step: which effects the declared model lacks, and what they change on runs not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.analysis import UNDECIDED, Analysis, Progress, Settings
from gsense_fusion.identification.campaign import MIN_MOVING_S, MIN_STILL_S, Campaign
from gsense_fusion.identification.catalogue import RECORDED
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.effects.quantization import Rounding, rounding
from gsense_fusion.identification.effects.recorded import RecordedEffect, Recording, Seen, look_at
from gsense_fusion.identification.effects.statistical import StatisticalEffect
from gsense_fusion.identification.errors.folds import make_folds
from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.memory import keep_freed_memory
from gsense_fusion.identification.motion.earth import without_earth_rate
from gsense_fusion.identification.motion.mounting import NOMINAL, wandering_delay
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.noise.rest import noise_at_rest
from gsense_fusion.identification.noise.spectrum import NoiseModel, at_least
from gsense_fusion.identification.outcome.assembly import assemble
from gsense_fusion.identification.recording.clock import Skew, on_one_clock
from gsense_fusion.identification.recording.integrity import CleanRun, clean_runs
from gsense_fusion.identification.recording.stillness import expand_still
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.search.alternatives import slow_residual
from gsense_fusion.identification.search.lesser_tops import without_lesser_tops
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.search.soundness import rather_sound
from gsense_fusion.identification.types import AXES, FloatArray, IdentificationError, Role
from gsense_fusion.identification.verdict.aliases import with_aliases
from gsense_fusion.identification.verdict.carried_over import shares
from gsense_fusion.identification.verdict.claims import Claims, judge
from gsense_fusion.identification.verdict.noise_effects import with_walk
from gsense_fusion.identification.verdict.sufficiency import Symptom
from gsense_fusion.identification.verdict.turned_field import beyond_turns

__all__ = ["Settings", "analyse", "close_loop"]

WANDERING = frozenset({"course", "drift", "intensity"})
"""Kinds of symptoms that block means alone show."""


def close_loop(runs: Sequence[tuple[Run, Role]], settings: Settings, progress: Progress | None = None) -> LoopResult:
    """Find what the declared model lacks.

    Args:
        runs: The runs with their roles; without a held-out one, each is held out in turn.
        settings: Sensor, declared effects and catalogue.
        progress: Where to say how far the work is.

    Raises:
        IdentificationError: The input is unusable; one line says why.

    """
    keep_freed_memory()
    say = progress or (lambda _text, _part: None)
    return assemble(analyse(runs, settings, say), say)


def analyse(runs: Sequence[tuple[Run, Role]], settings: Settings, say: Progress) -> Analysis:
    """Everything up to the claims and the folds that judge them; arguments and errors as `close_loop`."""
    _check_declared(settings)
    say("grid, losses and sessions", 0.02)
    clean = clean_runs(runs)
    say("motion, mounting and delay", 0.05)
    campaign, skew = _campaign(clean, settings)
    say("noise at rest", 0.15)
    recording = Recording(tuple(clean), campaign, skew, frozenset(e.name for e in settings.catalogue))
    seen = _recorded(recording, settings.catalogue)
    noise, notes, rounded = _noise(campaign, recording)
    source = DriverSource(campaign, Response.of(noise, campaign.rate_hz))
    fitted = tuple(e for e in settings.catalogue if not isinstance(e, RecordedEffect))
    effects, undecidable = decidable(fitted, campaign, source)
    statistical = tuple(e for e in effects if isinstance(e, StatisticalEffect))
    effects = tuple(e for e in effects if not isinstance(e, StatisticalEffect))
    likelihood = Likelihood(campaign, source, effects, noise)
    base = _declared(settings, campaign, likelihood)
    selection, claims, folds = _searched(likelihood, base, statistical, rounded, say)
    if claims.names and (in_motion := with_walk(noise, claims.noise)) is not None:
        likelihood = Likelihood(campaign, source, effects, noise, in_motion)
        selection, claims, folds = _searched(likelihood, base, statistical, rounded, say)
    if not folds:
        raise IdentificationError(
            f"{clean[0].path}: a single still stretch cannot be fitted and judged; record more runs"
        )
    declared = selection.candidate(base).fit
    seen = beyond_turns(seen, folds)
    return Analysis(
        settings,
        tuple(clean),
        campaign,
        noise,
        likelihood,
        selection,
        declared,
        claims,
        tuple(folds),
        notes + seen.notes + undecidable + seen.undecided,
        seen,
        rounded,
    )


def _recorded(recording: Recording, catalogue: Sequence[Effect]) -> Seen:
    """What the recording itself shows; an effect of the user's own catalogue goes before ours of that name."""
    known = (*(e for e in catalogue if isinstance(e, RecordedEffect)), *RECORDED)
    return look_at(recording, tuple({e.name: e for e in reversed(known)}.values()), recording.names)


def _declared(settings: Settings, campaign: Campaign, likelihood: Likelihood) -> frozenset[str]:
    """The declared effects that these runs can be fitted with."""
    base = frozenset(n for n in settings.declared if n != "bias" and n in likelihood.columns.start)
    if "g_sensitivity" in base and any(r.mounting is NOMINAL for r in campaign.runs):
        base |= likelihood.columns.start.keys() & {"time_offset"}  # nothing else tells the delay of the encoder
    return base


def _searched(
    likelihood: Likelihood,
    base: frozenset[str],
    statistical: Sequence[StatisticalEffect],
    rounded: Rounding | None,
    say: Progress,
) -> tuple[Selection, Claims, list[Held]]:
    """The models tried, and the claims with the folds that judge them."""
    selection = Selection(likelihood, base, lambda text: say(f"trying {text}", 0.4))
    best = rather_sound(selection, without_lesser_tops(selection, selection.search()))
    say("is anything left?", 0.7)
    return selection, *_proven(selection, best.fit, statistical, rounded, say)


def _proven(
    selection: Selection, best: Fit, statistical: Sequence[StatisticalEffect], rounded: Rounding | None, say: Progress
) -> tuple[Claims, list[Held]]:
    """The claims and the folds that judge them, without those that the runs held out speak against."""
    likelihood = selection.likelihood
    campaign, source, effects = likelihood.campaign, likelihood.source, likelihood.effects
    refuted: set[str] = set()
    while True:
        claims = judge(selection, best, statistical, rounded, refuted)
        claims = beyond_rounding(claims, rounded, np.std(slow_residual(likelihood, claims.full), axis=0))
        claims = with_aliases(claims, likelihood)
        folds = make_folds(campaign, source, effects, likelihood.noise, claims.ladder, lambda text: say(text, 0.8))
        dynamic = [n for n in claims.names if n in selection.effects and selection.effects[n].dynamic]
        found = shares(tuple(claims.ladder), dynamic, folds, likelihood.noise)
        against = [n for n, share in found.items() if share.refuted]
        if not against:
            return claims, folds
        refuted.add(min(against, key=lambda n: found[n].value))  # without it the others may carry over


def _campaign(clean: Sequence[CleanRun], settings: Settings) -> tuple[Campaign, Skew | None]:
    """Motion and mounting of the runs on one clock, without earth rate where the site is known."""
    campaign, skew = on_one_clock(split_single(expand_still(clean)))
    if settings.site is not None:
        campaign = without_earth_rate(campaign, settings.site)
    if not campaign.fit:
        raise IdentificationError("every run is held out: name runs to fit with --fit")
    if not any(r.windows for r in campaign.fit):
        raise IdentificationError(
            f"{campaign.fit[0].run.path}: the carriage neither moves steadily for {MIN_MOVING_S:g} s nor rests for "
            f"{MIN_STILL_S:g} s in any run to fit"
        )
    return campaign, skew


def _noise(campaign: Campaign, recording: Recording) -> tuple[dict[int, NoiseModel], tuple[str, ...], Rounding | None]:
    """Noise by axis, never under what rounding makes; what there is to say of it, and the rounding."""
    noise, notes = noise_at_rest(campaign)
    rounded = rounding(recording)
    if rounded is not None:
        made, coarse = rounded.spectrum(campaign.rate_hz), rounded.coarse
        for axis, model in noise.items():
            density = float(made[axis])
            noise[axis] = at_least(model, density) if coarse[axis] else replace(model, rounding=density)
    drifting = wandering_delay([r.geometry for r in campaign.runs])
    notes += () if drifting is None else (drifting,)
    return noise, notes, rounded


def beyond_rounding(claims: Claims, rounded: Rounding | None, wandered: FloatArray) -> Claims:
    """Without the symptoms that a coarse step of the output makes by itself.

    Args:
        claims: With all symptoms.
        rounded: What the rounding does.
        wandered: Standard deviation of the block means that the claims leave, rad/s, shape (3,): a course or a drift is
            no larger than that, whatever its strength makes of the whole session.

    """
    if rounded is None:
        return claims
    made = tuple(s for s in claims.symptoms if rounded.makes(s.axes, _shown(s, wandered), s.kind == "uneven"))
    if not made:
        return claims
    notes = tuple(f"as small as the gyro's rounding makes it: {s.description}" for s in made)
    left = tuple(s for s in claims.symptoms if s not in made)
    return replace(claims, symptoms=left, nearest=claims.nearest if left else (), notes=claims.notes + notes)


def _shown(symptom: Symptom, wandered: FloatArray) -> float:
    """Size of a symptom as far as the data itself shows it, rad/s."""
    if symptom.kind not in WANDERING:
        return symptom.rate_rms
    return min(symptom.rate_rms, float(np.linalg.norm([wandered[AXES.index(x)] for x in symptom.axes])))


def _check_declared(settings: Settings) -> None:
    known = {effect.name for effect in settings.catalogue if effect.part_of is None} | {"bias"}
    unknown = [n for n in settings.declared if n not in known]
    if unknown:
        raise IdentificationError(f"--declared {unknown[0]}: no such effect; known are {', '.join(sorted(known))}")


def split_single(runs: Sequence[CleanRun]) -> list[CleanRun]:
    """A single run is halved, so that each half can be judged by a model that saw only the other."""
    if len(runs) != 1:
        return list(runs)
    run = runs[0]
    middle = len(run) // 2
    halves = []
    for number, cut in enumerate((slice(0, middle), slice(middle, None))):
        time = run.time[cut]
        inside = None if run.pose_time is None else (run.pose_time >= time[0] - 0.5) & (run.pose_time <= time[-1] + 0.5)
        halves.append(
            replace(
                run,
                name=f"{run.name} half {number + 1}",
                time=time,
                angular_rate=run.angular_rate[cut],
                specific_force=run.specific_force[cut],
                valid=run.valid[cut],
                pose_time=None if run.pose_time is None or inside is None else run.pose_time[inside],
                pose=None if run.pose is None or inside is None else run.pose[inside],
                temperature=None if run.temperature is None else run.temperature[cut],
            )
        )
    return halves


def decidable(
    catalogue: tuple[Effect, ...], campaign: Campaign, source: DriverSource
) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
    """The effects that these runs can show at all, and for the others what is missing."""
    kept: list[Effect] = []
    lacking: list[str] = []
    drivers = [source.of(r, Templates()) for r in campaign.fit]
    for effect in catalogue:
        reasons = [reason for reason in (effect.missing(d) for d in drivers) if reason is not None]
        if reasons and (effect.every_run or len(reasons) == len(drivers)):
            if effect.part_of is not None:
                continue
            lacking.append(f"{effect.name} {UNDECIDED}: {reasons[0]}")
        elif all(any(e.name == need for e in catalogue) for need in effect.needs):
            kept.append(effect)
    return tuple(kept), tuple(lacking)
