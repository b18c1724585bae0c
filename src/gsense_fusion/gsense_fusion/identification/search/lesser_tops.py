"""Models whose search stopped at a lesser top than the one that a larger model found."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.search.selection import Candidate, Selection

LESSER_TOP = 0.1
"""In the log-likelihood: what a search between bounds may miss of the top that it found."""


def without_lesser_tops(selection: Selection, best: Candidate) -> Candidate:
    """The best model once the smaller ones have been tried where it is searched.

    An effect that moves none of the data would else seem to gain what its model is better tuned by.
    """
    while (smaller := _smaller_there(selection, best)).score > best.score + 1e-6:
        best = selection.search(smaller)
    return best


def _smaller_there(selection: Selection, best: Candidate) -> Candidate:
    """The best one, or one without one of its effects that is better where the best one is searched."""
    found = [best]
    for name in sorted(best.fit.names - selection.declared):
        rest = best.fit.names - selection.with_dependants(best.fit.names, name)
        templates = Templates()
        for t in selection.tuning.specs(rest):
            templates = templates.set(t.field, best.fit.templates.get(t.field, t.default))
        there = selection.likelihood.evaluate(rest, templates)
        if there.loglik > selection.candidate(rest).fit.loglik + LESSER_TOP:
            found.append(selection.candidate_from(there))
    return max(found, key=lambda c: c.score)
