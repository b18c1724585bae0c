"""What is remembered goes with its object; an analysis leaves nothing behind for the garbage collector."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator

import pytest
from tests.study.judge import analyse

from gsense_fusion.identification.kept import kept, once_for, weakly
from gsense_fusion.identification.likelihood.model import Likelihood

from .sessions import BOW, SETTINGS, made


class Counting:
    def __init__(self) -> None:
        self.calls: list[int] = []
        self.squared = kept(2, self._square)

    def _square(self, value: int) -> int:
        self.calls.append(value)
        return value * value


@pytest.fixture
def uncollected() -> Iterator[None]:
    gc.collect()
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("uncollected")
def test_the_last_results_are_kept_and_go_with_the_object() -> None:
    counting = Counting()
    assert [counting.squared(n) for n in (2, 3, 2, 3, 4, 2)] == [4, 9, 4, 9, 16, 4]
    assert counting.calls == [2, 3, 4, 2]
    gone = weakref.ref(counting)
    del counting
    assert gone() is None


def test_a_method_whose_object_is_gone_says_so() -> None:
    with pytest.raises(ReferenceError, match="gone"):
        weakly(Counting()._square)(2)


@pytest.mark.usefixtures("uncollected")
def test_once_for_each_object_while_it_lives() -> None:
    asked = []

    @once_for
    def name(of: Counting) -> str:
        asked.append(id(of))
        return "counted"

    first, second = Counting(), Counting()
    assert [name(first), name(first), name(second)] == ["counted"] * 3
    assert asked == [id(first), id(second)]
    gone = weakref.ref(first)
    del first
    assert gone() is None


@pytest.mark.slow
@pytest.mark.usefixtures("uncollected")
def test_an_analysis_leaves_no_campaign_behind() -> None:
    before = {id(o) for o in gc.get_objects() if isinstance(o, Likelihood)}
    result = analyse(made(BOW), SETTINGS)
    assert result.findings
    assert not [o for o in gc.get_objects() if isinstance(o, Likelihood) and id(o) not in before]
