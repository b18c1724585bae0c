"""Samples in, alarms out: every two seconds the last half minute is tested, and what stays is said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gsense_fusion.compensation import ReferenceTerm
from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Drivers, Effect
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.types import BoolArray, FloatArray

from .history import History
from .levels import Level, Levels, Step
from .orders import OrderEnergies, order_energies
from .reference import true_rate
from .spectrum import spectrum_of
from .suspects import Suspect, rank, rivals
from .window import Samples, Steady, steady_part

PAUSE_S = 60.0
"""A longer gap than this joins nothing."""
FULL_LEVEL = 0.8
"""Part of a mean's samples that must be there."""
_DEG = float(np.degrees(1.0))


@dataclass(frozen=True)
class WatchSettings:
    """How patient the watcher is."""

    window_s: float = 24.0
    """Length of what is tested; small: quicker, large: weaker effects."""
    hop_s: float = 2.0
    """From test to test."""
    order_p_value: float = 1e-8
    """Chance of a single order's test to fail on noise; an hour has 15,000 of them, most of them overlapping."""
    persistence: int = 3
    """Tests in a row that must fail before something is said."""
    noise_growth: float = 1.3
    """Power of the noise in motion over that at rest from which on it counts as speed noise."""
    level_s: float = 6.0
    """Length of the means that show a step of the bias."""


@dataclass(frozen=True)
class Alarm:
    """Something that the model lacks."""

    since: float
    """s, when the first failing test's newest sample came."""
    raised: float
    """s."""
    kind: str
    """orders, line, noise or step."""
    suspects: tuple[str, ...]
    """Likeliest first; those that fit about as well stand beside it. Empty: none of the catalogue."""
    text: str


@dataclass(frozen=True)
class WatchReport:
    """Outcome of one test."""

    time: float
    state: str
    """`rest`, `steady` or `other` (ramps, too short: not tested)."""
    angular_frequency: float | None
    energies: tuple[float, ...]
    """Whitened energy by order of the drive, 6 where only noise is; empty at rest."""
    alarms: tuple[Alarm, ...]
    """All that stand."""
    fresh: tuple[Alarm, ...]
    """Those raised by this test."""


@dataclass
class _Count:
    first: float = 0.0
    times: int = 0
    misses: int = 0


