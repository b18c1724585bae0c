"""What was claimed, as findings: parameters, axes, error before and after, rivals and the run that settles them."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.errors.metrics import band_rms
from gsense_fusion.identification.outcome.parameters import effect_parameters
from gsense_fusion.identification.result import Finding
from gsense_fusion.identification.types import AXES, FloatArray, Owner, Parameter
from gsense_fusion.identification.verdict.force_delay import delay_is_a_rival

AXIS_SIGMA = 2.576
SLOW_BAND_HZ = 0.1
TURNED = "board_turned_180"
QUARTER = "board_turned_90"
"""What is left open by the board turned by 180 degrees: on its side where the rig may turn, else about the vertical."""
OPPOSITE = -0.9
"""Cosine between the rail's directions in the sensor's axes from which a board counts as turned."""
ACROSS = 0.3
"""Cosine between two directions in the sensor's axes under which they count as at right angles."""
BAND_ORDERS = 3.0
"""A dynamic effect's own band reaches to the third order of the fastest drive."""


def all_findings(a: Analysis) -> tuple[Finding, ...]:
    """Of the gyro, of its noise, and of the recording."""
    out = []
    full = a.claims.full
    steps = ["declared", *a.claims.names]
    for before, name in itertools.pairwise(steps):
        effect = a.selection.effects[name]
        band = _own_band(a, effect)
        parameters = effect_parameters(a.likelihood, full, effect)
        alternatives = a.selection.alternatives(full, name)
        if delay_is_a_rival(a.likelihood, full, name) and "time_offset" not in alternatives:
            alternatives.append("time_offset")
        out.append(
            Finding(
                effect=name,
                owner=effect.owner,
                axes=_axes(a, effect, parameters),
                parameters=parameters,
                p_value=a.selection.p_value(full, name),
                rate_rms_before=band_rms(a.folds, before, band),
                rate_rms_after=band_rms(a.folds, name, band),
                alternatives=tuple(alternatives),
                separating_run=separating_run(a, name, alternatives),
                equation=effect.equation,
                source=effect.source,
            )
        )
    return (*out, *_noise_findings(a, steps[-1]), *_recorded_findings(a, steps[-1]))


def _recorded_findings(a: Analysis, last: str) -> list[Finding]:
    """What the recording itself shows: nothing can be subtracted, something has to be set or mended."""
    known = {e.name: e for e in a.settings.catalogue}
    rms = band_rms(a.folds, last, 0.4 * a.campaign.rate_hz) if a.seen.readings else 0.0
    return [
        Finding(
            effect=name,
            owner=known[name].owner,
            axes=found.axes,
            parameters=found.parameters,
            p_value=found.p_value,
            rate_rms_before=rms,
            rate_rms_after=rms,
            alternatives=found.alternatives,
            separating_run=found.separating_run,
            equation=known[name].equation,
            source=known[name].source,
            advice=found.advice,
        )
        for name, found in a.seen.readings.items()
    ]


def _noise_findings(a: Analysis, last: str) -> list[Finding]:
    """Effects that change the noise: nothing to subtract but, from each run with its own phase, a tone."""
    out = []
    known = {e.name: e for e in a.settings.catalogue}
    before = band_rms(a.folds, last, 0.4 * a.campaign.rate_hz)
    for name, found in a.claims.noise.items():
        after = float(np.sqrt(max(before**2 - found.removable**2 / len(a.campaign.axes), 0.0)))
        e = known[name]
        out.append(
            Finding(
                effect=name,
                owner=e.owner,
                axes=found.axes,
                parameters=found.parameters,
                p_value=found.p_value,
                rate_rms_before=before,
                rate_rms_after=after,
                alternatives=(),
                separating_run=None,
                equation=e.equation,
                source=e.source,
            )
        )
        before = after
    return out


def separating_run(a: Analysis, name: str, alternatives: Sequence[str]) -> str | None:
    """The run that tells an effect from its rivals, as the pair, it or one of them knows it; none that is there.

    A board turned by 180 degrees changes the sign of all that turns with the sensor, and of a tilt about a level axis:
    such pairs need it turned by 90 degrees.
    """
    if not alternatives:
        return None
    effects = [a.selection.effects[n] for n in (name, *alternatives)]
    pairs = [(name, n) for n in alternatives] + [(n, name) for n in alternatives]
    known = [a.selection.effects[one].separates.get(other) for one, other in pairs]
    known += [e.separating_run for e in effects]
    alike = all(_turns_with_sensor(e) for e in effects)
    useless = _done(a, alike) | ({TURNED} if alike else set())
    known += [QUARTER] if TURNED in known and TURNED in useless else []
    return next((run for run in known if run is not None and run not in useless), None)


def _turns_with_sensor(effect: Effect) -> bool:
    """Whether the sensor or its mount makes it of the specific force, in whatever direction the board lies."""
    return effect.owner in (Owner.SENSOR, Owner.MOUNT) or "g_sensitivity" in effect.needs


def _done(a: Analysis, about_vertical: bool) -> set[str]:
    """The turns of the board that the runs to fit have already; the one by 90 degrees about the vertical or the rail.

    About the rail the specific force keeps its axis in the sensor, about the vertical it comes to another one.
    """
    known = [r.mounting for r in a.campaign.fit if r.mounting is not None and r.mounting.along is not None]
    along = _cosines([m.along for m in known if m.along is not None])
    quarter = along if about_vertical else _cosines([m.up for m in known])
    done = {TURNED} if any(c < OPPOSITE for c in along) else set()
    return done | ({QUARTER} if any(abs(c) < ACROSS for c in quarter) else set())


def _cosines(directions: Sequence[FloatArray]) -> list[float]:
    """Between every two of some unit vectors."""
    return [float(one @ other) for one, other in itertools.combinations(directions, 2)]


def _own_band(a: Analysis, effect: Effect) -> float:
    """Up to where an effect acts, Hz, at most 0.4 of the sample rate."""
    fastest = max((r.motion.angular_frequency or 0.0 for r in a.campaign.runs if r.motion is not None), default=0.0)
    band = BAND_ORDERS * fastest / (2 * np.pi) if effect.dynamic and fastest else SLOW_BAND_HZ
    return float(min(max(band, SLOW_BAND_HZ), 0.4 * a.campaign.rate_hz))


def _axes(a: Analysis, effect: Effect, parameters: Mapping[str, Parameter]) -> tuple[str, ...]:
    """Axes with a significant parameter: the first letter after the underscore names the axis (c_x, t_y, g_xz)."""
    hit = {n.split("_")[1][0] for n, p in parameters.items() if "_" in n and abs(p.value) > AXIS_SIGMA * p.stderr > 0}
    axes = tuple(x for x in AXES if x in hit)
    if axes:
        return axes
    if effect.needs:  # it acts on the axes of the effect that it modifies
        other = a.selection.effects[effect.needs[0]]
        return _axes(a, other, effect_parameters(a.likelihood, a.claims.full, other))
    return tuple(AXES[i] for i in a.campaign.axes)
