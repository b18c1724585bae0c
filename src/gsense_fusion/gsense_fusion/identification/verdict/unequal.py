"""Claims that are of another size in every run, and what falls with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.search.soundness import sound
from gsense_fusion.identification.verdict.homogeneity import homogeneity
from gsense_fusion.identification.verdict.models import claimed_fit
from gsense_fusion.identification.verdict.sizes import axes_of, frequencies_in_motion, size_in_motion
from gsense_fusion.identification.verdict.sufficiency import Symptom


def unequal_among(selection: Selection, fit: Fit, names: Sequence[str]) -> list[str]:
    """Dynamic claims that are of another size in every run."""
    dynamic = [n for n in names if selection.effects[n].dynamic]
    return [n for n in dynamic if not homogeneity(selection.likelihood, fit, selection.effects[n]).holds]


def companions(
    selection: Selection, names: Sequence[str], refinements: Sequence[str], demoted: Sequence[str]
) -> list[str]:
    """Claims that hold only beside a demoted one: together they imitated what is in neither.

    Without it they are of another size in every run, or their searched parameters run to the end of their range.
    """
    out: list[str] = []
    new = list(demoted)
    while new:
        left = [n for n in names if n not in demoted and n not in out]
        rest = claimed_fit(selection, [*left, *refinements])
        new = unequal_among(selection, rest, left)
        new += [n for n in left if n not in new and not sound(selection, rest, n)]
        out += new
    return out


def unequal_symptom(selection: Selection, fit: Fit, name: str) -> Symptom:
    """What is left where a demoted claim was: something like it, of another size in every run."""
    likelihood = selection.likelihood
    rms = size_in_motion(selection, fit, name)
    tones = frequencies_in_motion(selection, fit, name)
    text = f"locked to the drive and like {name}, but of another size in every run"
    p = homogeneity(likelihood, fit, selection.effects[name]).p_value
    return Symptom("unequal", axes_of(rms), p, float(np.linalg.norm(rms)), tones, text)
