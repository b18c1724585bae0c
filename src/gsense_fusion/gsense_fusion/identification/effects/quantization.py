"""The step of the gyro's output is coarse against its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.effects.recorded import Reading, RecordedEffect, Recording, Seen
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.types import AXES, BoolArray, FloatArray, Owner, Parameter

COARSE_PART = 0.4
"""Of the variance, step^2 / 12 being the rounding's: there the noise before rounding is 0.35 steps, and from there on
the rounding is no noise but follows the signal, by step / pi exp(-2 pi^2 (noise / step)^2) = 3 % of a step and
more (Widrow and Kollar, Quantization Noise, 2008)."""
MIN_SAMPLES = 100
MIN_PIECE = 30
PIECE = 400
SIGMAS = np.geomspace(0.05, 3.0, 36)
REACH = 8


class Quantization(RecordedEffect):
    """x is rounded to a step that its noise does not blur."""

    name = "quantization"
    owner = Owner.SENSOR
    equation = "step round(x / step)"
    source = "the lattice of the recorded values; theory of dithered rounding"

    def look(self, recording: Recording) -> Seen:
        """Share of the rounding in the variance, by axis."""
        found = rounding(recording)
        if found is None or not found.coarse[_alive(recording)].any():  # what never moves is no word on the step
            return Seen()
        share, worst = found.share, int(np.argmax(found.share))
        axes = tuple(x for i, x in enumerate(AXES) if found.coarse[i])
        parameters = {"step": Parameter(float(found.step[worst]), 0.0, "rad/s")}
        parameters |= {f"share_{AXES[i]}": Parameter(float(share[i]), 0.0, "1") for i in range(3) if found.coarse[i]}
        step = f"{np.degrees(found.step[worst]):.3g} deg/s"
        noise = np.sqrt((1.0 / share[worst] - 1.0) / 12.0)
        text = f"the gyro's step is {step}, and its noise on {AXES[worst]} only {noise:.2g} of that"
        advice = "set a narrower range of the gyro, or a wider filter: half a step of noise makes rounding harmless"
        curve = _histogram(found.rest[:, worst], float(found.step[worst]))
        return Seen({self.name: Reading(parameters, axes, 0.0, text, advice, curve=curve)})


@dataclass(frozen=True, eq=False)
class Rounding:
    """What rounding does to each gyro axis."""

    step: FloatArray
    """rad/s, shape (3,); zero where the values lie on no lattice."""
    share: FloatArray
    """Of the rounding in the variance, shape (3,)."""
    rest: FloatArray
    """Samples at rest beside their window's median, rad/s, shape (n, 3)."""

    @property
    def coarse(self) -> BoolArray:
        """Axes whose noise does not blur the step, shape (3,)."""
        return np.asarray(self.share > COARSE_PART)

    def spectrum(self, rate_hz: float) -> FloatArray:
        """White noise that rounding makes, (rad/s)^2/Hz one-sided, shape (3,)."""
        return np.asarray(self.step**2 / 12.0 / (rate_hz / 2.0))

    @property
    def follows(self) -> FloatArray:
        """Amplitude of what follows the signal of the axes, rad/s, shape (3,); zero where the step is fine."""
        square = np.where(self.coarse, (1.0 / np.maximum(self.share, 1e-9) - 1.0) / 12.0, 0.0)
        return np.where(self.coarse, self.step / np.pi * np.exp(-2 * np.pi**2 * square), 0.0)

    def makes(self, axes: tuple[str, ...], rate_rms: float, somewhere: bool = False) -> bool:
        """Whether the rounding of these axes alone can make an error of this size.

        Args:
            axes: Their names.
            rate_rms: The size, rad/s.
            somewhere: In one run or at one place, where the signal may lie just between two values: half a step, not
                the mean over all signals.

        """
        hit = [i for i, x in enumerate(AXES) if x in axes]
        size = float(np.sqrt(np.sum(self.step[hit] ** 2) / (4.0 if somewhere else 12.0)))
        return bool(hit) and bool(self.coarse[hit].all()) and rate_rms <= size


