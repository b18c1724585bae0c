"""The differences between two reports with their errors, and which of them are more than chance.

All tests share the chance `FALSE_ALARM` (Bonferroni). Both reports' errors are taken to be independent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import inf, isfinite, log, sqrt

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.types import FloatArray, IdentificationError, Parameter

from .contrast import Contrast, contrast
from .snapshot import Estimate, Presence, Snapshot

FALSE_ALARM = 0.01
"""Chance that two analyses of the same thing are said to differ, all tests together."""
CYCLIC = ("g_xy", "g_yz", "g_zx")
"""The elements of G that the thesis's scalar k (its equation 7.4) stands for."""
EVENTS = frozenset({"bias_jump"})
"""What happens once: its parameters say nothing of another session."""
OF_THE_SESSION = frozenset({"t0", "phase", "samples"})
"""Parameters that belong to one recording."""
LEAST_NOISE_RATIO = 1.05
LEAST_DELAY_S = 2e-4
"""Less is beneath notice, however sure: filters, temperature and stamps do as much."""


class Status(str, Enum):
    """What became of an effect."""

    SAME = "same"
    DRIFTED = "drifted"
    ENTERED = "entered"
    GONE = "gone"
    SETTLED = "settled"
    """The one could not tell it from its rivals, the other can, or names another of them."""
    UNSURE = "unsure"
    """Only one names it, and the other does not exclude it."""
    SESSION = "of the session"
    """The bias: it differs from one switching on to the next."""


CHANGES = frozenset({Status.DRIFTED, Status.ENTERED, Status.GONE})


@dataclass(frozen=True)
class Difference:
    """A parameter in both reports; its values are kept where only one has it."""

    name: str
    unit: str
    old: Parameter | None
    new: Parameter | None
    known_stderr: float | None = None
    """Of the difference if nothing changed, by the covariances."""
    identified: bool = True
    """Whether both reports' data identify it."""

    @property
    def value(self) -> float:
        """New less old; NaN where only one has it."""
        return self.new.value - self.old.value if self.old and self.new else float("nan")

    @property
    def stderr(self) -> float:
        """Of the difference."""
        if self.known_stderr is not None:
            return self.known_stderr
        return sqrt(self.old.stderr**2 + self.new.stderr**2) if self.old and self.new else inf

    @property
    def z(self) -> float:
        """Difference in standard errors; NaN where that means nothing."""
        return self.value / self.stderr if self.identified and 0.0 < self.stderr < inf else float("nan")


@dataclass(frozen=True)
class EffectChange:
    """An effect that at least one of the two needs."""

    effect: str
    owner: str | None
    status: Status
    parameters: tuple[Difference, ...]
    chi2: float | None
    dof: int
    p_value: float | None
    note: str = ""


@dataclass(frozen=True)
class ScalarChange:
    """One number in both reports."""

    name: str
    unit: str
    old: Parameter
    new: Parameter
    p_value: float | None
    """None: said, not tested."""
    relevant: bool = True
    """Whether the difference is large enough to speak of."""
    known_stderr: float | None = None
    """Of the difference, where it is not that of independent errors."""

    @property
    def difference(self) -> Parameter:
        """New less old."""
        independent = sqrt(self.old.stderr**2 + self.new.stderr**2)
        stderr = independent if self.known_stderr is None else self.known_stderr
        return Parameter(self.new.value - self.old.value, stderr, self.unit)


@dataclass(frozen=True)
class Comparison:
    """What changed."""

    old: Snapshot
    new: Snapshot
    effects: tuple[EffectChange, ...]
    k: ScalarChange | None
    scalars: tuple[ScalarChange, ...]
    """Noise by axis, delay, error and floor."""
    unexplained: Status | None
    warnings: tuple[str, ...]
    level: float
    """Chance of a false alarm that each test has."""

    @property
    def changed_effects(self) -> tuple[EffectChange, ...]:
        """Those that drifted, entered or are gone."""
        return tuple(e for e in self.effects if e.status in CHANGES)

    @property
    def changed_scalars(self) -> tuple[ScalarChange, ...]:
        """Noise and delay that differ."""
        return tuple(s for s in self.scalars if s.p_value is not None and s.p_value < self.level and s.relevant)

    @property
    def verdict(self) -> str:
        """Whether anything did: changed or nothing_changed."""
        changed = self.changed_effects or self.changed_scalars or self.unexplained in CHANGES
        return "changed" if changed else "nothing_changed"


