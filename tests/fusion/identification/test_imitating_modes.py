"""Two modes that are sound only without a term that the claim has are no claim."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.verdict import claims

SECOND = frozenset({"g_sensitivity", "g_resonance", "g_resonance_second"})
ALL = SECOND | {"g_resonance_rate"}
ONE = frozenset({"g_sensitivity", "g_resonance", "g_resonance_rate"})


@pytest.mark.parametrize(
    ("best", "full", "sound", "claimed"),
    [
        (SECOND, ALL, False, []),
        (SECOND, ALL, True, ["g_resonance"]),
        (ALL, ALL, False, ["g_resonance"]),  # what is judged then is the best model itself
        (ONE - {"g_resonance_rate"}, ONE, False, ["g_resonance"]),  # one mode alone
    ],
)
def test_a_second_mode_is_sound_with_all_the_terms_of_its_claim(
    best: frozenset[str], full: frozenset[str], sound: bool, claimed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the best model two modes may ring and predict; with the rocking that comes beside, they are any two."""
    monkeypatch.setattr(claims, "refines", lambda *_: None)
    monkeypatch.setattr(claims, "refused", lambda *_: None)
    monkeypatch.setattr(claims, "claimed_fit", lambda *_: SimpleNamespace(names=full))
    monkeypatch.setattr(claims, "sound", lambda *_: sound)
    selection = SimpleNamespace(
        effects={e.name: e for e in REGRESSED},
        declared=frozenset({"g_sensitivity"}),
        bought=frozenset({"g_resonance_second"}) & best,
        gain=lambda *_: (100.0, 6),
    )
    names, _, refusals = claims._vetted(cast(Selection, selection), cast(Any, SimpleNamespace(names=best)), None, ())
    assert names == claimed
    assert set(refusals) == {"g_resonance"} - set(claimed)
