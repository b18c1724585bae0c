"""A search is not caught by an effect that imitates most of another effect's further term."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.study.simulator import Disturbance

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.search.selection import Selection

from .sessions import G, analysed, names

NAMES = ("g_sensitivity", "friction_pickup", "friction_pickup_inertia", "viscous_tilt", "speed_pickup")
UPRIGHT = (0.06, 0.05, 0.997)
LEVEL = (0.7, 0.6, 0.4)
"""How a motor's current acts on the sensor's axes, of which z stays upright."""
X, Y, Z = np.eye(3)
NOISE = 4.0


class Recording:
    """Two runs, the second with the board turned about the vertical; least squares with known white noise."""

    def __init__(self, direction: tuple[float, ...], inertia: float, tilt: float) -> None:
        """Beside a pick-up of friction of size one: what accelerates the carriage, and a tilt with the speed."""
        self.effects = [e for e in REGRESSED if e.name in NAMES]
        t = np.arange(0, 40, 0.02)
        self.v, self.a = np.cos(2 * t), -2 * np.sin(2 * t)
        felt = np.where(t < 20, 1.0, -1.0) * self.a
        self.columns = {
            "g_sensitivity": [np.outer(felt, axis) for axis in (X, Y, Z)],
            "viscous_tilt": [np.outer(felt, X), np.outer(felt, Y), np.outer(self.a, Z)],
            "speed_pickup": [np.outer(self.v, axis) for axis in (X, Y, Z)],
        }
        noise = np.random.default_rng(5).normal(size=(len(t), 3))
        current = np.outer(np.sign(self.v) + inertia * self.a, direction)
        self.measured = NOISE * noise + np.outer(felt, [0.3, -0.2, 0.1]) + current + np.outer(tilt * self.a, Z)
        self.samples = noise.size

    def evaluate(self, names: frozenset[str], templates: Templates, *_: object, **__: object) -> Any:
        """The fit of a set of effects."""
        pickup = np.sign(self.v) + templates.get("friction_inertia") * self.a
        columns = {**self.columns, "friction_pickup": [np.outer(pickup, axis) for axis in (X, Y, Z)]}
        used = np.column_stack([c.ravel() for n in sorted(names) for c in columns.get(n, [])])
        beta, _, rank, _ = np.linalg.lstsq(used, self.measured.ravel(), rcond=1e-9)
        rest = (self.measured.ravel() - used @ beta) / NOISE
        return SimpleNamespace(names=names, templates=templates, rank=int(rank), loglik=-0.5 * float(rest @ rest))


@pytest.mark.parametrize(
    ("direction", "inertia", "tilt", "found"),
    [
        (UPRIGHT, 2.0, 0.0, {"friction_pickup", "friction_pickup_inertia"}),
        (LEVEL, 2.0, 0.0, {"friction_pickup", "friction_pickup_inertia"}),
        (LEVEL, 0.0, 2.0, {"friction_pickup", "viscous_tilt"}),
        (LEVEL, 0.0, 0.0, {"friction_pickup"}),
    ],
    ids=["upright current", "level current", "tilt with the speed", "friction alone"],
)
def test_the_current_of_inertia_and_a_tilt_are_told_apart(
    direction: tuple[float, ...], inertia: float, tilt: float, found: set[str]
) -> None:
    """Upright the two are alike, and the tilt is taken first: it needs no pick-up beside it."""
    best = Selection(Recording(direction, inertia, tilt), frozenset({"g_sensitivity"})).search()  # type: ignore[arg-type]
    assert best.fit.names == {"g_sensitivity", *found}
    if inertia:
        assert best.fit.templates.get("friction_inertia") == pytest.approx(inertia, rel=0.3)


def test_a_further_term_is_tried_in_the_place_of_another_effect() -> None:
    selection = Selection(Recording(UPRIGHT, 2.0, 0.0), frozenset({"g_sensitivity"}))  # type: ignore[arg-type]
    caught = frozenset({"g_sensitivity", "friction_pickup", "viscous_tilt"})
    assert caught - {"viscous_tilt"} | {"friction_pickup_inertia"} in list(selection._neighbours(caught))


@pytest.mark.slow
def test_in_one_mounting_g_is_as_unsure_as_the_current_that_accelerates() -> None:
    """Of a picked-up current of 2e-4 (rad/s)/N the inertia's part, some newtons at the top, is in G."""
    result = analysed(Disturbance("motor_pickup", 2e-4))
    assert names(result) == ["friction_pickup"]
    found = result.declared_parameters["g_sensitivity"]
    error = np.array([found[f"g_{x}x"].value - G[i][0] for i, x in enumerate("xyz")])
    stderr = np.array([found[f"g_{x}x"].stderr for x in "xyz"])
    assert np.linalg.norm(error) > 1e-4
    assert np.abs(error / stderr).max() < 3.0
