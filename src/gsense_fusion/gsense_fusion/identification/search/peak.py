"""The top of a likelihood between two bounds: a parabola where it looks like one, else by golden sections."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from gsense_fusion.identification.types import FloatArray

PARABOLA_PART = 0.1
"""Of the way between the bounds: how far from the start the first parabola is looked at."""
MOST_PARABOLAS = 5


def peak(value: Callable[[float], float], start: float, low: float, high: float, within: float) -> float:
    """Where a function is largest between two bounds.

    A search by golden sections takes a dozen values wherever it starts; parabolas from a start near the top take five.

    Args:
        value: The function.
        start: Between the bounds, the nearer to the top the better.
        low: The lower bound.
        high: The upper bound.
        within: How exactly the place is wanted.

    """
    found = _by_parabolas(value, start, low, high, within)
    return sections(value, low, high, within) if found is None else found


def sections(value: Callable[[float], float], low: float, high: float, within: float) -> float:
    """The same without a start."""
    found = minimize_scalar(
        lambda x: -value(float(x)), bounds=(low, high), method="bounded", options={"xatol": within, "maxiter": 14}
    )
    return float(found.x)


def highest(value: Callable[[float], float], places: FloatArray, within: float) -> float:
    """The same where there are several tops: about the best of some increasing places, shape (p,) of at least two."""
    best = int(np.argmax([value(float(p)) for p in places]))
    below, above = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
    found = sections(value, float(below), float(above), within)
    return found if value(found) > value(float(places[best])) else float(places[best])


def _by_parabolas(
    value: Callable[[float], float], start: float, low: float, high: float, within: float
) -> float | None:
    """Through the three highest points, until their top stays; None where they bend up or lead out of the bounds."""
    step = PARABOLA_PART * (high - low)
    below, above = max(low, start - step), min(high, start + step)
    if start - below < within:
        below = start + 2 * step
    elif above - start < within:
        above = start - 2 * step
    points = sorted(((value(x), x) for x in (start, below, above)), reverse=True)
    for _ in range(MOST_PARABOLAS):
        top = _vertex(points)
        if top is None or not low < top < high:
            return None
        if abs(top - points[0][1]) < within:
            return top
        points = sorted([*points, (value(top), top)], reverse=True)[:3]
    return None


def _vertex(points: list[tuple[float, float]]) -> float | None:
    """Where a parabola through three points (height, place), the highest first, is highest; None where it is not."""
    heights, places = np.array(points).T
    a = places[0]
    bend, slope, _ = np.polyfit(places - a, heights, 2)
    return None if bend >= 0.0 else float(a - slope / (2.0 * bend))