def rounding(recording: Recording) -> Rounding | None:
    """Steps and their shares; None where too little rest was recorded."""
    pieces = at_rest(recording)
    if sum(map(len, pieces)) < MIN_SAMPLES:
        return None
    step = np.array([max((r.steps[i] for r in recording.clean), default=0.0) for i in range(3)])
    for i in set(recording.campaign.axes).difference(_alive(recording)):
        step[i] = step.max()  # a signal that never left its value shows no lattice; the other axes' converter is alike
    sigma = [noise_before_rounding([p[:, i] / step[i] for p in pieces]) if step[i] > 0 else np.inf for i in range(3)]
    share = np.array([1.0 / (1.0 + 12.0 * s**2) for s in sigma])
    rest = np.concatenate([p - np.sort(p, axis=0)[len(p) // 2] for p in pieces])
    return Rounding(step, share, rest)


def _alive(recording: Recording) -> list[int]:
    """Axes that have more than one value in some run."""
    axes = recording.campaign.axes
    return [i for i in axes if any(np.ptp(r.angular_rate[:, i]) > 0.0 for r in recording.clean)]


def at_rest(recording: Recording) -> list[FloatArray]:
    """Samples at rest in pieces too short to drift, rad/s, each of shape (n, 3)."""
    out: list[FloatArray] = []
    for data in recording.campaign.runs:
        for w in (w for w in data.windows if not w.moving):
            series = data.run.angular_rate[w.start : w.stop][data.run.valid[w.start : w.stop]]
            if len(series) >= MIN_PIECE:
                out += np.array_split(series, max(1, len(series) // PIECE))
    return out


def noise_before_rounding(pieces: Sequence[FloatArray]) -> float:
    """Deviation in steps of a normal variable of which rounding left these values, by maximum likelihood.

    The variance alone misleads: a mean between two values makes it large, one upon a value makes it vanish. The mean
    of each piece is free.

    Args:
        pieces: Values over the step, each of shape (n,).

    """
    total = np.zeros(len(SIGMAS))
    for values in pieces:
        centre = np.sort(values)[len(values) // 2]
        cell = np.clip(np.rint(values - centre), -REACH, REACH).astype(int) + REACH
        count = np.bincount(cell, minlength=2 * REACH + 1)
        total += (_cells() @ count).max(axis=1)
    return float(SIGMAS[int(np.argmax(total))])


@lru_cache(maxsize=1)
def _cells() -> FloatArray:
    """Logarithm of the probability of each value, shape (deviations, means, values); the outermost hold the tails."""
    edges = np.arange(-REACH, REACH) + 0.5
    mean = np.linspace(-0.5, 0.5, 17)
    below = norm.cdf((edges[None, None] - mean[None, :, None]) / SIGMAS[:, None, None])
    padded = np.concatenate([np.zeros((*below.shape[:2], 1)), below, np.ones((*below.shape[:2], 1))], axis=2)
    return np.asarray(np.log(np.maximum(np.diff(padded, axis=2), 1e-12)))


def _histogram(rest: FloatArray, step: float) -> Curve:
    """How often each value of the lattice comes at rest, and how often a normal distribution would have it."""
    place = np.rint(rest / step).astype(int)
    reach = min(max(3, int(np.max(np.abs(place)))), 30)
    at = np.arange(-reach, reach + 1)
    share = np.array([float(np.mean(place == k)) for k in at])
    sigma = max(float(np.std(rest)), 0.1 * step)
    expected = norm.cdf((at + 0.5) * step / sigma) - norm.cdf((at - 0.5) * step / sigma)
    return Curve(
        x=np.degrees(at * step),
        measured=share[:, None],
        fitted=expected[:, None],
        series=(),
        x_label="rate at rest beside its median, deg/s",
        y_label="share of the samples",
        how_to_read="Few dots under the bell: the noise does not reach the next value, and small rates are lost.",
    )
