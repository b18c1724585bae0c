"""The board's clock on the host's time axis.

The idea: a frame can arrive late (USB bursts, a busy host), never early, so the lower envelope of `arrival - board
time` is the clock's offset plus the constant transport delay, and its slope is the difference of the two crystals.
The smallest value in each half second of board time goes into a decayed fit of a line under these points. They stand
above it by exponentially distributed times, so the early ones decide and late outliers hardly count. The slope is held
by a prior as wide as a crystal's tolerance while the record is short; the slope found before a restart of the board
serves as a much tighter prior after it: it is the same crystal.

(The scheme of Klipper's clocksync, a decayed fit that outliers do not bend, on one-way data; the line under the points
as in Moon, Skelly, Towsley, "Estimation and removal of clock skew from network delay measurements", INFOCOM 1999.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_TIME_RANGE_US = 1 << 32
_GRID = np.linspace(-1.0, 1.0, 41)
_PASSES = (40.0, 10.0)
_SURE = 10  # bins after which the trend is known well enough to overrule the prior


@dataclass(frozen=True)
class ClockSettings:
    """Constants of the clock model."""

    bin_s: float = 0.5  # one minimum each; small: quick to react, large: less of the latency's noise
    memory_s: float = 30.0  # decay of the fit; small follows a warming crystal, large averages more
    fix_after_s: float = 0.3  # board time from the first frame to the first usable fix
    fix_frames: int = 6  # and the frames that it needs at least
    skew_sigma: float = 1e-4  # prior of the skew (crystals and the PIC's oscillator against the host), 1
    known_skew_sigma: float = 5e-6  # the same after a restart
    noise_s: float = 1e-4  # a bin's minimum stands at least this far above the envelope on average
    near_share: float = 0.5  # of the bins, the earliest: they tell how far on average; the others may be outliers
    late_step_s: float = 0.1  # bins that all stay this late ...
    late_step_after_s: float = 2.0  # ... for this long mean that the board's time jumped ...
    late_steady_s: float = 0.05  # ... if they differ by less than this: a busy host is late by ever other times
    late_step_anyway_s: float = 20.0  # ... or, however late each, for this long
    early_step_s: float = 0.25  # a frame this early cannot be: the board's time jumped


class BoardClock:
    """Maps board time to host time. Feed it every distinct frame, in order of arrival.

    Host times are integers in ns of any steady clock; board times are unwrapped integers in us.
    """

    def __init__(self, settings: ClockSettings | None = None) -> None:
        self.settings = settings or ClockSettings()
        self.steps = 0  # jumps of the board's time that the link did not announce
        self._slope = 0.0  # host seconds per board second, minus 1
        self._slope_prior = 0.0
        self._slope_sigma = self.settings.skew_sigma
        self._last_us = 0
        self._last_arrival_ns = 0
        self._begin()

    def _begin(self) -> None:
        self._fixed = False
        self._started = False
        self._origin_us = 0
        self._origin_ns = 0
        self._intercept = 0.0  # seconds, at the origin
        self._frames = 0
        self._points: list[tuple[float, float]] = []  # bins' minima: board s, arrival - board s, from the origin
        self._bin_end = 0.0
        self._bin_best: tuple[float, float] | None = None
        self._bin_residual = 0.0
        self._late_since: float | None = None  # of arrivals
        self._late_least = self._late_most = 0.0  # s, of the late bins since

    @property
    def fixed(self) -> bool:
        """True when `host_ns` is usable."""
        return self._fixed

    @property
    def skew_ppm(self) -> float:
        """How much the board's clock runs fast against the host's, in ppm."""
        return -1e6 * self._slope / (1.0 + self._slope)

    def restart(self) -> None:
        """The board started anew: forget the offset, keep the skew as a tight prior."""
        if len(self._points) * self.settings.bin_s > 5.0:
            self._slope_prior = self._slope
            self._slope_sigma = self.settings.known_skew_sigma
        self._slope = self._slope_prior
        self._begin()

    def unwrap(self, time_us: int, arrival_ns: int) -> int:
        """Unwrap a 32-bit board time; of all turns the one nearest to the host's elapsed time is taken."""
        if not self._started:
            self._started = True
            self._origin_us = self._last_us = time_us
            self._origin_ns = self._last_arrival_ns = arrival_ns
            return time_us
        expected = self._last_us + (arrival_ns - self._last_arrival_ns) // 1000
        half = _TIME_RANGE_US >> 1
        return expected + (time_us - expected + half) % _TIME_RANGE_US - half

    def observe(self, board_us: int, arrival_ns: int) -> bool:
        """Take a frame: its unwrapped board time, and its arrival less the constant transport delay.

        Returns True when the frame shows that the board's time jumped; the model has then begun anew with this frame.
        """
        if board_us > self._last_us:
            self._last_us, self._last_arrival_ns = board_us, arrival_ns
        x = (board_us - self._origin_us) * 1e-6
        y = (arrival_ns - self._origin_ns) * 1e-9 - x
        residual = y - self._intercept - self._slope * x
        if self._fixed and residual < -self.settings.early_step_s:
            return self._jumped(board_us, arrival_ns)
        self._frames += 1
        if self._bin_best is None or residual < self._bin_residual:
            self._bin_best, self._bin_residual = (x, y), residual
        if not self._fixed:
            self._try_fix(x)
        elif x >= self._bin_end:
            return self._close_bin(x, x + y) and self._jumped(board_us, arrival_ns)
        return False

    def host_ns(self, board_us: int) -> int:
        """Host time of an unwrapped board time, in ns."""
        x_us = board_us - self._origin_us
        return self._origin_ns + x_us * 1000 + round(self._intercept * 1e9 + self._slope * x_us * 1e3)

    def _jumped(self, board_us: int, arrival_ns: int) -> bool:
        self.steps += 1
        self.restart()
        self.unwrap(board_us % _TIME_RANGE_US, arrival_ns)
        self._last_us = self._origin_us
        self.observe(self._origin_us, arrival_ns)
        return True

    def _try_fix(self, x: float) -> None:
        if x < self.settings.fix_after_s or self._frames < self.settings.fix_frames or self._bin_best is None:
            return
        best_x, best_y = self._bin_best
        self._intercept = best_y - self._slope * best_x
        self._points.append(self._bin_best)
        self._fixed = True
        self._next_bin(x)

    def _next_bin(self, x: float) -> None:
        self._bin_best = None
        self._bin_end = x + self.settings.bin_s

    def _close_bin(self, x: float, arrival: float) -> bool:
        """Fit with the finished bin; True where bins were late for so long that the board's time must have jumped."""
        settings = self.settings
        late = self._bin_residual > settings.late_step_s
        if self._bin_best is not None:
            self._points.append(self._bin_best)
        self._next_bin(x)
        if late:
            return self._late_for_good(arrival)
        self._late_since = None
        self._fit(x)
        return False

    def _late_for_good(self, arrival: float) -> bool:
        """Take a late bin; True where such bins came for so long and so evenly that the board's time jumped."""
        settings = self.settings
        if self._late_since is None:
            self._late_since = arrival
            self._late_least = self._late_most = self._bin_residual
        self._late_least = min(self._late_least, self._bin_residual)
        self._late_most = max(self._late_most, self._bin_residual)
        waited = arrival - self._late_since  # of arrivals: after a stall all comes at once
        steady = self._late_most - self._late_least < settings.late_steady_s
        return waited >= (settings.late_step_after_s if steady else settings.late_step_anyway_s)

    def _fit(self, now: float) -> None:
        settings = self.settings
        keep_after = now - 3.0 * settings.memory_s
        while len(self._points) > 2 and self._points[0][0] < keep_after:
            del self._points[0]
        points = np.array(self._points)
        x, y = points[:, 0] - now, points[:, 1]
        weight = np.exp(x / settings.memory_s)
        trend = _trend(x, y)
        if x.size >= _SURE and self._height(y - trend * x) < 0.25 * self._height(y - self._slope * x):
            self._slope = self._slope_prior = trend  # no crystal: the prior is wrong
        for reach in _PASSES:
            self._slope, edge = self._posterior(x, y, weight, reach)
        self._intercept = edge - self._slope * now

    def _posterior(self, x: np.ndarray, y: np.ndarray, weight: np.ndarray, reach: float) -> tuple[float, float]:
        """Mean of slope and envelope at x = 0, for bins that stand above it by exponentially distributed times.

        Given the slope, the envelope touches the lowest bin; an exponential's likelihood of the others depends on
        their sum alone. `reach`: half width of the slopes' grid, in the accuracy that so many bins can give.
        """
        total = float(weight.sum())
        height = self._height(y - self._slope * x)
        width = min(4.0 * self._slope_sigma, reach * height / (total * max(-float(x[0]), 1e-3)))
        slopes = self._slope + width * _GRID
        lowest = (y[:, None] - x[:, None] * slopes).min(axis=0)
        above = weight @ y - slopes * (weight @ x) - total * lowest
        fit = above / height + 0.5 * ((slopes - self._slope_prior) / self._slope_sigma) ** 2
        chance = np.exp(fit.min() - fit)
        chance /= chance.sum()
        return float(chance @ slopes), float(chance @ lowest) - height / total

    def _height(self, residual: np.ndarray) -> float:
        """Mean height of the bins over their envelope, s, from the earliest ones (an exponential's censored mean)."""
        ordered = np.sort(residual)
        near = max(2, int(ordered.size * self.settings.near_share))
        if ordered.size < near:
            return self.settings.noise_s
        seen = ordered[:near].sum() + (ordered.size - near) * ordered[near - 1] - ordered.size * ordered[0]
        return max(self.settings.noise_s, float(seen) / near)


def _trend(x: np.ndarray, y: np.ndarray) -> float:
    """Slope of the plain regression: a crystal far from its prior must not pass for late frames."""
    dx = x - x.mean()
    return float(dx @ y / max(dx @ dx, 1e-12))
