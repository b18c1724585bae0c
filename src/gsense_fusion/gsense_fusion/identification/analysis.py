"""What an analysis starts from and what it leaves for the assembly of the result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from gsense_fusion.identification.campaign import Campaign
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.effects.recorded import Seen
from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.motion.earth import Site
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.verdict.claims import Claims

UNDECIDED = "could not be decided"
Progress = Callable[[str, float], None]
"""Called with what is being done and the part of the work that is done (0 to 1)."""


@dataclass(frozen=True)
class Settings:
    """What the caller may choose."""

    sensor: str
    declared: tuple[str, ...] = ("bias", "g_sensitivity")
    catalogue: tuple[Effect, ...] = CATALOGUE
    site: Site | None = None
    """Where the rig stands; without it earth rate is a constant of each mounting."""


@dataclass(frozen=True, eq=False)
class Analysis:
    """Everything the assembly of the result needs."""

    settings: Settings
    clean: tuple[CleanRun, ...]
    campaign: Campaign
    noise: dict[int, NoiseModel]
    likelihood: Likelihood
    selection: Selection
    declared: Fit
    claims: Claims
    folds: tuple[Held, ...]
    notes: tuple[str, ...]
    seen: Seen = field(default_factory=Seen)
    """What the recording itself shows."""
    rounded: Rounding | None = None
    """What the step of the gyro's output does."""
