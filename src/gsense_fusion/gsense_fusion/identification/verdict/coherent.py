"""What goes with a vibration that the accelerometer feels is no symptom: it is taken off all windows' residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gsense_fusion.identification.types import BoolArray, ComplexArray, FloatArray, IntArray

if TYPE_CHECKING:
    from gsense_fusion.identification.verdict.residual import WindowResidual

LOWEST_COHERENT_HZ = 5.0
MIN_COHERENT_BINS = 40
SINGULAR_SUMS = 1e-13
"""Of the largest eigenvalue of products of columns of unit length: less is rounding."""


@dataclass(frozen=True, eq=False)
class Extra:
    """Spectra of a moving window that the drive's harmonics do not contain, zero at the drive's orders."""

    felt: ComplexArray
    """Specific force beyond its model (a belt that rings), shape (m, 3)."""
    model: ComplexArray
    """The model's own rate above the band of the fit, where the sensor's filter changes it, shape (m, 3)."""


def without_coherent(windows: Sequence[WindowResidual], extras: Sequence[Extra]) -> list[WindowResidual]:
    """Residuals without what is coherent with vibration that the accelerometer feels or, above the band, the model.

    In each narrow band the residual of all windows in motion together is regressed on the felt specific force: a linear
    response to vibration (a coupling, a lever, whatever the sensor's filter makes of it) is neither a tone nor foreign
    noise. Where there are bins enough, each mounting has a response of its own: what the rig makes of a vibration does
    not turn with the board. The same is taken off the windows at rest, which motion is compared with: the
    accelerometer's own noise comes in with it.
    """
    mountings = list(dict.fromkeys(w.data.mounting_number for w in windows if w.window.moving))
    if not mountings:
        return list(windows)
    top = max(float(w.frequency[-1]) for w in windows)
    edges = [LOWEST_COHERENT_HZ]
    while edges[-1] < top:
        edges.append(max(edges[-1] * 1.04, edges[-1] + 0.4))
    spectra = [w.spectrum[0] + 1j * w.spectrum[1] for w in windows]
    free = [np.flatnonzero(w.away_from_orders()) for w in windows]
    joined = _Joined.of(windows, extras, free, mountings)
    rates = np.concatenate([s[i] for s, i in zip(spectra, free, strict=True)])
    band = np.searchsorted(edges, joined.frequency, side="right")
    order = np.argsort(band, kind="stable")
    for places in np.split(order, np.searchsorted(band[order], np.arange(1, len(edges) + 1)))[1:-1]:
        moving = joined.moving[places]
        if int(moving.sum()) < MIN_COHERENT_BINS:
            continue
        apart = int(moving.sum()) >= MIN_COHERENT_BINS * len(mountings)
        rates[places] = _unexplained(joined.regressors(places, apart=apart), rates[places].T, moving).T
    for s, i, rest in zip(spectra, free, np.split(rates, np.cumsum([len(i) for i in free])[:-1]), strict=True):
        s[i] = rest
    return [replace(w, spectrum=np.stack([s.real, s.imag])) for w, s in zip(windows, spectra, strict=True)]


@dataclass(frozen=True, eq=False)
class _Joined:
    """Bins of all windows away from the drive's orders, one window after the other, n of them."""

    frequency: FloatArray
    moving: BoolArray
    mounted: BoolArray
    """Which of the mountings each bin's window had, shape (n, mountings)."""
    weight: FloatArray
    felt: ComplexArray
    model: ComplexArray
    """Shape (n, 3), as the weight and what is felt."""

    @staticmethod
    def of(
        windows: Sequence[WindowResidual],
        extras: Sequence[Extra],
        free: Sequence[IntArray],
        mountings: Sequence[int | None],
    ) -> _Joined:
        number = np.repeat(np.arange(len(windows)), [len(i) for i in free])
        own = [[m in (None, w.data.mounting_number) for m in mountings] for w in windows]
        return _Joined(
            np.concatenate([w.frequency[i] for w, i in zip(windows, free, strict=True)]),
            np.array([w.window.moving for w in windows])[number],
            np.array(own)[number],
            np.concatenate([w.bins.weight[i] for w, i in zip(windows, free, strict=True)]),
            np.concatenate([e.felt[i] for e, i in zip(extras, free, strict=True)]),
            np.concatenate([e.model[i] for e, i in zip(extras, free, strict=True)]),
        )

    def regressors(self, places: IntArray, *, apart: bool) -> ComplexArray:
        """Whitened columns by axis: the felt force, in each mounting where `apart`, and the model, shape (3, k, c)."""
        felt = self.felt[places]
        if apart:
            felt = (self.mounted[places][:, :, None] * felt[:, None]).reshape(len(places), -1)
        both = [np.concatenate([felt, self.model[places, axis, None]], axis=1) for axis in range(3)]
        return np.asarray(np.stack(both) * self.weight[places].T[:, :, None])


def _unexplained(X: ComplexArray, y: ComplexArray, moving: BoolArray) -> ComplexArray:
    """What a regression of the bins in motion leaves of all bins (3, k), its expectation as that of the noise.

    What noise explains by chance is made up for: by the degrees that the regression took, and at rest by the error of
    its coefficients.
    """
    size = np.linalg.norm(X[:, moving], axis=1)
    there = size > 0.0
    X = X / np.where(there, size, 1.0)[:, None]
    X *= there[:, None]
    adjoint = X[:, moving].conj().transpose(0, 2, 1)
    inverse = np.linalg.pinv(adjoint @ X[:, moving], rcond=SINGULAR_SUMS, hermitian=True)
    rest = y - (X @ (inverse @ (adjoint @ y[:, moving, None])))[:, :, 0]
    count = int(moving.sum())
    rest[:, moving] *= np.sqrt(count / (count - there.sum(axis=1)))[:, None]
    still = X[:, ~moving]
    rest[:, ~moving] /= np.sqrt(1.0 + np.sum((still @ inverse * still.conj()).real, axis=2))
    return np.asarray(rest)
