"""What is remembered for as long as the object lives that it belongs to, and no longer.

`lru_cache` on a bound method is a circle: object, cache, method, object. Each held a whole campaign until the garbage
collector came by, which it seldom does, and on a function it holds the last arguments for good: a process that
analyses one session after the other grew by each.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary, WeakMethod

A = TypeVar("A")
P = ParamSpec("P")
R = TypeVar("R")


def weakly(method: Callable[P, R]) -> Callable[P, R]:
    """A bound method that may be called as long as something else holds its object."""
    reference = WeakMethod(method)

    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        bound = reference()
        if bound is None:
            raise ReferenceError("the object whose method this is has gone")
        return bound(*args, **kwargs)

    return call


def kept(size: int | None, method: Callable[P, R]) -> Callable[P, R]:
    """A bound method with its last `size` results, all of them for None; arguments must be hashable."""
    return lru_cache(maxsize=size)(weakly(method))  # type: ignore[return-value] # it takes any hashable arguments


def once_for(function: Callable[Concatenate[A, P], R]) -> Callable[Concatenate[A, P], R]:
    """A function of an object, called once for each; its result must not hold the object.

    What else the function takes must always be the same for the same object.
    """
    found: WeakKeyDictionary[A, R] = WeakKeyDictionary()

    @wraps(function)
    def call(of: A, /, *args: P.args, **kwargs: P.kwargs) -> R:
        if of not in found:
            found[of] = function(of, *args, **kwargs)
        return found[of]

    return call
