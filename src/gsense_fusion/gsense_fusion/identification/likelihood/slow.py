"""Slow part of the likelihood: block means under a Gaussian process of flicker noise and random walk.

A constant bias over drift that is not modelled makes false g-sensitivity, and polynomials are no better. Block means
carry what changes slowly (temperature, supply, drift); their covariance is white + flicker + random walk with strengths
that maximise the marginal likelihood (bias of each session unknown), so an effect must explain more than drift does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor
from scipy.linalg.lapack import dpotri, dpotrs
from scipy.optimize import minimize

from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray

OU_RATIO = 3.0
FASTEST_OU_S = 3.0
GRID = tuple(10.0**x for x in np.arange(-5.0, 1.01, 1.0))
"""Flicker strengths in Hz times the white density that are tried first."""
WALK_GRID = tuple(10.0**x for x in np.arange(-5.0, 3.01, 1.0))
WALK_SCALE = 1e-2
"""1/s: walk strengths are tried at this times WALK_GRID; an MPU-6050's reach to 0.016 deg/s/sqrt(s)."""
SETTLED = 1e-3
"""Relative change of a strength that counts as none."""
EARTH_VARIANCE = 7.292115e-5**2 / 3.0
"""(rad/s)^2: earth rate (thesis eq. 2.1) on one axis of a board of unknown heading; it turns with the mounting."""


@dataclass(frozen=True)
class Blocks:
    """Means over blocks of the fit runs, in order of time."""

    time: FloatArray
    """Middle of each block in s, shape (b,)."""
    duration: FloatArray
    """s, shape (b,)."""
    rate: FloatArray
    """Mean angular rate, rad/s, shape (b, 3)."""
    session: IntArray
    run: IntArray
    """Number of the run among the fit runs, shape (b,)."""
    pose: IntArray
    """Number of the mounting: earth rate is constant within one, shape (b,)."""

    def __len__(self) -> int:
        return len(self.time)

    def part(self, mask: BoolArray) -> Blocks:
        """Some of the blocks."""
        return Blocks(
            self.time[mask], self.duration[mask], self.rate[mask], self.session[mask], self.run[mask], self.pose[mask]
        )


@dataclass(frozen=True)
class Drift:
    """Strengths of one axis' slow noise: flicker (rad/s)^2 and walk in (rad/s)^2/s (variance rate)."""

    flicker: float
    walk: float

    def like(self, other: Drift) -> bool:
        """Whether no strength differs by more than what a search leaves open."""
        mine, theirs = np.array([self.flicker, self.walk]), np.array([other.flicker, other.walk])
        return bool(np.all(np.abs(mine - theirs) <= SETTLED * theirs))


@dataclass(frozen=True, eq=False)
class GridPoint:
    """Strengths that are tried, with what they make of the blocks."""

    strengths: Drift
    projector: FloatArray
    """P = K^-1 - K^-1 H (H' K^-1 H)^-1 H' K^-1 with the sessions' biases H, shape (b, b)."""
    logdet: float
    """ln|K| + ln|H' K^-1 H|."""


