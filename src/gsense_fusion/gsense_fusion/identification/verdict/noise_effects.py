"""Which symptoms vanish with an effect that changes the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.sufficiency import Symptom, find_symptoms


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


def without_drift(
    explained: dict[str, Explanation], likelihood: Likelihood, fit: Fit, left: Sequence[WindowResidual]
) -> tuple[dict[str, Explanation], list[Symptom]]:
    """Explanations but for a drift in motion, which becomes a symptom: what else moves the means looks like it."""
    kept = {n: found for n, found in explained.items() if found.settles != "drift"}
    if len(kept) == len(explained):
        return explained, []
    return kept, [s for s in find_symptoms(likelihood, fit, left) if s.kind == "drift"]


def with_walk(noise: Mapping[int, NoiseModel], explained: Mapping[str, Explanation]) -> dict[int, NoiseModel] | None:
    """Noise of the moving windows, by axis, with the walk that runs in motion; None where none was found.

    A window's low orders hold much of a strong walk: weighed by the noise at rest alone, a step or a slow part of some
    effect fits into it by many errors.
    """
    walks = (found.parameters["q"].value for found in explained.values() if found.settles == "drift")
    q = next(walks, None)
    if q is None:
        return None
    return {axis: replace(model, walk=model.walk + q**2 / (2 * np.pi**2)) for axis, model in noise.items()}
