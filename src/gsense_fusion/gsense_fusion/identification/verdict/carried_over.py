"""Whether what a claim says of runs that it was not fitted to is there."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.likelihood.bins import Bins, window_bins
from gsense_fusion.identification.likelihood.whitened import project_out_slow, whiten
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import FloatArray

LEAST_SHARE = 0.5
"""What a shape that is not quite the true one still keeps; nothing that is not there keeps so much."""
SURE = 3.0
"""Standard errors by which the share has to be below that."""


@dataclass(frozen=True)
class Share:
    """How much of what a claim adds to the predicted rate of the moving windows held out is in the measured one."""

    value: float
    """By least squares: one where the claim is right, none where it is not."""
    stderr: float

    @property
    def refuted(self) -> bool:
        """Whether the runs speak against the claim."""
        return self.value + SURE * self.stderr < LEAST_SHARE


def shares(
    ladder: Sequence[str], claims: Collection[str], folds: Sequence[Held], noise: Mapping[int, NoiseModel]
) -> dict[str, Share]:
    """The share of each claim that moves with the carriage and is not zero in the windows held out.

    Args:
        ladder: Labels of the models, each of which adds the effect that it is named after to the one before.
        claims: The effects that are asked for.
        folds: The models by label, and the runs that they did not see.
        noise: By axis.

    """
    out: dict[str, Share] = {}
    for before, name in itertools.pairwise(ladder):
        if name not in claims:
            continue
        both = power = 0.0
        for left, added in (x for fold in folds for x in _windows(fold, before, name, noise)):
            both += float(np.sum(left * added))
            power += float(np.sum(added**2))
        if power > 0:
            out[name] = Share(both / power, float(1.0 / np.sqrt(power)))
    return out


def _windows(
    fold: Held, before: str, after: str, noise: Mapping[int, NoiseModel]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Whitened residual of the model before, and what the one after adds to it, of each moving window held out."""
    for data in fold.held:
        left = fold.predictor.without(data, fold.models[before])
        added = left - fold.predictor.without(data, fold.models[after])
        both = np.stack([left, added], axis=2)
        for window in (w for w in data.windows if w.moving):
            bins = window_bins(len(window), data.run.rate_hz, noise)
            rows = _rows(both[window.start : window.stop], bins)
            yield rows[:, :, 0], rows[:, :, 1]


def _rows(series: FloatArray, bins: Bins) -> FloatArray:
    return project_out_slow(whiten(series, bins), bins)
