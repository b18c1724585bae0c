"""How much an effect does in motion, and about which axes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.errors.predict import Prediction, Predictor
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.motion.harmonics import least_squares
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.types import AXES, FloatArray

HIGHEST_ORDER = 6
STRONG = 0.2
"""Of the strongest order: what else is named."""


def size_in_motion(selection: Selection, fit: Fit, name: str) -> FloatArray:
    """Root mean square of an effect over the windows in motion, rad/s, shape (3,)."""
    square, count = np.zeros(3), 0
    for _, window, part in _parts(selection, fit, name):
        square += np.sum(part**2, axis=0)
        count += len(window)
    return np.asarray(np.sqrt(square / max(count, 1)))


def frequencies_in_motion(selection: Selection, fit: Fit, name: str) -> tuple[float, ...]:
    """Orders of the drive at which an effect acts in the fastest run, rad/s, strongest first; none without a sine."""
    driven = [
        (data.motion.angular_frequency, data.run.time[window.start : window.stop], part)
        for data, window, part in _parts(selection, fit, name)
        if data.motion is not None and data.motion.angular_frequency is not None
    ]
    if not driven:
        return ()
    w, time, part = max(driven, key=lambda d: d[0])
    phase = np.outer(time, w * np.arange(1, HIGHEST_ORDER + 1))
    beta = least_squares(np.column_stack([np.ones(len(time)), np.cos(phase), np.sin(phase)]), part)[1:]
    size = np.linalg.norm(beta.reshape(2, HIGHEST_ORDER, 3), axis=(0, 2))
    strong = [int(i) for i in np.argsort(-size) if size[i] > STRONG * size.max()]
    return tuple(float((i + 1) * w) for i in strong)


def _parts(selection: Selection, fit: Fit, name: str) -> Iterator[tuple[RunData, Window, FloatArray]]:
    """What an effect with its further terms makes in each window in motion of the fit runs, rad/s, (n, 3)."""
    likelihood = selection.likelihood
    own = likelihood.columns.index(selection.with_parts({name}))
    predictor = Predictor(likelihood.effects, likelihood.source)
    with_it = Prediction("with", fit.beta, fit.templates, fit.alignment)
    without = replace(with_it, beta=np.where(np.isin(np.arange(len(fit.beta)), own), 0.0, fit.beta))
    for data in likelihood.campaign.fit:
        for window in data.windows:
            if window.moving:
                cut = slice(window.start, window.stop)
                yield data, window, predictor.rate(data, with_it)[cut] - predictor.rate(data, without)[cut]


def axes_of(rms: FloatArray) -> tuple[str, ...]:
    """Axes that have a good part of the largest one's size."""
    return tuple(AXES[i] for i in range(3) if rms[i] > 0.3 * rms.max())
