"""Which models the search leaves out: what takes an effect's place must have gained something by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gsense_fusion.identification.search.hopeless import hopeless

LOGLIK = {"": 0.0, "a": 5000.0, "b": 300.0, "ab": 5100.0, "weak": 20.0, "near": 4000.0, "a weak": 5010.0}
"""Of models by their effects: `a` is what is there."""


def _candidate(names: frozenset[str]) -> Any:
    loglik = LOGLIK["ab" if names == {"a", "b"} else " ".join(sorted(names))]
    return SimpleNamespace(fit=SimpleNamespace(names=names, loglik=loglik), score=2 * loglik - 20.0 * len(names))


def _selection() -> Any:
    tried = [frozenset(n) for n in ([], ["a"], ["b"], ["a", "b"], ["weak"], ["near"])]
    return SimpleNamespace(declared=frozenset(), rough=_candidate, fitted=lambda names: names in tried)


@pytest.mark.parametrize(
    ("names", "out"),
    [
        ({"b", "weak"}, True),
        ({"b", "near"}, False),  # gains nearly what it takes the place of
        ({"a", "weak"}, False),  # as small as what it takes the place of
        ({"b", "new"}, False),  # was not tried by itself
        ({"b"}, False),
        ({"a", "b", "weak"}, False),  # only added
    ],
)
def test_what_gained_too_little_by_itself_takes_nothing_s_place(names: set[str], out: bool) -> None:
    assert hopeless(_selection(), frozenset(names), _candidate(frozenset({"a", "b"}))) == out