@dataclass
class Watcher:
    """Keeps the window and the alarms."""

    settings: WatchSettings = field(default_factory=WatchSettings)
    catalogue: Sequence[Effect] = REGRESSED
    reference: Sequence[ReferenceTerm] = ()
    """True rotations that the model knows."""

    def __post_init__(self) -> None:
        self._samples = History(7, self.settings.window_s)
        self._encoder = History(2, self.settings.window_s)
        self._next = -np.inf
        self._levels = Levels()
        self._level_until = -np.inf
        self._begun = -np.inf
        self._moved = False
        self._changed = -np.inf
        self._set_at: float | None = None
        self._quiet: FloatArray | None = None
        self._known_lines: list[float] = []
        self._counts: dict[str, _Count] = {}
        self._alarms: dict[str, Alarm] = {}
        self._mounting: Mounting | None = None

    def add_sample(self, time: float, residual: FloatArray, specific_force: FloatArray) -> None:
        """Take one sample of the IMU: s, rad/s (3,), m/s^2 (3,) with NaN where not reported."""
        newest = self._samples.newest
        if _another_clock(time, newest):
            self._samples.clear()
            self._next, self._set_at = -np.inf, time
        elif time <= newest:
            return
        self._samples.add(time, *residual, *specific_force)

    def begin_anew(self, time: float) -> None:
        """Another bias is predicted from here on (s): the residual before belongs to no common mean with it."""
        self._samples.clear()
        self._begun = time

    def add_position(self, time: float, position: float) -> None:
        """Take one position of the carriage, m."""
        if _another_clock(time, self._encoder.newest):  # rig and driver follow a clock that was set each in its time
            self._encoder.clear()
        if time > self._encoder.newest:
            self._encoder.add(time, position)

    def known_rate(self, time: float, position: float, velocity: float, specific_force: FloatArray) -> FloatArray:
        """The file's true rotation at one sample, rad/s, shape (3,), as far as position, velocity, acceleration tell.

        Zero until a steady motion has shown how the board is mounted.
        """
        mounting = self._mounting
        if not self.reference or mounting is None or mounting.along is None:
            return np.zeros(3)
        acceleration = float((specific_force - mounting.gravity * mounting.up) @ mounting.along)
        motion = Kinematics(*(np.array([x]) for x in (position, velocity, acceleration, 0.0)))
        drivers = Drivers(motion, mounting, specific_force[None], None, np.array([time]))
        return np.asarray(true_rate(self.reference, drivers, self.catalogue)[0])

    def due(self) -> bool:
        """Whether it is time for the next test."""
        return self._samples.newest >= self._next and len(self._samples) > 0

    def window(self) -> Samples:
        """A copy of what the next test looks at; not while a test works."""
        if self._set_at is not None:  # no count, mean or change of before has a time in this clock
            self._begun, self._set_at = self._set_at, None
            self._level_until = self._changed = -np.inf
            self._counts.clear()
        self._next = self._samples.newest + self.settings.hop_s
        imu, encoder = self._samples.recent(), self._encoder.recent()
        return Samples(imu[:, 0], imu[:, 1:4], imu[:, 4:7], encoder[:, 0], encoder[:, 1])

    def test(self, samples: Samples) -> WatchReport:
        """Test a window; a tenth of a second of work, in any thread, one at a time."""
        now = float(samples.time[-1])
        steady = steady_part(samples)
        if steady is None:
            return WatchReport(now, "other", None, (), tuple(self._alarms.values()), ())
        if self.reference:
            known = true_rate(self.reference, steady.drivers, self.catalogue)
            steady = replace(steady, residual=steady.residual - known)
        if steady.moving:
            self._mounting = steady.drivers.mounting
        before = set(self._alarms)
        w = steady.angular_frequency
        energies = None if w is None else order_energies(steady, w)
        remainder = _without_slow(steady) if energies is None else energies.remainder
        if energies is not None:
            self._test_orders(now, steady, energies)
        self._test_spectrum(now, steady, remainder)
        self._test_level(now, steady)
        return WatchReport(
            now,
            "steady" if steady.moving else "rest",
            steady.angular_frequency,
            () if energies is None else tuple(float(e) for e in energies.energy),
            tuple(self._alarms.values()),
            tuple(alarm for key, alarm in self._alarms.items() if key not in before),
        )

    # ---- the tests

    def _test_orders(self, now: float, steady: Steady, energies: OrderEnergies) -> None:
        failing = energies.p_value < self.settings.order_p_value
        if not self._lasts("orders", now, bool(failing.any())):
            return
        ranking = rank(energies, steady.drivers, self.catalogue)
        named = rivals(ranking)
        self._raise("orders", now, tuple(s.name for s in named), _orders_text(energies, failing, named, ranking))

    def _test_spectrum(self, now: float, steady: Steady, remainder: FloatArray) -> None:
        drive_hz = None if steady.angular_frequency is None else steady.angular_frequency / (2 * np.pi)
        seen = spectrum_of(remainder, steady.rate_hz, drive_hz)
        if not steady.moving:
            self._quiet = seen.density if self._quiet is None else 0.8 * self._quiet + 0.2 * seen.density
            if not self._known_lines and "line" not in self._counts:
                self._known_lines = list(seen.lines)  # what rest has from the start is noise
        new = [f for f in seen.lines if all(abs(f - known) > 3 * seen.resolution_hz for known in self._known_lines)]
        if self._lasts("line", now, bool(new)):
            tones = ", ".join(f"{f:.2f} Hz" for f in new[:3])
            names = ("line_tone", "belt_tooth") if steady.moving else ("line_tone",)
            self._raise("line", now, names, f"a tone at {tones} that was not there at rest")
        if steady.moving and self._quiet is not None:
            growth = float(np.max(seen.density / self._quiet))
            if self._lasts("noise", now, growth > self.settings.noise_growth):
                self._raise("noise", now, ("speed_noise",), f"noise in motion has {growth:.1f} times the power of rest")

    def _test_level(self, now: float, steady: Steady) -> None:
        """A mean a `level_s`, over whole periods of the drive, without overlap."""
        length = self.settings.level_s
        if steady.angular_frequency is not None:
            period = 2 * np.pi / steady.angular_frequency
            length = period * np.ceil(length / period)
        begin = max(self._level_until, float(steady.time[-1]) - self.settings.window_s)
        begin = max(begin, float(steady.time[0]), self._begun)
        if self._level_until < self._begun:
            self._levels = Levels()
        while begin + length <= steady.time[-1]:
            inside = (steady.time >= begin) & (steady.time < begin + length)
            begin += length
            self._level_until = begin
            if inside.sum() < FULL_LEVEL * length * steady.rate_hz:  # a mean over a gap would be a noisier one
                continue
            level = Level(begin - length / 2, steady.residual[inside].mean(axis=0))
            if self._moved is not steady.moving:
                self._moved, self._changed = steady.moving, level.time
            step = self._levels.add(level, steady.up)
            # a mean that comes with harmonics of the drive (g_squared) is theirs
            if step is not None and (not steady.moving or self._counts["orders"].times == 0):
                with_motion = abs(step.time - self._changed) < 2.0 * length
                names = ("bias_jump", "g_squared") if with_motion else ("bias_jump",)
                self._raise("step", now, names, _step_text(step))

    # ---- alarms

    def _lasts(self, kind: str, now: float, failed: bool) -> bool:
        """Count failing tests; one that holds clears the count, and some in a row the alarm."""
        count = self._counts.setdefault(kind, _Count())
        if not failed:
            count.times = 0
            count.misses += 1
            if count.misses >= self.settings.persistence:
                self._alarms.pop(kind, None)
            return False
        count.misses = 0
        if count.times == 0:
            count.first = now
        count.times += 1
        return count.times >= self.settings.persistence

    def _raise(self, kind: str, now: float, suspects: tuple[str, ...], text: str) -> None:
        former = self._alarms.get(kind)
        first = self._counts[kind].first if kind in self._counts else now
        since, raised = (first, now) if former is None else (former.since, former.raised)
        self._alarms[kind] = Alarm(since, raised, kind, suspects, text)


