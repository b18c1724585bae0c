"""Engineers' units beside SI: deg/s, deg/s/g, deg/s/K, deg/m, ms; and numbers with as many digits as they deserve."""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import floor, isfinite, log10, pi

from gsense_fusion.identification.types import GRAVITY, Parameter

DEG = 180.0 / pi
"""deg per rad."""
COVERAGE_95 = 1.959964
"""Half-width of a two-sided 95 % interval in standard errors."""
MANY_DECIMALS = 6
"""A number that needs more decimals than this is written with an exponent."""


@dataclass(frozen=True)
class Scale:
    """From an SI unit to the one that engineers quote: multiply by `factor`."""

    factor: float
    unit: str


_G_POWER = re.compile(r"^\(?rad/s\)?/\(?m/s\^2\)?(?:\^(?P<power>[23]))?$")
_PLAIN = {"s": Scale(1e3, "ms"), "m": Scale(1e3, "mm")}


def engineers(unit: str, name: str = "") -> Scale:
    """The customary unit for an SI unit; SI itself where there is none.

    Args:
        unit: SI unit as the catalogue writes it, e.g. "(rad/s)/(m/s^2)".
        name: The parameter's name; what ends in `_s`, and `t0`, are long times and stay in seconds.

    """
    if unit == "s" and (name.endswith("_s") or name == "t0"):
        return Scale(1.0, "s")
    if unit in _PLAIN:
        return _PLAIN[unit]
    match = _G_POWER.match(unit)
    if match:
        power = int(match["power"] or 1)
        return Scale(DEG * GRAVITY**power, "deg/s/g" + ("" if power == 1 else f"^{power}"))
    for si, factor, customary in (("(rad/s)", DEG, "deg/s"), ("rad", DEG, "deg"), ("T", 1e6, "uT")):
        if unit == si or unit.startswith(f"{si}/"):
            return Scale(factor, customary + unit[len(si) :])
    return Scale(1.0, unit)


def number(value: float, digits: int = 3) -> str:
    """A number with so many significant digits."""
    if not isfinite(value):
        return "unbounded" if value == value else "unknown"  # noqa: PLR0124  (NaN differs from itself)
    if value == 0.0:
        return "0"
    return rounded(value, decimals_for(value, digits))


def decimals_for(value: float, digits: int) -> int:
    """Decimals that show so many significant digits of a value."""
    return digits - 1 - floor(log10(abs(value))) if value and isfinite(value) else 0


def rounded(value: float, decimals: int) -> str:
    """A number with so many decimals; with an exponent where that would be a row of zeros."""
    if not isfinite(value):
        return number(value)
    if decimals > MANY_DECIMALS:
        significant = max(0, floor(log10(abs(value))) + decimals) if value else 0
        return f"{value:.{significant}e}"
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.lstrip("-") if float(text) == 0.0 else text


def together(*values: float) -> list[str]:
    """Numbers that are compared with each other: the same decimals for all, three digits of the smallest."""
    known = [abs(v) for v in values if v and isfinite(v)]
    decimals = min(max(decimals_for(v, 3) for v in known), decimals_for(max(known), 3) + 2) if known else 0
    return [rounded(v, decimals) for v in values]


def interval(parameter: Parameter, name: str = "", *, si: bool = False) -> str:
    """Value with its 95 % interval and unit, e.g. "0.130 +- 0.004 deg/m"; the interval's digits set the decimals."""
    scale = Scale(1.0, parameter.unit) if si else engineers(parameter.unit, name)
    value, half = parameter.value * scale.factor, COVERAGE_95 * parameter.stderr * scale.factor
    if not half > 0.0:  # a value that was not estimated, or whose error is unknown
        return f"{number(value)} {scale.unit}"
    if not isfinite(half):
        return f"{number(value)} +- unbounded {scale.unit}"
    digits = 2 if f"{half:.1e}"[0] in "123" else 1
    decimals = decimals_for(half, digits)
    if decimals > MANY_DECIMALS and value:
        exponent = floor(log10(max(abs(value), half)))
        shown = [f"{x / 10.0**exponent:.{max(decimals + exponent, 0)}f}" for x in (value, half)]
        return f"({shown[0]} +- {shown[1]})e{exponent:+03d} {scale.unit}"
    return f"{rounded(value, decimals)} +- {rounded(half, decimals)} {scale.unit}"


def probability(p: float) -> str:
    """A p-value as one quotes it."""
    if p < 1e-12:
        return "p < 1e-12"
    return f"p = {p:.1g}" if p < 0.1 else f"p = {p:.2f}"
