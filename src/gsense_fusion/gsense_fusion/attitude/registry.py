"""The filters by name. A further filter is one file and one line here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import radians
from typing import Any

from .bounded import Bounded, BoundedParameters
from .complementary import Complementary, ComplementaryParameters
from .gyro_only import GyroOnly, GyroOnlyParameters
from .interface import AttitudeFilter
from .kalman import Kalman, KalmanParameters
from .madgwick import Madgwick, MadgwickParameters
from .mahony import Mahony, MahonyParameters
from .own import Own, OwnParameters
from .rig_aided import RigAided, RigAidedParameters
from .stream import Channel
from .vqf_library import Vqf, VqfParameters


class UnknownFilterError(ValueError):
    """No filter of this name; the message lists those that there are."""


@dataclass(frozen=True)
class FilterKind:
    """How to make one filter."""

    make: Callable[[Any], AttitudeFilter]
    """From an instance of `parameters`, in its initial state."""
    parameters: type[Any]
    """Dataclass of its parameters; every field has a default."""
    uses_carriage: bool = False
    """Whether it is fed with the specific force less the carriage's acceleration."""
    uses_own: bool = False
    """Whether it is fed with the sensor's own attitude; what is compensated outside does not reach into that."""
    own_bias: float = 0.0
    """rad/s: a bias up to this is the filter's own business and is left in the rate; a larger one is taken off."""


FILTERS: dict[str, FilterKind] = {
    "complementary": FilterKind(Complementary, ComplementaryParameters),
    "kalman": FilterKind(Kalman, KalmanParameters),
    "madgwick": FilterKind(Madgwick, MadgwickParameters),
    "mahony": FilterKind(Mahony, MahonyParameters),
    "vqf": FilterKind(Vqf, VqfParameters, own_bias=radians(1.0)),  # the library searches within 2 deg/s
    "bounded": FilterKind(Bounded, BoundedParameters),
    "rig_aided": FilterKind(RigAided, RigAidedParameters, uses_carriage=True),
    "gyro_only": FilterKind(GyroOnly, GyroOnlyParameters),
    "own": FilterKind(Own, OwnParameters, uses_own=True),
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


def channels(
    names: Sequence[str], *, with_compensation: bool, parameters: Mapping[str, Mapping[str, float]] | None = None
) -> list[Channel]:
    """The outputs of some filters: `<filter>`, and with compensation `<filter>_gcomp` beside it.

    Args:
        names: of the filters.
        with_compensation: whether there is a compensation file.
        parameters: filter -> fields of its parameters that differ from the defaults.

    Raises:
        UnknownFilterError: there is none of a name.
        ValueError: a parameter out of its bounds.
    """
    out = []
    for name in dict.fromkeys(names):
        kind = filter_kind(name)
        more = dict((parameters or {}).get(name, {}))
        for compensated in (False, True) if with_compensation and not kind.uses_own else (False,):
            made = kind.make(kind.parameters(**more))
            label = f"{name}_gcomp" if compensated else name
            out.append(Channel(label, made, compensated, kind.uses_carriage, kind.own_bias, kind.uses_own))
    return out
