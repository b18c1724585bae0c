"""What closing the loop says: the content of report.json as typed values, and the arrays that the report draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.identification.errors.metrics import AttitudeTrace, Rms
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.types import FloatArray, Owner, Parameter

NOTHING_MISSING = "nothing_missing"
EFFECTS_FOUND = "effects_found"
UNEXPLAINED = "unexplained"


@dataclass(frozen=True)
class RunSummary:
    """One bag as it was used."""

    bag: str
    role: str
    samples: int
    lost: int
    rate_hz: float
    session: int
    angular_frequency: float | None
    """rad/s."""
    amplitude: float | None
    """m."""
    encoder_delay_s: float | None


@dataclass(frozen=True)
class Finding:
    """An effect that the declared model lacks."""

    effect: str
    owner: Owner
    axes: tuple[str, ...]
    parameters: Mapping[str, Parameter]
    p_value: float
    rate_rms_before: float
    rate_rms_after: float
    alternatives: tuple[str, ...]
    separating_run: str | None
    equation: str = ""
    source: str = ""
    advice: str = ""
    """What to set or to mend, where it is more than the owner says."""


@dataclass(frozen=True)
class Unexplained:
    """Something is there that no effect of the catalogue explains."""

    axes: tuple[str, ...]
    rate_rms: float
    description: str
    frequencies: tuple[float, ...]
    nearest_effects: tuple[str, ...]


@dataclass(frozen=True)
class RunErrors:
    """Held-out error of one run, rad/s after the 5 Hz low-pass, for the plot per frequency."""

    bag: str
    angular_frequency: float | None
    raw: float
    declared: float
    full: float
    noise_floor: float


@dataclass(frozen=True, eq=False)
class OrderSpectrum:
    """Residual amplitude at half-orders of the drive, rad/s, shape (orders, 3), before and after, and the noise's."""

    order: FloatArray
    declared: FloatArray
    full: FloatArray
    noise: FloatArray


@dataclass(frozen=True, eq=False)
class Ellipse:
    """Gyro against acceleration over one period of a held-out run: what a polynomial cannot fit."""

    bag: str
    angular_frequency: float
    axis: str
    acceleration: FloatArray
    """m/s^2 along the rail, shape (p,), one closed period."""
    measured: FloatArray
    """Angular rate averaged over the periods, rad/s, shape (p,)."""
    declared: FloatArray
    full: FloatArray


@dataclass(frozen=True, eq=False)
class PositionMap:
    """Residual over position and direction of a held-out run."""

    bag: str
    position: FloatArray
    """Bin centres in m, shape (b,)."""
    declared: FloatArray
    """rad/s, shape (2, b, 3): forward and backward; NaN for empty bins."""
    full: FloatArray


@dataclass(frozen=True, eq=False)
class SlowTrace:
    """Block means over the session with what the models say, rad/s, shape (b, 3)."""

    time: FloatArray
    measured: FloatArray
    declared: FloatArray
    full: FloatArray
    temperature: FloatArray | None
    """degrees Celsius, shape (b,)."""


@dataclass(frozen=True, eq=False)
class PoseScatter:
    """Means of still stretches, rad/s, shape (s, 3), bias removed: measured and after each model."""

    specific_force: FloatArray
    """m/s^2, shape (s, 3)."""
    raw: FloatArray
    declared: FloatArray
    full: FloatArray


@dataclass(frozen=True)
class Ranked:
    """One model that was tried, by its criterion (0 for the best)."""

    effects: tuple[str, ...]
    bic_difference: float
    loglik_difference: float


@dataclass(frozen=True, eq=False)
class Covariance:
    """Of the parameters in which an effect is linear: what a later comparison needs beside their standard errors."""

    parameters: tuple[str, ...]
    matrix: FloatArray
    """Shape (p, p), in the parameters' units."""
    plausible: FloatArray
    """Sizes that stand as errors where the data does not identify a direction, shape (p,)."""

    def ordered(self, parameters: Sequence[str]) -> Covariance:
        """The same with its parameters in another order."""
        index = [self.parameters.index(p) for p in parameters]
        return Covariance(tuple(parameters), self.matrix[np.ix_(index, index)], self.plausible[index])


@dataclass(frozen=True, eq=False)
class Plots:
    """Arrays behind the report's figures; None or empty where the data has no such thing."""

    per_run: tuple[RunErrors, ...] = ()
    orders: OrderSpectrum | None = None
    ellipse: Ellipse | None = None
    position: PositionMap | None = None
    slow: SlowTrace | None = None
    poses: PoseScatter | None = None
    attitude: AttitudeTrace | None = None
    spectrum_hz: FloatArray | None = None
    spectrum: Mapping[str, FloatArray] = field(default_factory=dict)
    """Amplitude spectral densities in rad/s/sqrt(Hz) at `spectrum_hz`, axes summed: declared, full, noise."""
    curves: Mapping[str, Curve] = field(default_factory=dict)
    """Fitted curves of the findings over their data, by effect."""


@dataclass(frozen=True, eq=False)
class LoopResult:
    """All that close_loop found."""

    sensor: str
    unit_id: str | None
    declared: tuple[str, ...]
    declared_parameters: Mapping[str, Mapping[str, Parameter]]
    runs: tuple[RunSummary, ...]
    findings: tuple[Finding, ...]
    unexplained: Unexplained | None
    rate_rms: Rms
    pose_rms: Rms | None
    attitude_gyro_only: Rms | None
    attitude_madgwick: Rms | None
    bias: tuple[float, float, float]
    """Of the last fit session under the full model, rad/s."""
    g_matrix: tuple[tuple[float, float, float], ...] | None
    """G of the full model where it is significant, (rad/s)/(m/s^2)."""
    temperature_reference: float
    undecided: tuple[str, ...]
    """What this data could not decide, and which run would."""
    notes: tuple[str, ...]
    ranking: tuple[Ranked, ...]
    plots: Plots
    supply_reference: float | None = None
    """V0 of supply_voltage, V."""
    direction: tuple[float, float, float] | None = None
    """Of the rail in the sensor's axes, in the mounting that most runs have."""
    covariances: Mapping[str, Covariance] = field(default_factory=dict)
    """By effect, of those in the full model and in `not_found`."""
    not_found: Mapping[str, Mapping[str, Parameter]] = field(default_factory=dict)
    """What the effects that were sought and not found would come to in the full model: how well they are excluded."""
    encoder_delay: Parameter | None = None
    """Of the IMU against the encoder, s."""
    deciding_runs: Mapping[str, str] = field(default_factory=dict)
    """By effect that is left open: the separating run that would decide it."""
    rest_noise: Mapping[str, Parameter] = field(default_factory=dict)
    """Amplitude density of the noise from 4 to 20 Hz by axis, rad/s/sqrt(Hz)."""

    @property
    def verdict(self) -> str:
        """unexplained, effects_found or nothing_missing."""
        if self.unexplained is not None:
            return UNEXPLAINED
        return EFFECTS_FOUND if self.findings else NOTHING_MISSING
