"""Effects that are not claimed and of which the runs tell hardly more than was known before."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gsense_fusion.identification.analysis import UNDECIDED, Analysis
from gsense_fusion.identification.likelihood.model import IDENTIFIED_PART
from gsense_fusion.identification.outcome.findings import separating_run
from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.types import AXES

LOOKS_LIKE = "g_sensitivity"
"""What a tilt with the speed is taken for."""


def open_effects(a: Analysis, spreads: Mapping[str, Covariance]) -> list[str]:
    """A line for each effect that may be there: what drift nearly never yields, and what the runs cannot show.

    Args:
        a: The analysis.
        spreads: Covariance of each effect that is not in the full model, in it.

    """
    lines = {n: f"{why}; record {_run(a, n)}" for n, why in a.claims.undecided.items()}
    for name, spread in spreads.items():
        if name in lines or not _may_hide(a, name):
            continue
        unit = a.selection.effects[name].parameters[0].unit
        error = np.sqrt(np.diag(spread.matrix))
        loose = {
            n: e for n, e, p in zip(spread.parameters, error, spread.plausible, strict=True) if e > IDENTIFIED_PART * p
        }
        loose = {n: e for n, e in loose.items() if AXES.index(n[-1]) in a.campaign.axes}
        if loose and (run := _run(a, name)) is not None:
            lines[name] = (
                f"these runs leave {', '.join(loose)} open within {max(loose.values()):.2g} {unit}; record {run}"
            )
    return [f"{name} {UNDECIDED}: {line}" for name, line in lines.items()]


def _may_hide(a: Analysis, name: str) -> bool:
    """Whether an effect can be invisible: slow ones where nothing changes, a tilt with the speed behind G.

    In one mounting a line of its own says of the tilt from which size on the accelerometer sees it.
    """
    mountings = {r.mounting_number for r in a.campaign.runs if r.motion is not None and r.mounting_number is not None}
    effect = a.selection.effects[name]
    return not effect.dynamic or (effect.separates.get(LOOKS_LIKE) is not None and len(mountings) > 1)


def _run(a: Analysis, name: str) -> str | None:
    effect = a.selection.effects[name]
    return separating_run(a, name, (LOOKS_LIKE,)) if effect.dynamic else effect.separating_run
