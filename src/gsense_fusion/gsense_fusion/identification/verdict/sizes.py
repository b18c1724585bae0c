"""How much an effect does in motion, and about which axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gsense_fusion.identification.errors.predict import Prediction, Predictor
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.types import AXES, FloatArray


def size_in_motion(selection: Selection, fit: Fit, name: str) -> FloatArray:
    """Root mean square of an effect over the windows in motion, rad/s, shape (3,)."""
    likelihood = selection.likelihood
    own = likelihood.columns.index(selection.with_parts({name}))
    predictor = Predictor(likelihood.effects, likelihood.source)
    with_it = Prediction.of("with", fit)
    without = replace(with_it, beta=np.where(np.isin(np.arange(len(fit.beta)), own), 0.0, fit.beta))
    square, count = np.zeros(3), 0
    for data in likelihood.campaign.fit:
        for window in data.windows:
            if window.moving:
                cut = slice(window.start, window.stop)
                part = predictor.rate(data, with_it)[cut] - predictor.rate(data, without)[cut]
                square += np.sum(part**2, axis=0)
                count += len(window)
    return np.asarray(np.sqrt(square / max(count, 1)))


def axes_of(rms: FloatArray) -> tuple[str, ...]:
    """Axes that have a good part of the largest one's size."""
    return tuple(AXES[i] for i in range(3) if rms[i] > 0.3 * rms.max())
