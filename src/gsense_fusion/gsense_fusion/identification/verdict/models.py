"""Models of the declared effects and some claims, and a model without one effect."""

from __future__ import annotations

from collections.abc import Iterable

from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.selection import Selection


def claimed_fit(selection: Selection, names: Iterable[str]) -> Fit:
    """The declared effects and the named ones with their further terms."""
    return selection.candidate(selection.with_parts(selection.declared | frozenset(names))).fit


def fit_without(selection: Selection, fit: Fit, name: str) -> Fit:
    """A model without one of its effects and what needs it."""
    return selection.candidate(fit.names - selection.with_dependants(fit.names, name)).fit
