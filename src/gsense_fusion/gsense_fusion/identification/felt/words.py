"""What the accelerometer decided, and what it could not, in words for the report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK
from gsense_fusion.identification.types import FloatArray

SPEED_TILT = "viscous_tilt"
SEEN_AT = 7.0
"""Standard errors at which a tilt that only the accelerometer shows is claimed (the square is about its least gain)."""
ROUNDING = 1e-9
ACROSS = 2
"""Turns about the first two axes of the rail (along it, and level across it) turn gravity; about the vertical not."""


def felt_notes(a: Analysis) -> list[str]:
    """One line for each claim that the accelerometer has a word on."""
    if not a.likelihood.felt.decides:
        return []
    out = []
    for name in a.claims.names:
        line = _own_turn(a, name) if _turns(a.selection.effects[name]) else _rejected(a, name)
        out.extend([] if line is None else [line])
    return out


def hidden_tilt(a: Analysis) -> str:
    """How large a tilt with the speed must be for the accelerometer to show it, as the end of a sentence."""
    error = _errors(a)
    if error is None:
        return "hides in it"
    roll, pitch = (f"{SEEN_AT * e:.1g}" for e in error)
    return (
        f"hides in it below {roll} (about the rail) and {pitch} rad/(m/s) (across it), where the accelerometer sees it"
    )


def _turns(effect: Effect) -> bool:
    return type(effect).felt is not Effect.felt


def _own_turn(a: Analysis, name: str) -> str | None:
    """Energy with which gravity turns where the effect is what it says."""
    full = a.claims.full
    beta = np.zeros(len(full.beta))
    index = a.likelihood.columns.index(a.selection.with_parts({name}) & full.names)
    beta[index] = full.beta[index]
    energy = sum(float(beta @ g.xx @ beta) for g in a.likelihood.felt.grams(full.names, full.templates).values())
    seen = a.selection.gain(full, name)[0]
    share = f"whitened energy {energy:.0f}, {energy / max(seen, 1.0):.1g} of its whole; {RIVAL_LOGLIK:g} decide"
    if energy < RIVAL_LOGLIK:
        return f"{name}: gravity would turn with it by too little for the accelerometer to tell ({share})"
    return f"{name}: the accelerometer feels gravity turn with it, as with no pick-up ({share})"


def _rejected(a: Analysis, name: str) -> str | None:
    """True turns that the gyro takes for the effect and the accelerometer does not."""
    full, selection = a.claims.full, a.selection
    rest = full.names - selection.with_dependants(full.names, name)
    out = []
    for other in (n for n in selection.claimable() if _turns(selection.effects[n]) and n not in full.names):
        swapped = _tried(a, selection.with_parts(rest | {other}))
        if swapped is None:
            continue
        lost = 2 * (full.best_loglik - swapped.best_loglik)
        felt = 2 * (a.likelihood.felt.loglik(full) - a.likelihood.felt.loglik(swapped))
        if lost >= RIVAL_LOGLIK > lost - felt:
            out.append(f"{name} and no {other}: gravity does not turn with it (twice the log-likelihood: {felt:.0f})")
    return "; ".join(out) or None


def _tried(a: Analysis, names: frozenset[str]) -> Fit | None:
    return next((c.fit for c in a.selection.tried() if c.fit.names == names), None)


def _errors(a: Analysis) -> Sequence[float] | None:
    """Standard errors of the tilt with the speed about and across the rail from the accelerometer alone, rad/(m/s)."""
    if SPEED_TILT not in a.selection.effects:
        return None
    grams = a.likelihood.felt.grams(frozenset({SPEED_TILT}), Templates()).values()
    index = a.likelihood.columns.index(frozenset({SPEED_TILT}))[:ACROSS]
    information: FloatArray = np.sum([g.xx[np.ix_(index, index)] for g in grams], axis=0) if grams else np.zeros((2, 2))
    values = np.linalg.eigvalsh(information)
    if values[0] <= ROUNDING * values[-1]:  # a direction that the accelerometer says nothing about
        return None
    return [float(e) for e in np.sqrt(np.diag(np.linalg.inv(information)))]
