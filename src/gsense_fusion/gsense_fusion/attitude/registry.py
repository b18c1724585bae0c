"""The filters by name. A further filter is one file and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .interface import AttitudeFilter
from .madgwick import Madgwick, MadgwickParameters


class UnknownFilterError(ValueError):
    """No filter of this name; the message lists those that there are."""


@dataclass(frozen=True)
class FilterKind:
    """How to make one filter."""

    make: Callable[[Any], AttitudeFilter]
    """From an instance of `parameters`, in its initial state."""
    parameters: type[Any]
    """Dataclass of its parameters; every field has a default."""


FILTERS: dict[str, FilterKind] = {
    "madgwick": FilterKind(Madgwick, MadgwickParameters),
}


def filter_kind(name: str) -> FilterKind:
    """The filter called `name`.

    Raises:
        UnknownFilterError: there is none.
    """
    try:
        return FILTERS[name]
    except KeyError:
        raise UnknownFilterError(f"no filter {name!r}; there are: {', '.join(sorted(FILTERS))}") from None
