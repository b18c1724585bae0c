"""What is only a local optimum leaves its place to a rival that is none."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.search import soundness
from gsense_fusion.identification.search.selection import Candidate, Selection

DECLARED = frozenset({"g_sensitivity"})
SCORES = {"g_resonance": 9.0, "jerk_coupling": 8.0, "viscous_tilt": 5.0, "belt_tilt": 4.0}


def _model(*names: str) -> Candidate:
    return Candidate(cast(Any, SimpleNamespace(names=DECLARED | set(names))), SCORES[names[0]])


@pytest.mark.parametrize(
    ("sound", "found"),
    [
        ({"g_resonance", "viscous_tilt"}, "g_resonance"),
        ({"viscous_tilt", "belt_tilt"}, "viscous_tilt"),
        (set(), "g_resonance"),
    ],
    ids=["sound itself", "the best of the sound rivals", "none is sound"],
)
def test_an_effect_that_is_not_sound_gives_way(sound: set[str], found: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(soundness, "sound", lambda _selection, _fit, name: name in sound)
    selection = SimpleNamespace(
        effects={e.name: e for e in REGRESSED},
        declared=DECLARED,
        with_dependants=lambda _names, name: frozenset({name}),
        with_parts=lambda names: names,
        alternatives=lambda _fit, _name: ["jerk_coupling", "viscous_tilt", "belt_tilt"],
        candidate=lambda names: _model(*(names - DECLARED)),
    )
    best = soundness.rather_sound(cast(Selection, selection), _model("g_resonance"))
    assert best.fit.names == DECLARED | {found}
