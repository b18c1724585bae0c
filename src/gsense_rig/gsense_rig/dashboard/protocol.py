"""What a page may say, one JSON object a message. Whatever else comes is answered with one line, never an exception."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

MAX_LENGTH = 4096  # bytes of a message
SHAPES = ("hold", "step", "triangle")  # numbered as in gsense_msgs/Move


class ProtocolError(ValueError):
    """A message that cannot be used; the text is one line."""


@dataclass(frozen=True)
class Hello:
    """First message: the token that allows to move the rig, or an empty one to look on."""

    token: str


@dataclass(frozen=True)
class Alive:
    """The page has drawn state message `n`."""

    n: int


@dataclass(frozen=True)
class View:
    """What the page shows from now on; empty: the first there is."""

    sensor: str
    filter: str


@dataclass(frozen=True)
class Call:
    """One of the rig's services: home, stop, reset, park."""

    id: int
    name: str


@dataclass(frozen=True)
class Sine:
    """Goal of rig/sinusoid; m, rad/s."""

    id: int
    amplitude: float
    angular_frequency: float
    cycles: int


@dataclass(frozen=True)
class Move:
    """Goal of rig/move; m, rad/s, s."""

    id: int
    shape: int
    position: float
    amplitude: float
    angular_frequency: float
    duration: float


Command = Call | Sine | Move
Message = Hello | Alive | View | Command


def parse(text: str | bytes) -> Message:
    """Read a page's message; raises ProtocolError."""
    if isinstance(text, bytes):
        raise ProtocolError("a binary message: JSON text is expected")
    try:
        data = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise ProtocolError("not JSON") from None
    if not isinstance(data, dict):
        raise ProtocolError("not a JSON object")
    kind = data.get("type")
    reader = _READERS.get(kind) if isinstance(kind, str) else None
    if reader is None:
        raise ProtocolError(f"type is unknown; use one of {', '.join(_READERS)}")
    return reader(data)


def _no_constant(name: str) -> None:
    raise ValueError(name)


def _text(data: dict[str, Any], name: str) -> str:
    value = data.get(name, "")
    if not isinstance(value, str) or len(value) > 200:
        raise ProtocolError(f"{name} is not a text of at most 200 characters")
    return value


def _number(data: dict[str, Any], name: str, default: float | None = None) -> float:
    value = data.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ProtocolError(f"{name} is not a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ProtocolError(f"{name} is not a finite number")
    return number


def _whole(data: dict[str, Any], name: str, highest: int) -> int:
    value = data.get(name)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= highest:
        raise ProtocolError(f"{name} is not a whole number from 0 to {highest}")
    return value


def _id(data: dict[str, Any]) -> int:
    return _whole(data, "id", 2**31)


def _shape(data: dict[str, Any]) -> int:
    shape = data.get("shape")
    if shape not in SHAPES:
        raise ProtocolError(f"shape is unknown; use one of {', '.join(SHAPES)}")
    return SHAPES.index(shape)


def _call(name: str) -> Callable[[dict[str, Any]], Message]:
    return lambda data: Call(_id(data), name)


_READERS: dict[str, Callable[[dict[str, Any]], Message]] = {
    "hello": lambda data: Hello(_text(data, "token")),
    "alive": lambda data: Alive(_whole(data, "n", 2**53)),
    "view": lambda data: View(_text(data, "sensor"), _text(data, "filter")),
    **{name: _call(name) for name in ("home", "stop", "reset", "park")},
    "sinusoid": lambda data: Sine(
        _id(data), _number(data, "amplitude"), _number(data, "angular_frequency"), _whole(data, "cycles", 2**32 - 1)
    ),
    "move": lambda data: Move(
        _id(data),
        _shape(data),
        _number(data, "position", 0.0),
        _number(data, "amplitude", 0.0),
        _number(data, "angular_frequency", 0.0),
        _number(data, "duration", 0.0),
    ),
}


def id_of(text: str | bytes) -> int | None:
    """The id of a message that could not be read, for the answer to it."""
    try:
        value = json.loads(text).get("id")
    except (ValueError, AttributeError, RecursionError):
        return None
    return value if isinstance(value, int) and not isinstance(value, bool) else None
