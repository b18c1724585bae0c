"""Which effect of the catalogue would make such harmonics? A ranking, not a verdict: that is close_loop's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect
from gsense_fusion.identification.types import FloatArray

from .orders import OrderEnergies

RIVAL_WITHIN = 10.0
"""In whitened energy less the cost of the parameters; as close_loop lists rivals."""
EXPLAINS = 0.8
"""Share of the energy beyond noise that an effect has to explain to be named alone."""
WELL_POSED = 1e-6


@dataclass(frozen=True)
class Suspect:
    """An effect and how well it fits."""

    name: str
    owner: str
    share: float
    """Of the energy beyond noise that it explains."""
    score: float
    """Whitened energy that it explains less the cost of its parameters."""


def rank(energies: OrderEnergies, drivers: Drivers, catalogue: Sequence[Effect]) -> list[Suspect]:
    """All effects that the window can judge, the likeliest first.

    Args:
        energies: harmonics of the window's residual.
        drivers: of the same window.
        catalogue: effects; only those that the motion drives and that linear columns describe are ranked.
    """
    white = 1.0 / np.sqrt(energies.level)
    y = (energies.coefficient * white).ravel()
    noise = float(y.size)
    beyond = max(float(y @ y) - noise, 1e-9)
    found = []
    for effect in catalogue:
        if not effect.dynamic or not effect.parameters or effect.part_of or effect.missing(drivers) is not None:
            continue
        parts = [e for e in catalogue if e.part_of == effect.name and not e.bought]
        models = [[effect], [effect, *parts]] if parts else [[effect]]
        fits = [_explained(m, d, energies, white, y) for m in models for d in _variants(effect, drivers)]
        energy, columns = max(fits, key=lambda fit: fit[0] - fit[1] * np.log(noise))
        share = float(np.clip((energy - columns) / beyond, 0.0, 1.0))
        cost = (columns + len(effect.templates)) * np.log(noise)
        found.append(Suspect(effect.name, effect.owner.value, share, energy - cost))
    return sorted(found, key=lambda s: -s.score)


def rivals(ranking: Sequence[Suspect]) -> list[Suspect]:
    """The likeliest suspect and those that fit about as well; empty where none explains the energy."""
    if not ranking or ranking[0].share < EXPLAINS:
        return []
    return [s for s in ranking if s.score > ranking[0].score - RIVAL_WITHIN and s.share >= EXPLAINS]


def _variants(effect: Effect, drivers: Drivers) -> Iterator[Drivers]:
    """The drivers at each node of the effect's searched parameters."""
    if not effect.templates:
        yield drivers
        return
    grids: Iterable[tuple[float, ...]] = product(*(spec.grid or (spec.default,) for spec in effect.templates))
    for values in grids:
        templates = drivers.templates
        for spec, value in zip(effect.templates, values, strict=True):
            templates = templates.set(spec.field, value)
        yield replace(drivers, templates=templates)


def _explained(
    model: Sequence[Effect], drivers: Drivers, energies: OrderEnergies, white: FloatArray, y: FloatArray
) -> tuple[float, int]:
    """Whitened energy that a model's columns can take, and how many directions they have."""
    X = np.concatenate([effect.design(drivers) for effect in model], axis=2)  # (n, 3, p)
    n, _, p = X.shape
    harmonics = (energies.projector @ X.reshape(n, 3 * p)).reshape(2, -1, 3, p)
    columns = (harmonics * white[..., None]).reshape(y.size, p)
    size = np.sqrt(np.sum(columns**2, axis=0))
    if not size.any():
        return 0.0, 0
    columns = columns[:, size > 1e-9 * size.max()]
    u, s, _ = np.linalg.svd(columns / np.sqrt(np.sum(columns**2, axis=0)), full_matrices=False)
    kept = u[:, s > WELL_POSED * s[0]]
    return float(np.sum((kept.T @ y) ** 2)), kept.shape[1]
