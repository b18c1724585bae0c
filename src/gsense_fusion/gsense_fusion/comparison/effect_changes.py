"""The effects of two reports beside each other: which one drifted, entered, is gone, or cannot be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite, sqrt

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.types import FloatArray, Parameter

from .changes import Difference, EffectChange, ScalarChange, Status
from .contrast import Contrast, contrast
from .snapshot import Estimate, Presence, Snapshot

CYCLIC = ("g_xy", "g_yz", "g_zx")
"""The elements of G that the thesis's scalar k (its equation 7.4) stands for."""
EVENTS = frozenset({"bias_jump"})
"""What happens once: its parameters say nothing of another session."""
OF_THE_SESSION = frozenset({"t0", "phase", "samples"})
"""Parameters that belong to one recording."""


def pairs(old: Snapshot, new: Snapshot) -> list[EffectChange]:
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


def judged(e: EffectChange, old: Snapshot, new: Snapshot, level: float) -> EffectChange:
    """What became of an effect, each test at this chance of a false alarm."""
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


def ordered(effects: Sequence[EffectChange]) -> list[EffectChange]:
    """Changes first, the bias last."""
    order = (Status.DRIFTED, Status.ENTERED, Status.GONE, Status.SETTLED, Status.UNSURE, Status.SAME, Status.SESSION)
    return sorted(effects, key=lambda e: order.index(e.status))


def cyclic(a: Estimate | None, b: Estimate | None) -> ScalarChange | None:
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
