"""The order in which a live campaign makes its runs: by lot, with as few turns of the board as the plan allows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_rig.campaign.plan import PlanRun


def draw_order(runs: Sequence[PlanRun], seed: int) -> tuple[PlanRun, ...]:
    """The runs by lot: mountings one after the other, the runs of each shuffled.

    A rest that opens or closes the plan keeps its place: the two bracket the session's drift. The mounting of the
    opening one comes first.
    """
    rng = np.random.default_rng([seed, 0x6F72646572])
    left = list(runs)
    opening = [left.pop(0)] if left and left[0].shape == "static" else []
    closing = [left.pop()] if left and left[-1].shape == "static" else []
    mountings = list(dict.fromkeys(run.mounting for run in left))
    mountings = [mountings[i] for i in rng.permutation(len(mountings))]
    if opening and opening[0].mounting in mountings:
        mountings.remove(opening[0].mounting)
        mountings.insert(0, opening[0].mounting)
    ordered: list[PlanRun] = []
    for mounting in mountings:
        block = [run for run in left if run.mounting == mounting]
        ordered += [block[i] for i in rng.permutation(len(block))]
    return (*opening, *ordered, *closing)