def compare(old: Snapshot, new: Snapshot) -> Comparison:
    """Compare two reports of the same sensor.

    Raises:
        IdentificationError: they are of different sensors.
    """
    if _bare(old.sensor) != _bare(new.sensor):
        raise IdentificationError(
            f"{new.path}: is of the sensor {new.sensor}, {old.path} of {old.sensor}: only one sensor with itself"
        )
    pairs = _pairs(old, new)
    k = _cyclic(old.effects.get("g_sensitivity"), new.effects.get("g_sensitivity"))
    scalars = (*_noise(old, new), *_delay(old, new), *_errors(old, new))
    tests = sum(e.p_value is not None and e.status is not Status.SESSION for e in pairs) + (k is not None)
    level = FALSE_ALARM / max(tests + sum(s.p_value is not None for s in scalars), 1)
    effects = [_judged(e, old, new, level) for e in pairs]
    if k is not None and k.p_value is not None and k.p_value < level:
        effects = [
            replace(e, status=Status.DRIFTED) if (e.effect, e.status) == ("g_sensitivity", Status.SAME) else e
            for e in effects
        ]
    return Comparison(
        old, new, tuple(_ordered(effects)), k, scalars, _unexplained(old, new), _warnings(old, new), level
    )


def _bare(sensor: str) -> str:
    return sensor.strip("/").removesuffix("/imu/data_raw")


def _pairs(old: Snapshot, new: Snapshot) -> list[EffectChange]:
    """Every effect that one of the two needs, not judged yet; rivals that stand for each other as one entry."""
    out: list[EffectChange] = []
    settled = _settled(old, new)
    for name in dict.fromkeys((*new.effects, *old.effects)):
        a, b = old.effects.get(name), new.effects.get(name)
        if name in settled.values() or not any(e is not None and (e.present or name == "bias") for e in (a, b)):
            continue
        if name in settled and b is not None:
            values = tuple(Difference(n, p.unit, None, p) for n, p in b.parameters.items())
            note = f"{settled[name]} or a rival of it in OLD"
            out.append(EffectChange(name, b.owner, Status.SETTLED, values, None, 0, None, note))
        else:
            out.append(_difference(name, a, b))
    return out


def _settled(old: Snapshot, new: Snapshot) -> dict[str, str]:
    """Findings of the new report that have another name in the old one, whose rivals they are, with that name."""
    out: dict[str, str] = {}
    here = {n for n, e in new.effects.items() if e.presence is Presence.FOUND}
    there = {n for n, e in old.effects.items() if e.presence is Presence.FOUND}
    for name in sorted(here - there):
        for other in sorted(there - here - set(out.values())):
            if name in old.effects[other].alternatives or other in new.effects[name].alternatives:
                out[name] = other
                break
    return out


def _difference(name: str, a: Estimate | None, b: Estimate | None) -> EffectChange:
    owner = next((e.owner for e in (b, a) if e is not None and e.owner is not None), None)
    x, y = (a.parameters if a else {}), (b.parameters if b else {})
    rows = []
    for n in dict.fromkeys((*y, *x)):
        if n not in OF_THE_SESSION:
            known = y[n] if n in y else x[n]
            rows.append(Difference(n, known.unit, x.get(n), y.get(n)))
    if name in EVENTS or a is None or b is None:
        return EffectChange(name, owner, Status.SAME, tuple(rows), None, 0, None)
    c = _contrast(a, b)
    if c is None:
        return EffectChange(name, owner, Status.SAME, tuple(rows), None, 0, _least([r.z for r in rows]))
    places = {n: i for i, n in enumerate(_shared(a, b))}
    rows = [
        replace(r, known_stderr=float(c.stderr[places[r.name]]), identified=bool(c.known[places[r.name]]))
        if r.name in places
        else r
        for r in rows
    ]
    searched = _least([r.z for r in rows if r.name not in places])
    p = c.p_value if searched is None else min(1.0, 2 * min(c.p_value, searched))
    return EffectChange(name, owner, Status.SAME, tuple(rows), c.statistic, c.dof, p)


def _least(z: Sequence[float]) -> float | None:
    """Chance of the largest of some differences in standard errors, for their number; None without any."""
    known = [abs(v) for v in z if isfinite(v)]
    return min(1.0, len(known) * float(2 * norm.sf(max(known)))) if known else None


def _shared(a: Estimate, b: Estimate) -> tuple[str, ...]:
    """Parameters whose covariance both reports have."""
    mine, theirs = (() if e.covariance is None else e.covariance.parameters for e in (a, b))
    return mine if set(mine) == set(theirs) else ()


def _contrast(a: Estimate, b: Estimate) -> Contrast | None:
    names = _shared(a, b)
    if not names or a.covariance is None or b.covariance is None:
        return None
    old, new = (np.array([e.parameters[n].value for n in names]) for e in (a, b))
    return contrast(old, new, a.covariance, b.covariance.ordered(names))


def _judged(e: EffectChange, old: Snapshot, new: Snapshot, level: float) -> EffectChange:
    if e.status is not Status.SAME:
        return e
    if e.effect == "bias":
        return replace(e, status=Status.SESSION)
    was, now = (x is not None and x.present for x in (s.effects.get(e.effect) for s in (old, new)))
    differs = e.p_value is not None and e.p_value < level
    if was and now:
        return replace(e, status=Status.DRIFTED if differs else Status.SAME)
    status = Status.ENTERED if now else Status.GONE
    if e.effect in EVENTS or differs:
        return replace(e, status=status)
    return _without_contrast(e, status, *(("OLD", old) if now else ("NEW", new)))


