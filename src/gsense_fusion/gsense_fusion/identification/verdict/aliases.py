"""A ripple of belt teeth above half the sample rate: its aliases are lines that no band of the fit explains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.likelihood.model import Likelihood
from gsense_fusion.identification.verdict.claims import Claims

HARMONICS = (1, 2, 3)
NEAR = 0.04
"""Of a ripple's highest frequency: it dwells just below it."""
NEAR_HZ = 1.5


def with_aliases(claims: Claims, likelihood: Likelihood) -> Claims:
    """The claims with what a claimed ripple does beyond the band said, and not counted as unexplained."""
    if "belt_tooth" not in claims.names:
        return claims
    pitch = claims.full.templates.get("tooth_pitch_m", 5e-3)
    fastest = _fastest(likelihood)
    notes = list(claims.notes)
    folded = [v / pitch for v, rate in fastest if v / pitch > rate / 2]
    if folded:
        notes.append(
            f"belt_tooth: in {len(folded)} of {len(fastest)} runs the ripple reaches {max(folded):.0f} Hz, above half "
            "the sample rate, and folds back into lower frequencies; its size comes from the slower runs"
        )
    left = []
    for symptom in claims.symptoms:
        tones = [w / (2 * np.pi) for w in symptom.frequencies]
        if symptom.kind == "lines" and all(_is_alias(f, fastest, pitch) for f in tones):
            notes.append(f"belt_tooth: {symptom.description}: the ripple's harmonics, folded by the sampling")
        else:
            left.append(symptom)
    nearest = claims.nearest if left else ()
    return replace(claims, symptoms=tuple(left), notes=tuple(notes), nearest=nearest)


def _fastest(likelihood: Likelihood) -> list[tuple[float, float]]:
    """Highest speed in m/s and sample rate of each fit run that moves."""
    out = []
    for data in likelihood.campaign.fit:
        speed = np.abs(likelihood.source.of(data, Templates()).kinematics.velocity)
        moving = [float(speed[w.start : w.stop].max()) for w in data.windows if w.moving]
        if moving:
            out.append((max(moving), data.run.rate_hz))
    return out


def _is_alias(frequency_hz: float, fastest: list[tuple[float, float]], pitch: float) -> bool:
    for speed, rate in fastest:
        for harmonic in HARMONICS:
            true = harmonic * speed / pitch
            seen = abs((true + rate / 2) % rate - rate / 2)
            if abs(frequency_hz - seen) < max(NEAR * true, NEAR_HZ):
                return True
    return False
