"""Is what an effect's columns are searched by inside its range, and known as well as it has to be?"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Effect, TemplateSpec, parts_of
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.interval import searched, template_stderr
from gsense_fusion.identification.search.selection import Candidate, Selection

SOUND_SIGMA = 2.6
END_PART = 0.01
"""A searched parameter this near to the end of its range is at it: a search between bounds stops short of them."""


def sound(selection: Selection, fit: Fit, name: str) -> bool:
    """Whether what an effect's columns are searched by is no local optimum; of two modes one is enough."""
    likelihood, effect = selection.likelihood, selection.effects[name]
    parts = parts_of(likelihood.effects, name, fit.names)
    open_ = _left_open(likelihood, fit, effect)
    known = ([t for t in e.templates if not t.optional] for e in parts if e is effect or (e.parameters and e.templates))
    return any(all(template_sound(likelihood, fit, t) and t.field not in open_ for t in own) for own in known)


def rather_sound(selection: Selection, best: Candidate) -> Candidate:
    """A model in which an effect of the motion that is not sound gives way to a rival that is, where there is one.

    A mode far above what was driven fits whatever answers at once, and is no claim: what it stood for may be one.
    """
    effects = selection.effects
    for name in sorted(best.fit.names - selection.declared):
        if not effects[name].dynamic or effects[name].part_of is not None or sound(selection, best.fit, name):
            continue
        rest = best.fit.names - selection.with_dependants(best.fit.names, name)
        rivals = [other for other in selection.alternatives(best.fit, name) if effects[other].dynamic]
        tried = [(other, selection.candidate(selection.with_parts(rest | {other}))) for other in rivals]
        best = max((c for n, c in tried if sound(selection, c.fit, n)), key=lambda c: c.score, default=best)
    return best


def _left_open(likelihood: Likelihood, fit: Fit, effect: Effect) -> frozenset[str]:
    """Fields of an effect that may be where it would be something else."""
    specs = [t for e in parts_of(likelihood.effects, effect.name, fit.names) for t in e.templates]
    if not any(t.below_upper or np.isfinite(t.known_to) for t in specs):
        return frozenset()
    out = set()
    for t, error in zip(specs, searched(likelihood, fit, effect)[0], strict=True):
        value = fit.templates.get(t.field, t.default)
        room = min(t.upper - value if t.below_upper else np.inf, t.known_to * abs(value))
        if room < SOUND_SIGMA * error:
            out.add(t.field)
    return frozenset(out)


def template_sound(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> bool:
    """Whether a searched parameter is inside its range and, where the effect exists by it alone, significant.

    A local optimum is no finding.
    """
    value = fit.templates.get(template.field, template.default)
    if not template.owns_effect:
        return (1 + END_PART) * template.lower < value < (1 - END_PART) * template.upper
    margin = END_PART * (template.upper - template.lower)
    inside = template.lower + margin < value < template.upper - margin
    return inside and abs(value) > SOUND_SIGMA * template_stderr(likelihood, fit, template)