class SlowNoise:
    """Covariance of the block means of one axis."""

    def __init__(self, blocks: Blocks, white_psd: float) -> None:
        """Prepare the kernels.

        Args:
            blocks: The blocks, shape (b,).
            white_psd: One-sided white density in (rad/s)^2/Hz.

        """
        gap = np.abs(blocks.time[:, None] - blocks.time[None])
        total = max(float(np.ptp(blocks.time)), 10.0)
        same = blocks.session[:, None] == blocks.session[None]
        count = max(2, int(np.ceil(np.log(10 * total / FASTEST_OU_S) / np.log(OU_RATIO))))
        taus = FASTEST_OU_S * OU_RATIO ** np.arange(count)
        self.white = np.diag(white_psd / (2.0 * blocks.duration)) + EARTH_VARIANCE * (
            blocks.pose[:, None] == blocks.pose[None]
        )
        # OU processes of equal variance, log-spaced, sum to a 1/f density: variance of each = flicker * ln(ratio)
        self.flicker = np.log(OU_RATIO) * same * sum(np.exp(-gap / tau) for tau in taus)
        origin = np.array([blocks.time[blocks.session == s].min() for s in blocks.session])
        start = blocks.time - origin
        self.walk = same * np.minimum(start[:, None], start[None])
        self.sessions = np.stack([blocks.session == s for s in np.unique(blocks.session)], axis=1).astype(float)
        self.white_psd = white_psd
        self._triangle = np.tri(len(blocks)) - 0.5 * np.eye(len(blocks))
        self.factor = kept(256, self._factor)
        self._projected = kept(64, self._projection)

    def covariance(self, drift: Drift) -> FloatArray:
        """Shape (b, b)."""
        return np.asarray(self.white + drift.flicker * self.flicker + drift.walk * self.walk)

    def _factor(self, drift: Drift) -> tuple[FloatArray, bool]:
        """Cholesky factor of the covariance; `factor` remembers the last ones."""
        K = self.covariance(drift)
        K.flat[:: len(K) + 1] *= 1.0 + 1e-12
        return cho_factor(K, lower=True, overwrite_a=True, check_finite=False)

    def logdet(self, drift: Drift) -> float:
        """ln|K| + ln|H' K^-1 H|: the biases H are integrated out."""
        return self._projected(drift)[1]

    def grid_logliks(self, residual: FloatArray, columns: FloatArray) -> FloatArray:
        """Marginal log-likelihood at every point of the grid of strengths, shape (points,)."""
        projectors, logdets = self._stacked
        px = projectors @ np.column_stack([columns, residual])
        inner = np.eye(columns.shape[1]) + columns.T @ px[:, :, :-1]
        cross = columns.T @ px[:, :, -1:]
        taken = np.sum(cross * np.linalg.solve(inner, cross), axis=(1, 2))
        return np.asarray(-0.5 * (residual @ px[:, :, -1].T - taken + logdets + np.linalg.slogdet(inner)[1]))

    def strengths(self, point: int) -> Drift:
        """Strengths at a point of the grid."""
        return self.grid[point].strengths

    def refine(self, residual: FloatArray, columns: FloatArray, start: Drift, prior: Drift) -> Drift:
        """Drift strengths of maximum marginal likelihood.

        Args:
            residual: Block means without the model's prediction, rad/s, shape (b,).
            columns: Block means of the model's columns in plausible sizes, shape (b, k). They are integrated out, or an
                effect that has taken up some of the drift would make it look smaller than it is.
            start: Where to begin.
            prior: What the other axes say: their logarithms differ by a factor e (standard deviation).

        """
        scale = self.white_psd * np.array([1.0, WALK_SCALE])
        low = np.log(scale * np.array([GRID[0], WALK_GRID[0]]) / 10.0)
        high = np.log(scale * np.array([GRID[-1], WALK_GRID[-1]]) * 10.0)
        centre = np.log(np.array([prior.flicker, prior.walk]))

        def cost(p: FloatArray) -> tuple[float, FloatArray]:
            value, gradient = self._negative(residual, columns, np.exp(p))
            return value + 0.5 * float(np.sum((p - centre) ** 2)), gradient + (p - centre)

        first = np.log(np.array([start.flicker, start.walk]))
        bounds = list(zip(low, high, strict=True))
        found = minimize(cost, first, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 12})
        return Drift(float(np.exp(found.x[0])), float(np.exp(found.x[1])))

    @cached_property
    def grid(self) -> list[GridPoint]:
        """Projectors of all combinations of strengths; they depend on the blocks alone, so every model reuses them."""
        return self.grid_of(self.walk, WALK_SCALE)

    @cached_property
    def _stacked(self) -> tuple[FloatArray, FloatArray]:
        """The grid's projectors (points, b, b) and logarithms of determinants (points,)."""
        return np.array([p.projector for p in self.grid]), np.array([p.logdet for p in self.grid])

    def grid_of(self, kernel: FloatArray, scale: float) -> list[GridPoint]:
        """The same for another kernel (b, b) than the walk, tried at `scale` times the flicker strengths."""
        white = self.white_psd
        return [self.point(Drift(white * f, white * w * scale), kernel) for f in GRID for w in WALK_GRID]

    def point(self, drift: Drift, kernel: FloatArray) -> GridPoint:
        """One pair of strengths, those of `walk` being the kernel's."""
        if kernel is self.walk:
            factor = self.factor(drift)
        else:
            factor = cho_factor(self.white + drift.flicker * self.flicker + drift.walk * kernel, lower=True)
        return GridPoint(drift, *self._without_biases(factor))

    def _projection(self, drift: Drift) -> tuple[FloatArray, float]:
        return self._without_biases(self.factor(drift))

    def _without_biases(self, factor: tuple[FloatArray, bool]) -> tuple[FloatArray, float]:
        inverse = _solved(factor, np.eye(len(self.white)))
        ih = inverse @ self.sessions
        hh = self.sessions.T @ ih
        logdet = 2.0 * float(np.sum(np.log(np.diag(factor[0])))) + float(np.linalg.slogdet(hh)[1])
        return inverse - ih @ np.linalg.solve(hh, ih.T), logdet

    def _negative(self, residual: FloatArray, columns: FloatArray, strengths: FloatArray) -> tuple[float, FloatArray]:
        """Minus the marginal log-likelihood and its gradient by the logarithms of the strengths.

        The sessions' biases have no prior, the columns' parameters one of unit variance; both are integrated out.
        """
        factor = self.factor(Drift(float(strengths[0]), float(strengths[1])))
        lower = dpotri(factor[0], lower=True)[0] * self._triangle  # of the symmetric inverse, with half its diagonal
        free = np.concatenate([self.sessions, columns, residual[:, None]], axis=1)
        image = lower @ free + lower.T @ free
        free, image, pr = free[:, :-1], image[:, :-1], image[:, -1]
        inner = free.T @ image
        prior = np.arange(self.sessions.shape[1], len(inner))
        inner[prior, prior] += 1.0
        taken = np.linalg.inv(inner)
        logdet = 2.0 * float(np.sum(np.log(np.diag(factor[0])))) + float(np.linalg.slogdet(inner)[1])
        weights = image @ taken
        pr = pr - weights @ (image.T @ residual)
        gradient = []
        for strength, kernel in zip(strengths, (self.flicker, self.walk), strict=True):
            trace = 2.0 * np.vdot(lower, kernel) - np.vdot(weights, kernel @ image)
            gradient.append(0.5 * strength * float(trace - pr @ kernel @ pr))
        return 0.5 * (float(residual @ pr) + logdet), np.array(gradient)

    def gram(self, X: FloatArray, y: FloatArray, drift: Drift) -> Gram:
        """Whitened normal equations of the blocks with the sessions' biases projected out; X (b, P), y (b,)."""
        both = np.column_stack([X, y])
        full = both.T @ (self._projected(drift)[0] @ both)
        p = X.shape[1]
        return Gram(full[:p, :p], full[:p, p], float(full[p, p]), len(y) - self.sessions.shape[1])


