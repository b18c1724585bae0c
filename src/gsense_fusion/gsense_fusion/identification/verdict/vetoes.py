"""Why an effect of the best model is no claim."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.alternatives import JUMP, gravity_columns, motion_offsets, p_beside
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK, Selection
from gsense_fusion.identification.search.soundness import sound
from gsense_fusion.identification.verdict.courses import rather_gradual
from gsense_fusion.identification.verdict.exertion import lingering
from gsense_fusion.identification.verdict.left_out import survives
from gsense_fusion.identification.verdict.models import claimed_fit, fit_without
from gsense_fusion.identification.verdict.refinement import delays_the_force, of_its_own
from gsense_fusion.identification.verdict.residual import residuals
from gsense_fusion.identification.verdict.sizes import axes_of, size_in_motion
from gsense_fusion.identification.verdict.sufficiency import FAMILIES, FAMILY_ALPHA, order_energy

SLOW_ALPHA = FAMILY_ALPHA / FAMILIES
"""Of what block means alone show: the chance that drift makes any of the slow alternatives gain as much."""
OPEN_ALPHA = 0.01
"""The same up to which such an effect is no claim, but undecided rather than absent."""
INSTANT_SHARE = 0.1
"""Of the level of a slow effect, for a second way to it."""
FELT_CLAIM_GAIN = 40.0
"""Least gain in twice the log-likelihood of what the accelerometer alone shows (a tilt with the speed, which hides in
G for the gyro)."""
REFINEMENT_PART = 0.01
"""An effect of the motion that removes less than this part of what the strongest one does refines a shape: no claim."""
FAMILY_PART = 0.1
"""The same beside one that looks alike to first order: what is left of it is more likely its own shape."""


def refines(selection: Selection, best: Fit, found: Sequence[str], name: str) -> str | None:
    """Why an effect of the motion only refines the shape of a larger one; None where it does not."""
    effects = selection.effects
    if not effects[name].dynamic:
        return None
    gain = {n: selection.gain(best, n)[0] for n in found if effects[n].dynamic}
    largest = max(gain, key=lambda n: gain[n])
    if gain[name] < REFINEMENT_PART * gain[largest] and not of_its_own(selection, best, name, largest):
        return f"improves the fit by under {100 * REFINEMENT_PART:.0f} % of the strongest effect"
    family = effects[name].family
    alike = {n: g for n, g in gain.items() if family is not None and effects[n].family == family}
    strongest = max(alike, key=lambda n: alike[n], default=name)
    if gain[name] < FAMILY_PART * gain[strongest]:
        return f"improves the fit by under {100 * FAMILY_PART:.0f} % of what {strongest} does, which looks like it"
    shaped = [n for n, g in gain.items() if g > gain[name] and n not in alike and selection.shapes_of(n)]
    if name == "time_offset" and shaped and not delays_the_force(selection, best):
        return f"is what the shape of {shaped[0]} leaves, as G f by itself is not that late"
    return None


@dataclass(frozen=True)
class Refusal:
    """Why an effect of the best model is no claim."""

    reason: str
    undecided: bool = False
    """Whether it may well be there."""


def refused(selection: Selection, best: Fit, name: str, rounded: Rounding | None) -> Refusal | None:
    """Why an effect of the best model is no claim; None where it is one."""
    if not selection.effects[name].dynamic and selection.gain(best, name)[0] >= RIVAL_LOGLIK:
        slow = _slow_refusal(selection, best, name)
        if slow is not None:
            return slow
    reason = _weak(selection, best, name, rounded)
    return None if reason is None else Refusal(reason)


def _weak(selection: Selection, best: Fit, name: str, rounded: Rounding | None) -> str | None:
    """What is wrong with a claim, whatever drift may do."""
    effect = selection.effects[name]
    if selection.gain(best, name)[0] < RIVAL_LOGLIK:
        return "hardly improves the fit: no claim"
    if _only_felt(selection, best, name):
        return "rests on the accelerometer alone and is not clear enough there: no claim"
    if not sound(selection, best, name):
        return "is only a local optimum: its parameter is not significant or at the end of its range"
    if rounded is not None and _is_rounding(selection, best, name, rounded):
        return "is as small as the gyro's rounding makes it: no claim"
    holds = not effect.dynamic or survives(selection, best, name)
    return None if holds else "does not hold on runs left out in turn: dropped"


def rests_on_motion(selection: Selection, names: Sequence[str], name: str, lingers: bool = False) -> bool:
    """Whether a slow effect is no more than chance where the means of the runs' motion are free.

    What something unexplained in the motion does to the means is then no evidence; what rest shows and what changes
    within a run still is, unless what motion leaves behind `lingers` there.
    """
    likelihood = selection.likelihood
    rest = claimed_fit(selection, [n for n in names if n != name and name not in selection.effects[n].needs])
    free = motion_offsets(likelihood)
    if lingers:
        free = np.concatenate([free, lingering(likelihood, rest)], axis=1)
    return p_beside(likelihood, rest, name, 0.0, free) > SLOW_ALPHA


def _slow_refusal(selection: Selection, best: Fit, name: str) -> Refusal | None:
    """Why drift alone, or for a step something gradual, may be what an effect of the block means explains."""
    rest = fit_without(selection, best, name)
    gain = selection.gain(best, name)[0]
    p = p_beside(selection.likelihood, rest, name, gain)
    if name == JUMP:
        free = gravity_columns(selection.likelihood, rest)
        p = max(p, p_beside(selection.likelihood, rest, name, gain, free)) if free.shape[1] else p
    p = min(p, _p_of_instant(selection, best, rest, name))
    if p > OPEN_ALPHA:
        return Refusal(f"gains no more than drift alone may ({100 * p:.2g} % by chance): no claim")
    if name == JUMP:
        course = rather_gradual(selection.likelihood, rest, best.templates.get("jump_time_s"))
        if course is not None:
            return Refusal(f"explains less than a gradual change ({course}): no claim")
    if p > SLOW_ALPHA:
        return Refusal(f"drift alone gains as much in {100 * p:.2g} % of sessions", undecided=True)
    return None


def _p_of_instant(selection: Selection, best: Fit, rest: Fit, name: str) -> float:
    """Chance that noise in motion makes a step look as sudden as it does within a run, at any instant of any run.

    Block means alone cannot tell a step in the middle of a block from drift, the samples of the run can.
    """
    apart_s = next((t.plausible for t in selection.effects[name].templates if t.gaps), None)
    if apart_s is None:
        return 1.0
    likelihood = selection.likelihood
    gain = 2 * (likelihood.moving_loglik(best) - likelihood.moving_loglik(rest))
    windows = (len(w) / r.run.rate_hz for r in likelihood.campaign.fit for w in r.windows if w.moving)
    instants = max(1.0, sum(windows) / apart_s)
    return float(min(1.0, instants / INSTANT_SHARE * chi2.sf(max(gain, 0.0), 1 + len(likelihood.slow))))


def _only_felt(selection: Selection, best: Fit, name: str) -> bool:
    """Whether the gyro would not miss an effect, and the accelerometer does not miss it clearly either."""
    felt = selection.felt_gain(best, name)
    seen = selection.gain(best, name)[0] - felt
    return selection.effects[name].dynamic and seen < RIVAL_LOGLIK and felt < FELT_CLAIM_GAIN


def _is_rounding(selection: Selection, fit: Fit, name: str, rounded: Rounding) -> bool:
    """Whether an effect is a curve of the signal that rounding to the gyro's step can make by itself."""
    if not selection.effects[name].memoryless:
        return False
    rms = size_in_motion(selection, fit, name)
    return rounded.makes(axes_of(rms), float(np.linalg.norm(rms)))


def removed_part(selection: Selection, full: Fit, name: str) -> float:
    """Part of the drive-locked energy that the effect removes from the model without it."""
    likelihood = selection.likelihood
    without = fit_without(selection, full, name)
    runs = likelihood.campaign.fit
    before = order_energy([w for w in residuals(likelihood, without, runs) if w.window.moving]).locked()
    after = order_energy([w for w in residuals(likelihood, full, runs) if w.window.moving]).locked()
    return 1.0 - after / before if before > 0 else 1.0