def _without_contrast(e: EffectChange, status: Status, name: str, lacking: Snapshot) -> EffectChange:
    """An effect that one report lacks without excluding it by numbers."""
    if any(line.startswith(e.effect) for line in lacking.undecided):
        return replace(e, status=Status.UNSURE, note=f"{name} could not decide it")
    if e.p_value is None:  # its shape is searched: there is no size that was excluded
        return replace(e, status=status, note=f"{name} sought it and did not find it")
    return replace(e, status=Status.UNSURE, note=f"{name} does not exclude it")


def _ordered(effects: Sequence[EffectChange]) -> list[EffectChange]:
    """Changes first, the bias last."""
    order = (Status.DRIFTED, Status.ENTERED, Status.GONE, Status.SETTLED, Status.UNSURE, Status.SAME, Status.SESSION)
    return sorted(effects, key=lambda e: order.index(e.status))


def _cyclic(a: Estimate | None, b: Estimate | None) -> ScalarChange | None:
    """The thesis's k in both: the mean of those of its elements that both identify, with one set of weights."""
    if a is None or b is None or not (a.present or b.present):
        return None
    c = _contrast(a, b)
    if c is None:
        return None
    index = [i for i, n in enumerate(_shared(a, b)) if n in CYCLIC and c.known[i]]
    if not index:
        return None
    names = [_shared(a, b)[i] for i in index]
    S = c.covariance[np.ix_(index, index)]
    w = np.linalg.solve(S, np.ones(len(index)))
    w /= w.sum()
    old, new = (_mean(e, names, w) for e in (a, b))
    stderr = sqrt(float(w @ S @ w))
    p = float(2 * norm.sf(abs(new.value - old.value) / stderr))
    return ScalarChange("k", old.unit, old, new, p, known_stderr=stderr)


def _mean(e: Estimate, names: Sequence[str], weights: FloatArray) -> Parameter:
    """Weighted mean of some elements; its error takes theirs for independent."""
    values = [e.parameters[n] for n in names]
    stderr = sqrt(sum((w * p.stderr) ** 2 for w, p in zip(weights, values, strict=True)))
    return Parameter(float(weights @ [p.value for p in values]), stderr, values[0].unit)


def _noise(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    out = []
    for axis in (x for x in old.noise if x in new.noise):
        a, b = old.noise[axis], new.noise[axis]
        if min(a.value, b.value) <= 0.0:
            continue
        ratio = log(b.value / a.value)
        z = abs(ratio) / max(sqrt((a.stderr / a.value) ** 2 + (b.stderr / b.value) ** 2), 1e-12)
        relevant = abs(ratio) > log(LEAST_NOISE_RATIO)
        out.append(ScalarChange(f"noise {axis}", a.unit, a, b, float(2 * norm.sf(z)), relevant))
    return out


def _delay(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    """Delay of the IMU against the encoder."""
    a, b = old.delay, new.delay
    if a is None or b is None:
        return []
    z = abs(b.value - a.value) / max(sqrt(a.stderr**2 + b.stderr**2), 1e-9)
    return [ScalarChange("delay of the IMU", "s", a, b, float(2 * norm.sf(z)), abs(b.value - a.value) > LEAST_DELAY_S)]


def _errors(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    names = {"raw": "rate error, bias alone", "full": "rate error, full model", "noise_floor": "noise floor"}
    return [
        ScalarChange(
            text, "rad/s", Parameter(old.rate_rms[n], 0.0, "rad/s"), Parameter(new.rate_rms[n], 0.0, "rad/s"), None
        )
        for n, text in names.items()
        if n in old.rate_rms and n in new.rate_rms
    ]


def _unexplained(old: Snapshot, new: Snapshot) -> Status | None:
    match (old.unexplained is not None, new.unexplained is not None):
        case (False, False):
            return None
        case (False, True):
            return Status.ENTERED
        case (True, False):
            return Status.GONE
        case _:
            return Status.SAME


def _warnings(old: Snapshot, new: Snapshot) -> tuple[str, ...]:
    out = []
    if old.unit_id != new.unit_id:
        if old.unit_id and new.unit_id:
            out.append(f"two units ({old.unit_id}, {new.unit_id}): a difference is between units, not in time")
        else:
            out.append("one report does not name its unit: that both are of the same is taken for granted")
    if set(old.declared) != set(new.declared):
        out.append(f"declared differently: OLD {', '.join(old.declared)}; NEW {', '.join(new.declared)}")
    common = old.recordings & new.recordings
    if common:
        out.append(f"{len(common)} bags are in both: the errors are not independent, the differences surer than said")
    rates = [float(np.median(s.rates_hz)) if s.rates_hz else 0.0 for s in (old, new)]
    if min(rates) > 0 and abs(log(rates[1] / rates[0])) > 0.05:
        out.append(f"sampled at {rates[0]:.0f} and {rates[1]:.0f} Hz: delay and noise may differ for that alone")
    if any("g_sensitivity" in s.effects and s.effects["g_sensitivity"].covariance is None for s in (old, new)):
        out.append("a report of an earlier version, without covariances: parameters are compared one by one")
    return tuple(out)