def _solved(factor: tuple[FloatArray, bool], right: FloatArray) -> FloatArray:
    """As `cho_solve`, whose checks of its input cost more than these small systems."""
    return np.asarray(dpotrs(factor[0], right, lower=factor[1])[0])


def estimate_drifts(
    slow: Mapping[int, SlowNoise],
    residual: FloatArray,
    columns: Mapping[int, FloatArray],
    near: Mapping[int, Drift] | None = None,
) -> dict[int, Drift]:
    """Drift strengths of all axes: each its own, drawn towards what all axes of the chip say together.

    Args:
        slow: Covariances by axis.
        residual: rad/s, shape (b, 3).
        columns: By axis the model's columns in plausible sizes, shape (b, k).
        near: Where to begin instead of at the best point of the grid, from an earlier round.

    """
    near = near or {}
    grids = {axis: s.grid_logliks(residual[:, axis], columns[axis]) for axis, s in slow.items()}
    pooled = int(np.argmax(np.sum(list(grids.values()), axis=0)))
    out = {}
    for axis, s in slow.items():
        start = near.get(axis) or s.strengths(int(np.argmax(grids[axis])))
        out[axis] = s.refine(residual[:, axis], columns[axis], start, s.strengths(pooled))
    return out


def initial_drift(noise: Mapping[int, NoiseModel]) -> dict[int, Drift]:
    """Drift as the rest records say: walk in the PSD is q^2 / (2 pi^2) / f^2."""
    return {axis: Drift(model.flicker, model.walk * 2 * np.pi**2) for axis, model in noise.items()}
