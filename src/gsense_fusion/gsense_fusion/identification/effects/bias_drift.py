"""The bias wanders more while the carriage moves than at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.types import AXES, Owner, Parameter
from gsense_fusion.identification.verdict.motion_drift import motion_drift
from gsense_fusion.identification.verdict.residual import WindowResidual


class BiasDrift(StatisticalEffect):
    """A rate random walk beyond what the rest records predict; equal drift at rest and in motion is no finding."""

    name = "bias_drift"
    owner = Owner.SENSOR
    equation = "b(t): random walk of strength q while the carriage moves"
    source = "IEEE Std 1431: rate random walk; wear of a mount or warming by motion makes it depend on the motion"
    symptom = "drift"
    separating_run = "long_rest"

    def explain(self, seen: Seen) -> Explanation | None:
        """The strength of the walk in motion."""
        found = motion_drift(seen.likelihood, seen.fit)
        if found is None:
            return None
        p = found.chance.p_value(found.gain)
        parameters = {"q": Parameter(found.q, found.q_stderr, "rad/s/sqrt(s)")}
        axes = tuple(AXES[i] for i in seen.likelihood.slow)
        windows = tuple(_whitened(w, found.q) for w in seen.windows)
        return Explanation(parameters, axes, p, windows, 0.0, settles=self.symptom)


def _whitened(residual: WindowResidual, q: float) -> WindowResidual:
    """A moving window's residual whitened by noise that contains the walk: q^2 / (2 pi^2 f^2)."""
    if not residual.window.moving:
        return residual
    walk = q**2 / (2 * np.pi**2 * residual.frequency**2)
    per_psd = residual.bins.weight**2 * residual.data.run.rate_hz * len(residual.window) / 4.0
    return replace(residual, spectrum=residual.spectrum / np.sqrt(1.0 + per_psd * walk[:, None]))