def _another_clock(time: float, newest: float) -> bool:
    """Whether the host's clock was set since the newest sample (s), or a bag began anew."""
    return time <= newest - 1.0 or time > newest + PAUSE_S > -np.inf


def _without_slow(steady: Steady) -> FloatArray:
    t = steady.time - steady.time.mean()
    basis = np.vander(t / t[-1], 3)
    return np.asarray(steady.residual - basis @ np.linalg.lstsq(basis, steady.residual, rcond=None)[0])


def _orders_text(
    energies: OrderEnergies, failing: BoolArray, named: Sequence[Suspect], ranking: Sequence[Suspect]
) -> str:
    orders = ", ".join(f"{order:.0f}" for order in energies.order[failing])
    amplitude = np.sqrt(np.sum(energies.coefficient[:, failing] ** 2)) * _DEG
    what = f"{amplitude:.4f} deg/s at order {orders} of the drive that the model does not predict"
    if named:
        return f"{what}; like {' or '.join(s.name for s in named)} ({named[0].owner})"
    nearest = f", nearest {ranking[0].name} ({ranking[0].share:.0%})" if ranking else ""
    return f"{what}; no effect of the catalogue explains it{nearest}"


def _step_text(step: Step) -> str:
    size = " ".join(f"{value * _DEG:+.4f}" for value in step.size)
    return f"the bias stepped by {size} deg/s"
