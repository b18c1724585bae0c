"""Effects that are not claimed and of which the runs tell hardly more than was known before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.analysis import UNDECIDED, Analysis
from gsense_fusion.identification.likelihood.identified import IDENTIFIED_PART
from gsense_fusion.identification.outcome.findings import separating_run
from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.types import AXES
from gsense_fusion.identification.verdict.motion_drift import too_little_rest

DRIFT = "bias_drift"
LOOKS_LIKE = "g_sensitivity"
"""What a tilt with the speed is taken for."""


@dataclass(frozen=True)
class OpenEffect:
    """An effect that may be there."""

    name: str
    reason: str
    run: str | None
    """The separating run that would decide."""

    @property
    def line(self) -> str:
        """In one sentence."""
        asked = "" if self.run is None else f"; record {self.run}"
        return f"{self.name} {UNDECIDED}: {self.reason}{asked}"


def open_effects(a: Analysis, spreads: Mapping[str, Covariance]) -> list[OpenEffect]:
    """What drift nearly never yields, what the runs cannot show, and a drift that too little rest was recorded for.

    Args:
        a: The analysis.
        spreads: Covariance of each effect that is not in the full model, in it.

    """
    found = {n: OpenEffect(n, why, _run(a, n)) for n, why in a.claims.undecided.items()}
    for name, spread in spreads.items():
        if name in found or not _may_hide(a, name):
            continue
        unit = a.selection.effects[name].parameters[0].unit
        error = np.sqrt(np.diag(spread.matrix))
        loose = {
            n: e for n, e, p in zip(spread.parameters, error, spread.plausible, strict=True) if e > IDENTIFIED_PART * p
        }
        loose = {n: e for n, e in loose.items() if AXES.index(n[-1]) in a.campaign.axes}
        if loose and (run := _run(a, name)) is not None:
            size = f"{max(loose.values()):.2g} {unit}"
            found[name] = OpenEffect(name, f"these runs leave {', '.join(loose)} open within {size}", run)
    return [*found.values(), *_drift(a)]


def _may_hide(a: Analysis, name: str) -> bool:
    """Whether an effect can be invisible: slow ones where nothing changes, a tilt with the speed behind G.

    In one mounting a line of its own says of the tilt from which size on the accelerometer sees it.
    """
    effect = a.selection.effects[name]
    return not effect.dynamic or (effect.separates.get(LOOKS_LIKE) is not None and len(_mountings(a)) > 1)


def _run(a: Analysis, name: str) -> str | None:
    effect = a.selection.effects[name]
    return separating_run(a, name, (LOOKS_LIKE,)) if effect.dynamic else effect.separating_run


def mounted_one_way(a: Analysis) -> bool:
    """Whether the board was never turned between the motions."""
    return len(_mountings(a)) == 1


def _mountings(a: Analysis) -> set[int]:
    return {r.mounting_number for r in a.campaign.runs if r.motion is not None and r.mounting_number is not None}


def _drift(a: Analysis) -> list[OpenEffect]:
    """A bias that wanders in motion, where rest is too short to tell whether it is the sensor's drift at all times."""
    settled = DRIFT in a.claims.noise or any(s.kind == "drift" for s in a.claims.symptoms)
    if settled or all(e.name != DRIFT for e in a.settings.catalogue):
        return []
    reason = too_little_rest(a.likelihood, a.claims.full)
    return [] if reason is None else [OpenEffect(DRIFT, reason, "long_rest")]
