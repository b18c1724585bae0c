"""Models that need not be tried: what takes the place of an effect gained far too little by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gsense_fusion.identification.search.selection import Candidate, Selection

MOST_BESIDE = 4.0
"""Times what an effect gains beside the declared ones alone that it gains beside others, at most."""
OUT_OF_REACH = 40.0
"""Score below the best one's at which a model with its searched parameters on their grids is given up."""


def hopeless(selection: Selection, names: frozenset[str], best: Candidate) -> bool:
    """Whether a set in which some effects of the best model have given way to others is out of reach of that.

    What is only added to the best model is always tried, and so is what was not tried by itself.
    """
    added, rest = names - best.fit.names, names & best.fit.names
    alone = selection.declared | added
    if not added or rest == best.fit.names or not selection.fitted(alone):
        return False
    gain = 2 * (selection.rough(alone).fit.loglik - selection.rough(selection.declared).fit.loglik)
    return selection.rough(rest).score + MOST_BESIDE * max(gain, 0.0) < best.score - OUT_OF_REACH
